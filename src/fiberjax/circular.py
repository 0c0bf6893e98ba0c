"""Densities on the circle, the wrapped normal and the trimmed logistic.

Both integrate to 1 over one turn, have period 2 pi, and tend to 1/(2 pi) as they widen.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats

TURN = 2 * 3.141592653589793
ROOT_TURN = 2.5066282746310002  # sqrt(2 pi)
LOGISTIC_SCALE = 0.6266570686577501
"""sqrt(pi/8): a logistic of scale sqrt(pi/8) beta has the peak of a normal of deviation
beta, and 1.137 times its deviation."""


def wrap(phi: Floats) -> Floats:
    """The angle of [-pi, pi] that differs from phi by whole turns."""
    return phi - TURN * jnp.round(phi * (1 / TURN))


def sin_cos(phi: Floats) -> tuple[Floats, Floats]:
    """Sine and cosine of any angle, from those of half of it, within (4 + |phi|) eps.

    XLA's own take longer on CPUs.
    """
    sin, cos = numerics.sin_cos(wrap(phi) / 2)
    return 2 * sin * cos, 1 - 2 * sin * sin


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
    return jnp.where(narrow, images / (b * ROOT_TURN), wide)


def trimmed_logistic(phi: Reals, s: Reals) -> Floats:
    """Logistic density of scale s, trimmed to [-pi, pi] and repeated every turn.

    D(x) = sigma(x/s) sigma(-x/s)/(s tanh(pi/(2 s))), x = phi wrapped to [-pi, pi].
    It is continuous at x = +-pi, where its slope changes sign.

    Args:
        phi: angle in radians, any real.
        s: scale in radians, > 0.

    Returns:
        Density per radian, shape broadcast(phi, s), dtype of phi.

    Reference: Chiang et al. 2016; renderers that leave out the wrapping lose up to
    half of the transmitted light.
    """
    phi, s = floats((phi,), (s,))
    return logistic_density(phi, logistic(s))


@jax.custom_jvp
def _bell(z: Floats) -> Floats:
    """The logistic density of scale 1, sigma(z) sigma(-z), by one exponential."""
    e = numerics.decay(-jnp.abs(z))
    return e / ((1 + e) * (1 + e))


@_bell.defjvp
def _bell_jvp(primals, tangents):
    """|z| has a kink where the density has none."""
    (z,), (dz,) = primals, tangents
    value = _bell(z)
    return value, -value * jnp.tanh(z / 2) * dz


class Logistic(NamedTuple):
    """The scale of a trimmed logistic, and what is trimmed on either side of it.

    The latter, over what is kept, is 1/expm1(pi/s).
    """

    scale: Floats
    trimmed: Floats


def logistic(s: Floats) -> Logistic:
    """That of scale s."""
    # Nothing overflows; beyond 80 it is below any number drawn.
    x = jnp.minimum(TURN / 2 / s, 80)
    return Logistic(s, jnp.exp(-x) / -jnp.expm1(-x))


def logistic_density(phi: Floats, of: Logistic) -> Floats:
    """`trimmed_logistic` of what it needs of the scale."""
    # 1 + 2 trimmed is 1/tanh(pi/(2 s)), whose derivative would cancel.
    level = (1 + 2 * of.trimmed) / of.scale
    return _bell(wrap(phi) * (1 / of.scale)) * level


def normal_quantile(u: Floats, beta: Floats) -> Floats:
    """The angle below which a share u of a normal lies, not wrapped."""
    return beta * jax.scipy.special.ndtri(u)


def logistic_quantile(u: Floats, of: Logistic) -> Floats:
    """The same of the logistic: s log((u + c)/(1 - u + c)), c what is trimmed.

    From |2 u - 1|, so that the middle keeps its digits.
    """
    above = u > 0.5
    less = jnp.where(above, 1 - u, u)
    size = of.scale * numerics.log1p((1 - 2 * less) / (less + of.trimmed))
    return jnp.where(above, size, -size)
