"""The near field by direction vectors in place of angles.

Unit vectors in the frame of the fiber, the tangent first: (sin theta, cos theta
cos phi, cos theta sin phi). No angle is computed but phi. Derivatives mean something
along the sphere only: those in the length of a vector depend on how its angles are
found. See `fiberjax.nearfield` for the model, its static choices and its errors.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from fiberjax import entering, numerics, programs
from fiberjax._types import Floats, Reals, broadcastable, choice, last_axis
from fiberjax.circular import sin_cos
from fiberjax.fiber import Fiber
from fiberjax.nearfield import Lobes, near_model, prepare
from fiberjax.sampling import GRADIENTS
from fiberjax.section import stacked
from fiberjax.spherical import Inclination


class DirectionSample(NamedTuple):
    """A sampled direction.

    omega_o, a unit vector, the tangent first; weight = evaluate/pdf, with the color
    axis of sigma_a; p, the lobe it was drawn from, P = max(lobes) + 1 for the rest.
    """

    omega_o: Floats
    weight: Floats
    p: Int[Array, "..."]


def _inclination(omega: Sequence[Floats]) -> Inclination:
    x, y, z = omega
    return Inclination(x, numerics.sqrt(y * y + z * z))


def _seen(omega_i: Sequence[Floats], omega_o: Sequence[Floats]) -> entering.Seen:
    """phi is 0 where a direction lies along the tangent."""
    (_, yi, zi), (_, yo, zo) = omega_i, omega_o
    across, along = yi * zo - zi * yo, yi * yo + zi * zo
    size = numerics.sqrt(across * across + along * along)
    defined = size > 0
    # In the half plane where an acute angle will do.
    acute = numerics.acute_angle(
        jnp.where(defined, across, 0),
        jnp.where(defined, jnp.abs(along), 1),
        jnp.where(defined, size, 1),
    )
    half = jnp.where(across < 0, -jnp.pi, jnp.pi)
    phi = jnp.where(along < 0, half - acute, acute)
    return entering.Seen(_inclination(omega_i), _inclination(omega_o), phi)


def _shown(out: Inclination, phi: Floats, omega_i: Sequence[Floats]) -> Floats:
    """The components of what was drawn: phi is from the given direction's azimuth."""
    _, y, z = omega_i
    cos_i = numerics.sqrt(y * y + z * z)
    y = numerics.quotient(y, cos_i, otherwise=1.0)
    z = numerics.quotient(z, cos_i, otherwise=0.0)
    sin, cos = sin_cos(phi)
    found = [out.sin, out.cos * (y * cos - z * sin), out.cos * (y * sin + z * cos)]
    return stacked(programs.apart(found, out.sin))


def _places(fiber: Fiber, omega_i, omega_o, h) -> tuple[Fiber, entering.Places]:
    last_axis(3, omega_i=omega_i, omega_o=omega_o)
    pair = {
        "omega_i[..., 0]": np.shape(omega_i)[:-1],
        "omega_o[..., 0]": np.shape(omega_o)[:-1],
    }
    broadcastable(**pair, h=np.shape(h))
    fiber, (omega_i, omega_o, h) = prepare(fiber, (omega_i, omega_o), (h,))
    return fiber, ((h,), (omega_i, omega_o))


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
        ValueError: a vector does not end in an axis of 3, shapes do not broadcast, and
            as `nearfield.evaluate`.
    """
    model = near_model(lobes, rest, detector, compat)
    fiber, places = _places(fiber, omega_i, omega_o, h)
    return entering.evaluate(model, compat, _seen, fiber, places)


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
    fiber, places = _places(fiber, omega_i, omega_o, h)
    return entering.pdf(model, compat, _seen, fiber, places)


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
    leading = {"omega_i[..., 0]": np.shape(omega_i)[:-1], "u[..., 0]": np.shape(u)[:-1]}
    broadcastable(**leading, h=np.shape(h))
    fiber, (omega_i, h, u) = prepare(fiber, (omega_i,), (h, u))
    places = (h,), (omega_i, u)
    found, weight, p = entering.sample(
        model, compat, gradient, _inclination, _shown, fiber, places
    )
    return DirectionSample(found, weight, p)
