"""The detectors of the azimuthal model, by which a rough fiber blurs its exits."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.circular import (
    LOGISTIC_SCALE,
    ROOT_TURN,
    TURN,
    logistic,
    logistic_density,
    logistic_quantile,
    normal_quantile,
    sin_cos,
    wrap,
    wrapped_normal,
)

Pair = Callable[[Floats], Floats]
"""The mean of the densities at x - turn and x + turn, as a function of turn."""

PairOf = Callable[[Floats, Floats], Pair]
"""That function for an x and a roughness."""


def _normal_pair(x: Floats, beta: Floats, images: int) -> Pair:
    """Both sides of a normal of which only the nearest image is seen, or two."""
    # Products with what does not depend on turn: quotients would take longer.
    over, peak = math.sqrt(0.5) / beta, 0.5 / (ROOT_TURN * beta)

    def side(away):
        near = jnp.abs(wrap(away))
        seen = [near, TURN - near][:images]
        return sum(numerics.decay(-((over * image) ** 2)) for image in seen)

    return lambda turn: peak * (side(x - turn) + side(x + turn))


def _normal_image(x: Floats, beta: Floats) -> Floats:
    return numerics.decay(-((x / beta) ** 2) / 2) / (ROOT_TURN * beta)


def _normal_distance(x: Floats, beta: Floats) -> Floats:
    erf = jax.scipy.special.erf(math.sqrt(0.5) / beta * x)
    return x * erf + 2 * beta * beta * _normal_image(x, beta)


def _logistic_image(x: Floats, beta: Floats) -> Floats:
    s = LOGISTIC_SCALE * beta
    e = numerics.decay(-jnp.abs(x) / s)
    mass = 1 + 2 / jnp.expm1(jnp.minimum(TURN / 2 / s, 40))
    return e / ((1 + e) * (1 + e)) * (mass / s)


def _logistic_distance(x: Floats, beta: Floats) -> Floats:
    s = LOGISTIC_SCALE * beta
    return jnp.abs(x) + 2 * s * jnp.log1p(numerics.decay(-jnp.abs(x) / s))


def _image_pair(image: Callable[[Floats, Floats], Floats]) -> PairOf:
    """Both sides of a density of which only the nearest image is seen."""

    def of(x, beta):
        return lambda turn: (
            (image(wrap(x - turn), beta) + image(wrap(x + turn), beta)) / 2
        )

    return of


def _weights(exponent: Floats, count: int) -> list[Floats]:
    """exp(n^2 exponent), n from 1 to count, by products."""
    q = jnp.exp(exponent)
    found, ratio = [q], q
    for _ in range(count - 1):
        ratio = ratio * (q * q)
        found.append(found[-1] * ratio)
    return found


@partial(jax.custom_jvp, nondiff_argnums=(2,))
def _cosines(x: Floats, exponent: Floats, count: int) -> Floats:
    """sum_n exp(n^2 exponent) cos(n a), n from 1 to count, at x = cos a."""
    b, after = numerics.clenshaw(_weights(exponent, count), x)
    return x * b - after


@_cosines.defjvp
def _cosines_jvp(count, primals, tangents):
    (x, exponent), (dx, dexponent) = primals, tangents
    each = list(enumerate(_weights(exponent, count), 1))
    by_x, _ = numerics.clenshaw([n * w for n, w in each], x)
    b, after = numerics.clenshaw([n * n * w for n, w in each], x)
    return _cosines(*primals, count), by_x * dx + (x * b - after) * dexponent


def _harmonics(x: Floats, beta: Floats, count: int) -> Pair:
    """Both sides of a broad normal, 1 + 2 sum_n exp(-n^2 beta^2/2) cos(n a)."""
    cos, sin, exponent = jnp.cos(x), jnp.sin(x), -beta * beta / 2

    def pair(turn):
        sin_turn, cos_turn = sin_cos(turn)
        near, far = cos * cos_turn, sin * sin_turn
        here, there = (_cosines(a, exponent, count) for a in (near + far, near - far))
        return (1 + here + there) / TURN

    return pair


class Form(NamedTuple):
    """A formula for both sides of a density, and the roughness it serves."""

    low: float
    high: float
    pair: PairOf

    def serves(self, beta: Floats) -> Any:
        """Whether it does, element by element."""
        return (beta >= self.low) & (beta < self.high)


def _normal_forms(tolerance: float) -> list[Form]:
    """One image while the next is below `tolerance`, then two, then harmonics."""
    depth = math.sqrt(2 * math.log(1 / tolerance))
    one, two = math.pi / depth, 2 * math.pi / depth
    count = math.ceil(depth / two)
    return [
        Form(0.0, one, partial(_normal_pair, images=1)),
        Form(one, two, partial(_normal_pair, images=2)),
        Form(two, math.inf, partial(_harmonics, count=count)),
    ]


def _logistic_forms(tolerance: float) -> list[Form]:
    """The trimmed density is its nearest image."""
    del tolerance
    every = _image_pair(_logistic_image)
    return [Form(0.0, math.inf, every)]


class Detector(NamedTuple):
    """A density in azimuth of roughness beta_n, and how to draw from it.

    width(beta_n)                  what the next two need of it
    density(phi, width)            per radian
    quantile(u, width)             not wrapped
    image(x, beta_n)               per radian, not wrapped, for small roughness
    distance(x, beta_n)            the mean of |x + y|, y drawn from the detector, not
                                   wrapped or trimmed, for small roughness
    forms(tolerance)               formulas for both sides of it, one of which serves
                                   any roughness; error below tolerance of the peak
    reach(tolerance)               beyond this many beta_n the density is below
                                   tolerance of the peak, wrapping aside
    bandwidth(tolerance)           wave number times beta_n from which on a quadrature
                                   need not follow it
    effort(tolerance)              nodes of a window, relative to the normal
    care                           by what `auto` divides its tolerance: long tails
                                   leave more outside windows and between nodes
    kink                           whether the slope jumps at half a turn
    """

    width: Callable[[Floats], Any]
    density: Callable[[Floats, Any], Floats]
    quantile: Callable[[Floats, Any], Floats]
    image: Callable[[Floats, Floats], Floats]
    distance: Callable[[Floats, Floats], Floats]
    forms: Callable[[float], list[Form]]
    reach: Callable[[float], float]
    bandwidth: Callable[[float], float]
    effort: Callable[[float], float]
    care: float
    kink: bool

    def within(self, low: float, high: float) -> "Detector":
        """The same with no formulas but those that a range of roughness needs."""

        def forms(tolerance):
            every = self.forms(tolerance)
            return [form for form in every if form.low <= high and form.high > low]

        return self._replace(forms=forms)


DETECTORS = {
    "normal": Detector(
        lambda beta: beta,
        wrapped_normal,
        normal_quantile,
        _normal_image,
        _normal_distance,
        _normal_forms,
        lambda tolerance: math.sqrt(2 * math.log(1 / tolerance)),
        lambda tolerance: math.sqrt(2 * math.log(1 / tolerance)),
        effort=lambda tolerance: 1.0,
        care=1.0,
        kink=False,
    ),
    "logistic": Detector(
        lambda beta: logistic(LOGISTIC_SCALE * beta),
        logistic_density,
        logistic_quantile,
        _logistic_image,
        _logistic_distance,
        _logistic_forms,
        lambda tolerance: LOGISTIC_SCALE * math.log(4 / tolerance),
        lambda tolerance: math.log(1 / tolerance) / 2,
        # Its poles lie pi scales off the real axis, whatever the window's width.
        effort=lambda tolerance: (3 + math.log(1 / tolerance)) / 7.4,
        care=20.0,
        kink=True,
    ),
}
