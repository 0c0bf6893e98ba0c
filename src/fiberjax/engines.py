"""Converters of game engines: Karis' model of Unreal, and Unity's HDRP.

Each system's tangent is its own; alpha is along it. All are checked while the numbers
are known; under a transformation of JAX nothing is.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import artist, parameters, perceptual, pigment
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, TILTS, Numbers, clamp, within
from fiberjax.shading import PASS

_NO_OTHER_ETA = "its Fresnel and eta' are for 1.55, another would be lost"
_LEAST = 1e-2  # 1 - smoothness of HDRP
_UNITY_WIDTHS = (1.0, 0.25, 4.0)
_UNITY_TILTS = (2.0, -1.0, -3.0, 0.0)


class Karis(NamedTuple):
    """What Karis' hair takes; `karis` makes a fiber of it."""

    base_color: Any
    roughness: Any
    shift: Any


class Unity(NamedTuple):
    """What HDRP's hair takes; `unity` makes a fiber of it."""

    smoothness: Any
    radial_smoothness: Any
    cuticle_angle: Any
    absorption: Any


def karis(
    base_color: Numbers,
    roughness: Reals = 0.3,
    shift: Reals = 0.035,
    *,
    specular: Reals = 1.0,
    beta_n: Reals | None = None,
) -> Fiber:
    """Fiber that Karis' hair of Unreal, 2016, approximates.

    | theirs | ours |
    |---|---|
    | beta = (1, 1/2, 2) roughness^2 | beta_m = roughness^2, widths_m (1, 1/2, 2) |
    | alpha = (-2, 1, 4) shift, radians | alpha = -shift |
    | base color C | sigma_a = -log(C)/4, C at least 1e-30 |
    | eta 1.55 in eta' | eta |

    Its Gaussian M is in sin theta_o + sin theta_i, beta wide: the same width in theta_o
    where cos theta_o = 1 alone. Its azimuth knows no roughness; beta_n = roughness^2
    unless given. No lobe beyond TRT: `rest=False`. scatter is the light of other hairs
    and `karis.Constants` its forms: neither is a fiber's. `artist` has the whole model.

    Args:
        base_color: C in [0, 1], one or any number of colors.
        roughness: > 0.
        shift: tilt of TT in radians.
        specular: 1; a Fiber has no factor of R.
        beta_n: azimuthal deviation in radians.

    Raises:
        ValueError: specular is not 1 and would be lost; a number has no meaning.

    Reference: Karis 2016.
    """
    within("base_color", base_color, 0, 1)
    within("roughness", roughness, 0, jnp.inf, open_low=True)
    parameters.equal("specular", specular, 1, "a Fiber has no factor of R, it is lost")
    color, rough, tilt = floats((base_color, roughness, shift))
    beta = rough * rough
    return Fiber(
        eta=ETA,
        beta_m=beta,
        beta_n=beta if beta_n is None else beta_n,
        alpha=-tilt,
        sigma_a=-jnp.log(clamp(color, artist.DARKEST)) / PASS,
    )


def to_karis(fiber: Fiber) -> Karis:
    """What Karis' hair takes of a fiber: the inverse of `karis`.

    Args:
        fiber: fiber of eta 1.55 and beta_n = beta_m, of at most 3 colors, with the
            widths (1, 1/2, 2) and (1,) and the tilts (2, -1, -4, 0).

    Returns:
        The numbers, for `karis(*numbers)`.

    Raises:
        ValueError: what Karis' hair does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "Karis", tilts=TILTS)
    parameters.equal("eta", fiber.eta, ETA, _NO_OTHER_ETA)
    lost = "the azimuth of Karis knows no roughness, it would be lost"
    parameters.equal("beta_n", fiber.beta_n, fiber.beta_m, lost)
    color = jnp.exp(-PASS * parameters.rgb(fiber))
    return Karis(color, jnp.sqrt(fiber.beta_m), -parameters.tilt(fiber))


def unity(
    smoothness: Reals,
    radial_smoothness: Reals,
    cuticle_angle: Reals,
    absorption: Numbers | None = None,
    *,
    diffuse_color: Numbers | None = None,
    eumelanin: Reals | None = None,
    pheomelanin: Reals | None = None,
) -> Fiber:
    """Fiber of the physical hair of Unity's HDRP.

    | theirs, r = 1 - min(smoothness, .99) | ours |
    |---|---|
    | R: theta_h + c, r^2 wide | beta_m = 2 r^2 |
    | TT: theta_h - c/2, (r/2)^2 wide; TRT: - 3 c/2, (2 r)^2 | widths_m (1, 1/4, 4) |
    | cuticle angle c, degrees | alpha = -c in radians, tilts (2, -1, -3, 0) |
    | b = 1 - min(radial smoothness, .99) | beta_n = 0.265 b + 1.194 b^2 + 5.372 b^22 |
    | absorption | sigma_a, per radius |
    | diffuse color | `pigment.chiang_sigma_a` with b |
    | eumelanin, pheomelanin | `pigment.melanin`, table "pbrt" |
    | eta 1.55, fixed | eta |

    Sources: ConvertSurfaceDataToBSDFData and EvaluateBSDF of Hair.hlsl; for beta_n the
    path tracer, whose M is that of `pbrt` with b = r and alpha = -c. The raster's M is
    a Gaussian in theta_h = (theta_o + theta_i)/2: deviations of theta_o are twice its.
    Before the cinematic hair (HDRP 14) the widths were (1, 1/2, 2) r^2. The tangent
    runs from root to tip. The azimuth on the raster is a table of b, of which the map
    to a deviation is not said. A factor 1/pi, Schlick's Fresnel and Karis' eta' are
    lost. No lobe beyond TRT: `rest=False`.

    Args:
        smoothness: perceptual, along the fiber, in [0, 1].
        radial_smoothness: perceptual, around the fiber, in [0, 1].
        cuticle_angle: c in degrees.
        absorption: absorption per radius.
        diffuse_color: color of hair in (0, 1], in place of absorption.
        eumelanin, pheomelanin: concentrations, in place of absorption.

    Raises:
        ValueError: no or two absorptions; a number has no meaning.
    """
    within("smoothness", smoothness, 0, 1)
    within("radial_smoothness", radial_smoothness, 0, 1)
    melanin = eumelanin if pheomelanin is None else pheomelanin
    way = parameters.required(
        absorption=absorption, diffuse_color=diffuse_color, eumelanin=melanin
    )
    smooth, radial, angle = floats((smoothness, radial_smoothness, cuticle_angle))
    r, b = clamp(1 - smooth, _LEAST), clamp(1 - radial, _LEAST)
    if way == "diffuse_color":
        absorption = parameters.of_color("diffuse_color", diffuse_color, b)
    elif way == "eumelanin":
        both = (0.0 if x is None else x for x in (eumelanin, pheomelanin))
        absorption = pigment.melanin(*both)
    return Fiber(
        eta=ETA,
        beta_m=2 * r * r,
        beta_n=perceptual.azimuthal(b),
        alpha=-jnp.radians(angle),
        sigma_a=absorption,
        widths_m=_UNITY_WIDTHS,
        tilts=_UNITY_TILTS,
    )


def to_unity(fiber: Fiber) -> Unity:
    """What HDRP's hair takes of a fiber: the inverse of `unity`.

    Args:
        fiber: fiber of eta 1.55 and of at most 3 colors, with the widths (1, 1/4, 4)
            and (1,) and the tilts (2, -1, -3, 0).

    Returns:
        The numbers, for `unity(*numbers)`.

    Raises:
        ValueError: what HDRP does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "HDRP", widths=_UNITY_WIDTHS, tilts=_UNITY_TILTS)
    parameters.equal("eta", fiber.eta, ETA, _NO_OTHER_ETA)
    smooth = 1 - jnp.sqrt(fiber.beta_m / 2)
    radial = 1 - perceptual.from_azimuthal(fiber.beta_n)
    for name, x in (("smoothness", smooth), ("radial_smoothness", radial)):
        within(f"{name} of HDRP", x, -1e-5, 1 - _LEAST + 1e-5)
    angle = -jnp.degrees(parameters.tilt(fiber))
    return Unity(smooth, radial, angle, parameters.rgb(fiber))
