"""Converters of MaterialX' nodes for hair.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, given, within

_ROUGHNESS = (1e-3, 1.0)  # perceptual, v and s
_EUMELANIN = (0.657704, 0.498077, 0.254106)
_PHEOMELANIN = (0.829443, 0.670320, 0.349937)


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

    | theirs | ours | source |
    |---|---|---|
    | longitudinal 0.1, clamped to [0.001, 1] | v = beta_m^2 of `pbrt` | roughness |
    | azimuthal 0.2, clamped to [0.001, 1] | s = beta_n of `pbrt` | roughness |
    | scale_TT 0.5, scale_TRT 2, squared on v | v of TT and TRT | roughness |

    roughness is mx_chiang_hair_roughness of mx_chiang_hair_bsdf.glsl.

    Args:
        longitudinal, azimuthal: perceptual roughness.
        scale_TT, scale_TRT: factors of the deviation, squared on v.

    Returns:
        Three arrays (v, s), shape (2,), for `materialx`.
    """
    b_m, b_n, *scales = floats((longitudinal, azimuthal, scale_TT, scale_TRT))
    beta_m = perceptual.longitudinal(clamp(b_m, *_ROUGHNESS))
    s = perceptual.azimuthal(clamp(b_n, *_ROUGHNESS))
    tt, trt = (jnp.stack([(beta_m * scale) ** 2, s]) for scale in scales)
    return jnp.stack([beta_m * beta_m, s]), tt, trt


@parameters.in_their_dtype
def materialx(
    roughness_R: Numbers = (0.1, 0.1),
    roughness_TT: Numbers = (0.05, 0.05),
    roughness_TRT: Numbers = (0.2, 0.2),
    cuticle_angle: Reals = 0.5,
    ior: Reals = ETA,
    absorption_coefficient: Numbers | None = None,
    *,
    color: Numbers | None = None,
    azimuthal_roughness: Reals | None = None,
    melanin_concentration: Reals | None = None,
    melanin_redness: Reals | None = None,
    eumelanin_color: Numbers | None = None,
    pheomelanin_color: Numbers | None = None,
    tint_R: Numbers = 1.0,
    tint_TT: Numbers = 1.0,
    tint_TRT: Numbers = 1.0,
) -> Fiber:
    """Fiber of MaterialX' chiang_hair_bsdf.

    | theirs | ours | source |
    |---|---|---|
    | roughness of a lobe (v, s), each clamped to [0.001, 1] | beta_m = sqrt(v), \
beta_n = s of it | mx_chiang_hair_bsdf |
    | its logistic scale sqrt(pi/8) s | the same | mx_hair_trimmed_logistic |
    | cuticle_angle c in [0, 1], 1/2 for none | alpha = -(c - 1/2) pi along it | \
mx_hair_alpha_angles |
    | ior 1.55 | eta | mx_chiang_hair_bsdf |
    | absorption_coefficient 0 | sigma_a, per radius | mx_chiang_hair_bsdf |
    | color 1, in [0.001, 1], azimuthal_roughness 0.2 | `pigment.chiang_sigma_a` | \
mx_chiang_hair_absorption_from_color |
    | melanin_concentration 0.25, melanin_redness 0.5 | `pigment.concentrations` | \
mx_deon_hair_absorption_from_melanin |
    | eumelanin_color, pheomelanin_color | -log of them, per concentration | the same |
    | tint_R, tint_TT, tint_TRT | 1 | mx_chiang_hair_bsdf |

    The functions are of mx_chiang_hair_bsdf.glsl, the defaults of pbrlib_defs.mtlx. v
    is a variance and s a deviation: neither is perceptual; `materialx_roughness` is the
    node that makes them. The specification has the absorption per diameter and the
    cuticle angle in radians, above 1/2 towards the root; the code, and this, takes it
    per radius and turns R to sin(theta_i + 2 (c - 1/2) pi), as Cycles does and against
    pbrt. Lobes p >= 3 are one, with TRT's v. The factors 1/pi and pi^2 of its code are
    lost.

    Args:
        roughness_R, roughness_TT, roughness_TRT: (v, s), shape (2,).
        cuticle_angle: c in [0, 1].
        ior: index of refraction, >= 1.
        absorption_coefficient: absorption per radius, >= 0; clear if no other is given.
        color: color of hair, in its place.
        azimuthal_roughness: perceptual roughness that color is read with.
        melanin_concentration: in [0, 1], in its place.
        melanin_redness: share of pheomelanin, in [0, 1].
        eumelanin_color, pheomelanin_color: exp(-absorption) of a unit of each, > 0;
            those of table "pbrt", rounded, if not given.
        tint_R, tint_TT, tint_TRT: factors of the lobes; what is not 1 is an error.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: two ways to absorb; a tint, which would be lost; a shape, or a
            number outside of its range.
    """
    melanin = {
        "melanin_concentration": melanin_concentration,
        "melanin_redness": melanin_redness,
    }
    colors = {
        "eumelanin_color": eumelanin_color,
        "pheomelanin_color": pheomelanin_color,
    }
    chosen = parameters.way(
        {"absorption_coefficient": absorption_coefficient},
        {"color": color, "azimuthal_roughness": azimuthal_roughness},
        melanin | colors,
    )
    tints = {"tint_R": tint_R, "tint_TT": tint_TT, "tint_TRT": tint_TRT}
    for name, tint in tints.items():
        parameters.equal(name, tint, 1, "a Fiber has no tint of a lobe, it is lost")
    within(1, math.inf, {"ior": ior})
    within(
        0,
        1,
        {"cuticle_angle": cuticle_angle, "azimuthal_roughness": azimuthal_roughness},
    )
    within(0, 1, melanin)
    within(0, math.inf, colors, open_low=True)
    within(0, math.inf, {"absorption_coefficient": absorption_coefficient})
    *lobes, c = floats((roughness_R, roughness_TT, roughness_TRT, cuticle_angle))
    names = ("roughness_R", "roughness_TT", "roughness_TRT")
    last_axis(2, **dict(zip(names, lobes, strict=True)))
    sigma_a = absorption_coefficient
    if chosen == "color":
        b = given(azimuthal_roughness, 0.2)
        shown = given(color, (1.0, 1.0, 1.0))
        sigma_a = parameters.of_color(b, {"color": shown}, least=1e-3, most=1)
    elif chosen == "melanin_concentration":
        both = pigment.concentrations(
            given(melanin_concentration, 0.25), given(melanin_redness, 0.5)
        )
        brown, red, *units = floats(
            both,
            (
                given(eumelanin_color, _EUMELANIN),
                given(pheomelanin_color, _PHEOMELANIN),
            ),
        )
        of_brown, of_red = (-jnp.log(unit) for unit in units)
        sigma_a = clamp(brown[..., None] * of_brown + red[..., None] * of_red, 0)
    v, s = clamp(jnp.stack(lobes), *_ROUGHNESS).T
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
        named = {f"(v, s) of lobe {p}": lobes[-1]}
        parameters.fits("MaterialX", *_ROUGHNESS, named)
    c = 0.5 - alpha / math.pi
    parameters.fits("MaterialX", 0, 1, {"cuticle_angle": c})
    return MaterialX(lobes[0], lobes[1], lobes[2], c, fiber.eta, parameters.rgb(fiber))
