"""Karis' hair of 2016 by what an artist sets: scattering and environment light too."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.karis import PUBLISHED, TRT, TT, Constants, R
from fiberjax.shading import PASS, Directions, Hair, added, of_angles

DARKEST = 1e-30
"""Least component of a base color: what is black has a logarithm too."""

_LUMA = (0.2126, 0.7152, 0.0722)
"""Luminance of linear colors, Rec. 709."""


class Artist(NamedTuple):
    """What an artist sets.

    base_color in (0, 1), (3,); specular, a factor of R; roughness, beta is its square;
    scatter, a factor of the scattering; shift, the tilt of TT in radians. A component
    of base_color below 1e-30 counts as that.
    """

    base_color: Any
    specular: Any = 1.0
    roughness: Any = 0.3
    scatter: Any = 1.0
    shift: Any = 0.035


def _prepare(artist: Artist, *numbers: Reals) -> tuple[Artist, list[Floats]]:
    """All in one dtype, that of the numbers; ValueError unless there are 3 colors."""
    last_axis(3, base_color=artist.base_color)
    arrays = floats(numbers, tuple(artist))
    return Artist(*arrays[len(numbers) :]), arrays[: len(numbers)]


def of_artist(artist: Artist, wider: Floats | float = 0.0) -> Hair:
    """The hair that the parameters describe, each beta_m `wider` by so much.

    eta is 1.55, which eta' is fitted for. beta_n, which nothing here knows, is 0.
    """
    color, _, roughness, _, shift = map(jnp.asarray, artist)
    color = checkpoint_name(jnp.maximum(color, DARKEST), "color")
    beta_m = tuple(factor * roughness**2 + wider for factor in (1, 0.5, 2))
    tilt = tuple(factor * shift for factor in (-2, 1, 4))
    eta, none = (jnp.full_like(roughness, x) for x in (1.55, 0))
    return Hair(eta, -jnp.log(color) / PASS, beta_m, tilt, 3 * (none,))


def scattering(color: Floats, at: Directions, shadow: Floats) -> Floats:
    """The term for light that other hairs have scattered, colors on the last axis.

    sqrt(C) (n . w_i + 1)/(4 pi) (C/luma)^(1 - shadow), n = the part of w_o across the
    tangent, normalized; luma is that of Rec. 709, which is not said there.
    """
    color = checkpoint_name(jnp.maximum(color, DARKEST), "color")
    fake = at.cos_i * at.cos_phi
    luma = checkpoint_name(color @ jnp.asarray(_LUMA, color.dtype), "luma")
    tint = (color / luma) ** (1 - shadow[..., None])
    tint = checkpoint_name(jnp.sqrt(color) * tint / (4 * math.pi), "tint")
    return (fake[..., None] + 1) * tint


PARTS: dict[str, Callable[..., Floats]] = {
    "R": lambda artist, at, shadow, k: artist.specular * R(k, of_artist(artist), at),
    "TT": lambda artist, at, shadow, k: TT(k, of_artist(artist), at),
    "TRT": lambda artist, at, shadow, k: TRT(k, of_artist(artist), at),
    "scattering": lambda artist, at, shadow, k: (
        artist.scatter * scattering(artist.base_color, at, shadow)
    ),
}
"""The terms that one light adds, each on a last axis of colors or of one."""


def shade(
    artist: Artist,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    shadow: Reals = 1.0,
    k: Constants = PUBLISHED,
) -> Floats:
    """All that one light adds, per unit of its irradiance: the whole model.

    specular R + TT + TRT + scatter scattering; the shadow itself is not multiplied by.

    Args:
        artist: base color, specular, roughness, scatter and shift.
        theta_i: inclination of the direction towards the light in radians.
        theta_o: inclination of the direction towards the eye in radians.
        phi: azimuth between them in radians.
        shadow: light that reaches the hair, in [0, 1].
        k: the constants.

    Returns:
        Per steradian, shape broadcast(angles) + (3,).

    Raises:
        ValueError: base_color does not end in an axis of 3.

    Reference: Karis 2016.
    """
    artist, (*angles, shadow) = _prepare(artist, theta_i, theta_o, phi, shadow)
    at = of_angles(*jnp.broadcast_arrays(*angles))
    return added([part(artist, at, shadow, k) for part in PARTS.values()])


def environment(
    artist: Artist,
    theta_o: Reals,
    *,
    theta_i: Reals = 0.0,
    phi: Reals = 0.0,
    wider: Reals = 0.2,
    k: Constants = PUBLISHED,
) -> Floats:
    """What an environment adds, over its radiance from one direction.

    pi times the model under a light there, with R times saturate(w_i . w_o + 1),
    without TT, and each beta_m `wider`.

    Args:
        artist: base color, specular, roughness, scatter and shift.
        theta_o: inclination of the direction towards the eye in radians.
        theta_i, phi: the direction that the environment is sampled in, inclination and
            azimuth from the eye in radians; by default the fake normal, across the
            tangent on the side of the eye, where the factor of R is 1.
        wider: what is added to each beta_m, in radians.
        k: the constants.

    Returns:
        Shape broadcast(angles) + (3,).

    Raises:
        ValueError: base_color does not end in an axis of 3.

    Reference: Karis 2016, "Environment lighting".
    """
    artist, (*angles, wider) = _prepare(artist, theta_i, theta_o, phi, wider)
    at = of_angles(*jnp.broadcast_arrays(*angles))
    hair, one = of_artist(artist, wider), jnp.ones_like(at.cos_io)
    color, specular, _, scatter, _ = artist
    seen = jnp.clip(at.cos_io + 1, 0, 1)[..., None]
    light = specular * seen * R(k, hair, at) + TRT(k, hair, at)
    return math.pi * (light + scatter * scattering(color, at, one))
