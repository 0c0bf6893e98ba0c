"""Converters of path tracers that take a fiber's numbers: pbrt-v4 and Mitsuba 3.

Each system's tangent is its own; alpha is along it. All are checked while the numbers
are known; under a transformation of JAX nothing is.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, within

_SMALLEST = 1e-2  # of both roughnesses of pbrt-v4


class Pbrt(NamedTuple):
    """What pbrt-v4's hair takes; `pbrt` makes a fiber of it."""

    beta_m: Any
    beta_n: Any
    alpha: Any
    sigma_a: Any
    eta: Any


class Mitsuba(NamedTuple):
    """What Mitsuba 3's hair takes; `mitsuba` makes a fiber of it."""

    longitudinal_roughness: Any
    azimuthal_roughness: Any
    scale_tilt: Any
    sigma_a: Any
    int_ior: Any
    ext_ior: Any


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

    | theirs | ours |
    |---|---|
    | beta_m, clamped to [0.01, 1], b | beta_m = 0.726 b + 0.812 b^2 + 3.7 b^20 |
    | v of TT, TRT and more: 1/4, 4 | widths_m (1, 1/2, 2) |
    | beta_n, clamped to [0.01, 1], b | beta_n = 0.265 b + 1.194 b^2 + 5.372 b^22 |
    | alpha, degrees | alpha, radians, the same sign along dp/du |
    | sigma_a, at least 0 | sigma_a, per radius |
    | reflectance, at most 1 | `pigment.chiang_sigma_a` with the clamped beta_n |
    | eumelanin 1.3, pheomelanin 0 | `pigment.melanin`, table "pbrt" |

    Sources: HairMaterial::GetBxDF, HairBxDF::f with sin(theta_o - 2 alpha) for R,
    SigmaAFromReflectance, SigmaAFromConcentration.

    R leaves at theta_i' = -theta_o + 2 alpha, towards dp/du for alpha > 0. Where a
    curve runs from root to tip that is towards the tip, the other way than Cycles' and
    than the default of `Fiber`. Its model takes attenuations at the direction to the
    camera (`incidence="theta_i"` here) and the logistic detector; lobes p >= 3 are one,
    untilted, of TRT's width, uniform in azimuth: `rest=True`.

    Args:
        beta_m, beta_n: perceptual roughness.
        alpha: tilt of the scales in degrees.
        sigma_a: absorption per radius, (3,) or any number of colors.
        eta: index of refraction, >= 1.
        reflectance: color of hair in (0, 1], in place of sigma_a.
        eumelanin, pheomelanin: concentrations, in place of sigma_a.

    Raises:
        ValueError: two ways to absorb are given, which pbrt takes the first of; a
            number has no meaning.
    """
    melanin = eumelanin if pheomelanin is None else pheomelanin
    parameters.given(sigma_a=sigma_a, reflectance=reflectance, eumelanin=melanin)
    within("eta", eta, 1, jnp.inf)
    b_m, b_n = (clamp(b, _SMALLEST, 1) for b in (beta_m, beta_n))
    if reflectance is not None:
        sigma_a = parameters.of_color("reflectance", reflectance, b_n)
    elif sigma_a is None:
        brown = 1.3 if melanin is None else 0.0
        brown = brown if eumelanin is None else eumelanin
        red = 0.0 if pheomelanin is None else pheomelanin
        sigma_a = pigment.melanin(clamp(brown, 0), clamp(red, 0))
    return _chiang(b_m, b_n, alpha, clamp(sigma_a, 0), eta)


def _chiang(b_m: Reals, b_n: Reals, degrees: Reals, sigma_a: Any, eta: Reals) -> Fiber:
    (angle,) = floats((degrees,))
    return Fiber(
        eta=eta,
        beta_m=perceptual.longitudinal(b_m),
        beta_n=perceptual.azimuthal(b_n),
        alpha=jnp.radians(angle),
        sigma_a=sigma_a,
    )


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
    for name, b in (("beta_m", b_m), ("beta_n", b_n)):
        within(f"perceptual {name} of pbrt", b, _SMALLEST * (1 - 1e-5), 1 + 1e-5)
    alpha = jnp.degrees(parameters.tilt(fiber))
    return Pbrt(b_m, b_n, alpha, parameters.rgb(fiber), fiber.eta)


def mitsuba(
    longitudinal_roughness: Reals = 0.3,
    azimuthal_roughness: Reals = 0.3,
    scale_tilt: Reals = 2.0,
    sigma_a: Numbers | None = None,
    int_ior: Reals = ETA,
    ext_ior: Reals = 1.000277,
    *,
    eumelanin: Reals | None = None,
    pheomelanin: Reals | None = None,
    scale: Reals = 1.0,
) -> Fiber:
    """Fiber of Mitsuba 3's `hair` plugin.

    | theirs | ours |
    |---|---|
    | longitudinal_roughness, (0, 1] | beta_m and widths_m as of `pbrt` |
    | azimuthal_roughness, (0, 1] | beta_n as of `pbrt` |
    | scale_tilt, degrees | alpha, radians, the same sign along +y of the frame |
    | sigma_a times scale | sigma_a, per radius |
    | eumelanin 1.3, pheomelanin 0.2 | `pigment.melanin`, table "pbrt" |
    | int_ior 1.55 (amber), ext_ior 1.000277 (air) | eta = int_ior/ext_ior |

    Sources: the plugin's documentation; `update`, `reframe_with_scales` and
    `absorption` of hair.cpp.

    Its documentation calls sigma_a one per scene unit, but paths are in radii. scale
    acts on sigma_a alone. Whether +y runs from root to tip is up to the shape. Spectral
    variants upsample the pigments. The roughness 0 that it allows has no density.

    Args:
        longitudinal_roughness, azimuthal_roughness: perceptual roughness.
        scale_tilt: tilt of the scales in degrees.
        sigma_a: absorption per radius, before scale.
        int_ior, ext_ior: indices of refraction of the fiber and around it.
        eumelanin, pheomelanin: concentrations, in place of sigma_a.
        scale: factor of sigma_a.

    Raises:
        ValueError: both sigma_a and a concentration are given; a number is not allowed
            there, or a fiber has less refraction than its surroundings.
    """
    melanin = eumelanin if pheomelanin is None else pheomelanin
    parameters.given(sigma_a=sigma_a, eumelanin=melanin)
    rough = {
        "longitudinal_roughness": longitudinal_roughness,
        "azimuthal_roughness": azimuthal_roughness,
    }
    for name, b in rough.items():
        within(name, b, 0, 1, open_low=True)
    inside, outside = floats((int_ior, ext_ior))
    eta = inside / outside
    within("int_ior/ext_ior", eta, 1, jnp.inf)
    if sigma_a is not None:
        within("sigma_a", sigma_a, 0, jnp.inf)
        absorption, factor = floats((sigma_a,), (scale,))
        absorption = absorption * factor
    else:
        brown = 1.3 if eumelanin is None else eumelanin
        red = 0.2 if pheomelanin is None else pheomelanin
        absorption = pigment.melanin(brown, red)
    b_m, b_n = rough.values()
    return _chiang(b_m, b_n, scale_tilt, absorption, eta)


def to_mitsuba(fiber: Fiber, *, ext_ior: Reals = 1.000277) -> Mitsuba:
    """What Mitsuba 3 takes of a fiber: the inverse of `mitsuba`.

    Args:
        fiber: fiber of at most 3 colors with the widths and tilts that `to_pbrt` asks
            for.
        ext_ior: index of refraction around it.

    Returns:
        The numbers, for `mitsuba(*numbers)`.

    Raises:
        ValueError: what Mitsuba does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "Mitsuba")
    b_m = perceptual.from_longitudinal(fiber.beta_m)
    b_n = perceptual.from_azimuthal(fiber.beta_n)
    for name, b in (("longitudinal", b_m), ("azimuthal", b_n)):
        within(f"{name}_roughness of Mitsuba", b, 0, 1 + 1e-5, open_low=True)
    eta, outside = floats((fiber.eta,), (ext_ior,))
    tilt = jnp.degrees(parameters.tilt(fiber))
    return Mitsuba(b_m, b_n, tilt, parameters.rgb(fiber), eta * outside, outside)
