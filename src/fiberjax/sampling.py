"""Importance sampling of the far-field model."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int

from fiberjax._types import Floats, Reals, choice, floats, last_axis
from fiberjax.auto import DEFAULT
from fiberjax.azimuthal import drop_color
from fiberjax.circular import TURN, wrap
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import Fiber, cast, cone
from fiberjax.model import Model, entry, positive
from fiberjax.rules import Rule
from fiberjax.section import ray, refraction
from fiberjax.selection import (
    DEFAULT_STRATEGY,
    STRATEGIES,
    draw_offset,
    first_choice,
    pick,
    scaled,
    second_choice,
)
from fiberjax.spherical import M, open_unit, sample_cone

GRADIENTS = ("reparameterized", "detached")


class Sample(NamedTuple):
    """A sampled direction.

    theta_o in radians, [-pi/2, pi/2]; phi in radians, [-pi, pi]; weight, an unbiased
    estimate of evaluate/pdf, with the color axis of sigma_a; p, the lobe it left by,
    P = max(lobes) + 1 for the rest.
    """

    theta_o: Floats
    phi: Floats
    weight: Floats
    p: Int[Array, "..."]


def _ratio(x: Floats) -> Floats:
    """1, with the derivative of log x."""
    return x / jax.lax.stop_gradient(x)


def clamped(clamp: Any) -> float | None:
    """The clamp as a number, or None; ValueError unless it is one above 0."""
    if clamp is None:
        return None
    try:
        bound = float(clamp)
    except (TypeError, ValueError) as error:  # tracers raise it too
        raise ValueError(f"clamp = {clamp!r}: must be a number > 0") from error
    if not bound > 0:
        raise ValueError(f"clamp = {clamp!r}: must be > 0")
    return bound


def sample_model(model: Model, strategy, gradient, fiber: Fiber, theta_i, u, clamp):
    """`sample` by static choices of any kind."""
    shape = jnp.broadcast_shapes(theta_i.shape, u.shape[:-1])
    detached, again = gradient == "detached", strategy != "lobe_first"

    def position(x):
        return jax.lax.stop_gradient(x) if detached else x

    drawn = draw_offset(model, strategy, fiber, theta_i, u[..., 0])
    offset, density = position(drawn)
    probability, alive = first_choice(model, strategy, fiber, theta_i, offset)
    first = jax.lax.stop_gradient(probability)
    index, left = pick(first, u[..., 1])

    shapes = [model.shape(fiber, part) for part in model.parts]
    cones = jnp.stack([cone(theta_i, s) for s in shapes], -1)
    cones = jnp.broadcast_to(cones, (*shape, len(shapes)))
    beta_m = jnp.stack([s.beta_m for s in shapes])
    beta_n = jnp.stack([s.beta_n for s in shapes])
    beta_m = positive(beta_m) if again else beta_m
    theta_o = position(
        sample_cone(entry(cones, index), beta_m[index], u[..., 2], u[..., 3])
    )

    section = model.section(fiber, theta_i, theta_o)
    one = ray(offset, section)
    if again:
        along, _ = scaled(M(cones, theta_o[..., None], beta_m**2))
        mixture = (first * along).sum(-1) * density
        probability, alive = second_choice(model, along, one)
        second = jax.lax.stop_gradient(probability)
        index, _ = pick(second, left)
        # With M and theta_o alive, and both probabilities held, this is unbiased.
        # Dividing by 1 rather than by the mixture keeps 1/mixture^2 finite.
        held = jax.lax.stop_gradient(mixture)
        share = entry(along, index) / held
        share = share if detached else share / _ratio(mixture)
        share = share / entry(second, index)
    else:
        share = 1 / entry(first, index)
        if detached:
            share = share * _ratio(M(entry(cones, index), theta_o, beta_m[index] ** 2))

    p = jnp.asarray(model.parts)[index]
    is_rest = p == model.tail
    seen = DETECTORS[model.detector]
    blur = seen.width(beta_n[index])
    turn = p.astype(u.dtype) * (2 * refraction(offset, section) + jnp.pi)
    specular = turn - 2 * offset.gamma
    v = open_unit(u[..., 4])
    phi = wrap(specular + seen.quantile(v, blur))
    phi = position(jnp.where(is_rest, TURN * (v - 0.5), phi))
    if detached:
        # The rest is uniform in azimuth: its score is that of M alone.
        aside = jnp.where(is_rest, 0, phi - specular)
        score = _ratio(seen.density(aside, blur))
        share = share * jnp.where(is_rest, 1, score)

    each = [model.attenuation(q, one).stacked() for q in model.parts]
    attenuation = jnp.stack(jnp.broadcast_arrays(*each), -2)
    chosen = jnp.take_along_axis(attenuation, index[..., None, None], -2)[..., 0, :]
    weight = jnp.where(alive[..., None], share[..., None] * chosen, 0)
    if clamp is not None:
        weight = jnp.minimum(weight, jnp.asarray(clamp, weight.dtype))
    return Sample(theta_o, phi, drop_color(weight, fiber.sigma_a), p)


_sample = jax.jit(sample_model, static_argnames=("model", "strategy", "gradient"))


def sample(
    fiber: Fiber,
    theta_i: Reals,
    u: Reals,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
    rest: bool = True,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
    strategy: str = DEFAULT_STRATEGY,
    gradient: str = "reparameterized",
    clamp: float | None = None,
) -> Sample:
    """A direction drawn from `pdf`, and the weight that makes it estimate `evaluate`.

    The offset h; a lobe p with probability w_p(h); theta_o from M_p, exactly; the lobe
    q that is left by; phi = Phi(q, h) + a deviate of the detector, at the actual
    theta_d. mean(weight f(theta_o, phi)) estimates int evaluate f d omega_o. By
    strategy:

        lobe_first   h is uniform, w_p in proportion to the channel mean of A_p at the
                     specular cone, folded where it has passed a pole; q = p;
                     weight = A_q/w_q. The sampler of d'Eon et al. 2013.
        lobe_again   w_p follows A_p at one inclination for all, the mean one of an M
                     with twice the v of R's; q is chosen anew, by
                     P_q = M_q A_q/(sum_r M_r A_r), channel means of A at the actual
                     theta_d; weight = M_q A_q/(P_q sum_p w_p M_p).
        guided       lobe_again, with h from a density r(h)/2 that follows the light
                     left in all lobes; weight as before, over r.

    The variance of the weight, against that of lobe_first, is in figures/variance.

    Args:
        fiber: one fiber; beta_m = 0 and beta_n = 0 are allowed here. A beta_m below 64
            eps is taken as 64 eps, but by lobe_first.
        theta_i: inclination of the given direction in radians, [-pi/2, pi/2]; the
            direction towards the camera in a path tracer.
        u: uniform numbers in [0, 1), shape (..., 5): offset, lobe, two for M, azimuth.
            Pseudo-random or low-discrepancy; they are moved to the centers of their
            cells, so 0 and 1 - eps/2 are allowed.
        lobes, rest, detector, incidence: static, as in `evaluate`.
        rule: accepted as in `pdf`; nothing is integrated here.
        strategy: static, one of the above.
        gradient: static, what derivatives of an estimate differentiate.
            "reparameterized": positions and weights, with w_p and P_q held fixed; right
            where f is smooth. "detached": positions are held fixed and the weight
            carries the derivative of log density; right for any f. It needs beta well
            above the spacing of the angles, eps: at 1e-4 in float32 it is noise.
        clamp: upper bound of the weights, > 0. With the 2.0 of the paper lobe_first
            loses 30 % of the energy at theta_i = 85 deg and 41 % at 89 deg (beta .6,
            alpha 2.5 deg, clear).

    Returns:
        `Sample` of shape broadcast(theta_i, u[..., 0]). Where no light is left in any
        lobe the weight is 0.

    Raises:
        ValueError: u does not end in an axis of 5, clamp <= 0, and as `evaluate`.

    Reference: d'Eon et al. 2013, sections 3.1 to 3.5; errata: the cone is not folded
    there, and clamping the weights is said to lose no energy.
    """
    model = Model(lobes, rest, rule, detector, incidence)
    choice("strategy", strategy, STRATEGIES)
    choice("gradient", gradient, GRADIENTS)
    last_axis(5, u=u)
    clamp = clamped(clamp)
    theta_i, u = floats((theta_i,), (u,))
    fiber = cast(fiber, theta_i.dtype)
    return _sample(model, strategy, gradient, fiber, theta_i, u, clamp)
