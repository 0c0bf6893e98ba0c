"""The tail: all lobes above TRT as one term, which any real-time model adds.

The reference has it in closed form: one lobe, untilted, of the last width and uniform
in azimuth, M a/(2 pi) with a = 1/2 int A_rest(3, h) dh. Here

    M = exp(-X/(2 v))/(v (1 - exp(-2/v)) sqrt(o + c x)), x = cos theta_i cos theta_o/v
    a = sqrt(Y)/(q_0 + q_1 Y + Y^2) (K_0 + K_1 Y)
    X = 2 - 2 cos(theta_i + theta_o), Y = 4 cos^2 theta_d

with 1/sqrt(o + c x) for exp(-x) I_0(x): one exponential and one reciprocal root for
all colors.
"""

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax._types import Floats
from fiberjax.shading import Directions, Hair

DATA = Path(__file__).parent / "data" / "tail.json"
"""The constants; fits/tail.py finds them."""

REST = 3
"""The place of the rest in the tuples of a hair."""

_MIDDLE = 0.55 / 2.55
"""(eta - 1)/(eta + 1) of eta = 1.55."""

_BROAD = 0.3
"""Variance at which the form of M changes most."""


class Constants(NamedTuple):
    """Logarithms of what is positive, polynomials with the constant term first.

    In z = 10 ((eta - 1)/(eta + 1) - 11/51): q_0 and q_1; the level of a; and what
    absorption does to it, K_0 = exp(-decay sigma_a)/(1 + loss sigma_a) and K_1 =
    tint sigma_a exp(-tint_decay sigma_a)/(1 + loss sigma_a), both times the level. In
    u = v/(v + .3): o, and c, which is 2 pi at u = 0, where I_0 has its asymptote.
    """

    o: tuple[Any, Any, Any]
    c: tuple[Any, Any]
    q_0: tuple[Any, Any]
    q_1: tuple[Any, Any]
    level: tuple[Any, Any]
    decay: tuple[Any, Any]
    loss: tuple[Any, Any]
    tint: tuple[Any, Any]
    tint_decay: tuple[Any]


def _read() -> Constants:
    """The constants of the file."""
    found = json.loads(DATA.read_text())
    return Constants(**{name: tuple(x) for name, x in found.items()})


FITTED = _read()


def _exp(k: tuple[Any, ...], x: Floats) -> Floats:
    """The exponential of a polynomial."""
    value = jnp.full_like(x, k[-1])
    for coefficient in k[-2::-1]:
        value = value * x + coefficient
    return jnp.exp(value)


def _colors(k: Constants, z: Floats, level: Floats, sigma_a: Floats, Y: Floats):
    """The level times K_0 + K_1 Y, on a last axis of colors."""
    less = checkpoint_name(level / (1 + _exp(k.loss, z) * sigma_a), "less")
    K_0 = checkpoint_name(jnp.exp(-_exp(k.decay, z) * sigma_a) * less, "K0")
    slower = jnp.exp(-_exp(k.tint_decay, z) * sigma_a) * less
    K_1 = checkpoint_name(_exp(k.tint, z) * sigma_a * slower, "K1")
    return K_0 + K_1 * Y[..., None]


def rest(k: Constants, hair: Hair, at: Directions) -> Floats:
    """M N of all lobes p >= 3.

    X and Y are sums of squares, which keep their digits where 1 -+ cos would cancel; Y
    is positive wherever a cosine of an inclination is. Exponentials decay in sigma_a
    for every eta >= 1.

    Args:
        k: the constants, `FITTED` or others in their place.
        hair: with the width of the rest at `REST`, as `fiberjax.shading.of_fiber` has.
        at: the directions, of any shape.

    Returns:
        Per steradian, the cosine included as in `fiberjax.evaluate`; colors on a last
        axis, one color if the hair is clear. fits/constants/tail.json has the errors.
    """
    beta = checkpoint_name(hair.beta_m[REST], "beta")
    z = checkpoint_name(10 * ((hair.eta - 1) / (hair.eta + 1) - _MIDDLE), "z")
    v = checkpoint_name(beta * beta, "v")
    u = checkpoint_name(v / (v + _BROAD), "u")
    t = checkpoint_name(jnp.tanh(1 / v), "t")
    # 1/(1 - exp(-2/v)) = (1 + t)/(2 t), which loses nothing where v is large.
    level = (1 + t) / (4 * math.pi * t * v) * _exp(k.level, z)
    level = checkpoint_name(level, "level")
    narrow = checkpoint_name(-0.5 / v, "narrow")
    o = checkpoint_name(_exp(k.o, u), "o")
    c = checkpoint_name(_exp((math.log(2 * math.pi), *k.c), u) / v, "c")
    q_0 = checkpoint_name(_exp(k.q_0, z), "q0")
    q_1 = checkpoint_name(_exp(k.q_1, z), "q1")
    both = checkpoint_name(at.sin_i + at.sin_o, "both")
    apart = checkpoint_name(at.cos_i - at.cos_o, "apart")
    together = checkpoint_name(at.cos_i + at.cos_o, "together")
    square = checkpoint_name(both * both, "square_both")
    X = checkpoint_name(square + apart * apart, "X")
    Y = checkpoint_name(square + together * together, "Y")
    quadratic = checkpoint_name(q_0 + Y * (q_1 + Y), "quadratic")
    across = checkpoint_name(at.cos_i * at.cos_o, "across")
    under = Y * (o + c * across) * (quadratic * quadratic)
    under = checkpoint_name(under, "square")
    front = jnp.exp(narrow * X) * (Y * jax.lax.rsqrt(under))
    if hair.sigma_a is None:
        return (level * front)[..., None]
    return front[..., None] * _colors(k, z, level, hair.sigma_a, Y)


def lobe(p: int, k: Constants, hair: Hair, at: Directions) -> Floats:
    """The rest, called as the lobes of a tier are; p is `REST`."""
    del p
    return rest(k, hair, at)
