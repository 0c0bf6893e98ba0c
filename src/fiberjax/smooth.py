"""The limit of vanishing azimuthal roughness."""

from functools import partial

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, lobe_number
from fiberjax.auto import DEFAULT
from fiberjax.azimuthal import check_sigma_a, drop_color
from fiberjax.circular import TURN
from fiberjax.fiber import Fiber
from fiberjax.model import Model, longitudinal, prepare
from fiberjax.roots import Rays, rays
from fiberjax.rules import Rule
from fiberjax.section import Light, colorless, ray, section


def _per_radian(rays: Rays, weight: Light) -> Floats:
    """Sum over rays of weight/(2 |dPhi/dh|), with a trailing color axis."""
    light = weight.stacked() * (rays.offset.cos / 2)[..., None]
    density = numerics.quotient(light, rays.slope[..., None], jnp.inf)
    return jnp.where(rays.exists[..., None], density, 0).sum(0)


@partial(jax.jit, static_argnames="p")
def _N_smooth(p, phi, theta_d, eta, sigma_a):
    here = section(theta_d, eta, sigma_a)
    found = rays(p, phi, here)
    value = _per_radian(found, ray(found.offset, here).A(p))
    return drop_color(value, sigma_a)


def N_smooth(
    p: int, phi: Reals, theta_d: Reals, *, eta: Reals, sigma_a: Reals | None
) -> Floats:
    """Azimuthal scattering function of lobe p of a smooth fiber, per radian.

    N_p(phi) = sum over the `roots` of A(p, h)/(2 |dPhi/dh|), the limit of `N` as
    beta_n -> 0; evaluated as A cos gamma/(2 |dPhi/dgamma|), h = sin gamma. It is 0
    where no ray exists. It grows as x^(-1/2) at a distance x from a caustic, on its lit
    side, and is infinite on it, or as large as the rounding of phi lets it be; a rough
    fiber has a peak there in proportion to beta_n^(-1/2). TT of eta = 1 is infinite at
    phi = pi, where all its light goes.

    Args:
        p: number of internal segments, a static integer >= 0.
        phi: azimuth phi_o - phi_i in radians, any real.
        theta_d: difference angle (theta_o - theta_i)/2 in radians, [-pi/2, pi/2].
        eta: index of refraction, >= 1; broadcasts with the angles.
        sigma_a: absorption per fiber radius, >= 0, shape () or (C,); None if clear.

    Returns:
        Density per radian, shape broadcast(angles) + sigma_a.shape, dtype of the
        angles. Derivatives are those of the function between its caustics and edges,
        0 where no ray exists, and of no use on a caustic.

    Raises:
        ValueError: p negative or not static, sigma_a of more than one axis.

    Reference: Marschner et al. 2003.
    """
    p = lobe_number("p", p)
    phi, theta_d, eta, *sigma = floats(
        (phi, theta_d), (eta,) if sigma_a is None else (eta, sigma_a)
    )
    sigma_a = sigma[0] if sigma else None
    check_sigma_a(sigma_a)
    return _N_smooth(p, phi, theta_d, eta, sigma_a)


@partial(jax.jit, static_argnames="model")
def _pdf_smooth(model: Model, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    here = model.section(fiber, theta_i, theta_o)
    along = longitudinal(model, fiber, model.parts, theta_i, theta_o)
    total = jnp.zeros((), phi.dtype)
    for k, part in enumerate(model.parts):

        def chosen(offset, k=k):
            return colorless(model.selection(fiber, theta_i, offset)[0][..., k])

        if part == model.tail:
            around = model.rule.average(chosen, here)[..., 0] / TURN
        else:
            found = rays(part, phi, here)
            around = _per_radian(found, chosen(found.offset))[..., 0]
        total = total + along[k] * around
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
    """The limit of `pdf` of "lobe_first" as beta_n -> 0, in closed form for R and TT.

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
