"""Elementary functions whose derivatives stay finite and accurate, and are cheap.

A `where` that guards a singular derivative replaces the argument by a harmless one
before the singular operation, so that no NaN enters a gradient.
"""

from collections.abc import Sequence
from functools import cache
from math import factorial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax._types import Floats


def sqrt(x: Floats) -> Floats:
    """sqrt(x); at x <= 0 the value is 0 and so is the derivative."""
    positive = x > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1)), 0)


def quotient(x: Floats | float, y: Floats, otherwise: float) -> Floats:
    """x/y; the constant `otherwise` where y = 0."""
    nonzero = y != 0
    return jnp.where(nonzero, x / jnp.where(nonzero, y, 1), otherwise)


@jax.custom_jvp
def log1p(x: Floats) -> Floats:
    """log(1 + x) for x > -1, within 4 eps.

    What 1 + x rounds off cannot be made up for from (1 + x) - 1: compiled, that is x.
    """
    far = jnp.abs(x) > 0.3
    near = jnp.log1p(jnp.where(far, 0, x))
    return jnp.where(far, jnp.log(1 + jnp.where(far, x, 0)), near)


@log1p.defjvp
def _log1p_jvp(primals, tangents):
    return log1p(*primals), tangents[0] / (1 + primals[0])


@jax.custom_jvp
def decay(x: Floats) -> Floats:
    """exp(x) for x <= 0, within two eps; 0 below the smallest normal number.

    2^n e^r by Taylor's series: in float64 XLA's own takes longer on CPUs.
    """
    if x.dtype != jnp.float64:
        return jnp.exp(x)
    scale, r = _scale_and_rest(x)
    return power_series([1 / factorial(k) for k in range(14)], r) * scale


@decay.defjvp
def _decay_jvp(primals, tangents):
    value = decay(*primals)
    return value, value * tangents[0]


def _scale_and_rest(x: Floats) -> tuple[Floats, Floats]:
    """(2^n, r) with exp(x) = 2^n e^r, |r| <= ln(2)/2, for x <= 0."""
    info = jnp.finfo(x.dtype)
    # ln 2 in two parts, of which the first has zeros to spare.
    high, low = (
        (0.6931471803691238, 1.9082149292705877e-10)
        if info.bits == 64
        else (0.693359375, -2.1219444005469057e-4)
    )
    x = jnp.maximum(x, (float(info.minexp) - info.nmant) * 0.6931471805599453)
    n = jnp.round(x * 1.4426950408889634)
    r = (x - n * high) - n * low
    exponent = jnp.maximum(n + (1 - info.minexp), 0).astype(f"int{info.bits}")
    exponent = exponent << info.nmant
    return jax.lax.bitcast_convert_type(exponent, x.dtype), r


@jax.custom_jvp
def absorption(x: Floats) -> tuple[Floats, Floats]:
    """exp(-x) and 1 - exp(-x) for x >= 0, each to its own last digits.

    Both from q = e^r - 1: 2^n (1 + q), and 1 - 2^n - 2^n q, of which n = 0 leaves -q.
    """
    scale, r = _scale_and_rest(-x)
    terms = 7 if jnp.finfo(x.dtype).bits <= 32 else 13
    q = r * power_series([1 / factorial(k) for k in range(1, terms + 1)], r)
    return scale + scale * q, (1 - scale) - scale * q


@absorption.defjvp
def _absorption_jvp(primals, tangents):
    (left, lost), (dx,) = absorption(*primals), tangents
    return (left, lost), (-left * dx, left * dx)


def clenshaw(coefficients: Sequence[Any], x: Floats) -> tuple[Floats, Floats]:
    """(b, b') with b = sum_n c_n U_(n-1)(x) and x b - b' = sum_n c_n T_n(x), n >= 1."""
    b = after = jnp.zeros_like(x)
    for c in coefficients[::-1]:
        b, after = c + 2 * x * b - after, b
    return b, after


def power_series(coefficients: Sequence[float], y: Floats) -> Floats:
    """sum_k c_k y^k by Horner's rule, with a short fixed number of terms."""
    total = jnp.full_like(y, coefficients[-1])
    for c in coefficients[-2::-1]:
        total = total * y + c
    return total


def _solved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """x with a x = b, in the precision of a: NumPy has nothing above float64."""
    rows, n = np.column_stack([a, b]), len(b)
    for k in range(n):
        best = k + int(np.argmax(abs(rows[k:, k])))
        rows[[k, best]] = rows[[best, k]]
        rows[k] /= rows[k, k]
        others = np.arange(n) != k
        rows[others] -= rows[others, k, None] * rows[k]
    return rows[:, n]


@cache
def _arctan_quotient(terms: int) -> tuple[Sequence[float], ...]:
    """Coefficients of P, Q with arctan(t) = t P(t^2)/Q(t^2) for t in [0, 1].

    The quotient is exact at Chebyshev points, which for so smooth a function is as good
    as the best one but for a factor of 2.
    """
    count = 2 * terms - 1
    k = np.arange(count, dtype=np.longdouble)
    u = (1 - np.cos(np.pi * (k + 0.5) / count)) / 2
    f = np.arctan(np.sqrt(u)) / np.sqrt(u)
    powers = u[:, None] ** np.arange(terms)
    system = np.hstack([powers, -f[:, None] * powers[:, 1:]])
    found = [float(c) for c in _solved(system, f)]
    return tuple(found[:terms]), (1.0, *found[terms:])


@jax.custom_jvp
def sin_cos(x: Floats) -> tuple[Floats, Floats]:
    """Sine and cosine for |x| <= pi/2, without the reduction that larger angles need.

    The sine keeps its relative accuracy as x -> 0; the cosine is good to two eps.
    """
    y = x * x
    terms = range(1, 7 if jnp.finfo(x.dtype).bits <= 32 else 11)
    for_sin = [(-1) ** k / factorial(2 * k + 1) for k in terms]
    for_cos = [(-1) ** k / factorial(2 * k) for k in terms]
    sin = x + x * (y * power_series(for_sin, y))
    cos = 1 + y * power_series(for_cos, y)
    # Fused into everything that uses them, the polynomials would be computed anew.
    return jax.lax.optimization_barrier((sin, cos))


@sin_cos.defjvp
def _sin_cos_jvp(primals, tangents):
    sin, cos = sin_cos(*primals)
    (dx,) = tangents
    return (sin, cos), (cos * dx, -sin * dx)


@jax.custom_jvp
def acute_angle(y: Floats, x: Floats, r: Floats) -> Floats:
    """atan2(y, x) for x >= 0, where r = sqrt(x^2 + y^2) > 0 is known.

    A half-angle step and a quotient of polynomials: XLA's own arctangents and arcsine
    take longer on CPUs. Error below 4 eps of the angle.
    """
    t = y / (r + x)
    u = t * t
    terms = 4 if jnp.finfo(u.dtype).bits <= 32 else 7
    over, under = _arctan_quotient(terms)
    return (2 * t * power_series(over, u)) / power_series(under, u)


@acute_angle.defjvp
def _acute_angle_jvp(primals, tangents):
    y, x, r = primals
    dy, dx, _ = tangents
    over = 1 / r
    return acute_angle(y, x, r), over * ((over * x) * dy - (over * y) * dx)
