"""What renderers compute in place of M, to compare with them digit by digit."""

from math import factorial

import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.spherical import Inclination

_TERMS = 10
_NARROW = 0.1
_LARGE = 12.0


def _I0(x: Floats) -> Floats:
    """I0 by ten terms of its series."""
    return numerics.power_series(
        [1 / (4**k * factorial(k) ** 2) for k in range(_TERMS)], x * x
    )


def _log_I0(x: Floats) -> Floats:
    """log I0, whose asymptotic form has its 1/(8 x) inside the half: 2 % at x = 12."""
    large = x > _LARGE
    y = jnp.where(large, x, 2 * _LARGE)
    far = y + 0.5 * (-jnp.log(2 * jnp.pi) + jnp.log(1 / y) + 1 / (8 * y))
    return jnp.where(large, far, jnp.log(_I0(jnp.where(large, 0, x))))


def M_renderers(cone: Inclination, out: Inclination, v: Floats) -> Floats:
    """M as pbrt, Mitsuba, Cycles, Unity and MaterialX evaluate it.

    exp(log I0(a) + b - 1/v + 0.6931 + log(1/(2 v))) for v <= 0.1, else
    exp(b) I0(a)/(2 v sinh(1/v)), a = cos cos/v, b = sin sin/v. Wrong by up to 2 %
    through its log I0, and in float32 by what the sum of b and 1/v loses.

    Args:
        cone: the lobe's cone, its cosine of either sign.
        out: the direction scattered into.
        v: variance in radians^2, > 0.

    Returns:
        Density as of `M`, shape of the broadcast.

    Reference: pbrt-v3 and v4, hair.cpp, Mp; Jakob 2012. The expansion of log I0 ends
    in + 1/(8 x).
    """
    a, b = jnp.abs(cone.cos) * out.cos / v, cone.sin * out.sin / v
    narrow = v <= _NARROW
    low = jnp.where(narrow, v, _NARROW)
    exponent = _log_I0(a) + b - 1 / low + 0.6931 + jnp.log(1 / (2 * low))
    wide = jnp.where(narrow, 1, v)
    kept = jnp.where(narrow, 0, 1)
    series = jnp.exp(kept * b) * _I0(kept * a) / (jnp.sinh(1 / wide) * 2 * wide)
    return jnp.where(narrow, jnp.exp(jnp.where(narrow, exponent, 0)), series)
