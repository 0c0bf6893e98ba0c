"""Converters of MaterialX' nodes for hair.

Its tangent is its own; alpha is along it. All are checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, within

_LEAST, _MOST = 1e-3, 1.0  # of roughnesses, v and s


class MaterialX(NamedTuple):
    """What MaterialX' chiang_hair_bsdf takes; `materialx` makes a fiber of it."""

    roughness_R: Any
    roughness_TT: Any
    roughness_TRT: Any
    cuticle_angle: Any
    ior: Any
    absorption_coefficient: Any


def materialx_roughness(
    longitudinal: Reals = 0.1,
    azimuthal: Reals = 0.2,
    scale_TT: Reals = 0.5,
    scale_TRT: Reals = 2.0,
) -> tuple[Floats, Floats, Floats]:
    """roughness_R, roughness_TT and roughness_TRT of MaterialX' chiang_hair_roughness.

    (v, s) = (beta_m(b)^2 scale^2, beta_n(b)), both roughnesses clamped to [0.001, 1].

    Args:
        longitudinal, azimuthal: perceptual roughness.
        scale_TT, scale_TRT: factors of the deviation, squared on v.

    Returns:
        Three arrays (v, s), shape (2,), for `materialx`.
    """
    b_m, b_n, *scales = floats((longitudinal, azimuthal, scale_TT, scale_TRT))
    beta_m = perceptual.longitudinal(clamp(b_m, _LEAST, _MOST))
    s = perceptual.azimuthal(clamp(b_n, _LEAST, _MOST))
    tt, trt = (jnp.stack([(beta_m * scale) ** 2, s]) for scale in scales)
    return jnp.stack([beta_m * beta_m, s]), tt, trt


def materialx(
    roughness_R: Numbers = (0.1, 0.1),
    roughness_TT: Numbers = (0.05, 0.05),
    roughness_TRT: Numbers = (0.2, 0.2),
    cuticle_angle: Reals = 0.5,
    ior: Reals = ETA,
    absorption_coefficient: Numbers | None = None,
    *,
    color: Numbers | None = None,
    azimuthal_roughness: Reals = 0.2,
    melanin_concentration: Reals | None = None,
    melanin_redness: Reals = 0.5,
    tints: Numbers = 1.0,
) -> Fiber:
    """Fiber of MaterialX' chiang_hair_bsdf.

    | theirs | ours |
    |---|---|
    | roughness of a lobe (v, s), each clamped to [0.001, 1] | its beta_m = sqrt(v) |
    | the same, scale of the logistic sqrt(pi/8) s | its beta_n = s |
    | cuticle angle c in [0, 1], 1/2 for none | alpha = -(c - 1/2) pi along the curve |
    | ior 1.55 | eta |
    | absorption coefficient, 0 | sigma_a, per radius |
    | chiang_hair_absorption_from_color, at least 0.001 | `pigment.chiang_sigma_a` |
    | deon_hair_absorption_from_melanin | `pigment.concentrations`, table "pbrt" |

    Sources: mx_chiang_hair_bsdf.glsl and pbrlib_defs.mtlx. v is a variance and s a
    deviation: neither is perceptual; `materialx_roughness` is the node that makes them.
    R is at sin(theta_i + 2 a), a = (c - 1/2) pi, as in Cycles and against pbrt. Lobes
    p >= 3 are one, with TRT's v. The factors 1/pi and pi^2 of its code are lost.

    Args:
        roughness_R, roughness_TT, roughness_TRT: (v, s), shape (2,).
        cuticle_angle: c in [0, 1].
        ior: index of refraction, >= 1.
        absorption_coefficient: absorption per radius; clear if no other is given.
        color: color of hair, with azimuthal_roughness, in its place.
        azimuthal_roughness: perceptual roughness that color is read with.
        melanin_concentration: in [0, 1], with melanin_redness, in its place.
        melanin_redness: share of pheomelanin, in [0, 1].
        tints: of all lobes; what is not 1 is an error.

    Raises:
        ValueError: two ways to absorb; a tint, which would be lost; a shape or number
            without a meaning.
    """
    parameters.given(
        absorption_coefficient=absorption_coefficient,
        color=color,
        melanin_concentration=melanin_concentration,
    )
    parameters.equal("tints", tints, 1, "a Fiber has no tint of a lobe, it is lost")
    within("cuticle_angle", cuticle_angle, 0, 1)
    within("ior", ior, 1, math.inf)
    *lobes, c = floats((roughness_R, roughness_TT, roughness_TRT, cuticle_angle))
    names = ("roughness_R", "roughness_TT", "roughness_TRT")
    last_axis(2, **dict(zip(names, lobes, strict=True)))
    if color is not None:
        sigma_a = parameters.of_color("color", color, azimuthal_roughness, least=1e-3)
    elif melanin_concentration is not None:
        both = pigment.concentrations(melanin_concentration, melanin_redness)
        sigma_a = pigment.melanin(*both)
    else:
        within("absorption_coefficient", absorption_coefficient, 0, math.inf)
        sigma_a = absorption_coefficient
    v, s = clamp(jnp.stack(lobes), _LEAST, _MOST).T
    beta_m = jnp.sqrt(v)
    alpha = (0.5 - c) * math.pi
    return Fiber(ior, beta_m[0], s[0], alpha, sigma_a, beta_m / beta_m[0], s / s[0])


def to_materialx(fiber: Fiber) -> MaterialX:
    """What MaterialX takes of a fiber: the inverse of `materialx`.

    Args:
        fiber: fiber of at most 3 colors and 3 widths with the tilts (2, -1, -4, 0).

    Returns:
        The numbers, for `materialx(*numbers)`.

    Raises:
        ValueError: what MaterialX does not have, by name, and what would be lost.
    """
    for name in ("widths_m", "widths_n"):
        if getattr(fiber, name).shape[0] > 3:
            raise ValueError(
                f"{name} has {getattr(fiber, name).shape[0]} factors: must have at "
                "most 3; MaterialX has no width beyond TRT's, it would be lost"
            )
    alpha = parameters.tilt(fiber)
    if fiber.alpha is not None:
        lost = "those of MaterialX are fixed, others would be lost"
        parameters.per_lobe("tilts", fiber.tilts, parameters.TILTS, lost)
    lobes = []
    for p in range(3):
        w_m, w_n = (f[min(p, len(f) - 1)] for f in (fiber.widths_m, fiber.widths_n))
        beta_m, w_m, w_n = floats((fiber.beta_m,), (w_m, w_n))
        lobes.append(jnp.stack([(w_m * beta_m) ** 2, w_n * fiber.beta_n]))
        within(f"(v, s) of lobe {p}", lobes[-1], _LEAST * (1 - 1e-5), _MOST + 1e-5)
    c = 0.5 - alpha / math.pi
    within("cuticle_angle of MaterialX", c, 0, 1)
    return MaterialX(lobes[0], lobes[1], lobes[2], c, fiber.eta, parameters.rgb(fiber))
