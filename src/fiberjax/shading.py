"""What a real-time model is given: sines and cosines of two directions, and a hair."""

import operator
from collections.abc import Sequence
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax._types import Floats
from fiberjax.fiber import Fiber, lobe_shape, rest_shape

LOBES = (0, 1, 2)
"""R, TT and TRT."""

PASS = 4
"""A hair of color C has sigma_a = -ln(C)/4: one pass through its middle leaves
C^(1/2)."""

LEAST = 1e-6
"""Least cosine that is divided by; nothing is seen next to it."""


class Directions(NamedTuple):
    """Sines and cosines of two directions, i given and o scattered into.

    Those of theta_i and theta_o; the cosine between the directions; cos phi,
    |cos(phi/2)| and cos theta_d; 1 over the last two, at most 1e6.
    """

    sin_i: Floats
    sin_o: Floats
    cos_i: Floats
    cos_o: Floats
    cos_io: Floats
    cos_phi: Floats
    cos_half_phi: Floats
    cos_d: Floats
    over_half_phi: Floats
    over_d: Floats


def of_angles(theta_i: Floats, theta_o: Floats, phi: Floats) -> Directions:
    """From the angles, each to all its digits, derivatives too."""
    sin_i, sin_o = jnp.sin(theta_i), jnp.sin(theta_o)
    # cos(float32(pi/2)) is negative: the angle has passed the pole by rounding alone.
    cos_i, cos_o = jnp.abs(jnp.cos(theta_i)), jnp.abs(jnp.cos(theta_o))
    cos_phi = jnp.cos(phi)
    half, cos_d = jnp.abs(jnp.cos(phi / 2)), jnp.abs(jnp.cos((theta_o - theta_i) / 2))
    return Directions(
        sin_i,
        sin_o,
        cos_i,
        cos_o,
        sin_i * sin_o + cos_i * cos_o * cos_phi,
        cos_phi,
        half,
        cos_d,
        1 / jnp.maximum(half, LEAST),
        1 / jnp.maximum(cos_d, LEAST),
    )


def _root(square: Floats, of: str) -> tuple[Floats, Floats]:
    """A cosine and 1 over it from its square, by one reciprocal square root."""
    square = checkpoint_name(jnp.maximum(square, LEAST**2), f"square_{of}")
    over = checkpoint_name(jax.lax.rsqrt(square), f"over_{of}")
    return checkpoint_name(square * over, f"cos_{of}"), over


def of_dots(sin_i: Floats, sin_o: Floats, cos_io: Floats) -> Directions:
    """From three products of unit vectors, as a shader has them.

    Those of the tangent with both directions, and of the directions with each other.
    Next to the poles cosines and cos phi have only the digits that rounding of the
    three leaves them. No cosine is below 1e-6.
    """
    cos_i, over_i = _root(1 - sin_i * sin_i, "i")
    cos_o, over_o = _root(1 - sin_o * sin_o, "o")
    along = checkpoint_name(sin_i * sin_o, "along")
    cos_phi = jnp.clip((cos_io - along) * (over_i * over_o), -1, 1)
    cos_phi = checkpoint_name(cos_phi, "cos_phi")
    half, over_half = _root(0.5 + 0.5 * cos_phi, "half_phi")
    cos_d, over_d = _root(0.5 + 0.5 * (cos_i * cos_o + along), "d")
    return Directions(
        sin_i, sin_o, cos_i, cos_o, cos_io, cos_phi, half, cos_d, over_half, over_d
    )


class Hair(NamedTuple):
    """What a real-time model knows of a fiber: numbers of R, TT and TRT in tuples.

    eta; sigma_a per radius, (C,), or None if clear; beta_m and the tilt of the cone in
    radians for each lobe; beta_n in radians for each. Those that `of_fiber` makes end
    with the numbers of the rest, all higher lobes together.
    """

    eta: Floats
    sigma_a: Floats | None
    beta_m: tuple[Any, ...]
    tilt: tuple[Any, ...]
    beta_n: tuple[Any, ...]


def of_fiber(fiber: Fiber) -> Hair:
    """The hair of a fiber of the reference."""
    shapes = [*(lobe_shape(fiber, p) for p in LOBES), rest_shape(fiber)]
    return Hair(
        fiber.eta,
        None if fiber.sigma_a is None else jnp.atleast_1d(fiber.sigma_a),
        tuple(shape.beta_m for shape in shapes),
        tuple(0.0 if shape.tilt is None else shape.tilt for shape in shapes),
        tuple(shape.beta_n for shape in shapes),
    )


def added(terms: Sequence[Floats]) -> Floats:
    """The sum of at least one term."""
    return reduce(operator.add, terms)
