"""Reflection at the surface of a smooth dielectric."""

from typing import NamedTuple

import jax
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


def _parts(mu: Floats, eta: Floats) -> tuple[Floats, ...]:
    """k = eta^2 - 1, g, r_s, r_p, 1/(mu + g) and 1/(eta^2 mu + g)."""
    k = (eta - 1) * (eta + 1)
    g = numerics.sqrt(k + mu * mu)
    # Both sums vanish only at mu = 0, eta = 1, where nothing is reflected.
    s = mu + g
    s = 1 / jnp.where(s == 0, 1, s)
    t = eta * eta * mu + g
    t = 1 / jnp.where(t == 0, 1, t)
    # One factor at a time: the squares may overflow.
    r_s = -(k * s) * s
    r_p = (k * t) * (((eta * eta + 1) * mu * mu - 1) * t)
    return k, g, r_s, r_p, s, t


@jax.custom_jvp
def interface(mu: Floats, eta: Floats) -> Interface:
    """Unpolarized reflectance F and 1 - F at incident cosine mu."""
    _, g, r_s, r_p, s, t = _parts(mu, eta)
    passed = 2 * ((mu * s) * (g * s) + eta * eta * ((mu * t) * (g * t)))
    return Interface((r_s * r_s + r_p * r_p) / 2, passed, g)


@interface.defjvp
def _interface_jvp(primals, tangents):
    """In closed form: what is lost by reflection is gained by transmission.

    dr_s/dmu = -2 r_s/g, dr_p/dmu = 2 eta^2 k/(g (eta^2 mu + g)^2), and in eta
    -2 eta mu/(g (mu + g)^2), 2 eta mu (eta^2 - 2 + 2 mu^2)/(g (eta^2 mu + g)^2).
    """
    (mu, eta), (dmu, deta) = primals, tangents
    k, g, r_s, r_p, s, t = _parts(mu, eta)
    over = numerics.quotient(1.0, g, 0.0)
    square = eta * eta
    by_mu = 2 * ((square * (k * t)) * (t * r_p) - r_s * r_s) * over
    from_p = ((square - 2) + 2 * mu * mu) * (t * (t * r_p))
    by_eta = (2 * eta) * (mu * over) * (from_p - s * (s * r_s))
    dF = by_mu * dmu + by_eta * deta
    dg = over * (mu * dmu + eta * deta)
    return interface(mu, eta), Interface(dF, -dF, dg)


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
