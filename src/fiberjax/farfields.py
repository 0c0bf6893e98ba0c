"""Converters of far-field models with one roughness: Tungsten, RTXCR.

Each system's tangent is its own; alpha is along it. All are checked while the numbers
are known; under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import numerics, parameters, pigment
from fiberjax._types import Reals, choice, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, within

_SMOOTHEST = 0.04  # beta of Tungsten


class Tungsten(NamedTuple):
    """What Tungsten's hair takes; `tungsten` makes a fiber of it."""

    roughness: Any
    scale_angle: Any
    sigma_a: Any


def tungsten(
    roughness: Reals = 0.1,
    scale_angle: Reals = 2.0,
    sigma_a: Numbers | None = None,
    *,
    melanin_concentration: Reals | None = None,
    melanin_ratio: Reals | None = None,
) -> Fiber:
    """Fiber of Tungsten's `hair` BSDF.

    | theirs | ours |
    |---|---|
    | roughness r | beta_m = beta_n = max(pi r/2, 0.04), widths_m (1, 1/2, 2) |
    | scale_angle, degrees | alpha, radians, the same sign along +y of the frame |
    | sigma_a | sigma_a, per radius |
    | melanin_concentration c 0.25, melanin_ratio m 0.5 | c (1 - m) and c m of "pbrt" |
    | eta 1.55, fixed | eta |

    Source: HairBcsdf.cpp, `prepareForRender` and `eval`, with theta_i - 2 alpha for R.

    The far-field model of d'Eon et al. with a wrapped normal of R's width in every
    lobe, as `evaluate` has it; R, TT and TRT only: `lobes=(0, 1, 2), rest=False`. Its
    tables of 64 x 64 are not carried over.

    Args:
        roughness: of R, as of a rough dielectric.
        scale_angle: tilt of the scales in degrees.
        sigma_a: absorption per radius.
        melanin_concentration: total concentration, in place of sigma_a.
        melanin_ratio: share of pheomelanin, in place of sigma_a.

    Raises:
        ValueError: both sigma_a and melanin are given; a number is negative.
    """
    melanin = melanin_concentration if melanin_ratio is None else melanin_ratio
    parameters.given(sigma_a=sigma_a, melanin_concentration=melanin)
    within("roughness", roughness, 0, jnp.inf)
    if sigma_a is not None:
        within("sigma_a", sigma_a, 0, jnp.inf)
    else:
        amount = 0.25 if melanin_concentration is None else melanin_concentration
        share = 0.5 if melanin_ratio is None else melanin_ratio
        amount, share = floats((amount, share))
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
    within("beta_m of Tungsten", fiber.beta_m, _SMOOTHEST * (1 - 1e-5), jnp.inf)
    angle = jnp.degrees(parameters.tilt(fiber))
    return Tungsten(2 / jnp.pi * fiber.beta_m, angle, parameters.rgb(fiber))


_NARROWEST = 0.01  # of cos(phi/2) in the width of R
_MODELS = ("normalized", "physics")


def rtxcr(
    roughness: Reals,
    cuticle_angle: Reals,
    ior: Reals = ETA,
    absorption: Numbers | None = None,
    *,
    base_color: Numbers | None = None,
    azimuthal_roughness: Reals = 0.3,
    melanin: Reals | None = None,
    melanin_redness: Reals = 0.0,
    absorption_model: str = "normalized",
    diffuse_weight: Reals = 0.0,
    at: tuple[Reals, Reals] = (0.0, 0.0),
) -> Fiber:
    """Fiber that RTXCR's far field (d'Eon 2022) is at one pair of directions.

    | theirs | ours, at (theta_i, phi) |
    |---|---|
    | R: theta_h + c, (sqrt 2 r max(.01, cos(phi/2)))/2 wide | beta_m, twice that |
    | TT: theta_h - c/2, r sqrt(eta^2 - 1)/(4 cos theta_i) wide | twice that |
    | TRT: theta_h - 3 c/2, r (2 + abs(theta_i)^1.5)/2 wide | twice that |
    | cuticle angle c, degrees | alpha = -c in radians, tilts (2, -1, -3, 0) |
    | roughness r, azimuth of TRT | beta_n = r |
    | absorption coefficient | sigma_a, per radius |
    | base color, at least 1e-4 | `pigment.chiang_sigma_a` with azimuthal roughness |
    | melanin m, "normalized" | -log(max(1 - m, 1e-4)) of table "cycles" |
    | melanin m, "physics" | 2.4 m^2 of table "cycles" |

    Source: HairFarFieldBCSDF.hlsli and HairMaterial.hlsli of the RTXCR material
    library. theta_h = (theta_o + theta_i)/2, so a deviation in it is half of one in
    theta_o. The widths vary with both directions and a `Fiber` has numbers: they are
    taken at the directions `at`, at normal incidence and phi = 0 if nothing is said;
    elsewhere they are lost, and so are the smooth azimuth of R and TT, Schlick's
    Fresnel and the 3.75 in place of 4 in TRT's path. Lobes beyond TRT it does not have:
    `rest=False`.

    Args:
        roughness: r > 0 in radians.
        cuticle_angle: c in degrees, towards the tangent's tail for c > 0.
        ior: index of refraction, > 1.
        absorption: absorption per radius.
        base_color: color of hair, in place of absorption.
        azimuthal_roughness: perceptual roughness that base_color is read with.
        melanin: in place of absorption, [0, 1] if normalized.
        melanin_redness: share of pheomelanin.
        absorption_model: "normalized" or "physics", how melanin is read.
        diffuse_weight: 0; another lobe than those of a fiber is an error.
        at: theta_i towards the light, and phi, in radians.

    Raises:
        ValueError: no or two absorptions; a diffuse lobe, which would be lost; numbers
            without a meaning; theta_i at the pole, where TT is infinitely wide.
    """
    choice("absorption_model", absorption_model, _MODELS)
    within("roughness", roughness, 0, jnp.inf, open_low=True)
    within("ior", ior, 1, jnp.inf, open_low=True)
    lost = "a Fiber has no diffuse lobe, it would be lost"
    parameters.equal("diffuse_weight", diffuse_weight, 0, lost)
    way = parameters.required(
        absorption=absorption, base_color=base_color, melanin=melanin
    )
    if way == "base_color":
        absorption = parameters.of_color(
            "base_color", base_color, azimuthal_roughness, least=1e-4
        )
    elif way == "melanin":
        absorption = _absorption(melanin, melanin_redness, absorption_model)
    r, angle, eta, *at_angles = floats((roughness,), (cuticle_angle, ior, *at))
    widths = _widths(r, eta, *at_angles)
    return Fiber(
        eta=eta,
        beta_m=widths[0],
        beta_n=r,
        alpha=-jnp.radians(angle),
        sigma_a=absorption,
        widths_m=widths / widths[0],
        tilts=(2.0, -1.0, -3.0, 0.0),
    )


def _widths(r: Any, eta: Any, theta_i: Any, phi: Any) -> Any:
    """Deviations of theta_o in R, TT and TRT."""
    within("theta_i of at", jnp.abs(theta_i), 0, math.pi / 2 - 1e-6)
    narrowing = clamp(jnp.cos(phi / 2), _NARROWEST)
    tt = jnp.sqrt((eta - 1) * (eta + 1)) / (2 * jnp.cos(theta_i))
    return r * jnp.stack(
        [
            math.sqrt(2) * narrowing,
            tt,
            2 + jnp.abs(theta_i) * numerics.sqrt(jnp.abs(theta_i)),
        ]
    )


def _absorption(melanin: Any, redness: Reals, model: str) -> Any:
    amount, share = floats((melanin,), (redness,))
    if model == "normalized":
        pigments = pigment.concentrations(amount, share)
    else:
        quantity = 2.4 * amount * amount
        pigments = quantity * (1 - share), quantity * share
    return pigment.melanin(*pigments, table="cycles")
