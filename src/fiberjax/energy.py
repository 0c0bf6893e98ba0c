"""How much of the light a fiber scatters."""

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals, flag
from fiberjax.auto import DEFAULT
from fiberjax.azimuthal import drop_color
from fiberjax.fiber import Fiber, cone, fold
from fiberjax.model import Model, longitudinal, prepare
from fiberjax.quadrature import gauss_legendre_unit, weighted_sum
from fiberjax.rules import Rule
from fiberjax.section import ray

_REACH = 9.0
"""Half-width of the range of theta_o in units of beta: exp(-_REACH^2/2) is 3e-18."""
_INCLINATIONS = 64


def _part_albedo(model: Model, fiber: Fiber, part, theta_i) -> Floats:
    """Energy of one part: the mean of 1/2 int A dh under M cos(theta_o)."""

    def around(theta_o):
        section = model.section(fiber, theta_i, theta_o)

        def weight(offset):
            return model.attenuation(part, ray(offset, section))

        return model.rule.average(weight, section)

    if model.incidence == "theta_i":
        return around(-theta_i)
    shape = model.shape(fiber, part)
    center = fold(cone(theta_i, shape))
    # The chord of the sphere is what M falls off with; the cut carries no energy.
    reach = 2 * jnp.arcsin(jnp.minimum(_REACH / 2 * shape.beta_m, 1))
    low, high = (
        jax.lax.stop_gradient(jnp.clip(x, -jnp.pi / 2, jnp.pi / 2))
        for x in (center - reach, center + reach)
    )

    def term(t, w):
        theta_o = low + (high - low) * t
        (along,) = longitudinal(model, fiber, (part,), theta_i, theta_o)
        share = (high - low) * w * along * jnp.cos(theta_o)
        return share[..., None] * around(theta_o)

    return weighted_sum(term, gauss_legendre_unit(_INCLINATIONS), theta_i.dtype)


def albedo_model(model: Model, fiber: Fiber, theta_i, per_lobe) -> Floats:
    """`albedo` by static choices of any kind."""
    parts = [_part_albedo(model, fiber, part, theta_i) for part in model.parts]
    value = jnp.stack(parts) if per_lobe else sum(parts[1:], parts[0])
    return drop_color(value, fiber.sigma_a)


_albedo = jax.jit(albedo_model, static_argnames=("model", "per_lobe"))


def albedo(
    fiber: Fiber,
    theta_i: Reals,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
    rest: bool = True,
    per_lobe: bool = False,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Floats:
    """Fraction of the light of direction theta_i that is scattered: int evaluate.

    sum_p int M_p cos(theta_o) a_p dtheta_o with a_p = 1/2 int A(p, h) dh. With
    incidence="theta_i" a_p does not depend on theta_o and the sum of all lobes is 1 for
    a clear fiber. With "theta_d" it is 1 only if all lobes have one width and no tilt;
    with the usual widths it lies between .723 and 1.135 (eta 1.55, beta_m .05 to .9,
    |alpha| <= 2.5 deg; figures/furnace). This is the model as published: nothing is
    renormalized.

    Args:
        fiber: one fiber.
        theta_i: inclination of the given direction in radians, [-pi/2, pi/2].
        lobes, rest, rule, incidence: static, see the module.
        per_lobe: static; True for a leading axis over the lobes and the rest.
        detector: accepted as in `evaluate`; every detector integrates to 1.

    Returns:
        Albedo, shape theta_i.shape + sigma_a.shape, with an axis of length
        len(lobes) + rest in front if per_lobe.

    Raises:
        ValueError: as `evaluate`.

    Reference: d'Eon et al. 2011, whose "energy-conserving" holds at fixed theta_d.
    """
    model = Model(lobes, rest, rule, detector, incidence)
    fiber, (theta_i,) = prepare(fiber, theta_i)
    return _albedo(model, fiber, theta_i, flag("per_lobe", per_lobe))
