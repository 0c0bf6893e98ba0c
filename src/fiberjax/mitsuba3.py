"""Converter of Mitsuba 3's hair.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Reals, choice, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import Numbers, given, within

INDICES = {
    "vacuum": 1.0,
    "helium": 1.000036,
    "hydrogen": 1.000132,
    "air": 1.000277,
    "carbon dioxide": 1.00045,
    "water": 1.333,
    "acetone": 1.36,
    "ethanol": 1.361,
    "carbon tetrachloride": 1.461,
    "glycerol": 1.4729,
    "benzene": 1.501,
    "silicone oil": 1.52045,
    "bromine": 1.661,
    "water ice": 1.31,
    "fused quartz": 1.458,
    "pyrex": 1.47,
    "acrylic glass": 1.49,
    "polypropylene": 1.49,
    "bk7": 1.5046,
    "sodium chloride": 1.544,
    "amber": 1.55,
    "pet": 1.575,
    "diamond": 2.419,
}
"""Indices of refraction by the names that Mitsuba has for them, of ior.h."""


class Mitsuba(NamedTuple):
    """What Mitsuba 3's hair takes; `mitsuba` makes a fiber of it."""

    longitudinal_roughness: Any
    azimuthal_roughness: Any
    scale_tilt: Any
    sigma_a: Any
    int_ior: Any
    ext_ior: Any


def _index(name: str, ior: Reals | str) -> Reals:
    """The index of refraction of a number or of a name in any case."""
    if not isinstance(ior, str):
        return ior
    choice(name, ior.lower(), tuple(INDICES))
    return INDICES[ior.lower()]


@parameters.in_their_dtype
def mitsuba(
    longitudinal_roughness: Reals = 0.3,
    azimuthal_roughness: Reals = 0.3,
    scale_tilt: Reals = 2.0,
    sigma_a: Numbers | None = None,
    int_ior: Reals | str = "amber",
    ext_ior: Reals | str = "air",
    *,
    eumelanin: Reals | None = None,
    pheomelanin: Reals | None = None,
    scale: Reals = 1.0,
) -> Fiber:
    """Fiber of Mitsuba 3's `hair` plugin.

    | theirs | ours | source |
    |---|---|---|
    | longitudinal_roughness, (0, 1] | beta_m, widths_m of `pbrt` | hair.cpp, update |
    | azimuthal_roughness, (0, 1] | beta_n as of `pbrt` | hair.cpp, update |
    | scale_tilt, degrees, along +y of the frame | alpha, radians, the same sign | \
hair.cpp, reframe_with_scales |
    | sigma_a times scale | sigma_a, per radius | hair.cpp, absorption |
    | eumelanin 1.3, pheomelanin 0.2 | `pigment.melanin` | hair.cpp, absorption |
    | int_ior "amber", 1.55; ext_ior "air", 1.000277 | eta = int_ior/ext_ior | \
hair.cpp, Hair; ior.h |

    Its documentation calls sigma_a one per scene unit, but paths are in radii. scale
    acts on sigma_a alone. Whether +y runs from root to tip is up to the shape. Spectral
    variants upsample the pigments. The roughness 0 that it allows has no density.

    Args:
        longitudinal_roughness, azimuthal_roughness: perceptual roughness.
        scale_tilt: tilt of the scales in degrees.
        sigma_a: absorption per radius, before scale, >= 0.
        int_ior, ext_ior: indices of refraction of the fiber and around it, or names.
        eumelanin, pheomelanin: concentrations >= 0, in place of sigma_a.
        scale: factor of sigma_a, >= 0.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: both sigma_a and a concentration are given; a number is not allowed
            there, or a fiber has less refraction than its surroundings.
    """
    pigments = {"eumelanin": eumelanin, "pheomelanin": pheomelanin}
    chosen = parameters.way({"sigma_a": sigma_a}, pigments)
    rough = {
        "longitudinal_roughness": longitudinal_roughness,
        "azimuthal_roughness": azimuthal_roughness,
    }
    within(0, 1, rough, open_low=True)
    within(0, math.inf, {"sigma_a": sigma_a, "scale": scale, **pigments})
    inside, outside = floats((_index("int_ior", int_ior), _index("ext_ior", ext_ior)))
    within(0, math.inf, {"ext_ior": outside}, open_low=True)
    eta = inside / outside
    within(1, math.inf, {"int_ior/ext_ior": eta})
    if chosen == "sigma_a":
        absorption, factor = floats((sigma_a,), (scale,))
        absorption = absorption * factor
    else:
        absorption = pigment.melanin(given(eumelanin, 1.3), given(pheomelanin, 0.2))
    b_m, b_n = rough.values()
    return parameters.chiang(b_m, b_n, scale_tilt, absorption, eta)


def to_mitsuba(fiber: Fiber, *, ext_ior: Reals | str = "air") -> Mitsuba:
    """What Mitsuba 3 takes of a fiber: the inverse of `mitsuba`.

    Args:
        fiber: fiber of at most 3 colors with the widths and tilts that `to_pbrt` asks
            for.
        ext_ior: index of refraction around it, or its name.

    Returns:
        The numbers, for `mitsuba(*numbers)`.

    Raises:
        ValueError: what Mitsuba does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "Mitsuba")
    b_m = perceptual.from_longitudinal(fiber.beta_m)
    b_n = perceptual.from_azimuthal(fiber.beta_n)
    named = {"longitudinal_roughness": b_m, "azimuthal_roughness": b_n}
    parameters.fits("Mitsuba", 0, 1, named, open_low=True)
    eta, outside = floats((fiber.eta,), (_index("ext_ior", ext_ior),))
    tilt = jnp.degrees(parameters.tilt(fiber))
    return Mitsuba(b_m, b_n, tilt, parameters.rgb(fiber), eta * outside, outside)
