"""An opaque fiber whose surface is Lambertian, seen from afar.

evaluate and pdf differ by the color alone: sampling is perfect, and its weight is the
color. Nothing depends on theta_i.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.azimuthal import check_color
from fiberjax.circular import wrap
from fiberjax.spherical import open_unit

_SERIES = tuple((-1) ** k * 2 * (k + 1) / math.factorial(2 * k + 3) for k in range(10))
"""(sin d - d cos d)/d^3 in powers of d^2; the next term is below 1e-19 at d = 1."""


class Sample(NamedTuple):
    """A sampled direction.

    theta_o in radians, [-pi/2, pi/2]; phi in radians, [-pi, pi]; weight, evaluate/pdf.
    """

    theta_o: Floats
    phi: Floats
    weight: Floats


def _lit(phi: Floats) -> Floats:
    """sin d - d cos d, d = pi - |phi| with phi wrapped to [-pi, pi]."""
    x = wrap(phi)
    # Not jnp.abs, whose second derivative at phi = 0 is 0.
    d = jnp.maximum(jnp.pi - jnp.where(x < 0, -x, x), 0)
    near = jnp.where(d < 1, d, 0)
    series = near * near * near * numerics.power_series(_SERIES, near * near)
    return jnp.where(d < 1, series, jnp.sin(d) - d * jnp.cos(d))


@jax.jit
def _pdf(theta_i: Floats, theta_o: Floats, phi: Floats) -> Floats:
    # cos(float32(pi/2)) is negative: the angle has passed the pole by rounding alone.
    density = jnp.abs(jnp.cos(theta_o)) * (_lit(phi) / (4 * math.pi))
    return jnp.broadcast_to(density, jnp.broadcast_shapes(theta_i.shape, density.shape))


def pdf(theta_i: Reals, theta_o: Reals, phi: Reals) -> Floats:
    """Probability density, per steradian, with which `sample` chooses a direction.

    cos(theta_o) (sin d - d cos d)/(4 pi): `evaluate` of a white fiber.

    Args:
        theta_i, theta_o, phi: as in `evaluate`.

    Returns:
        Density per steradian, int pdf d omega_o = 1; shape broadcast(angles).
    """
    return _pdf(*floats((theta_i, theta_o, phi)))


def evaluate(theta_i: Reals, theta_o: Reals, phi: Reals, *, color: Reals) -> Floats:
    """Scattered throughput per steradian, S cos(theta_o), of a Lambertian fiber.

    S = k_d (sin d - d cos d)/(4 pi), d = pi - |phi|, for |phi| <= pi; other phi are
    wrapped. For d < 1 the series in d is summed: the difference, d^3/3, would lose its
    digits as phi -> pi, where no lit part of the fiber is seen. int S dphi is
    2 k_d/pi, and int S cos(theta_o) d omega_o, the albedo, k_d at every theta_i.

    Args:
        theta_i: inclination of the given direction in radians; the result is the same
            for all.
        theta_o: inclination of the direction scattered into, radians, [-pi/2, pi/2].
        phi: azimuth phi_o - phi_i in radians, any real.
        color: k_d, albedo of the surface and of the fiber, in [0, 1], () or (C,).

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles) + color.shape, dtype of
        the angles.

    Raises:
        ValueError: color has more than one axis.

    Reference: d'Eon et al. 2013, eq. 9; printed with |(pi - phi) cos phi + sin phi| for
    phi in [0, 2 pi].
    """
    *angles, color = floats((theta_i, theta_o, phi), (color,))
    check_color("color", color)
    density = _pdf(*angles)
    return density * color if color.ndim == 0 else density[..., None] * color


@jax.jit
def _direction(theta_i: Floats, u: Floats) -> tuple[Floats, Floats]:
    u = open_unit(u)
    h, square, turn = 2 * u[..., 0] - 1, u[..., 1], 2 * math.pi * u[..., 2]
    radius, normal = jnp.sqrt(square), jnp.sqrt(1 - square)
    along, aside = radius * jnp.cos(turn), radius * jnp.sin(turn)
    theta_o = jnp.atan2(along, jnp.sqrt(normal * normal + aside * aside))
    # Light of offset h meets the normal at the azimuth -asin h.
    phi = wrap(jnp.atan2(aside, normal) - jnp.arcsin(h))
    shape = jnp.broadcast_shapes(theta_i.shape, phi.shape)
    return jnp.broadcast_to(theta_o, shape), jnp.broadcast_to(phi, shape)


def sample(theta_i: Reals, u: Reals, *, color: Reals) -> Sample:
    """A direction drawn from `pdf`, exactly; its weight is the color.

    h uniform; the normal at the azimuth -asin h; a direction of density cosine/pi about
    it, as a point of the unit disk lifted to the sphere.

    Args:
        theta_i: inclination of the given direction in radians; only its shape counts.
        u: uniform numbers in [0, 1), shape (..., 3): offset, radius and azimuth in the
            disk. They are moved to the centers of their cells.
        color: k_d, albedo of the surface, in [0, 1], shape () or (C,).

    Returns:
        `Sample` of shape broadcast(theta_i, u[..., 0]), dtype of theta_i.

    Raises:
        ValueError: u does not end in an axis of 3, color has more than one axis.

    Reference: d'Eon et al. 2013, section 4.
    """
    last_axis(3, u=u)
    theta_i, u, color = floats((theta_i,), (u, color))
    check_color("color", color)
    theta_o, phi = _direction(theta_i, u)
    return Sample(theta_o, phi, jnp.broadcast_to(color, (*phi.shape, *color.shape)))
