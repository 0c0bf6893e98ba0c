"""The limit of vanishing azimuthal roughness."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals
from fiberjax.circular import TURN, wrap
from fiberjax.crossings import offset_at
from fiberjax.fiber import Fiber
from fiberjax.model import Model, longitudinal, prepare
from fiberjax.path import deflection_slope, eta_prime
from fiberjax.rules import DEFAULT, Rule


def _root(inclination: Floats, fiber: Fiber, half: Floats) -> tuple[Floats, Any]:
    """gamma of the TT ray that leaves at |phi| = 2 half, and whether there is one.

    tan gamma = eta' sin b/(eta' cos b - 1), b = (pi - |phi|)/2.
    """
    eta_p = eta_prime(inclination, fiber.eta)
    b = jnp.pi / 2 - half
    ahead = eta_p * jnp.cos(b) - 1
    lit = ahead > 0
    gamma = jnp.atan2(eta_p * jnp.sin(b), jnp.where(lit, ahead, 1))
    return jnp.where(lit, gamma, 0), lit


@partial(jax.jit, static_argnames="model")
def _pdf_smooth(model: Model, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    inclination = model.inclination(theta_i, theta_o)
    half = jnp.abs(wrap(phi)) / 2
    total = jnp.zeros((), phi.dtype)
    for k, part in enumerate(model.parts):

        def chosen(offset, k=k):
            return model.selection(fiber, theta_i, offset)[0][..., k, None]

        if part == model.tail:
            around = model.rule.average(chosen, inclination, fiber.eta)[..., 0] / TURN
        else:
            gamma, lit = (half, True) if part == 0 else _root(inclination, fiber, half)
            offset = offset_at(gamma)
            slope = jnp.abs(deflection_slope(part, offset, inclination, fiber.eta))
            density = offset.cos / (2 * jnp.where(lit, slope, 1))
            around = jnp.where(lit, density * chosen(offset)[..., 0], 0)
        total = total + longitudinal(model, fiber, part, theta_i, theta_o) * around
    return total


def pdf_smooth(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    lobes: tuple[int, ...] = (0, 1),
    rest: bool = False,
    rule: Rule = DEFAULT,
    incidence: str = "theta_d",
) -> Floats:
    """The limit of `pdf` as beta_n -> 0, in closed form for R and TT.

    Each lobe has one root h of Phi(p, h) = phi, and contributes
    M_p w_p(h) |dh/dphi|/2. For beta_n > 0 it is not the density of `sample`. TT has no
    root, and no density, where |phi| < 2 asin(1/eta').

    Args:
        fiber: one fiber; beta_n is not used.
        theta_i, theta_o, phi: as in `evaluate`.
        lobes: R and TT, (0, 1), (0,) or (1,).
        rest, rule, incidence: static, as given to `sample`.

    Returns:
        Density per steradian, shape broadcast(angles).

    Raises:
        ValueError: a lobe other than 0 and 1, and as `evaluate`.

    Reference: d'Eon et al. 2013, section 3.5.
    """
    model = Model(lobes, rest, rule, "normal", incidence)
    if max(model.lobes) > 1:
        raise ValueError(f"lobes = {model.lobes}: must be 0 (R) and 1 (TT)")
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _pdf_smooth(model, fiber, *angles)
