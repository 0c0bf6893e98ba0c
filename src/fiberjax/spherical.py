"""The longitudinal density M and its sampler.

M is what a spherical Gaussian makes of the specular cone: a cone of inclination
theta_cone, convolved on the sphere with a von Mises-Fisher density of variance v.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import bessel, numerics, programs
from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.circular import sin_cos


class Inclination(NamedTuple):
    """An angle from the normal plane by its sine and cosine, which may be negative."""

    sin: Floats
    cos: Floats


def inclination(theta: Floats) -> Inclination:
    """The sine and cosine of an angle."""
    return Inclination(jnp.sin(theta), jnp.cos(theta))


def turned(of: Inclination, by: Inclination) -> Inclination:
    """The sum of two angles."""
    return Inclination(
        of.sin * by.cos + of.cos * by.sin, of.cos * by.cos - of.sin * by.sin
    )


class Width(NamedTuple):
    """The width of a lobe: beta = sqrt(v), v and 1 - exp(-2/v)."""

    beta: Floats
    v: Floats
    within: Floats


def width(beta: Floats) -> Width:
    """That of beta, differentiable at 0."""
    v = beta * beta
    # Below v = 0.05, expm1(-2/v) is -1 to the last digit.
    broad = v > 0.05
    within = -jnp.expm1(-2 / jnp.where(broad, v, 1))
    return Width(beta, v, jnp.where(broad, within, 1))


def density(
    E: Floats,
    a: Floats,
    level: Floats,
    scaled: Callable[[Floats], Floats] = bessel.scaled_I0,
) -> Floats:
    """M from its exponent, a = cos theta_c cos theta_o/v, and 1/(v (1 - exp(-2/v))).

    `scaled` is exp(-|a|) I0(a).
    """
    # |a| - a is not 0 where an angle lies past pi/2, as float32(pi/2) does. Summed in
    # another order the exponent would lose a digit for each digit of 1/v.
    # The factor behind is large where the exponential is small, so it comes first.
    return jnp.exp(E + (jnp.abs(a) - a)) * (scaled(a) * level)


@jax.custom_jvp
def _M(theta_c: Floats, theta_o: Floats, v: Floats) -> Floats:
    x = 1 / v
    E = -2 * x * jnp.sin((theta_o - theta_c) / 2) ** 2
    level = 1 / (-v * jnp.expm1(-2 * x))
    return density(E, x * jnp.cos(theta_c) * jnp.cos(theta_o), level)


def _log_M_derivatives(
    cone: Inclination, out: Inclination, sin_D: Floats, versine: Floats, v: Floats
) -> tuple[Floats, Floats, Floats]:
    """Derivatives of log M in theta_c, theta_o and v, in forms without cancellation.

    D is theta_o - theta_c and versine 1 - cos D. Differentiating e^-a I0(a) gives a
    difference that loses every digit at large a. With r = I1(a)/I0(a) and 1 - r known
    separately, two forms cover everything.
    """
    x = 1 / v
    (sin_c, cos_c), (sin_o, cos_o) = cone, out
    a = x * cos_c * cos_o
    r, rest = programs.stored(lambda: bessel.ratio(a), v)
    peaked = a > 2
    by_o = jnp.where(
        peaked,
        -sin_D + cos_c * sin_o * rest,
        sin_c * cos_o - cos_c * sin_o * r,
    )
    by_c = jnp.where(
        peaked,
        sin_D + cos_o * sin_c * rest,
        sin_o * cos_c - cos_o * sin_c * r,
    )
    narrow = x > 2
    y = jnp.where(narrow, x, 3)
    tail = -2 * jnp.exp(-2 * y) / jnp.expm1(-2 * y)  # 2/expm1(2y) without overflow
    by_x = jnp.where(
        narrow,
        -versine - cos_c * cos_o * rest + (1 / y - tail),
        sin_c * sin_o + cos_c * cos_o * r - bessel.langevin(jnp.where(narrow, 1, x)),
    )
    return x * by_c, x * by_o, -x * x * by_x


@_M.defjvp
def _M_jvp(primals, tangents):
    theta_c, theta_o, v = primals
    value, D = _M(*primals), theta_o - theta_c
    slopes = _log_M_derivatives(
        inclination(theta_c),
        inclination(theta_o),
        jnp.sin(D),
        2 * jnp.sin(D / 2) ** 2,
        v,
    )
    return value, value * sum(s * t for s, t in zip(slopes, tangents, strict=True))


def versine(cone: Inclination, out: Inclination) -> Floats:
    """1 - cos of the difference of two angles."""
    by_sin, by_cos = out.sin - cone.sin, out.cos - cone.cos
    return (by_sin * by_sin + by_cos * by_cos) / 2


def slopes(cone: Inclination, out: Inclination, v: Floats) -> tuple[Floats, ...]:
    """Derivatives of log M along the circles of both angles, and in v."""
    sin_D = out.sin * cone.cos - out.cos * cone.sin
    return _log_M_derivatives(cone, out, sin_D, versine(cone, out), v)


def turning(of: Inclination, moved: Inclination) -> Floats:
    """What a tangent of sine and cosine is along the circle."""
    return of.cos * moved.sin - of.sin * moved.cos


@jax.custom_jvp
def M_around(cone: Inclination, out: Inclination, of: Width) -> Floats:
    """`M` from sines and cosines, which it knows as well as they do the angles.

    Derivatives are those along the circles of both.
    """
    x = 1 / of.v
    E = -x * versine(cone, out)
    return density(E, x * cone.cos * out.cos, x / of.within)


@M_around.defjvp
def _M_around_jvp(primals, tangents):
    """The tangent of a width is that of v."""
    (cone, out, of), (dcone, dout, dof) = primals, tangents
    value = M_around(*primals)
    turns = [turning(cone, dcone), turning(out, dout), dof.v]
    each = zip(slopes(cone, out, of.v), turns, strict=True)
    return value, value * sum(s * t for s, t in each)


def M(theta_cone: Reals, theta_o: Reals, v: Reals) -> Floats:
    """Longitudinal density around the specular cone of inclination theta_cone.

    M = csch(1/v)/(2v) exp(sin theta_cone sin theta_o/v)
        I0(cos theta_cone cos theta_o/v),
    evaluated as exp(E + |a| - a) I0e(a)/(-v expm1(-2/v)) with
    E = -2 sin^2((theta_o - theta_cone)/2)/v and a = cos theta_cone cos theta_o/v: one
    form for every v, with first and second derivatives of their own. Relative error
    within (4 + 2|E|) eps for v in [1e-8, 1e4]. Symmetric in the two angles, and
    unchanged if a cone past the pole is folded back.

    Args:
        theta_cone: inclination of the cone in radians; -theta_i without tilt.
        theta_o: outgoing inclination in radians, [-pi/2, pi/2].
        v: variance beta^2 in radians^2, > 0.

    Returns:
        Density with int M cos(theta_o) dtheta_o = 1 over [-pi/2, pi/2], finite at the
        poles; shape of the broadcast, dtype of the angles.

    Reference: d'Eon et al. 2013, eq. 5, without its factor 1/cos(theta_o); that factor
    goes with a second cosine in the measure.
    """
    theta_cone, theta_o, v = floats((theta_cone, theta_o), (v,))
    return _M(theta_cone, theta_o, v)


def open_unit(u: Floats) -> Floats:
    """Centers of the cells of a uniform number of [0, 1): a number in (0, 1)."""
    eps = jnp.finfo(u.dtype).eps
    return jnp.minimum(u + eps / 2, 1 - eps / 2)


def sample_around(cone: Inclination, of: Width, u0: Floats, u1: Floats) -> Inclination:
    """`sample_M` as sine and cosine, differentiable at beta = sqrt(v) = 0."""
    depth = -numerics.log1p(-open_unit(u0) * of.within)
    w = jnp.minimum(of.v * depth, 2)  # 1 - cosine of the angle off the cone
    s = of.beta * numerics.sqrt(depth * (2 - w))
    sin, cos = sin_cos(2 * jnp.pi * u1)
    along = (1 - w) * cone.sin + s * cos * cone.cos
    out = (1 - w) * cone.cos - s * cos * cone.sin
    across = s * sin
    return Inclination(along, numerics.sqrt(out * out + across * across))


def sample_cone(theta_c: Floats, beta: Floats, u0: Floats, u1: Floats) -> Floats:
    """`sample_M` in terms of beta = sqrt(v), differentiable at beta = 0."""
    return jnp.atan2(*sample_around(inclination(theta_c), width(beta), u0, u1))


def sample_M(theta_cone: Reals, v: Reals, u: Reals) -> Floats:
    """An inclination drawn from M exactly: the density of theta_o is M cos(theta_o).

    The cosine of the angle off the cone is 1 + v log(1 - xi (1 - exp(-2/v))), the
    azimuth around the cone's direction 2 pi u1; theta_o is the inclination of that
    point. Evaluated through w = 1 - cosine and an atan2, accurate as v -> 0.

    Args:
        theta_cone: inclination of the cone in radians.
        v: variance in radians^2, > 0.
        u: uniform numbers in [0, 1), shape (..., 2). The first is moved to the center
            of its cell of width eps, so that 0 and 1 - eps/2 are allowed.

    Returns:
        theta_o in radians, [-pi/2, pi/2], shape broadcast(theta_cone, v, u[..., 0]),
        dtype of theta_cone.

    Raises:
        ValueError: the last axis of u is not 2.

    Reference: d'Eon et al. 2013, eq. 6 and 7; Jakob 2012 for the form in xi.
    """
    last_axis(2, u=u)
    theta_cone, v, u = floats((theta_cone,), (v, u))
    return sample_cone(theta_cone, jnp.sqrt(v), u[..., 0], u[..., 1])
