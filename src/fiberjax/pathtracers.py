"""Converter of pbrt-v4's hair.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Reals
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, given, within

_ROUGHNESS = (1e-2, 1.0)


class Pbrt(NamedTuple):
    """What pbrt-v4's hair takes; `pbrt` makes a fiber of it."""

    beta_m: Any
    beta_n: Any
    alpha: Any
    sigma_a: Any
    eta: Any


@parameters.in_their_dtype
def pbrt(
    beta_m: Reals = 0.3,
    beta_n: Reals = 0.3,
    alpha: Reals = 2.0,
    sigma_a: Numbers | None = None,
    eta: Reals = ETA,
    *,
    reflectance: Numbers | None = None,
    eumelanin: Reals | None = None,
    pheomelanin: Reals | None = None,
) -> Fiber:
    """Fiber of pbrt-v4's `hair` material.

    | theirs | ours | source |
    |---|---|---|
    | beta_m, beta_n, clamped to [0.01, 1] | b | materials.h, GetBxDF |
    | v of R = (0.726 b + 0.812 b^2 + 3.7 b^20)^2 | beta_m^2 | bxdfs.cpp, HairBxDF |
    | v of TT, TRT and more: v/4, 4 v | widths_m (1, 1/2, 2) | bxdfs.cpp, HairBxDF |
    | s/sqrt(pi/8) = 0.265 b + 1.194 b^2 + 5.372 b^22 | beta_n | bxdfs.cpp, HairBxDF |
    | alpha, degrees, along dp/du | alpha, radians, the same sign | bxdfs.cpp, f |
    | sigma_a, at least 0 | sigma_a, per radius | materials.h, GetBxDF |
    | reflectance, at most 1 | `pigment.chiang_sigma_a` of the clamped beta_n | \
bxdfs.cpp, SigmaAFromReflectance |
    | eumelanin 1.3, pheomelanin 0; 0 for the one not given | `pigment.melanin` | \
bxdfs.cpp, SigmaAFromConcentration |

    R has sin(theta_o - 2 alpha) in `f`: it leaves at theta_i' = -theta_o + 2 alpha,
    towards dp/du for alpha > 0. Where a curve runs from root to tip that is towards the
    tip, the other way than Cycles' and than the default of `Fiber`. Its model takes
    attenuations at the direction to the camera (`incidence="theta_i"` here) and the
    logistic detector; lobes p >= 3 are one, untilted, of TRT's width, uniform in
    azimuth: `rest=True`.

    Args:
        beta_m, beta_n: perceptual roughness.
        alpha: tilt of the scales in degrees.
        sigma_a: absorption per radius, (3,) or any number of colors.
        eta: index of refraction, >= 1.
        reflectance: color of hair, > 0, in place of sigma_a.
        eumelanin, pheomelanin: concentrations, in place of sigma_a.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: two ways to absorb are given, which pbrt takes the first of; eta < 1
            or a reflectance of 0.
    """
    chosen = parameters.way(
        {"sigma_a": sigma_a},
        {"reflectance": reflectance},
        {"eumelanin": eumelanin, "pheomelanin": pheomelanin},
    )
    within(1, math.inf, {"eta": eta})
    b_m, b_n = (clamp(b, *_ROUGHNESS) for b in (beta_m, beta_n))
    absorption: Any = sigma_a
    if chosen == "reflectance":
        absorption = parameters.of_color(b_n, {"reflectance": reflectance}, most=1)
    elif chosen != "sigma_a":
        brown = given(eumelanin, 0.0) if chosen else 1.3
        red = given(pheomelanin, 0.0)
        absorption = pigment.melanin(clamp(brown, 0), clamp(red, 0))
    return parameters.chiang(b_m, b_n, alpha, clamp(absorption, 0), eta)


def to_pbrt(fiber: Fiber) -> Pbrt:
    """What pbrt-v4 takes of a fiber: the inverse of `pbrt`.

    Args:
        fiber: fiber of at most 3 colors with the widths (1, 1/2, 2) and (1,) and the
            tilts (2, -1, -4, 0).

    Returns:
        The numbers, for `pbrt(*numbers)`.

    Raises:
        ValueError: what pbrt does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "pbrt")
    b_m = perceptual.from_longitudinal(fiber.beta_m)
    b_n = perceptual.from_azimuthal(fiber.beta_n)
    named = {"perceptual beta_m": b_m, "perceptual beta_n": b_n}
    parameters.fits("pbrt", *_ROUGHNESS, named)
    alpha = jnp.degrees(parameters.tilt(fiber))
    return Pbrt(b_m, b_n, alpha, parameters.rgb(fiber), fiber.eta)
