"""What a real-time model is given: sines and cosines of two directions, and a hair."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.fiber import Fiber, lobe_shape

LOBES = (0, 1, 2)
"""R, TT and TRT."""

PASS = 4
"""A hair of color C has sigma_a = -ln(C)/4: one pass through its middle leaves
C^(1/2)."""


class Directions(NamedTuple):
    """Sines and cosines of two directions, i given and o scattered into.

    Those of theta_i and theta_o; the cosine between the directions; cos phi,
    |cos(phi/2)| and cos theta_d.
    """

    sin_i: Floats
    sin_o: Floats
    cos_i: Floats
    cos_o: Floats
    cos_io: Floats
    cos_phi: Floats
    cos_half_phi: Floats
    cos_d: Floats


def of_angles(theta_i: Floats, theta_o: Floats, phi: Floats) -> Directions:
    """From the angles, each to all its digits, derivatives too."""
    sin_i, sin_o = jnp.sin(theta_i), jnp.sin(theta_o)
    # cos(float32(pi/2)) is negative: the angle has passed the pole by rounding alone.
    cos_i, cos_o = jnp.abs(jnp.cos(theta_i)), jnp.abs(jnp.cos(theta_o))
    cos_phi = jnp.cos(phi)
    return Directions(
        sin_i,
        sin_o,
        cos_i,
        cos_o,
        sin_i * sin_o + cos_i * cos_o * cos_phi,
        cos_phi,
        jnp.abs(jnp.cos(phi / 2)),
        jnp.abs(jnp.cos((theta_o - theta_i) / 2)),
    )


def of_dots(sin_i: Floats, sin_o: Floats, cos_io: Floats) -> Directions:
    """From three products of unit vectors, as a shader has them.

    Those of the tangent with both directions, and of the directions with each other.
    Next to the poles cos phi has only the digits that rounding of these leaves it.
    """
    cos_i = checkpoint_name(numerics.sqrt(1 - sin_i * sin_i), "cos_i")
    cos_o = checkpoint_name(numerics.sqrt(1 - sin_o * sin_o), "cos_o")
    across = checkpoint_name(cos_i * cos_o, "across")
    along = checkpoint_name(sin_i * sin_o, "along")
    bent = numerics.quotient(cos_io - along, across, otherwise=1.0)
    cos_phi = checkpoint_name(jnp.clip(bent, -1, 1), "cos_phi")
    half = checkpoint_name(numerics.sqrt(0.5 + 0.5 * cos_phi), "cos_half_phi")
    cos_d = checkpoint_name(numerics.sqrt(0.5 + 0.5 * (across + along)), "cos_d")
    return Directions(sin_i, sin_o, cos_i, cos_o, cos_io, cos_phi, half, cos_d)


class Hair(NamedTuple):
    """What a real-time model knows of a fiber: numbers of R, TT and TRT in tuples.

    eta; sigma_a per radius, (C,), or None if clear; beta_m and the tilt of the cone in
    radians for each lobe; beta_n in radians for each.
    """

    eta: Floats
    sigma_a: Floats | None
    beta_m: tuple[Any, ...]
    tilt: tuple[Any, ...]
    beta_n: tuple[Any, ...]


def of_fiber(fiber: Fiber) -> Hair:
    """The hair of a fiber of the reference."""
    shapes = [lobe_shape(fiber, p) for p in LOBES]
    return Hair(
        fiber.eta,
        None if fiber.sigma_a is None else jnp.atleast_1d(fiber.sigma_a),
        tuple(shape.beta_m for shape in shapes),
        tuple(0.0 if shape.tilt is None else shape.tilt for shape in shapes),
        tuple(shape.beta_n for shape in shapes),
    )
