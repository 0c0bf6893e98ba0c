"""Densities on the circle: the detectors of the azimuthal model.

Both integrate to 1 over one turn, have period 2 pi, and tend to 1/(2 pi) as they widen.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals, floats

TURN = 2 * 3.141592653589793
_ROOT_TURN = 2.5066282746310002  # sqrt(2 pi)
LOGISTIC_SCALE = 0.6266570686577501
"""sqrt(pi/8): a logistic of scale sqrt(pi/8) beta has the peak of a normal of deviation
beta, and 1.137 times its deviation."""


def wrap(phi: Floats) -> Floats:
    """The angle of [-pi, pi] that differs from phi by whole turns."""
    return phi - TURN * jnp.round(phi * (1 / TURN))


def wrapped_normal(phi: Reals, beta: Reals) -> Floats:
    """Normal density of standard deviation beta, wrapped around the circle.

    D(phi) = sum_k exp(-(phi - 2 pi k)^2/(2 beta^2))/(beta sqrt(2 pi)), k over all
    integers. Evaluated from five images for beta <= 1.5 and from six harmonics of
    (1 + 2 sum_n exp(-n^2 beta^2/2) cos n phi)/(2 pi) above; what is left out is below
    1e-17 of the value in either case.

    Args:
        phi: angle in radians, any real.
        beta: standard deviation in radians, > 0.

    Returns:
        Density per radian, shape broadcast(phi, beta), dtype of phi.

    Reference: d'Eon et al. 2011, the Gaussian detector D.
    """
    phi, beta = floats((phi,), (beta,))
    x = wrap(phi)
    narrow = beta <= 1.5
    b = jnp.where(narrow, beta, 1)
    images = sum(jnp.exp(-(((x - TURN * k) / b) ** 2) / 2) for k in range(-2, 3))
    c = jnp.where(narrow, 2, beta)
    q = jnp.exp(-c * c / 2)
    cosine, before, harmonics = jnp.cos(x), jnp.ones_like(x), 0.0
    now = cosine
    for n in range(1, 7):
        harmonics = harmonics + q ** (n * n) * now
        now, before = 2 * cosine * now - before, now
    wide = (1 + 2 * harmonics) / TURN
    return jnp.where(narrow, images / (b * _ROOT_TURN), wide)


def trimmed_logistic(phi: Reals, s: Reals) -> Floats:
    """Logistic density of scale s, trimmed to [-pi, pi] and repeated every turn.

    D(x) = sigma(x/s) sigma(-x/s)/(s tanh(pi/(2 s))), x = phi wrapped to [-pi, pi].
    It is continuous at x = +-pi, where its slope changes sign. The product of two
    sigmoids neither overflows nor has a kink at 0.

    Args:
        phi: angle in radians, any real.
        s: scale in radians, > 0.

    Returns:
        Density per radian, shape broadcast(phi, s), dtype of phi.

    Reference: Chiang et al. 2016; renderers that leave out the wrapping lose up to
    half of the transmitted light.
    """
    phi, s = floats((phi,), (s,))
    z = wrap(phi) / s
    both = jax.nn.sigmoid(z) * jax.nn.sigmoid(-z)
    # 1/tanh(pi/(2 s)); beyond 40 the second term is below rounding. The derivative of
    # tanh itself would cancel.
    return both / s * (1 + 2 / jnp.expm1(jnp.minimum(TURN / 2 / s, 40)))


def _normal_quantile(u: Floats, beta: Floats) -> Floats:
    return beta * jax.scipy.special.ndtri(u)


def _logistic_quantile(u: Floats, s: Floats) -> Floats:
    """2 s atanh((2 u - 1) tanh(pi/(2 s))); below s = 0.05 the tanh is 1."""
    broad = s > 0.05
    mass = jnp.where(broad, jnp.tanh(TURN / 4 / jnp.where(broad, s, 1)), 1)
    return 2 * s * jnp.atanh((2 * u - 1) * mass)


Pair = Callable[[Floats], Floats]
"""The mean of the densities at x - turn and x + turn, as a function of turn."""

PairOf = Callable[[Floats, Floats], Pair]
"""That function for an x and a roughness."""


def _normal_pair(x: Floats, beta: Floats) -> Pair:
    """Both sides of a normal of which only the nearest image is seen."""
    # Products with what does not depend on turn: quotients would take longer.
    over, peak = math.sqrt(0.5) / beta, 0.5 / (_ROOT_TURN * beta)

    def side(away):
        return jnp.exp(-((over * wrap(away)) ** 2))

    return lambda turn: peak * (side(x - turn) + side(x + turn))


def _normal_image(x: Floats, beta: Floats) -> Floats:
    return jnp.exp(-((x / beta) ** 2) / 2) / (_ROOT_TURN * beta)


def _logistic_image(x: Floats, beta: Floats) -> Floats:
    s = LOGISTIC_SCALE * beta
    e = jnp.exp(-jnp.abs(x) / s)
    mass = 1 + 2 / jnp.expm1(jnp.minimum(TURN / 2 / s, 40))
    return e / ((1 + e) * (1 + e)) * (mass / s)


def _image_pair(image: Callable[[Floats, Floats], Floats]) -> PairOf:
    """Both sides of a density of which only the nearest image is seen."""

    def of(x, beta):
        return lambda turn: (
            (image(wrap(x - turn), beta) + image(wrap(x + turn), beta)) / 2
        )

    return of


def _harmonics(x: Floats, beta: Floats, count: int) -> Pair:
    """Both sides of a broad normal: 1 + 2 sum_n q^(n^2) cos(n x) cos(n turn)."""
    cos_x, q = jnp.cos(x), jnp.exp(-beta * beta / 2)

    def pair(turn):
        cos_turn = jnp.cos(turn)
        here, there, weight, ratio = cos_x, cos_turn, q, q
        total = jnp.zeros_like(q)
        x_before = turn_before = jnp.ones_like(q)
        for _ in range(count):
            total = total + weight * (here * there)
            here, x_before = 2 * cos_x * here - x_before, here
            there, turn_before = 2 * cos_turn * there - turn_before, there
            ratio = ratio * (q * q)
            weight = weight * ratio
        return (1 + 2 * total) / TURN

    return pair


class Form(NamedTuple):
    """A formula for both sides of a density, and the roughness it serves."""

    serves: Callable[[Floats], Any]
    pair: PairOf


def _normal_forms(tolerance: float) -> list[Form]:
    """One image up to the roughness at which the next is `tolerance`, harmonics above.

    The two take turns: at the limit both need the fewest terms.
    """
    depth = 2 * math.log(1 / tolerance)
    limit = math.pi / math.sqrt(depth)
    count = math.ceil(math.sqrt(depth) / limit)
    return [
        Form(lambda beta: beta < limit, _normal_pair),
        Form(lambda beta: beta >= limit, partial(_harmonics, count=count)),
    ]


def _logistic_forms(tolerance: float) -> list[Form]:
    """The trimmed density is its nearest image."""
    del tolerance
    every = _image_pair(_logistic_image)
    return [Form(lambda beta: True, every)]


class Detector(NamedTuple):
    """A density in azimuth of roughness beta_n, and how to draw from it.

    density(phi, beta_n)           per radian
    quantile(u, beta_n)            not wrapped
    image(x, beta_n)               per radian, not wrapped, for small roughness
    forms(tolerance)               formulas for both sides of it, one of which serves
                                   any roughness; error below tolerance of the peak
    reach(tolerance)               beyond this many beta_n the density is below
                                   tolerance of the peak, wrapping aside
    bandwidth(tolerance)           wave number times beta_n from which on a quadrature
                                   need not follow it
    effort(tolerance)              nodes of a window, relative to the normal
    kink                           whether the slope jumps at half a turn
    """

    density: Callable[[Floats, Floats], Floats]
    quantile: Callable[[Floats, Floats], Floats]
    image: Callable[[Floats, Floats], Floats]
    forms: Callable[[float], list[Form]]
    reach: Callable[[float], float]
    bandwidth: Callable[[float], float]
    effort: Callable[[float], float]
    kink: bool


DETECTORS = {
    "normal": Detector(
        wrapped_normal,
        _normal_quantile,
        _normal_image,
        _normal_forms,
        lambda tolerance: math.sqrt(2 * math.log(1 / tolerance)),
        lambda tolerance: math.sqrt(2 * math.log(1 / tolerance)),
        effort=lambda tolerance: 1.0,
        kink=False,
    ),
    "logistic": Detector(
        lambda phi, beta: trimmed_logistic(phi, LOGISTIC_SCALE * beta),
        lambda u, beta: _logistic_quantile(u, LOGISTIC_SCALE * beta),
        _logistic_image,
        _logistic_forms,
        lambda tolerance: LOGISTIC_SCALE * math.log(4 / tolerance),
        lambda tolerance: math.log(1 / tolerance) / 2,
        # Its poles lie pi scales off the real axis, whatever the window's width.
        effort=lambda tolerance: (3 + math.log(1 / tolerance)) / 8,
        kink=True,
    ),
}
