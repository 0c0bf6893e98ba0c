"""The model of Marschner et al. 2003, beside d'Eon's: Gaussian M and smooth N.

To compare, not to render with: N is infinite on the caustics of TRT and higher lobes
(`fiberjax.caustics`), where the paper puts lobes of its own that are not built here;
beta_n, its roughness in azimuth, is not used. It has no pdf or sampler: a sample would
have to fall onto the caustics in proportion.
"""

import math
from functools import partial

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats
from fiberjax.auto import DEFAULT
from fiberjax.fiber import Fiber, cone, lobe_shape
from fiberjax.model import Model, prepare
from fiberjax.smooth import N_smooth


def M(theta_cone: Reals, theta_o: Reals, v: Reals) -> Floats:
    """Marschner's longitudinal density, a Gaussian about the specular cone.

    exp(-(theta_o - theta_cone)^2/(2 v))/sqrt(2 pi v), per radian of theta_o over the
    whole line: what lies beyond the poles is lost. int M cos(theta_o) dtheta_o is not
    1; `evaluate` says what becomes of it.

    Args:
        theta_cone: inclination of the cone in radians; -theta_i without tilt.
        theta_o: outgoing inclination in radians.
        v: variance in radians^2 of theta_o, > 0.

    Returns:
        Density per radian of theta_o, shape of the broadcast, dtype of the angles.

    Reference: Marschner et al. 2003, M_p = g(beta; theta_h - alpha) with
    theta_h = (theta_i + theta_o)/2. There g integrates to 1 over theta_h, half as far
    as theta_o goes: as printed a narrow lobe returns twice the light. Here it has unit
    integral over theta_o; beta and alpha of the paper are half of sqrt(v) and tilt.
    """
    theta_cone, theta_o, v = floats((theta_cone, theta_o), (v,))
    off = theta_o - theta_cone
    return jnp.exp(-(off * off) / (2 * v)) / jnp.sqrt(2 * math.pi * v)


@partial(jax.jit, static_argnames="lobes")
def _evaluate(fiber: Fiber, lobes, theta_i, theta_o, phi) -> Floats:
    theta_d = (theta_o - theta_i) / 2
    cos_d = jnp.cos(theta_d)
    measure = numerics.quotient(jnp.abs(jnp.cos(theta_o)), cos_d * cos_d, 0.0)
    total = 0.0
    for p in lobes:
        shape = lobe_shape(fiber, p)
        along = M(cone(theta_i, shape), theta_o, shape.beta_m**2) * measure
        around = N_smooth(p, phi, theta_d, eta=fiber.eta, sigma_a=fiber.sigma_a)
        if fiber.sigma_a is not None and fiber.sigma_a.ndim:
            along = along[..., None]
        # Far off the cone M is 0, on caustics too, where N is infinite.
        total = total + along * jnp.where(along > 0, around, 0)
    return jnp.asarray(total)


def evaluate(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
) -> Floats:
    """Scattered throughput per steradian, S cos(theta_o), by Marschner et al. 2003.

    S = sum_p M_p N_p/cos^2 theta_d, N_p that of a smooth fiber: `N_smooth`. With the
    cosine of S and that of solid angle, int cos^2(theta_o)/cos^2(theta_d) M dtheta_o is
    the energy of a lobe over that of its N; it tends to 1 for a narrow one. Untilted:

        beta_m    theta_i 0   30 deg   60 deg   80 deg   85 deg
        0.05         0.998     0.998    0.996    0.980    0.955
        0.2          0.971     0.968    0.948    0.961    1.076
        0.6          0.781     0.782    0.822    1.041    1.229

    Args:
        fiber: one fiber; beta_n is not used.
        theta_i: inclination of the given direction in radians, [-pi/2, pi/2].
        theta_o: inclination of the direction scattered into, radians, [-pi/2, pi/2].
        phi: azimuth phi_o - phi_i in radians, any real.
        lobes: static, the lobes p that are added; there is no rest.

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles) + sigma_a.shape, dtype of
        the angles. Infinite on a caustic, but 0 where M is 0. It grows as 1/cos theta_i
        towards the poles and is 0 where both directions are opposite poles.

    Raises:
        ValueError: as `fiberjax.evaluate`.

    Reference: Marschner et al. 2003, with plain eta in Fresnel's terms in place of
    eta' and eta'', and without its treatment of caustics and eccentricity.
    """
    lobes = Model(lobes, False, DEFAULT, "normal", "theta_d").lobes
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _evaluate(fiber, lobes, *angles)
