"""Bessel functions of M and of its derivatives: I0, I1/I0 and I_(3/2)/I_(1/2)."""

from functools import cache
from math import factorial

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import numerics
from fiberjax._types import Floats

_TERMS = range(14)  # 1/(14!)^2 and 4^14/29! are below 1e-20


_MIDDLE = 4.0
"""Where one polynomial of I0 ends and the other begins: together they are short."""
_BELOW, _ABOVE = 14, 10


@cache
def _I0_coefficients() -> tuple[tuple[float, ...], ...]:
    """Of e^-a I0(a) in a/2 - 1, a <= 4, and of its product with a^(1/2) in 8/a - 1.

    Exact at Chebyshev points, good to 2e-8. With t the angle of the integral of I0 the
    midpoint rule is exact to rounding.
    """
    t = np.pi * (np.arange(4096) + 0.5) / 4096
    fall = 2 * np.sin(t / 2) ** 2

    def through(count, argument, factor):
        s = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        a = argument(s)
        values = np.exp(-a[:, None] * fall).mean(1) * factor(a)
        series = np.polynomial.chebyshev.chebfit(s, values, count - 1)
        return tuple(float(c) for c in np.polynomial.chebyshev.cheb2poly(series))

    below = through(_BELOW, lambda s: _MIDDLE / 2 * (1 + s), np.ones_like)
    above = through(_ABOVE, lambda s: 2 * _MIDDLE / (1 + s), np.sqrt)
    return below, above


def scaled_I0(a: Floats) -> Floats:
    """e^-|a| I0(a), not meant to be differentiated.

    In single precision by a polynomial on either side of 4, within 3 eps: XLA's own
    takes longer.
    """
    if a.dtype == jnp.float64:
        return jax.scipy.special.i0e(a)
    size = jnp.abs(a)
    below, above = _I0_coefficients()
    root = jax.lax.rsqrt(jnp.maximum(size, _MIDDLE))
    small = numerics.power_series(below, (2 / _MIDDLE) * jnp.minimum(size, _MIDDLE) - 1)
    large = root * numerics.power_series(above, (2 * _MIDDLE) * root * root - 1)
    return jnp.where(size < _MIDDLE, small, large)


def langevin(x: Floats) -> Floats:
    """I_(3/2)(x)/I_(1/2)(x) = coth x - 1/x for 0 <= x <= 2, without cancellation.

    Both x cosh x - sinh x and x sinh x are power series with positive terms.
    """
    y = x * x
    numerator = [2 * (k + 1) / factorial(2 * k + 3) for k in _TERMS]
    denominator = [1 / factorial(2 * k + 1) for k in _TERMS]
    return (
        x * numerics.power_series(numerator, y) / numerics.power_series(denominator, y)
    )


def _ratio_small(a: Floats) -> Floats:
    """I1(a)/I0(a) for |a| <= 2, from the two power series."""
    y = a * a / 4
    i0 = [1 / factorial(k) ** 2 for k in _TERMS]
    i1 = [1 / (factorial(k) * factorial(k + 1)) for k in _TERMS]
    return a / 2 * numerics.power_series(i1, y) / numerics.power_series(i0, y)


@cache
def _complement_coefficients() -> tuple[float, ...]:
    """Chebyshev coefficients of e(w), w = 1/a in (0, 1/2], 1 - I1/I0 = w/2 + w^2 e(w).

    With J_k = int_0^pi (1 - cos t)^k exp(-a (1 - cos t)) dt, integration by parts gives
    1 - I1/I0 = J_1/J_0 = (1 + a J_2/J_0)/(1 + 2a), hence
    e = (2 a^2 J_2/J_0 - 1) a/(2 (1 + 2a)), which cancels only a factor of 3.
    The integrands are smooth and periodic: the midpoint rule is exact to rounding.
    """
    count, samples = 64, 4096
    s = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    a = 4 / (1 + s)
    y = 2 * np.sin(np.pi / 2 * (np.arange(samples) + 0.5) / samples) ** 2
    density = np.exp(-a[:, None] * y)
    e = 2 * a**2 * (density @ y**2) / density.sum(1) - 1
    e *= a / (2 * (1 + 2 * a))
    coefficients = np.polynomial.chebyshev.chebfit(s, e, count - 1)
    return tuple(float(c) for c in coefficients)


def _complement_series(w: Floats) -> Floats:
    """e(w) by Clenshaw's recurrence."""
    s = 4 * w - 1
    eps = float(jnp.finfo(w.dtype).eps)
    coefficients = [c for c in _complement_coefficients() if abs(c) > eps / 8]
    b, after = numerics.clenshaw(coefficients[1:], s)
    return coefficients[0] + s * b - after


@jax.custom_jvp
def _complement_large(a: Floats) -> Floats:
    """1 - I1(a)/I0(a) for a >= 2."""
    w = 1 / a
    return w / 2 + w * w * _complement_series(w)


@_complement_large.defjvp
def _complement_large_jvp(primals, tangents):
    """From r' = 1 - r/a - r^2, with the terms that cancel taken out.

    Differentiating the series instead would cost two digits near a = 2.
    """
    (a,), (da,) = primals, tangents
    w = 1 / a
    e = _complement_series(w)
    slope = -w * w * (0.25 + 2 * e - w * w * e * e)
    return w / 2 + w * w * e, slope * da


def ratio(a: Floats) -> tuple[Floats, Floats]:
    """(r, 1 - r) with r = I1(a)/I0(a), for any real a; r is odd.

    1 - r keeps its relative accuracy as a grows, where it tends to 1/(2a).
    """
    size = jnp.abs(a)
    large = size > 2
    small_r = _ratio_small(jnp.where(large, 0, a))
    complement = _complement_large(jnp.where(large, size, 3))
    r = jnp.where(large, jnp.sign(a) * (1 - complement), small_r)
    return r, jnp.where(a > 2, complement, 1 - r)
