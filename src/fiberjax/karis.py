"""Karis' hair of 2016, as published: R, TT and TRT, scattering, environment light.

Every function takes the constants, a PyTree of numbers, so that fits act on them.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.shading import PASS, Directions, Hair, added, of_angles

_DARKEST = 1e-30
"""Least component of a base color: what is black has a logarithm too."""

_LUMA = (0.2126, 0.7152, 0.0722)
"""Luminance of linear colors, Rec. 709."""


class Constants(NamedTuple):
    """The published constants, or others in their place.

    eta' = k0/cos theta_d + k1 cos theta_d; h_TT = (1 + (k0 + k1 cos phi)/eta')
    cos(phi/2); D = exp(k0 cos phi + k1) of TT and TRT; the one offset of TRT; the
    exponent of C in its absorption, over cos theta_d.
    """

    eta_prime: tuple[Any, Any] = (1.19, 0.36)
    h_tt: tuple[Any, Any] = (0.6, -0.8)
    d_tt: tuple[Any, Any] = (-3.65, -3.98)
    d_trt: tuple[Any, Any] = (17.0, -16.78)
    h_trt: Any = math.sqrt(3) / 2
    absorbed_trt: Any = 0.8


PUBLISHED = Constants()


def _gaussian(x: Floats, beta: Floats) -> Floats:
    """Density of deviation beta, in whatever x is measured in."""
    beta = checkpoint_name(beta, "beta")
    narrow = checkpoint_name(-0.5 / (beta * beta), "narrow")
    peak = checkpoint_name(1 / (beta * math.sqrt(2 * math.pi)), "peak")
    return peak * jnp.exp(narrow * (x * x))


def _M(p: int, hair: Hair, at: Directions) -> Floats:
    """A Gaussian in sin theta about the specular cone."""
    tilt = checkpoint_name(hair.tilt[p], "tilt")
    off = checkpoint_name(at.sin_i + at.sin_o - tilt, "off")
    return _gaussian(off, hair.beta_m[p])


def _schlick(cos: Floats, eta: Floats) -> Floats:
    root = checkpoint_name((eta - 1) / (eta + 1), "root")
    f0 = checkpoint_name(root * root, "f0")
    f1 = checkpoint_name(1 - f0, "f1")
    x = checkpoint_name(1 - cos, "x")
    return checkpoint_name(f0 + f1 * x**5, "F")


def _let_through(hair: Hair, passes: Floats) -> Floats:
    """C to the power of `passes`, on a last axis of colors."""
    if hair.sigma_a is None:
        return jnp.ones_like(passes)[..., None]
    log_color = checkpoint_name(-PASS * hair.sigma_a, "log_color")
    return jnp.exp(log_color * passes[..., None])


def R(k: Constants, hair: Hair, at: Directions) -> Floats:
    """M N of R, on a last axis of one color.

    With alpha half the tilt, M's Gaussian is centered on
    2 sin alpha (cos alpha cos theta_o cos(phi/2) + sin alpha sin theta_o), where a
    mirror turned by alpha throws the light, and sqrt 2 cos(phi/2) beta wide: d'Eon et
    al. 2014. N = cos(phi/2)/4 F, in which cos(phi/2) is the one in M's denominator.
    """
    del k
    alpha, c = checkpoint_name(hair.tilt[0] / 2, "alpha"), at.cos_half_phi
    sin, cos = checkpoint_name(jnp.sin(alpha), "sin_alpha"), jnp.cos(alpha)
    across = checkpoint_name(2 * (sin * cos), "shift_across")
    along = checkpoint_name(2 * (sin * sin), "shift_along")
    shift = checkpoint_name(across * at.cos_o * c + along * at.sin_o, "shift")
    off = (at.sin_i + at.sin_o - shift) * at.over_half_phi
    width = math.sqrt(2) * hair.beta_m[0]
    half = checkpoint_name(numerics.sqrt(0.5 + 0.5 * at.cos_io), "cos_half")
    F = _schlick(half, hair.eta)
    return (_gaussian(checkpoint_name(off, "off"), width) / 4 * F)[..., None]


def R_separable(k: Constants, hair: Hair, at: Directions) -> Floats:
    """R with the M of the other lobes: no azimuth in its center or width."""
    del k
    half = numerics.sqrt(0.5 + 0.5 * at.cos_io)
    N = at.cos_half_phi / 4 * _schlick(half, hair.eta)
    return (_M(0, hair, at) * N)[..., None]


def TT(k: Constants, hair: Hair, at: Directions) -> Floats:
    """M N of TT, colors on the last axis.

    N = (1 - F)^2 C^(sqrt(1 - h^2/eta'^2)/(2 cos theta_d)) D at one offset h for each
    phi; F is Schlick's at cos theta_d sqrt(1 - h^2).
    """
    a = at.cos_d / (k.eta_prime[0] + k.eta_prime[1] * at.cos_d**2)
    a = checkpoint_name(a, "a")
    h = (1 + a * (k.h_tt[0] + k.h_tt[1] * at.cos_phi)) * at.cos_half_phi
    h = checkpoint_name(h, "h")
    F = _schlick(at.cos_d * numerics.sqrt(1 - h * h), hair.eta)
    D = jnp.exp(k.d_tt[0] * at.cos_phi + k.d_tt[1])
    inside = checkpoint_name(h * a, "sin_inside")
    passes = 0.5 * numerics.sqrt(1 - inside * inside) * at.over_d
    passed = checkpoint_name(1 - F, "passed")
    left = passed**2 * D * _M(1, hair, at)
    return left[..., None] * _let_through(hair, checkpoint_name(passes, "passes"))


def TRT(k: Constants, hair: Hair, at: Directions) -> Floats:
    """M N of TRT, colors on the last axis.

    N = (1 - F)^2 F C^(.8/cos theta_d) D with one offset h for all phi.
    """
    F = _schlick(
        at.cos_d * numerics.sqrt(jnp.asarray(1 - k.h_trt**2, at.cos_d.dtype)), hair.eta
    )
    D = jnp.exp(k.d_trt[0] * at.cos_phi + k.d_trt[1])
    passed = checkpoint_name(1 - F, "passed")
    left = passed**2 * F * D * _M(2, hair, at)
    passes = checkpoint_name(k.absorbed_trt * at.over_d, "passes")
    return left[..., None] * _let_through(hair, passes)


def lobe(p: int, k: Constants, hair: Hair, at: Directions) -> Floats:
    """R, TT or TRT."""
    return (R, TT, TRT)[p](k, hair, at)


class Artist(NamedTuple):
    """What an artist sets.

    base_color in (0, 1), (3,); specular, a factor of R; roughness, beta is its square;
    scatter, a factor of the scattering; shift, the tilt of TT in radians.
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
    color = checkpoint_name(jnp.maximum(color, _DARKEST), "color")
    beta_m = tuple(factor * roughness**2 + wider for factor in (1, 0.5, 2))
    tilt = tuple(factor * shift for factor in (-2, 1, 4))
    eta, none = (jnp.full_like(roughness, x) for x in (1.55, 0))
    return Hair(eta, -jnp.log(color) / PASS, beta_m, tilt, 3 * (none,))


def scattering(color: Floats, at: Directions, shadow: Floats) -> Floats:
    """The term for light that other hairs have scattered, colors on the last axis.

    sqrt(C) (n . w_i + 1)/(4 pi) (C/luma)^(1 - shadow), n = the part of w_o across the
    tangent, normalized; luma is that of Rec. 709, which is not said there.
    """
    color = checkpoint_name(jnp.maximum(color, _DARKEST), "color")
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
    artist: Artist, theta_o: Reals, *, wider: Reals = 0.2, k: Constants = PUBLISHED
) -> Floats:
    """What an environment adds, over its radiance from the fake normal.

    pi times the model under a light in that direction, across the tangent and on the
    side of the eye, with R times saturate(w_i . w_o + 1), without TT, and each beta_m
    `wider`.

    Args:
        artist: base color, specular, roughness, scatter and shift.
        theta_o: inclination of the direction towards the eye in radians.
        wider: what is added to each beta_m, in radians.
        k: the constants.

    Returns:
        Shape of theta_o + (3,).

    Raises:
        ValueError: base_color does not end in an axis of 3.

    Reference: Karis 2016, "Environment lighting".
    """
    artist, (theta_o, wider) = _prepare(artist, theta_o, wider)
    none, one = jnp.zeros_like(theta_o), jnp.ones_like(theta_o)
    at, hair = of_angles(none, theta_o, none), of_artist(artist, wider)
    color, specular, _, scatter, _ = artist
    seen = jnp.clip(at.cos_io + 1, 0, 1)[..., None]
    light = specular * seen * R(k, hair, at) + TRT(k, hair, at)
    return math.pi * (light + scatter * scattering(color, at, one))
