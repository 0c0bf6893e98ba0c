"""The near field by direction vectors in place of angles.

Unit vectors in the frame of the fiber, the tangent first: (sin theta, cos theta
cos phi, cos theta sin phi). No angle is computed but phi. See `fiberjax.nearfield` for
the model, its static choices and its errors.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Int

from fiberjax import entering, numerics
from fiberjax._types import Floats, Reals, choice, last_axis
from fiberjax.fiber import Fiber
from fiberjax.nearfield import Lobes, near_model, prepare
from fiberjax.sampling import GRADIENTS
from fiberjax.spherical import Inclination


class DirectionSample(NamedTuple):
    """A sampled direction.

    omega_o, a unit vector, the tangent first; weight = evaluate/pdf, with the color
    axis of sigma_a; p, the lobe it was drawn from, P = max(lobes) + 1 for the rest.
    """

    omega_o: Floats
    weight: Floats
    p: Int[Array, "..."]


def _across(omega: Floats) -> Inclination:
    y, z = omega[..., 1], omega[..., 2]
    return Inclination(omega[..., 0], numerics.sqrt(y * y + z * z))


def _azimuth(omega_i: Floats, omega_o: Floats) -> Floats:
    """phi_o - phi_i; 0 where a direction lies along the tangent."""
    (yi, zi), (yo, zo) = ((w[..., 1], w[..., 2]) for w in (omega_i, omega_o))
    across, along = yi * zo - zi * yo, yi * yo + zi * zo
    defined = (across != 0) | (along != 0)
    return jnp.atan2(jnp.where(defined, across, 0), jnp.where(defined, along, 1))


def _vectors(fiber: Fiber, omega_i, omega_o, h):
    last_axis(3, omega_i=omega_i, omega_o=omega_o)
    fiber, (omega_i, omega_o, h) = prepare(fiber, (omega_i, omega_o), (h,))
    where = _across(omega_i), _across(omega_o), _azimuth(omega_i, omega_o), h
    return fiber, where


def evaluate(
    fiber: Fiber,
    omega_i: Reals,
    omega_o: Reals,
    h: Reals,
    *,
    lobes: Lobes = (0, 1, 2),
    rest: bool = True,
    detector: str = "logistic",
    compat: str | None = None,
) -> Floats:
    """`nearfield.evaluate` of two directions.

    Args:
        fiber, h: as in `nearfield.evaluate`.
        omega_i: the given direction, away from the fiber, shape (..., 3).
        omega_o: the direction scattered into, away from the fiber, shape (..., 3).
        lobes, rest, detector, compat: static, see the module.

    Returns:
        S cos(theta_o) per steradian; the dtype is that of the vectors. Along the
        tangent phi is 0.

    Raises:
        ValueError: a vector does not end in an axis of 3, and as
            `nearfield.evaluate`.
    """
    model = near_model(lobes, rest, detector, compat)
    fiber, where = _vectors(fiber, omega_i, omega_o, h)
    return entering.evaluate(model, compat, fiber, *where)


def pdf(
    fiber: Fiber,
    omega_i: Reals,
    omega_o: Reals,
    h: Reals,
    *,
    lobes: Lobes = (0, 1, 2),
    rest: bool = True,
    detector: str = "logistic",
    compat: str | None = None,
) -> Floats:
    """`nearfield.pdf` of two directions; arguments and errors as in `evaluate`.

    Returns:
        Density per steradian, no color axis.
    """
    model = near_model(lobes, rest, detector, compat)
    fiber, where = _vectors(fiber, omega_i, omega_o, h)
    return entering.pdf(model, compat, fiber, *where)


def sample(
    fiber: Fiber,
    omega_i: Reals,
    h: Reals,
    u: Reals,
    *,
    lobes: Lobes = (0, 1, 2),
    rest: bool = True,
    detector: str = "logistic",
    compat: str | None = None,
    gradient: str = "reparameterized",
) -> DirectionSample:
    """`nearfield.sample` of a direction.

    Args:
        fiber, omega_i, h: as in `evaluate`.
        u, lobes, rest, detector, compat, gradient: as in `nearfield.sample`.

    Returns:
        `DirectionSample` of shape broadcast(omega_i[..., 0], h, u[..., 0]).

    Raises:
        ValueError: u does not end in an axis of 4, and as `evaluate`.
    """
    model = near_model(lobes, rest, detector, compat)
    choice("gradient", gradient, GRADIENTS)
    last_axis(3, omega_i=omega_i)
    last_axis(4, u=u)
    fiber, (omega_i, h, u) = prepare(fiber, (omega_i,), (h, u))
    given = _across(omega_i)
    out, phi, weight, p = entering.sample(model, compat, gradient, fiber, given, h, u)
    # The given direction's azimuth as a rotation: phi is from it.
    safe = given.cos > 0
    over = 1 / jnp.where(safe, given.cos, 1)
    y = jnp.where(safe, omega_i[..., 1] * over, 1)
    z = omega_i[..., 2] * over
    cos, sin = jnp.cos(phi), jnp.sin(phi)
    across = y * cos - z * sin, y * sin + z * cos
    sides = jnp.broadcast_arrays(out.sin, *(out.cos * x for x in across))
    return DirectionSample(jnp.stack(sides, -1), weight, p)
