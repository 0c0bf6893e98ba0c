"""Karis' hair of 2016, as published: R, TT and TRT. The rest is in fiberjax.artist.

Every function takes the constants, a PyTree of numbers, so that fits act on them.
"""

import math
from typing import Any, NamedTuple

import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.shading import PASS, Directions, Hair


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
