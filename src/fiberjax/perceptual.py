"""Perceptual roughness: what [0, 1] means in renderers after Chiang et al. 2016."""

from functools import partial

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals, floats

_LONGITUDINAL = (0.726, 0.812, 3.7, 20)
_AZIMUTHAL = (0.265, 1.194, 5.372, 22)
_STEPS = 8
"""Newton steps from a bound that is at most 3 times too high: all digits."""


def _polynomial(c: tuple[float, float, float, int], b: Floats) -> Floats:
    first, second, third, power = c
    return b * (first + b * (second + third * b ** (power - 2)))


def _slope(c: tuple[float, float, float, int], b: Floats) -> Floats:
    first, second, third, power = c
    return first + b * (2 * second + power * third * b ** (power - 2))


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _inverse(c: tuple[float, float, float, int], y: Floats) -> Floats:
    """b >= 0 with polynomial(b) = y >= 0.

    No term alone exceeds y, so the least of the three bounds is not below b, and from
    there Newton's method for a convex increasing function descends to b.
    """
    first, second, third, power = c
    bound = jnp.minimum(y / first, jnp.sqrt(y / second))
    b = jnp.minimum(bound, (y / third) ** (1 / power))
    for _ in range(_STEPS):
        b = b - (_polynomial(c, b) - y) / _slope(c, b)
    return b


@_inverse.defjvp
def _inverse_jvp(c, primals, tangents):
    b = _inverse(c, *primals)
    return b, tangents[0] / _slope(c, b)


def longitudinal(b: Reals) -> Floats:
    """Longitudinal deviation of a perceptual roughness.

    beta_m = 0.726 b + 0.812 b^2 + 3.7 b^20, whose square is the variance v of R.

    Args:
        b: perceptual roughness >= 0, in [0, 1] as renderers have it.

    Returns:
        beta_m in radians, in the dtype of b.

    Reference: Chiang et al. 2016, eq. 7.
    """
    (b,) = floats((b,))
    return _polynomial(_LONGITUDINAL, b)


def azimuthal(b: Reals) -> Floats:
    """Azimuthal deviation of a perceptual roughness.

    beta_n = 0.265 b + 1.194 b^2 + 5.372 b^22; the scale of the logistic distribution is
    s = sqrt(pi/8) beta_n.

    Args:
        b: perceptual roughness >= 0, in [0, 1] as renderers have it.

    Returns:
        beta_n in radians, in the dtype of b.

    Reference: Chiang et al. 2016, eq. 8.
    """
    (b,) = floats((b,))
    return _polynomial(_AZIMUTHAL, b)


def from_longitudinal(beta_m: Reals) -> Floats:
    """The perceptual roughness that `longitudinal` takes.

    By Newton's method; derivatives by the implicit function theorem.

    Args:
        beta_m: longitudinal deviation in radians, >= 0.

    Returns:
        b >= 0, above 1 where beta_m > 5.238.
    """
    (beta_m,) = floats((beta_m,))
    return _inverse(_LONGITUDINAL, beta_m)


def from_azimuthal(beta_n: Reals) -> Floats:
    """The perceptual roughness that `azimuthal` takes.

    By Newton's method; derivatives by the implicit function theorem.

    Args:
        beta_n: azimuthal deviation in radians, >= 0.

    Returns:
        b >= 0, above 1 where beta_n > 6.831.
    """
    (beta_n,) = floats((beta_n,))
    return _inverse(_AZIMUTHAL, beta_n)
