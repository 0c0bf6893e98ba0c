"""Directions and the angles of the model."""

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, last_axis


def _unscaled(vector: Floats) -> Floats:
    """The vector over its largest component: angles do not depend on lengths, and
    squares of very long or short vectors would leave the range of float32.
    """
    size = jax.lax.stop_gradient(jnp.abs(vector).max(-1, keepdims=True))
    return vector / jnp.where(size > 0, size, 1)


def _dot(a: Floats, b: Floats) -> Floats:
    return jnp.sum(a * b, -1)


def _length(a: Floats) -> Floats:
    return numerics.sqrt(_dot(a, a))


def to_angles(wi: Reals, wo: Reals, tangent: Reals) -> tuple[Floats, Floats, Floats]:
    """Inclinations and azimuth of two directions that point away from the fiber.

    theta = atan2(t . w, |t x w|), positive towards +tangent; phi = phi_o - phi_i, the
    right-handed angle about the tangent from wi to wo. In coordinates with the tangent
    first, w = (sin theta, cos theta cos phi, cos theta sin phi).

    Args:
        wi: given direction, shape (..., 3), any length > 0.
        wo: direction scattered into, shape (..., 3), any length > 0.
        tangent: direction of the fiber, shape (..., 3), any length > 0.

    Returns:
        theta_i, theta_o in [-pi/2, pi/2] and phi in [-pi, pi], radians, in the shape of
        the broadcast without its last axis. Where a direction lies along the tangent
        its azimuth is undefined: phi is 0 there, and the derivatives are finite.

    Raises:
        ValueError: an argument does not end in an axis of 3.
    """
    last_axis(3, wi=wi, wo=wo, tangent=tangent)
    vectors = jnp.broadcast_arrays(*floats((wi, wo, tangent)))
    wi, wo, t = map(_unscaled, vectors)
    across_i, across_o = jnp.cross(t, wi), jnp.cross(t, wo)
    theta_i = jnp.atan2(_dot(t, wi), _length(across_i))
    theta_o = jnp.atan2(_dot(t, wo), _length(across_o))
    along = _dot(across_i, across_o)
    turned = _length(t) * _dot(t, jnp.cross(wi, wo))
    defined = (along != 0) | (turned != 0)
    phi = jnp.atan2(jnp.where(defined, turned, 0), jnp.where(defined, along, 1))
    return theta_i, theta_o, phi


def from_angles(
    theta_i: Reals, theta_o: Reals, phi: Reals, tangent: Reals, phi_i: Reals = 0.0
) -> tuple[Floats, Floats]:
    """Unit directions of the given angles: the inverse of `to_angles`.

    w = sin theta t + cos theta (cos phi n + sin phi b), with unit vectors t along the
    tangent, n across it and b = t x n. n is the part across the tangent of the
    coordinate axis that the tangent is least aligned with.

    Args:
        theta_i, theta_o: inclinations in radians, [-pi/2, pi/2].
        phi: azimuth phi_o - phi_i in radians.
        tangent: direction of the fiber, shape (..., 3), any length > 0.
        phi_i: azimuth of wi about the tangent in radians, 0 at n.

    Returns:
        wi and wo, unit vectors of shape broadcast(angles, tangent[..., 0]) + (3,).

    Raises:
        ValueError: the tangent does not end in an axis of 3.
    """
    last_axis(3, tangent=tangent)
    theta_i, theta_o, phi, t, phi_i = floats((theta_i, theta_o, phi), (tangent, phi_i))
    t = _unscaled(t)
    t = t / _length(t)[..., None]
    axis = jnp.argmin(jnp.abs(t), -1)
    n = (jnp.arange(3) == axis[..., None]).astype(t.dtype)
    n = n - _dot(n, t)[..., None] * t
    n = n / _length(n)[..., None]
    b = jnp.cross(t, n)

    def direction(theta, phi):
        theta, phi = theta[..., None], phi[..., None]
        across = jnp.cos(phi) * n + jnp.sin(phi) * b
        return jnp.sin(theta) * t + jnp.cos(theta) * across

    return direction(theta_i, phi_i), direction(theta_o, phi_i + phi)
