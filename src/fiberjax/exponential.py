"""R, TT and TRT as exponentials of polynomials in cos phi and cos 2 theta_d.

A tier is its constants, nested dicts of numbers as fits/tiers.py writes them: what they
do not name is not computed. A key is a monomial, one letter for each factor, "1" if
there is none. What depends on the fiber alone is in the coefficients, polynomials in
its numbers; beside those R costs an exp2 and one or two roots, TT a root and an exp2
for each color, TRT a root and one or two exp2.
"""

import math
from collections.abc import Mapping
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.ad_checkpoint import checkpoint_name

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.shading import Directions, Hair, added

NAMES = ("R", "TT", "TRT")

DOMAIN = {
    "eta": (1.45, 1.65),
    "beta_m": (0.09, 0.49),
    "beta_n": (0.05, 0.49),
    "sigma_a": (0.0, 1.15),
}
"""Where coefficients are polynomials; beyond, they are those of the nearest fiber.

The width of M goes on with beta_m, to `_WIDEST`, and absorption with sigma_a, as
exp(-2 p sigma_a). In float32 a tilted lobe narrower than that loses digits: the
relative error is about 4 (tilt/beta)^2 eps.
"""

WIDTHS = (1.0, 0.5, 2.0)
"""beta_m of the lobes over that of R, in the fibers of the fits."""

_LEAST = 1e-5
_WIDEST = 0.8
"""beta_m of R beyond which it is this: fitted, M of wider ones would give back more."""
_STEEPEST = 1.2
"""Tilt of a lobe in radians beyond which it is this: its tangent is finite."""

_LOG2_E = 1 / math.log(2)


def _inside(x: Floats, name: str) -> Floats:
    low, high = DOMAIN[name]
    # Without absorption its derivative is whole.
    return jnp.minimum(jnp.maximum(x, low), high) if low else jnp.minimum(x, high)


def width(hair: Hair, p: int) -> Floats:
    """beta_m of lobe p."""
    return checkpoint_name(jnp.minimum(hair.beta_m[p], _WIDEST * WIDTHS[p]), "width")


def features(hair: Hair, p: int) -> dict[str, Floats]:
    """What the coefficients of lobe p are polynomials in.

    e = 10 (eta - 1.55); n = beta_n, b = 4 beta_n^2, r = 1/(1 + 20 beta_n^2);
    m = 4 beta_m^2 with beta_m of R; s = sigma_a, (C,).
    """
    beta_n = checkpoint_name(_inside(hair.beta_n[p], "beta_n"), "n")
    beta_m = checkpoint_name(_inside(hair.beta_m[p] / WIDTHS[p], "beta_m"), "m")
    square = checkpoint_name(beta_n * beta_n, "n2")
    none = jnp.zeros_like(beta_n)[..., None]
    return {
        "e": checkpoint_name(10 * (_inside(hair.eta, "eta") - 1.55), "e"),
        "n": beta_n,
        "b": checkpoint_name(4 * square, "b"),
        "r": checkpoint_name(1 / (1 + 20 * square), "r"),
        "m": checkpoint_name(4 * (beta_m * beta_m), "m4"),
        "s": none if hair.sigma_a is None else _inside(hair.sigma_a, "sigma_a"),
    }


def polynomial(terms: Mapping[str, Any], of: Mapping[str, Any], base: Any = 0) -> Any:
    """base + the sum of the terms, nested: what comes first in `of` is outermost."""
    terms = {key.replace("1", ""): value for key, value in terms.items()}
    for name, x in of.items():
        with_x = {k.replace(name, "", 1): v for k, v in terms.items() if name in k}
        if with_x:
            rest = {k: v for k, v in terms.items() if name not in k}
            return polynomial(rest, of, base) + x * polynomial(with_x, of)
    return terms[""] + base if terms else base


def coefficients(terms: Mapping[str, Any], of: Mapping[str, Any]) -> dict[str, Any]:
    """Each a polynomial of the fiber, for an exponent of 2."""
    return {
        key: checkpoint_name(_LOG2_E * polynomial(value, of), f"k_{key}")
        for key, value in terms.items()
    }


def exponent(terms: Mapping[str, Any], of: Mapping[str, Any], base: Floats) -> Floats:
    """base + the sum of the terms, colors last: those of one color are made once."""
    one = {key: value for key, value in terms.items() if not jnp.ndim(value)}
    each = {key: value for key, value in terms.items() if jnp.ndim(value)}
    base = polynomial(one, of, base)[..., None]
    return polynomial(each, {name: x[..., None] for name, x in of.items()}, base)


class Geometry(NamedTuple):
    """What all lobes share: u = cos phi, q = cos 2 theta_d, Y = 4 cos^2 theta_d.

    And cos theta_i cos theta_o, sin theta_i cos theta_o, sin(theta_i + theta_o), and
    X = 2 - 2 cos(theta_i + theta_o); X and Y are sums of squares, which keep their
    digits next to 0.
    """

    u: Floats
    q: Floats
    X: Floats
    Y: Floats
    cc: Floats
    sc: Floats
    turned: Floats


def geometry(at: Directions) -> Geometry:
    """From the sines and cosines, by products and sums."""
    cc = checkpoint_name(at.cos_i * at.cos_o, "cc")
    sc = checkpoint_name(at.sin_i * at.cos_o, "sc")
    q = checkpoint_name(cc + at.sin_i * at.sin_o, "q")
    both = checkpoint_name(at.sin_i + at.sin_o, "both")
    apart = checkpoint_name(at.cos_i - at.cos_o, "apart")
    together = checkpoint_name(at.cos_i + at.cos_o, "together")
    square = checkpoint_name(both * both, "square_both")
    X = checkpoint_name(square + apart * apart, "X")
    Y = checkpoint_name(square + together * together, "Y")
    turned = checkpoint_name(sc + at.sin_o * at.cos_i, "turned")
    return Geometry(at.cos_phi, q, X, Y, cc, sc, turned)


class Cone(NamedTuple):
    """A lobe's specular cone, turned by its tilt and folded where it passes a pole.

    a = |cos(cone) cos(theta_o)|/cos(tilt); 2 (cos(tilt) - cos(cone - theta_o)) over
    cos(tilt), without tilt the square of a chord; cos(tilt) and 1 - cos(tilt).
    """

    a: Floats
    square: Floats
    cos: Any
    less: Any


def cone(tilt: Any, at: Geometry) -> Cone:
    """The cone of a lobe."""
    tilt = jnp.clip(tilt, -_STEEPEST, _STEEPEST)
    half, cos = jnp.sin(tilt / 2), checkpoint_name(jnp.cos(tilt), "cos_tilt")
    tan = checkpoint_name(jnp.sin(tilt) / cos, "tan_tilt")
    less = checkpoint_name(2 * (half * half), "less")
    a = checkpoint_name(at.cc + tan * at.sc, "a")
    square = at.X - 2 * tan * at.turned - 4 * jnp.maximum(-a, 0)
    return Cone(jnp.abs(a), checkpoint_name(square, "square"), cos, less)


def _along(of: Cone, over_v: Any) -> Floats:
    """log2 of exp((cos(cone - theta_o) - 1) over_v)."""
    scale = checkpoint_name(_LOG2_E * over_v, "scale")
    slope = checkpoint_name(-0.5 * scale * of.cos, "k_square")
    return checkpoint_name(-scale * of.less, "k_tilt") + slope * of.square


def R(k: Any, hair: Hair, at: Geometry) -> Floats:
    """M N of R, on a last axis of one color.

    T rsqrt(T I (1 + kF^2 P)) 2^(...) with T = u + kT and P = Y (u + kP), about
    8 cos^2(theta_d) cos^2(phi/2). I, the largest of some lines in
    x = cos(cone) cos(theta_o)/v, stands for (I0(x) exp(-x))^-2.
    """
    of = features(hair, 0)
    over_v = 1 / width(hair, 0) ** 2 + polynomial(k["over_v"], of)
    # It has a logarithm however wide M is.
    over_v = checkpoint_name(jnp.maximum(over_v, _LEAST), "over_v")
    beta_n = checkpoint_name(of["n"] + polynomial(k["beta_n"], of), "beta_n")
    kT, kP = (
        checkpoint_name(1 + (polynomial(k[x], of) * beta_n) ** 2 + _LEAST, x)
        for x in ("kT", "kP")
    )
    turned = cone(hair.tilt[0], at)
    T = checkpoint_name(at.u + kT, "T")
    P = checkpoint_name(at.Y * (at.u + kP), "P")
    lines = []
    for line in k["lines"]:
        slope = polynomial(line["slope"], of) * (turned.cos * over_v)
        slope = checkpoint_name(slope, "slope")
        offset = checkpoint_name(polynomial(line["offset"], of), "offset")
        lines.append(offset + slope * turned.a)
    below = (
        T
        * reduce(jnp.maximum, lines)
        * (1 + checkpoint_name(polynomial(k["kF"], of) ** 2, "kF") * P)
    )
    terms = coefficients(k["exponent"], of)
    base = _along(turned, over_v) + checkpoint_name(jnp.log2(over_v), "log_peak")
    variables = {"P": P, "q": at.q, "u": at.u}
    if "x" in terms:
        variables["x"] = numerics.sqrt(P)
    power = jnp.exp2(polynomial(terms, variables, base))
    below = checkpoint_name(below, "square_size")
    return (T * jax.lax.rsqrt(below) * power)[..., None]


def _through(p: int, k: Any, hair: Hair, at: Geometry) -> Floats:
    """M N of TT or TRT, colors last.

    Y rsqrt((Y + k0^2)^2 (a + k1^2)) sum_j K_j 2^(polynomial in u and q), times
    the exponential of M; in TRT, u is cos phi - 1.
    """
    of, turned = features(hair, p), cone(hair.tilt[p], at)
    beta_m = width(hair, p)
    over_v = checkpoint_name(1 / (beta_m * beta_m), "over_v")
    peak = checkpoint_name(1 / (math.sqrt(2 * math.pi) * beta_m), "peak")
    # A square: below 0 it would be a pole.
    k_near = checkpoint_name(polynomial(k["rise"]["Y"], of) ** 2 + _LEAST, "k_near")
    near = checkpoint_name(at.Y + k_near, "near")
    flat = checkpoint_name(polynomial(k["rise"]["a"], of) ** 2 + _LEAST, "flat")
    below = checkpoint_name(near * near * (turned.a + flat), "square_rise")
    rise = checkpoint_name(at.Y * jax.lax.rsqrt(below), "rise")
    u = at.u if p == 1 else checkpoint_name(at.u - 1, "u")
    darker = 0.0 if hair.sigma_a is None else -2.0 * p * (hair.sigma_a - of["s"])
    found = []
    for one in k["terms"]:
        log_K = _LOG2_E * (polynomial(one["K"], of) + darker)
        K = checkpoint_name(peak * jnp.exp2(log_K), "K")
        base = _along(turned, over_v + polynomial(one["over_v"], of))
        terms = coefficients(one["exponent"], of)
        power = jnp.exp2(exponent(terms, {"u": u, "q": at.q}, base))
        # Colors last: they are multiplied once.
        number = rise[..., None]
        found.append(number * K * power if p == 1 else number * power * K)
    return added(found)


def lobe(p: int, k: Any, hair: Hair, at: Directions) -> Floats:
    """R, TT or TRT from the constants of a tier, on a last axis of colors or of one."""
    shared = geometry(at)
    if p:
        return _through(p, k[NAMES[p]], hair, shared)
    return R(k["R"], hair, shared)
