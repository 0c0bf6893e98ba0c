"""Converter of Tungsten's hair, the far field of d'Eon et al. with one roughness.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, pigment
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, given, within

_SMOOTHEST = 0.04  # beta of Tungsten


class Tungsten(NamedTuple):
    """What Tungsten's hair takes; `tungsten` makes a fiber of it."""

    roughness: Any
    scale_angle: Any
    sigma_a: Any


@parameters.in_their_dtype
def tungsten(
    roughness: Reals = 0.1,
    scale_angle: Reals = 2.0,
    sigma_a: Numbers | None = None,
    *,
    melanin_concentration: Reals | None = None,
    melanin_ratio: Reals | None = None,
) -> Fiber:
    """Fiber of Tungsten's `hair` BSDF.

    | theirs | ours | source |
    |---|---|---|
    | roughness r 0.1 | beta_m = max(pi r/2, 0.04), widths_m (1, 1/2, 2) | \
prepareForRender |
    | the same, without factors | beta_n = beta_m | precomputeAzimuthalDistributions |
    | scale_angle, degrees, along +y | alpha, radians, the same sign | eval |
    | sigma_a | sigma_a, per radius | NpIntegrand |
    | melanin_concentration c 0.25, melanin_ratio m 0.5 | `pigment.melanin` of \
c (1 - m) and c m | prepareForRender |
    | eta 1.55, fixed | eta | HairBcsdf.hpp |

    All but the last are of HairBcsdf.cpp; R has theta_i - 2 alpha.

    The far-field model of d'Eon et al. with a wrapped normal of R's width in every
    lobe, as `evaluate` has it; R, TT and TRT only: `lobes=(0, 1, 2), rest=False`. Its
    tables of 64 x 64 are not carried over.

    Args:
        roughness: of R, as of a rough dielectric.
        scale_angle: tilt of the scales in degrees.
        sigma_a: absorption per radius, >= 0.
        melanin_concentration: total concentration >= 0, in place of sigma_a.
        melanin_ratio: share of pheomelanin in [0, 1], in place of sigma_a.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: both sigma_a and melanin are given; a number outside of its range.
    """
    concentration = {"melanin_concentration": melanin_concentration}
    ratio = {"melanin_ratio": melanin_ratio}
    chosen = parameters.way({"sigma_a": sigma_a}, concentration | ratio)
    within(0, math.inf, {"roughness": roughness, "sigma_a": sigma_a, **concentration})
    within(0, 1, ratio)
    if chosen != "sigma_a":
        amount, share = floats(
            (given(melanin_concentration, 0.25), given(melanin_ratio, 0.5))
        )
        sigma_a = pigment.melanin(amount * (1 - share), amount * share)
    (r, angle) = floats((roughness,), (scale_angle,))
    beta = clamp(jnp.pi / 2 * r, _SMOOTHEST)
    return Fiber(ETA, beta, beta, jnp.radians(angle), sigma_a)


def to_tungsten(fiber: Fiber) -> Tungsten:
    """What Tungsten takes of a fiber: the inverse of `tungsten`.

    Args:
        fiber: fiber of eta 1.55 and of beta_m = beta_n >= 0.04, of at most 3 colors,
            with the widths and tilts that `to_pbrt` asks for.

    Returns:
        The numbers, for `tungsten(*numbers)`.

    Raises:
        ValueError: what Tungsten does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "Tungsten")
    parameters.equal("eta", fiber.eta, ETA, "Tungsten has no other, eta would be lost")
    lost = "Tungsten has one roughness, that of the azimuth would be lost"
    parameters.equal("beta_n", fiber.beta_n, fiber.beta_m, lost)
    parameters.fits("Tungsten", _SMOOTHEST, math.inf, {"beta_m": fiber.beta_m})
    angle = jnp.degrees(parameters.tilt(fiber))
    return Tungsten(2 / jnp.pi * fiber.beta_m, angle, parameters.rgb(fiber))
