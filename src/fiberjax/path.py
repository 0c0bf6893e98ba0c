"""One ray through a smooth circular fiber: where it leaves and what is left of it.

Lobe p is the number of internal segments: 0 R, 1 TT, 2 TRT, 3 TRRT. The ray enters at
the signed offset h = sin(gamma_i) in [-1, 1], in units of the fiber's radius.
"""

import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, lobe_number


def eta_prime(theta_d: Reals, eta: Reals) -> Floats:
    """Index of refraction as seen in the projection onto the normal plane (Bravais).

    eta' = sqrt(eta^2 - sin^2 theta_d)/cos theta_d, evaluated as
    sqrt(cos^2 theta_d + (eta - 1)(eta + 1))/|cos theta_d|, exact as eta -> 1.

    Args:
        theta_d: difference angle (theta_o - theta_i)/2 in radians, [-pi/2, pi/2].
        eta: index of refraction, >= 1.

    Returns:
        eta' >= 1, shape broadcast(theta_d, eta), dtype of theta_d.

    Reference: d'Eon et al. 2013, section 3; erratum: the sine is printed unsquared.
    """
    theta_d, eta = floats((theta_d,), (eta,))
    c = jnp.abs(jnp.cos(theta_d))
    return jnp.sqrt(c * c + (eta - 1) * (eta + 1)) / c


def Phi(p: int, h: Reals, eta_p: Reals) -> Floats:
    """Azimuth at which the ray of offset h leaves after p internal segments.

    Phi = 2 p gamma_t - 2 gamma_i + p pi, gamma_i = asin h, gamma_t = asin(h/eta').
    gamma_t is evaluated as atan2(h, sqrt((eta' - h)(eta' + h))), which loses nothing
    where eta' and |h| are close to 1. dPhi/dh is infinite at |h| = 1. At eta' = |h| = 1
    dPhi/deta' is infinite from one side; 0 is returned.

    Args:
        p: number of internal segments, a static integer >= 0.
        h: offset, in [-1, 1].
        eta_p: eta' of `eta_prime`, >= 1.

    Returns:
        Change of azimuth in radians, not wrapped; shape broadcast(h, eta_p), dtype
        of h.

    Raises:
        ValueError: p is not a static integer >= 0.

    Reference: d'Eon et al. 2013, eq. 3; erratum: there eta = asin h and
    gamma_i = asin(h/eta') are printed for gamma_i and gamma_t.
    """
    p = lobe_number("p", p)
    h, eta_p = floats((h,), (eta_p,))
    gamma_i = jnp.arcsin(h)
    if p == 0:
        return -2 * gamma_i + jnp.zeros_like(eta_p)
    gamma_t = jnp.atan2(h, numerics.sqrt((eta_p - h) * (eta_p + h)))
    return 2 * p * gamma_t - 2 * gamma_i + p * jnp.pi


def _length_over_g(theta_d: Floats, eta: Floats) -> Floats:
    """Length of one segment over g, 2 eta/(eta^2 - 1 + cos^2 theta_d)."""
    c = jnp.cos(theta_d)
    return 2 * eta / ((eta - 1) * (eta + 1) + c * c)


def transmittance(h: Reals, theta_d: Reals, eta: Reals, sigma_a: Reals) -> Floats:
    """Fraction of light that one internal segment lets through.

    T = exp(-sigma_a 2 cos gamma_t/cos theta_t), sin theta_t = sin(theta_d)/eta. The
    length is evaluated as 2 eta g/(eta^2 - 1 + cos^2 theta_d),
    g = sqrt(eta^2 - 1 + cos^2(theta_d)(1 - h^2)): no angle is formed.

    Args:
        h: offset, in [-1, 1].
        theta_d: difference angle in radians, [-pi/2, pi/2].
        eta: index of refraction, >= 1.
        sigma_a: absorption per fiber radius, >= 0. All four broadcast; for colors
            append an axis to the others.

    Returns:
        T in [0, 1], shape of the broadcast, dtype of h and theta_d. At eta = 1, |h| = 1
        the derivatives in h and eta are infinite from one side; 0 is returned.

    Reference: d'Eon et al. 2011; erratum: Karis 2016 prints about twice this path.
    """
    h, theta_d, eta, sigma_a = floats((h, theta_d), (eta, sigma_a))
    c = jnp.cos(theta_d)
    g = numerics.sqrt((eta - 1) * (eta + 1) + c * c * ((1 - h) * (1 + h)))
    return jnp.exp(-sigma_a * (g * _length_over_g(theta_d, eta)))


def A(p: int, F: Reals, T: Reals, transmitted: Reals | None = None) -> Floats:
    """Attenuation of lobe p: what is left after its surface interactions and segments.

    A_0 = F, A_p = (1 - F)^2 F^(p-1) T^p.

    Args:
        p: number of internal segments, a static integer >= 0.
        F: Fresnel reflectance, in [0, 1].
        T: transmittance of one segment, in [0, 1].
        transmitted: 1 - F where it is known better than by subtraction.

    Returns:
        A_p in [0, 1], shape broadcast(F, T), their dtype.

    Raises:
        ValueError: p is not a static integer >= 0.

    Reference: d'Eon et al. 2011; Chiang et al. 2016.
    """
    p = lobe_number("p", p)
    F, T = floats((F, T))
    if p == 0:
        return jnp.broadcast_to(F, jnp.broadcast_shapes(F.shape, T.shape))
    passed = 1 - F if transmitted is None else jnp.asarray(transmitted, F.dtype)
    return passed**2 * F ** (p - 1) * T**p


def A_rest(
    p: int,
    F: Reals,
    T: Reals,
    transmitted: Reals | None = None,
    absorbed: Reals | None = None,
) -> Floats:
    """Attenuation of all lobes from p on, summed in closed form.

    sum_{q >= p} A_q = (1 - F)^2 F^(p-1) T^p/(1 - F T), with the denominator as
    (1 - F) + F (1 - T), which does not cancel. At F = T = 1 it is 0, its limit.

    Args:
        p: first lobe of the sum, a static integer >= 1.
        F: Fresnel reflectance, in [0, 1].
        T: transmittance of one segment, in [0, 1].
        transmitted: 1 - F where it is known better than by subtraction.
        absorbed: 1 - T where it is known better than by subtraction.

    Returns:
        The sum, in [0, 1], shape broadcast(F, T), their dtype.

    Raises:
        ValueError: p is not a static integer >= 1.

    Reference: d'Eon et al. 2011; Chiang et al. 2016, A_pmax.
    """
    p = lobe_number("p", p, lowest=1)
    F, T = floats((F, T))
    passed = 1 - F if transmitted is None else jnp.asarray(transmitted, F.dtype)
    lost = 1 - T if absorbed is None else jnp.asarray(absorbed, F.dtype)
    return passed * F ** (p - 1) * (escaping(F, passed, lost) * T**p)


def escaping(F: Floats, passed: Floats, absorbed: Floats) -> Floats:
    """(1 - F)/(1 - F T), for 1 - F and 1 - T; 1 at F = T = 1."""
    return numerics.quotient(passed, passed + F * absorbed, otherwise=1.0)
