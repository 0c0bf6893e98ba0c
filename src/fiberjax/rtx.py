"""Converter of the far field of NVIDIA's RTXCR.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import numerics, parameters, pigment
from fiberjax._types import Reals, choice, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import CUTICLE_TILTS, ETA, Numbers, clamp, given, within

_NARROWEST = 0.01  # of cos(phi/2) in the width of R
_MELANIN, _REDNESS = 0.805, 0.05
_COLOR = (0.227, 0.130, 0.035)
_MODELS = ("normalized", "physics")


class Rtxcr(NamedTuple):
    """What RTXCR's far field takes; `rtxcr` with an `at` makes a fiber of it."""

    roughness: Any
    cuticle_angle_in_degrees: Any
    ior: Any
    absorption_coefficient: Any


@parameters.in_their_dtype
def rtxcr(
    roughness: Reals = 0.25,
    cuticle_angle_in_degrees: Reals = 3.0,
    ior: Reals = ETA,
    absorption_coefficient: Numbers | None = None,
    *,
    base_color: Numbers | None = None,
    azimuthal_roughness: Reals | None = None,
    melanin: Reals | None = None,
    melanin_redness: Reals | None = None,
    absorption_model: str = "physics",
    diffuse_reflection_weight: Reals = 0.0,
    at: tuple[Reals, Reals] = (0.0, 0.0),
) -> Fiber:
    """Fiber that RTXCR's far field (d'Eon 2022) is at one pair of directions.

    | theirs | ours, at (theta_i, phi) | source |
    |---|---|---|
    | R: theta_h + c, sqrt(2) r max(0.01, cos(acos(cos phi)/2))/2 wide | beta_m, \
twice that | RTXCR_HairFarFieldBcsdfEval |
    | TT: theta_h - c/2, r sqrt(eta^2 - 1)/(4 cos theta_i) | twice that | the same |
    | TRT: theta_h - 3 c/2, r (2 + abs(theta_i)^1.5)/2 | twice that | the same |
    | cuticleAngleInDegrees c 3 | alpha = -c, radians, tilts (2, -1, -3, 0) | the same |
    | roughness r 0.25, azimuth of TRT when sampled | beta_n = r | \
RTXCR_SampleFarFieldBcsdf |
    | absorptionCoefficient | sigma_a, per radius | RTXCR_HairFarFieldBcsdfEval |
    | baseColor (0.227, 0.13, 0.035), at least 1e-4, azimuthalRoughness 0.6 | \
`pigment.chiang_sigma_a` | RTXCR_AbsorptionCoefficientFromColor |
    | melanin m 0.805, melaninRedness 0.05, "physics" | 2.4 m^2 of table "cycles" | \
RTXCR_AbsorptionCoefficientFromMelanin |
    | the same, "normalized" | -log(max(1 - m, 1e-4)) of it | \
RTXCR_AbsorptionCoefficientFromMelaninNormalized |

    The functions are of HairFarFieldBCSDF.hlsli and HairMaterial.hlsli of the material
    library, the defaults of the RTXCR sample. theta_h = (theta_o + theta_i)/2, so a
    deviation in it is half of one in theta_o. The widths vary with both directions and
    a `Fiber` has numbers: they are taken at the directions `at`, at normal incidence
    and phi = 0 if nothing is said; elsewhere they are lost, and so are the smooth
    azimuth of R and TT, Schlick's Fresnel and the 3.75 in place of 4 in TRT's path.
    Lobes beyond TRT it does not have: `rest=False`.

    Args:
        roughness: r > 0 in radians.
        cuticle_angle_in_degrees: c, towards the tangent's tail for c > 0.
        ior: index of refraction, > 1.
        absorption_coefficient: absorption per radius, >= 0.
        base_color: color of hair, in its place.
        azimuthal_roughness: perceptual roughness in [0, 1] that it is read with.
        melanin: in its place, >= 0 and if normalized <= 1.
        melanin_redness: share of pheomelanin in [0, 1].
        absorption_model: "physics" or "normalized", how melanin is read.
        diffuse_reflection_weight: 0; a Fiber has no diffuse lobe.
        at: theta_i towards the light, and phi, in radians.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: two absorptions; a diffuse lobe, which would be lost; a number
            outside of its range; theta_i at the pole, where TT is infinitely wide.
    """
    choice("absorption_model", absorption_model, _MODELS)
    chosen = parameters.way(
        {"absorption_coefficient": absorption_coefficient},
        {"base_color": base_color, "azimuthal_roughness": azimuthal_roughness},
        {"melanin": melanin, "melanin_redness": melanin_redness},
    )
    within(0, math.inf, {"roughness": roughness}, open_low=True)
    within(1, math.inf, {"ior": ior}, open_low=True)
    within(0, math.inf, {"absorption_coefficient": absorption_coefficient})
    within(0, 1, {"azimuthal_roughness": azimuthal_roughness})
    within(0, 1 if absorption_model == "normalized" else math.inf, {"melanin": melanin})
    within(0, 1, {"melanin_redness": melanin_redness})
    lost = "a Fiber has no diffuse lobe, it would be lost"
    weight = diffuse_reflection_weight
    parameters.equal("diffuse_reflection_weight", weight, 0, lost)
    if chosen == "absorption_coefficient":
        sigma_a = absorption_coefficient
    elif chosen == "base_color":
        b, shown = given(azimuthal_roughness, 0.6), given(base_color, _COLOR)
        sigma_a = parameters.of_color(b, {"base_color": shown}, least=1e-4)
    else:
        amount, share = given(melanin, _MELANIN), given(melanin_redness, _REDNESS)
        sigma_a = _absorption(amount, share, absorption_model)
    r, angle, eta = floats((roughness,), (cuticle_angle_in_degrees, ior))
    widths = _widths(eta, at)
    return Fiber(
        eta=eta,
        beta_m=r * widths[0],
        beta_n=r,
        alpha=-jnp.radians(angle),
        sigma_a=sigma_a,
        widths_m=widths / widths[0],
        tilts=CUTICLE_TILTS,
    )


def _widths(eta: Any, at: tuple[Reals, Reals]) -> Any:
    """Deviations of theta_o in R, TT and TRT, over the roughness."""
    (eta, theta_i, phi) = floats((eta,), at)
    theta_i = jnp.abs(theta_i)
    within(0, math.pi / 2 - 1e-6, {"theta_i of at": theta_i})
    # acos(cos phi) lies in [0, pi], where the cosine of its half is not negative.
    narrowing = clamp(jnp.abs(jnp.cos(phi / 2)), _NARROWEST)
    tt = jnp.sqrt((eta - 1) * (eta + 1)) / (2 * jnp.cos(theta_i))
    trt = 2 + theta_i * numerics.sqrt(theta_i)
    return jnp.stack([math.sqrt(2) * narrowing, tt, trt])


def _absorption(melanin: Any, redness: Reals, model: str) -> Any:
    amount, share = floats((melanin,), (redness,))
    if model == "normalized":
        pigments = pigment.concentrations(amount, share)
    else:
        quantity = 2.4 * amount * amount
        pigments = quantity * (1 - share), quantity * share
    return pigment.melanin(*pigments, table="cycles")


def to_rtxcr(fiber: Fiber, *, at: tuple[Reals, Reals] = (0.0, 0.0)) -> Rtxcr:
    """What RTXCR's far field takes of a fiber: the inverse of `rtxcr` at `at`.

    Args:
        fiber: fiber of eta > 1 and of at most 3 colors, with the widths that RTXCR has
            at these directions for the roughness beta_n, (1,) and the tilts
            (2, -1, -3, 0).
        at: theta_i towards the light, and phi, in radians.

    Returns:
        The numbers, for `rtxcr(*numbers, at=at)`.

    Raises:
        ValueError: what RTXCR does not have, by name, and what would be lost.
    """
    parameters.fits("RTXCR", 1, math.inf, {"eta": fiber.eta}, open_low=True)
    widths = _widths(fiber.eta, at)
    own = {"widths": widths / widths[0], "tilts": CUTICLE_TILTS}
    parameters.marschner(fiber, "RTXCR", **own)
    lost = "RTXCR has one roughness, that along the fiber would be lost"
    parameters.equal("beta_m/beta_n", fiber.beta_m / fiber.beta_n, widths[0], lost)
    angle = -jnp.degrees(parameters.tilt(fiber))
    return Rtxcr(fiber.beta_n, angle, fiber.eta, parameters.rgb(fiber))
