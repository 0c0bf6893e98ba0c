"""What renderers compute in place of M, to compare with them digit by digit."""

from math import factorial

import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.spherical import Inclination, M_around, Width

PBRT, MITSUBA = 10, 11
"""Terms of their series of I0."""
_NARROW = 0.1
_LARGE = 12.0


def _I0(x: Floats, terms: int) -> Floats:
    """I0 by its series."""
    return numerics.power_series(
        [1 / (4**k * factorial(k) ** 2) for k in range(terms)], x * x
    )


def _log_I0(x: Floats, terms: int) -> Floats:
    """log I0, whose asymptotic form has its 1/(8 x) inside the half."""
    large = x > _LARGE
    y = jnp.where(large, x, 2 * _LARGE)
    far = y + 0.5 * (-jnp.log(2 * jnp.pi) + jnp.log(1 / y) + 1 / (8 * y))
    return jnp.where(large, far, jnp.log(_I0(jnp.where(large, 0, x), terms)))


def M_renderers(
    cone: Inclination, out: Inclination, v: Floats, terms: int = PBRT
) -> Floats:
    """M as pbrt, Mitsuba, Cycles, Unity and MaterialX evaluate it.

    exp(log I0(a) + b - 1/v + 0.6931 + log(1/(2 v))) for v <= 0.1, else
    exp(b) I0(a)/(2 v sinh(1/v)), a = cos cos/v, b = sin sin/v. Wrong where a is near
    12, by 2.0 % at 10 terms of I0 and 0.58 % at 11, and in float32 by what the sum of b
    and 1/v loses: figures/bessel.

    Args:
        cone, out: the lobe's cone and the direction scattered into, their cosines of
            either sign.
        v: variance in radians^2, > 0.
        terms: static, the length of the series of I0: pbrt has 10, Mitsuba 11.

    Returns:
        Density as of `M`, shape of the broadcast.

    Reference: pbrt-v3 and v4, hair.cpp, Mp; Jakob 2012. The expansion of log I0 ends
    in + 1/(8 x).
    """
    # cos(float32(pi/2)) is negative: the angle has passed the pole by rounding alone.
    a, b = jnp.abs(cone.cos * out.cos) / v, cone.sin * out.sin / v
    narrow = v <= _NARROW
    low = jnp.where(narrow, v, _NARROW)
    exponent = _log_I0(a, terms) + b - 1 / low + 0.6931 + jnp.log(1 / (2 * low))
    wide = jnp.where(narrow, 1, v)
    kept = jnp.where(narrow, 0, 1)
    series = jnp.exp(kept * b) * _I0(kept * a, terms) / (jnp.sinh(1 / wide) * 2 * wide)
    return jnp.where(narrow, jnp.exp(jnp.where(narrow, exponent, 0)), series)


def _of_renderer(terms: int):
    def M(cone: Inclination, out: Inclination, of: Width) -> Floats:
        return M_renderers(cone, out, of.v, terms)

    return M


LONGITUDINAL = {
    None: M_around,
    "pbrt": _of_renderer(PBRT),
    "mitsuba": _of_renderer(MITSUBA),
}
"""M of a cone, a direction and a width, by the renderer that is stood beside."""
