"""Converter of the physical hair of Unity's HDRP.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import CUTICLE_TILTS, ETA, Numbers, clamp, given, within

_LEAST = 1e-2  # 1 - smoothness
_ABSORPTION = (0.06, 0.1, 0.2)


class Unity(NamedTuple):
    """What HDRP's hair takes; `unity` makes a fiber of it."""

    smoothness: Any
    radial_smoothness: Any
    cuticle_angle: Any
    absorption: Any


@parameters.in_their_dtype
def unity(
    smoothness: Reals = 0.5,
    radial_smoothness: Reals = 0.7,
    cuticle_angle: Reals = 3.0,
    absorption: Numbers | None = None,
    *,
    diffuse_color: Numbers | None = None,
    eumelanin: Reals | None = None,
    pheomelanin: Reals | None = None,
) -> Fiber:
    """Fiber of the physical hair of Unity's HDRP.

    | theirs | ours | source |
    |---|---|---|
    | smoothness 0.5; r = 1 - min(it, 0.99), variance r^2 of theta_h for R | \
beta_m = 2 r | Hair.hlsl, ConvertSurfaceDataToBSDFData, Gaussian |
    | (r/2)^2 and (2 r)^2 for TT and TRT | widths_m (1, 1/2, 2) | the same |
    | cuticle_angle c 3, degrees: theta_h + c, - c/2, - 3 c/2 | alpha = -c in radians, \
tilts (2, -1, -3, 0) | the same |
    | radial_smoothness 0.7; b = 1 - min(it, 0.99) | beta_n as of `pbrt` | \
HairMultipleScatteringPreIntegration.compute, LogisticScaleFromBeta |
    | absorption (0.06, 0.1, 0.2) | sigma_a, per radius | HDBlockFields.cs |
    | diffuse_color, at least 0.001 | `pigment.chiang_sigma_a` with b | \
Hair.hlsl, AbsorptionFromReflectance |
    | eumelanin 0.3, pheomelanin 0.3 | `pigment.melanin` | \
Hair.hlsl, AbsorptionFromMelanin |
    | eta 1.55, fixed | eta | HairReferenceCommon.hlsl |

    That is the raster; its M is a Gaussian in theta_h = (theta_o + theta_i)/2, so a
    deviation of theta_o is twice one of theta_h. Before HDRP 14 the deviations were r^2
    times (1, 1/2, 2). The tangent runs from root to tip. The cinematic raster takes M
    from a table: that of `pbrt` at b = r with alpha = +3 degrees, whatever c is. The
    path tracer has the same at alpha = -c, and the exact eta'; the raster and its
    tables have Karis' eta'. All take Schlick's Fresnel: those are lost. No lobe beyond
    TRT on the raster: `rest=False`.

    Args:
        smoothness: perceptual, along the fiber, in [0, 1].
        radial_smoothness: perceptual, around the fiber, in [0, 1].
        cuticle_angle: c in degrees.
        absorption: absorption per radius, >= 0; a graph itself starts from its color.
        diffuse_color: color of hair, in place of absorption.
        eumelanin, pheomelanin: concentrations >= 0, in place of absorption.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: two absorptions are given; a number outside of its range.
    """
    pigments = {"eumelanin": eumelanin, "pheomelanin": pheomelanin}
    chosen = parameters.way(
        {"absorption": absorption}, {"diffuse_color": diffuse_color}, pigments
    )
    within(0, 1, {"smoothness": smoothness, "radial_smoothness": radial_smoothness})
    within(0, math.inf, {"absorption": absorption, **pigments})
    smooth, radial, angle = floats((smoothness, radial_smoothness, cuticle_angle))
    r, b = clamp(1 - smooth, _LEAST), clamp(1 - radial, _LEAST)
    if chosen == "diffuse_color":
        sigma_a = parameters.of_color(b, {"diffuse_color": diffuse_color}, least=1e-3)
    elif chosen == "eumelanin":
        sigma_a = pigment.melanin(given(eumelanin, 0.3), given(pheomelanin, 0.3))
    else:
        sigma_a = given(absorption, _ABSORPTION)
    return Fiber(
        eta=ETA,
        beta_m=2 * r,
        beta_n=perceptual.azimuthal(b),
        alpha=-jnp.radians(angle),
        sigma_a=sigma_a,
        tilts=CUTICLE_TILTS,
    )


def to_unity(fiber: Fiber) -> Unity:
    """What HDRP's hair takes of a fiber: the inverse of `unity`.

    Args:
        fiber: fiber of eta 1.55 and of at most 3 colors, with the widths (1, 1/2, 2)
            and (1,) and the tilts (2, -1, -3, 0).

    Returns:
        The numbers, for `unity(*numbers)`.

    Raises:
        ValueError: what HDRP does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "HDRP", tilts=CUTICLE_TILTS)
    parameters.equal("eta", fiber.eta, ETA, "HDRP has no other, it would be lost")
    smooth = 1 - fiber.beta_m / 2
    radial = 1 - perceptual.from_azimuthal(fiber.beta_n)
    parameters.fits(
        "HDRP", 0, 1 - _LEAST, {"smoothness": smooth, "radial_smoothness": radial}
    )
    angle = -jnp.degrees(parameters.tilt(fiber))
    return Unity(smooth, radial, angle, parameters.rgb(fiber))
