"""Converter of Cycles' Principled Hair BSDF, the model of Chiang.

Its tangent is its own; alpha is along it. All are checked while the numbers are known;
under a transformation of JAX nothing is.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import parameters, perceptual, pigment
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, WIDTHS, Numbers, clamp, within

_LEAST, _MOST = 1e-3, 1.0  # of every roughness
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
    melanin_redness: Reals = 1.0,
    tint: Numbers = (1.0, 1.0, 1.0),
) -> Fiber:
    """Fiber of Cycles' Principled Hair BSDF, model of Chiang.

    | theirs | ours |
    |---|---|
    | roughness, clamped to [0.001, 1], b | beta_m = 0.726 b + 0.812 b^2 + 3.7 b^20 |
    | coat c: (1 - c) b for R | widths_m (beta_m((1 - c) b)/beta_m, 1/2, 2) |
    | radial roughness, the same clamp | beta_n = 0.265 b + 1.194 b^2 + 5.372 b^22 |
    | offset, radians | alpha = -offset along dP/du, from root to tip |
    | ior 1.55 | eta |
    | absorption coefficient | sigma_a, per radius |
    | color (the default) | `pigment.chiang_sigma_a`, radial roughness not clamped |
    | melanin, melanin redness | `pigment.concentrations`, `melanin` of table "cycles" |
    | tint, with melanin | sigma_a of the tint is added |

    Sources: bsdf_hair_principled.h, svm/closure.h and the node's sockets; R is at
    sin(theta_light + 2 offset), so at theta_light = -theta - 2 offset. That is the
    other way than pbrt's. Lobes p >= 3 as of `pbrt`. Random color and roughness are of
    many fibers: `jax.vmap` over what they make of the numbers. Sockets end at 1; a
    melanin above 0.9999 is that.

    Args:
        roughness, radial_roughness: perceptual roughness.
        coat: in [0, 1], clamped; 1 makes R as narrow as there is.
        ior: index of refraction, >= 1.
        offset: tilt of the scales in radians.
        absorption_coefficient: absorption per radius.
        color: color of hair in (0, 1], in place of absorption_coefficient.
        melanin: amount in [0, 1], in place of absorption_coefficient.
        melanin_redness: share of pheomelanin, in [0, 1].
        tint: color in (0, 1] of the dye over melanin.

    Raises:
        ValueError: two ways to absorb are given; a number has no meaning.
    """
    parameters.given(
        absorption_coefficient=absorption_coefficient, color=color, melanin=melanin
    )
    within("ior", ior, 1, math.inf)
    b, radial, coated, angle = floats((roughness, radial_roughness, coat, offset))
    if melanin is not None:
        pigments = pigment.concentrations(melanin, melanin_redness)
        dye = parameters.of_color("tint", tint, radial)
        sigma_a = pigment.melanin(*pigments, table="cycles")
        sigma_a = sigma_a + dye.astype(sigma_a.dtype)
    elif absorption_coefficient is not None:
        within("absorption_coefficient", absorption_coefficient, 0, math.inf)
        sigma_a = absorption_coefficient
    else:
        shown = _COLOR if color is None else color
        sigma_a = parameters.of_color("color", shown, radial)
    b = clamp(b, _LEAST, _MOST)
    of_R = clamp((1 - clamp(coated, 0, 1)) * b, _LEAST, _MOST)
    beta_m = perceptual.longitudinal(b)
    first = perceptual.longitudinal(of_R) / beta_m
    widths = jnp.stack([first, *(jnp.full_like(first, w) for w in WIDTHS[1:])])
    beta_n = perceptual.azimuthal(clamp(radial, _LEAST, _MOST))
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
    allowed = (float(first) if parameters.known(first) else 1.0, *WIDTHS[1:])
    parameters.marschner(fiber, "Cycles", widths=allowed)
    b = perceptual.from_longitudinal(fiber.beta_m)
    of_R = perceptual.from_longitudinal(first.astype(b.dtype) * fiber.beta_m)
    radial = perceptual.from_azimuthal(fiber.beta_n)
    named = {"roughness": b, "roughness of R": of_R, "radial_roughness": radial}
    for name, x in named.items():
        within(f"{name} of Cycles", x, _LEAST * (1 - 1e-5), _MOST + 1e-5)
    coat = 1 - of_R / b
    within("coat of Cycles", coat, -1e-5, 1)
    offset = -parameters.tilt(fiber)
    return Cycles(b, radial, coat, fiber.eta, offset, parameters.rgb(fiber))
