"""Converter of Cycles' Principled Hair BSDF, the model of Chiang.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, WIDTHS, Numbers, clamp, given, within

_ROUGHNESS = (1e-3, 1.0)
_COLOR = (0.017513, 0.005763, 0.002059)
_OFFSET = math.radians(2)


class Cycles(NamedTuple):
    """What Cycles' hair takes; `cycles` makes a fiber of it."""

    roughness: Any
    radial_roughness: Any
    coat: Any
    ior: Any
    offset: Any
    absorption_coefficient: Any


@parameters.in_their_dtype
def cycles(
    roughness: Reals = 0.3,
    radial_roughness: Reals = 0.3,
    coat: Reals = 0.0,
    ior: Reals = ETA,
    offset: Reals = _OFFSET,
    absorption_coefficient: Numbers | None = None,
    *,
    color: Numbers | None = None,
    melanin: Reals | None = None,
    melanin_redness: Reals | None = None,
    tint: Numbers | None = None,
    random_color: Reals | None = None,
    random_roughness: Reals = 0.0,
    random: Reals = 0.0,
) -> Fiber:
    """Fiber of Cycles' Principled Hair BSDF, model of Chiang.

    | theirs | ours | source |
    |---|---|---|
    | roughness, radial_roughness, times f = 1 + 2 (random - 1/2) random_roughness | \
b_m, b_n | svm/closure.h, svm_node_closure_bsdf |
    | b_m clamped to [0.001, 1] | beta_m as of `pbrt` | chiang.h, setup |
    | coat c: (1 - c) b_m for R | widths_m (beta_m((1 - c) b_m)/beta_m, 1/2, 2) | \
chiang.h, setup |
    | b_n clamped to [0.001, 1] | beta_n as of `pbrt` | chiang.h, setup |
    | offset 2 degrees, in radians, along dP/du, from root to tip | alpha = -offset | \
chiang.h, hair_alpha_angles |
    | ior 1.55 | eta | nodes.cpp |
    | absorption_coefficient | sigma_a, per radius | svm/closure.h |
    | color (the default) | `pigment.chiang_sigma_a` with b_n, not clamped | \
bsdf_util.h, sigma_from_reflectance |
    | melanin 0.8, times 1 + 2 (random - 1/2) random_color; melanin_redness 1 | \
`pigment.concentrations`, `melanin` of table "cycles" | svm/closure.h |
    | tint, with melanin | its sigma_a, as of color, is added | svm/closure.h |

    chiang.h is bsdf_principled_hair_chiang.h, bsdf_hair_principled.h before Blender 4.
    R is at sin(theta_light + 2 offset), so at theta_light = -theta - 2 offset: the
    other way than pbrt's. Lobes p >= 3 as of `pbrt`. A hair has its own `random`:
    `jax.vmap` over it makes many. A melanin above 0.9999 is that.

    Args:
        roughness, radial_roughness: perceptual roughness.
        coat: in [0, 1], clamped; 1 makes R as narrow as there is.
        ior: index of refraction, >= 1.
        offset: tilt of the scales in radians.
        absorption_coefficient: absorption per radius, >= 0.
        color: color of hair, > 0, in place of absorption_coefficient.
        melanin: amount in [0, 1], in place of absorption_coefficient.
        melanin_redness: share of pheomelanin, in [0, 1].
        tint: color, > 0, of the dye over melanin.
        random_color: how much `random` changes melanin, clamped to [0, 1].
        random_roughness: how much it changes both roughnesses, in [0, 1].
        random: number of this hair, in [0, 1].

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: two ways to absorb are given; a number outside of its range; black.
    """
    chosen = parameters.way(
        {"absorption_coefficient": absorption_coefficient},
        {"color": color},
        {
            "melanin": melanin,
            "melanin_redness": melanin_redness,
            "tint": tint,
            "random_color": random_color,
        },
    )
    within(1, math.inf, {"ior": ior})
    within(0, math.inf, {"absorption_coefficient": absorption_coefficient})
    within(0, 1, {"melanin": melanin, "melanin_redness": melanin_redness})
    within(0, 1, {"random_roughness": random_roughness, "random": random})
    b, radial, coated, angle, rough_by, own, amount, share, dark_by = floats(
        (roughness, radial_roughness, coat, offset, random_roughness, random),
        (given(melanin, 0.8), given(melanin_redness, 1.0), given(random_color, 0.0)),
    )
    rougher, darker = (
        1 + 2 * (own - 0.5) * by for by in (rough_by, clamp(dark_by, 0, 1))
    )
    b, radial = b * rougher, radial * rougher
    if chosen == "melanin":
        pigments = pigment.concentrations(amount * darker, share)
        dye = parameters.of_color(radial, {"tint": given(tint, (1.0, 1.0, 1.0))})
        sigma_a = pigment.melanin(*pigments, table="cycles") + dye
    elif chosen == "absorption_coefficient":
        sigma_a = absorption_coefficient
    else:
        sigma_a = parameters.of_color(radial, {"color": given(color, _COLOR)})
    b = clamp(b, *_ROUGHNESS)
    of_R = clamp((1 - clamp(coated, 0, 1)) * b, *_ROUGHNESS)
    beta_m = perceptual.longitudinal(b)
    first = perceptual.longitudinal(of_R) / beta_m
    widths = jnp.stack([first, *(jnp.full_like(first, w) for w in WIDTHS[1:])])
    beta_n = perceptual.azimuthal(clamp(radial, *_ROUGHNESS))
    return Fiber(ior, beta_m, beta_n, -angle, sigma_a, widths)


def to_cycles(fiber: Fiber) -> Cycles:
    """What Cycles takes of a fiber: the inverse of `cycles`.

    Args:
        fiber: fiber of at most 3 colors with the widths (w, 1/2, 2), w <= 1, and (1,)
            and the tilts (2, -1, -4, 0).

    Returns:
        The numbers, for `cycles(*numbers)`.

    Raises:
        ValueError: what Cycles does not have, by name, and what would be lost.
    """
    first = fiber.widths_m[0]
    parameters.marschner(fiber, "Cycles", widths=(first, *WIDTHS[1:]))
    b = perceptual.from_longitudinal(fiber.beta_m)
    of_R = perceptual.from_longitudinal(first * fiber.beta_m)
    radial = perceptual.from_azimuthal(fiber.beta_n)
    named = {"roughness": b, "roughness of R": of_R, "radial_roughness": radial}
    parameters.fits("Cycles", *_ROUGHNESS, named)
    coat = 1 - of_R / b
    parameters.fits("Cycles", 0, 1, {"coat": coat})
    offset = -parameters.tilt(fiber)
    return Cycles(b, radial, coat, fiber.eta, offset, parameters.rgb(fiber))
