"""The model of Kajiya and Kay: diffuse and specular terms without azimuth.

It is not a density: neither term has a sampler here, and neither conserves energy
unless its factor is chosen for that. The albedo, int evaluate d omega_o, is
pi^2 k_d of the diffuse term at every theta_i. That of the specular term with k_s = 1:

    exponent   theta_i 0   30 deg   60 deg   80 deg   90 deg
    1             9.870     8.694    6.011    4.046    3.142
    8             5.106     4.422    2.594    1.224    0.698
    40            2.445     2.117    1.222    0.450    0.153
    200           1.110     0.961    0.555    0.193    0.031

A factor k_d = .4, with which a report shows hair, returns 3.95 times the light by the
diffuse term alone; k_d <= 1/pi^2 = 0.1013 returns no more than the fiber gets.
"""

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals, broadcastable, floats
from fiberjax.azimuthal import check_color


def _power_of_cosine(angle: Floats, exponent: Floats) -> Floats:
    """cos(angle)^exponent; 0, with derivatives 0, where the cosine is not positive.

    By the logarithm of the cosine, from the sine where the cosine is close to 1: a
    large exponent multiplies the rounding of what is close to 1.
    """
    sin, cos = jnp.sin(angle), jnp.cos(angle)
    steep, lit = cos < 0.7, cos > 0
    from_cos = jnp.log(jnp.where(steep & lit, cos, 1))
    from_sin = jnp.log1p(-(jnp.where(steep, 0, sin) ** 2)) / 2
    log = jnp.where(steep, from_cos, from_sin)
    return jnp.where(lit, jnp.exp(exponent * log), 0)


@jax.jit
def _evaluate(theta_i, theta_o, phi, diffuse, specular, exponent) -> Floats:
    shape = jnp.broadcast_shapes(theta_i.shape, theta_o.shape, phi.shape)
    # cos(float32(pi/2)) is negative: the angle has passed the pole by rounding alone.
    cosine = jnp.broadcast_to(jnp.abs(jnp.cos(theta_o)), shape)
    lobe = jnp.broadcast_to(_power_of_cosine(theta_i + theta_o, exponent), shape)
    if diffuse.ndim or specular.ndim:
        cosine, lobe = cosine[..., None], lobe[..., None]
    return diffuse * cosine + specular * lobe


def evaluate(
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    diffuse: Reals,
    specular: Reals,
    exponent: Reals,
) -> Floats:
    """Throughput per steradian, S cos(theta_o), by Kajiya and Kay.

    k_d sin(t, l) + k_s cos(t, e')^n = k_d cos theta_o + k_s cos(theta_i + theta_o)^n,
    and no specular term where |theta_i + theta_o| >= pi/2. As printed it is what an eye
    at theta_i sees of light from theta_o, of which cos theta_o is received; the
    specular term has no such cosine, so that its S is not reciprocal. The module says
    how much light this scatters. All azimuths are alike: the far side has no shadow.

    Args:
        theta_i: inclination of the given direction, that to the eye, in radians.
        theta_o: inclination of the direction scattered into, that to the light.
        phi: azimuth phi_o - phi_i in radians; only its shape counts.
        diffuse: k_d >= 0 per steradian, shape () or (C,).
        specular: k_s >= 0 per steradian, shape () or (C,).
        exponent: n > 0, a number.

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles) + that of the colors,
        dtype of the angles. Where the specular term starts its derivatives are those
        of 0; the one-sided derivative is infinite for n < 1.

    Raises:
        ValueError: diffuse or specular has more than one axis, or they do not
            broadcast; exponent is no number.

    Reference: Kajiya and Kay 1989, where the angle to the tangent of one direction is
    measured along the light: with both directions pointing away their
    cos(t, l) cos(t, e) + sin(t, l) sin(t, e) has its highlight on the wrong cone,
    theta_o = theta_i.
    """
    *angles, diffuse, specular, exponent = floats(
        (theta_i, theta_o, phi), (diffuse, specular, exponent)
    )
    check_color("diffuse", diffuse)
    check_color("specular", specular)
    broadcastable(diffuse=diffuse.shape, specular=specular.shape)
    if exponent.ndim:
        raise ValueError(f"exponent has shape {exponent.shape}: must be ()")
    return _evaluate(*angles, diffuse, specular, exponent)
