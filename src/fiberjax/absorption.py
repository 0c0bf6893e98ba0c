"""Absorption per fiber radius: by pigments, colors, millimeters, or a fiber's albedo.

    from_melanin   concentrations of eumelanin and pheomelanin
    from_color     Chiang's inversion: the color of a whole assembly of hair
    zeta           Karis' C: what one pass through the middle leaves is C^(1/2)
    solve          the color of a single fiber, exactly
    per_radius     absorption per millimeter, and a radius

They mean different things by a color. Chiang's fit is to hair that light meets many
times: with C = .1, b = .3, one fiber of the default widths scatters .759 of the light
at normal incidence. With Karis' C = .1, which is the color of TT, it scatters .378.
figures/absorption compares them.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jax.core import Tracer

from fiberjax._types import Floats, Reals, floats
from fiberjax.auto import DEFAULT
from fiberjax.azimuthal import check_color
from fiberjax.energy import albedo
from fiberjax.fiber import Fiber, cast
from fiberjax.model import Model
from fiberjax.pigment import chiang_sigma_a as from_color
from fiberjax.pigment import melanin as from_melanin
from fiberjax.quadrature import gauss_legendre
from fiberjax.shading import PASS

__all__ = ["from_color", "from_melanin", "per_radius", "reach", "solve", "zeta"]

_INCLINATIONS = 64
_STEPS = 64
"""At most. Newton's method takes up to 12, and all where rounding is left of C - R."""


def zeta(color: Reals) -> Floats:
    """Absorption of a hair of Karis' base color: sigma_a = -ln(C)/4.

    One pass through its middle, 2 radii long, leaves C^(1/2) of the light.

    Args:
        color: C in (0, 1] of each channel.

    Returns:
        sigma_a per radius, shape and dtype of the color; infinite for black.

    Reference: Karis 2016, whose zeta(C), in T = exp(-zeta(C) cos gamma_t/cos theta_d),
    is 2 sigma_a; his path is over cos theta_d, where light goes over cos theta_t.
    """
    (color,) = floats((color,))
    return -jnp.log(color) / PASS


def per_radius(sigma_a_per_mm: Reals, radius_mm: Reals) -> Floats:
    """Absorption per fiber radius from that per millimeter: their product.

    Args:
        sigma_a_per_mm: absorption per millimeter, >= 0.
        radius_mm: radius of the fiber in millimeters, > 0; .02 to .05 of scalp hair.

    Returns:
        sigma_a as `Fiber` takes it, shape of the broadcast, dtype of sigma_a_per_mm.
    """
    sigma_a_per_mm, radius_mm = floats((sigma_a_per_mm,), (radius_mm,))
    return sigma_a_per_mm * radius_mm


def _split(model: Model, fiber: Fiber, sigma_a: Floats, theta_i) -> tuple[Floats, ...]:
    """What R scatters, and what all others do, by color: a sum, not a difference."""
    mean = theta_i is None
    x, w = gauss_legendre(_INCLINATIONS)
    at = np.pi / 2 * x
    parts = albedo(
        replace(fiber, sigma_a=sigma_a),
        jnp.asarray(at, sigma_a.dtype) if mean else theta_i,
        lobes=model.lobes,
        rest=model.rest,
        incidence=model.incidence,
        per_lobe=True,
    )
    if mean:
        weight = jnp.asarray(w * np.cos(at) ** 2, sigma_a.dtype)
        parts = (weight[:, None] * parts).sum(1)
    is_R = np.array(model.parts) == 0
    return parts[is_R].sum(0), parts[~is_R].sum(0)


@partial(jax.jit, static_argnames="model")
def _reach(model: Model, fiber: Fiber, theta_i) -> tuple[Floats, Floats]:
    (low,), (inside,) = _split(model, fiber, jnp.zeros((1,), fiber.eta.dtype), theta_i)
    return low, low + inside


@partial(jax.jit, static_argnames="model")
def _solve(model: Model, fiber: Fiber, color: Floats, theta_i):
    """sigma_a of a vector of colors, and the ends of what can be reached."""
    low, high = _reach(model, fiber, theta_i)
    eps = float(jnp.finfo(color.dtype).eps)
    reachable = (color > low) & (color <= high * (1 + 16 * eps))
    asked = jnp.where(reachable, color, (low + high) / 2)

    def residual(sigma_a, given):
        fiber, asked, theta_i = given
        R, inside = _split(model, fiber, sigma_a, theta_i)
        return jnp.log(inside) - jnp.log(asked - R)

    # Newton's steps double the digits: the last one is from half of them.
    tolerance = eps**0.45
    found = optx.root_find(
        residual,
        optx.Newton(tolerance, tolerance),
        jnp.zeros_like(asked),
        (fiber, asked, theta_i),
        max_steps=_STEPS,
        tags=frozenset({lx.diagonal_tag}),
        throw=False,
    ).value
    # The clear fiber itself may come out a rounding below 0.
    found = found - jax.lax.stop_gradient(jnp.minimum(found, 0))
    return jnp.where(reachable, found, jnp.nan), low, high


def _prepare(fiber: Fiber, theta_i, lobes, rest, incidence, *colors: Reals):
    model = Model(lobes, rest, DEFAULT, "normal", incidence)
    if model.parts == (0,):
        raise ValueError(f"lobes = {lobes}: must name a lobe that is absorbed, p >= 1")
    given = () if theta_i is None else (theta_i,)
    fiber = replace(fiber, sigma_a=None)
    *arrays, eta = floats((*given, *colors), (fiber.eta,))
    at = arrays.pop(0) if given else None
    if at is not None and at.ndim:
        raise ValueError(f"theta_i has shape {at.shape}: must be (); use jax.vmap")
    return model, cast(fiber, eta.dtype), at, arrays


def reach(
    fiber: Fiber,
    theta_i: Reals | None = None,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
    rest: bool = True,
    incidence: str = "theta_d",
) -> tuple[Floats, Floats]:
    """The albedos that absorption can give a fiber: R's, and that of the clear fiber.

    Args:
        fiber, theta_i, lobes, rest, incidence: as in `solve`.

    Returns:
        (low, high), numbers; low is only tended to, as sigma_a grows.

    Raises:
        ValueError: as `solve`, but for the color.
    """
    model, fiber, at, _ = _prepare(fiber, theta_i, lobes, rest, incidence)
    return _reach(model, fiber, at)


def solve(
    fiber: Fiber,
    color: Reals,
    theta_i: Reals | None = None,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
    rest: bool = True,
    incidence: str = "theta_d",
) -> Floats:
    """The sigma_a at which the albedo of one fiber is a color: albedo(sigma_a) = C.

    Each channel alone, by Newton's method on log(albedo - R) - log(C - R), from
    sigma_a = 0. What is not reflected is a sum of exponentials of sigma_a with positive
    weights: its logarithm is convex, and the steps approach the root from one side
    without fail. Derivatives are those of the implicit function.

    Without theta_i the albedo is the mean 2/pi int albedo cos^2(theta_i) dtheta_i: what
    a fiber scatters of the light of surroundings that are equally bright everywhere,
    for a cosine goes with solid angle and another with the width that it shows. The
    mean is right within 1e-7 for beta_m >= .02, eta >= 1.05, |alpha| <= .1.

    Args:
        fiber: one fiber; its sigma_a is not used.
        color: albedo C asked for, shape () or (C,), above R's albedo and not above that
            of the clear fiber, which `reach` returns.
        theta_i: inclination of the given direction in radians, a number; None for the
            mean over all.
        lobes, rest, incidence: static, as in `fiberjax.albedo`.

    Returns:
        sigma_a per radius, shape of the color, dtype of color and theta_i. Inside jit,
        vmap or grad, where values are not known, NaN for a color out of reach.

    Raises:
        ValueError: a color out of reach, with the range; lobes without absorption;
            shapes.
    """
    model, fiber, at, (color,) = _prepare(fiber, theta_i, lobes, rest, incidence, color)
    check_color("color", color)
    found, low, high = _solve(model, fiber, jnp.atleast_1d(color), at)
    if not isinstance(found, Tracer) and np.isnan(found).any():
        bad = np.atleast_1d(color)[np.isnan(found)][0]
        raise ValueError(
            f"color = {bad}: must lie in ({low:.6g}, {high:.6g}], from what R scatters "
            "to what the clear fiber does"
        )
    return found.reshape(color.shape)
