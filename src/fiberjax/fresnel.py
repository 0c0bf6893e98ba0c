"""Reflection at the surface of a smooth dielectric."""

from typing import NamedTuple

import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats


class Interface(NamedTuple):
    """Reflected and transmitted fractions, and the cosine behind them.

    g = sqrt(eta^2 - 1 + mu^2) is eta times the cosine of the refracted ray. The two
    fractions come from formulas of their own: neither is one minus the other.
    """

    reflected: Floats
    transmitted: Floats
    g: Floats


def interface(mu: Floats, eta: Floats) -> Interface:
    """Unpolarized reflectance F and 1 - F at incident cosine mu."""
    k = (eta - 1) * (eta + 1)
    g = numerics.sqrt(k + mu * mu)
    # Both sums vanish only at mu = 0, eta = 1, where nothing is reflected.
    s = mu + g
    s = 1 / jnp.where(s == 0, 1, s)
    t = eta * eta * mu + g
    t = 1 / jnp.where(t == 0, 1, t)
    # One factor at a time: the squares, and theirs in the derivatives, may overflow.
    r_s = -(k * s) * s
    r_p = (k * t) * (((eta * eta + 1) * mu * mu - 1) * t)
    passed = 2 * ((mu * s) * (g * s) + eta * eta * ((mu * t) * (g * t)))
    return Interface((r_s * r_s + r_p * r_p) / 2, passed, g)


def reflectance(cos_theta_i: Reals, eta: Reals) -> Floats:
    """Exact unpolarized Fresnel reflectance of a dielectric.

    F = (r_s^2 + r_p^2)/2 with mu = cos_theta_i, g = sqrt(eta^2 - 1 + mu^2),
    r_s = -(eta^2 - 1)/(mu + g)^2,
    r_p = (eta^2 - 1)((eta^2 + 1) mu^2 - 1)/(eta^2 mu + g)^2: the usual quotients with
    the differences multiplied out, so that F keeps its relative accuracy as eta -> 1.
    F(0, 1) is 0 by definition.

    For a fiber the incident cosine is cos(theta_d) cos(gamma_i) and eta is the plain
    index of refraction at every interaction along the path.

    Args:
        cos_theta_i: cosine of the angle of incidence, in [0, 1].
        eta: index of refraction inside relative to outside, >= 1.

    Returns:
        Reflected fraction, shape broadcast(cos_theta_i, eta), dtype of cos_theta_i.

    Reference: Fresnel's equations. Marschner et al. 2003 use two indices eta', eta'';
    plain eta agrees with a 3-D ray trace.
    """
    mu, eta = floats((cos_theta_i,), (eta,))
    # cos(float32(pi/2)) is negative: the angle has passed grazing by rounding alone.
    return interface(jnp.abs(mu), eta).reflected
