"""M to a tolerance: one short polynomial in place of two long ones for I0."""

import math
from dataclasses import dataclass
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import i0e

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.spherical import Inclination, density, slopes, turning, versine

_SCALES = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)
_MOST = 40
_POINTS = 2000


def _places(low: float, high: float, count: int) -> np.ndarray:
    """Values from low to high, as dense in log(1 + a)."""
    return np.expm1(np.linspace(math.log1p(low), math.log1p(high), count))


@cache
def _polynomial(low: float, high: float, tolerance: float) -> tuple[float, ...]:
    """The polynomial for I0e(a)/t: scale, both ends of t, coefficients.

    It is one in t = 1/sqrt(1 + scale a), moved to [-1, 1]. t is bounded for all a, and
    the function is smooth in it at both ends: for large a, I0e sqrt(a) is a series in
    1/a. The scale is the one that needs the fewest terms.
    """
    a = _places(low, high, _POINTS)
    best: tuple[float, ...] | None = None
    for scale in _SCALES:
        ends = tuple(1 / math.sqrt(1 + scale * x) for x in (high, low))
        if ends[1] - ends[0] < 1e-9:
            ends = ends[0] - 1e-9, ends[1] + 1e-9

        def value(a, scale=scale, ends=ends):
            t = 1 / np.sqrt(1 + scale * a)
            return (2 * t - ends[1] - ends[0]) / (ends[1] - ends[0]), i0e(a) / t

        s, f = value(a)
        for count in range(1, _MOST):
            node = np.cos(np.pi * (np.arange(count) + 0.5) / count)
            t = (node + 1) / 2 * (ends[1] - ends[0]) + ends[0]
            _, exact = value(np.maximum(1 / (t * t) - 1, 0) / scale)
            fit = np.polynomial.chebyshev.chebfit(node, exact, count - 1)
            power = np.polynomial.chebyshev.cheb2poly(fit)
            error = np.abs(np.polynomial.polynomial.polyval(s, power) / f - 1).max()
            if error <= tolerance:
                if best is None or len(power) < len(best) - 3:
                    best = (scale, *ends, *map(float, power))
                break
    if best is None:
        raise ValueError(f"tolerance = {tolerance}: must be above the rounding of I0")
    return best


def _inverse_root(x: Floats, largest: float) -> Floats:
    """1/sqrt(x) for 1 <= x <= largest, to 3e-14: no derivative is taken of it.

    In float64 a root and a quotient take longer than all else in M: one step of Newton
    from float32 does not, where float32 holds x.
    """
    if x.dtype == jnp.float32 or largest > 1e30:
        return 1 / jnp.sqrt(x)
    near = jax.lax.rsqrt(x.astype(jnp.float32)).astype(x.dtype)
    return near * (1.5 - 0.5 * x * near * near)


@dataclass(frozen=True)
class Along:
    """M for a range of a = cos theta_cone cos theta_o/v, to a relative tolerance.

    Sines and cosines are polynomials, of each angle once, and I0 is one too: of few
    terms where a is small or large throughout, the forms for broad and for narrow
    lobes. Args: the ends of a, the tolerance.
    """

    low: float
    high: float
    tolerance: float

    @property
    def terms(self) -> int:
        """Terms of the polynomial."""
        return len(_polynomial(self.low, self.high, self.tolerance)) - 3

    def bessel(self, a: Floats) -> Floats:
        """exp(-|a|) I0(a)."""
        scale, low, high, *power = _polynomial(self.low, self.high, self.tolerance)
        t = _inverse_root(1 + scale * jnp.abs(a), 1 + scale * self.high)
        s = (2 / (high - low)) * t - (high + low) / (high - low)
        return numerics.power_series(power, s) * t

    def M(self, cone: Inclination, out: Inclination, v: Floats) -> Floats:
        """`fiberjax.M` of sines and cosines; derivatives of its logarithm are exact."""
        return _M(cone, out, v, self)


@partial(jax.custom_jvp, nondiff_argnums=(3,))
def _M(cone: Inclination, out: Inclination, v: Floats, form: Along) -> Floats:
    x = 1 / v
    a = x * cone.cos * out.cos
    level = 1 / (-v * jnp.expm1(-2 * x))
    return density(-x * versine(cone, out), a, level, form.bessel)


@_M.defjvp
def _M_jvp(form, primals, tangents):
    (cone, out, v), (dcone, dout, dv) = primals, tangents
    value = _M(*primals, form)
    turns = [turning(cone, dcone), turning(out, dout), dv]
    each = zip(slopes(cone, out, v), turns, strict=True)
    return value, value * sum(s * t for s, t in each)
