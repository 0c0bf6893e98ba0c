"""The far-field model: S cos(theta_o) of a fiber thinner than what sees it.

S = sum_p M_p N_p. Every function takes a `Fiber` first, angles that broadcast like
NumPy arrays, and the same static choices as keywords:

    lobes      the lobes p that are told apart; default R, TT, TRT
    rest       whether all lobes above the highest of them are added in closed form, as
               one untilted lobe of the last width, uniform in azimuth
    rule       how to integrate over the offset h
    detector   density in azimuth, "normal" (d'Eon) or "logistic" (Chiang)
    incidence  angle at which attenuations and eta' are taken: "theta_d" (d'Eon 2013)
               or "theta_i" (Chiang 2016)

theta_i belongs to the direction that is given, theta_o to the one that is scattered
into. A path tracer that walks from the camera passes the direction towards the camera
as theta_i and the one towards the light as theta_o; a light tracer the reverse. With
incidence="theta_d" and no tilt both give the same value; tilt and "theta_i" are not
symmetric.
"""

from functools import partial

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats
from fiberjax.azimuthal import drop_color
from fiberjax.circular import DETECTORS, TURN, wrap
from fiberjax.fiber import Fiber, cast, cone, fold
from fiberjax.model import Model
from fiberjax.path import Offset, eta_prime
from fiberjax.quadrature import gauss_legendre_unit, weighted_sum
from fiberjax.rules import DEFAULT, Rule
from fiberjax.spherical import M


def prepare(fiber: Fiber, *angles: Reals) -> tuple[Fiber, list[Floats]]:
    """The fiber and the angles in one dtype, that of the angles."""
    arrays = floats(angles, tuple(jax.tree.leaves(fiber)))[: len(angles)]
    return cast(fiber, arrays[0].dtype), arrays


def _longitudinal(model: Model, fiber: Fiber, part, theta_i, theta_o) -> Floats:
    shape = model.shape(fiber, part)
    return M(cone(theta_i, shape), theta_o, shape.beta_m**2)


def _around(model: Model, fiber: Fiber, part, weight, phi, inclination) -> Floats:
    """Azimuthal integral of weight(offset) for one part, with a color axis."""
    if part == model.tail:
        return model.rule.average(weight, inclination, fiber.eta) / TURN
    seen, beta_n = DETECTORS[model.detector], model.shape(fiber, part).beta_n

    def density(x):
        return seen.density(x, beta_n)

    return model.rule.convolve(
        weight, part, phi, inclination, fiber.eta, density, seen.kink
    )


def _scattered(model: Model, fiber: Fiber, weight, theta_i, theta_o, phi) -> Floats:
    """Sum over parts of M times the azimuthal integral of weight(part, offset)."""
    inclination = model.inclination(theta_i, theta_o)

    def scattered(part):
        along = _longitudinal(model, fiber, part, theta_i, theta_o)[..., None]
        of_part = partial(weight, part, inclination)
        return along * _around(model, fiber, part, of_part, phi, inclination)

    return sum(map(scattered, model.parts[1:]), scattered(model.parts[0]))


@partial(jax.jit, static_argnames="model")
def _evaluate(model: Model, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    def weight(part, inclination, offset):
        return model.attenuation(fiber, part, offset, inclination)

    value = _scattered(model, fiber, weight, theta_i, theta_o, phi)
    return drop_color(value, fiber.sigma_a)


@partial(jax.jit, static_argnames="model")
def _pdf(model: Model, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    def weight(part, inclination, offset):
        probability, _ = model.selection(fiber, theta_i, offset)
        return probability[..., model.parts.index(part), None]

    return _scattered(model, fiber, weight, theta_i, theta_o, phi)[..., 0]


def evaluate(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
    rest: bool = True,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Floats:
    """Scattered throughput per steradian, S cos(theta_o).

    sum_p M(theta_cone_p, theta_o, v_p) N_p(phi, theta_d), theta_cone_p = -theta_i +
    tilt, plus A_rest M(-theta_i, theta_o, v_last)/(2 pi). Its integral over the
    directions of theta_o is `albedo(fiber, theta_i)`. The BCSDF of the papers without
    the cosine is this divided by cos(theta_o).

    Args:
        fiber: one fiber; jax.vmap makes many.
        theta_i: inclination of the given direction in radians, [-pi/2, pi/2]. A path
            tracer that walks from the camera passes the direction towards the camera.
        theta_o: inclination of the direction scattered into, radians, [-pi/2, pi/2].
        phi: azimuth phi_o - phi_i in radians, any real.
        lobes, rest, rule, detector, incidence: static, see the module.

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles) + sigma_a.shape, dtype of
        the angles.

    Raises:
        ValueError: a field of the fiber has the wrong shape, or a choice is unknown.

    Reference: d'Eon et al. 2013. There M has a factor 1/cos(theta_o) that is paired
    with cos^2 in the measure; Chiang et al. 2016 have neither.
    """
    model = Model(lobes, rest, rule, detector, incidence)
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _evaluate(model, fiber, *angles)


def lobe(
    fiber: Fiber,
    p: int,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Floats:
    """One lobe of `evaluate`: M_p N_p.

    Args:
        fiber: one fiber.
        p: number of internal segments, a static integer >= 0.
        theta_i, theta_o, phi: as in `evaluate`.
        rule, detector, incidence: static, see the module.

    Returns:
        M_p N_p per steradian, shape broadcast(angles) + sigma_a.shape.

    Raises:
        ValueError: as `evaluate`.
    """
    model = Model((p,), False, rule, detector, incidence)
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _evaluate(model, fiber, *angles)


def pdf(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    lobes: tuple[int, ...] = (0, 1, 2),
    rest: bool = True,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Floats:
    """Probability density, per steradian, with which `sample` chooses a direction.

    sum_p M_p 1/2 int w_p(h) D(phi - Phi(p, h)) dh, w_p the probability of choosing lobe
    p at offset h: `evaluate` with w in place of A. int pdf d omega_o = 1, and the mean
    weight of samples that leave in one direction is evaluate/pdf there.

    Args:
        fiber, theta_i, theta_o, phi: as in `evaluate`.
        lobes, rest, rule, detector, incidence: static, as given to `sample`.

    Returns:
        Density per steradian, shape broadcast(angles); no color axis.

    Raises:
        ValueError: as `evaluate`.

    Reference: d'Eon et al. 2013, section 3.5. The single-root form given there for R
    and TT holds only without azimuthal roughness: `pdf_smooth`.
    """
    model = Model(lobes, rest, rule, detector, incidence)
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _pdf(model, fiber, *angles)


@partial(jax.jit, static_argnames="model")
def _pdf_smooth(model: Model, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    inclination = model.inclination(theta_i, theta_o)
    eta_p = eta_prime(inclination, fiber.eta)
    half = jnp.abs(wrap(phi)) / 2
    total = jnp.zeros((), phi.dtype)
    for k, part in enumerate(model.parts):
        along = _longitudinal(model, fiber, part, theta_i, theta_o)

        def chosen(gamma, k=k):
            offset = Offset(gamma, jnp.sin(gamma), jnp.cos(gamma))
            return model.selection(fiber, theta_i, offset)[0][..., k]

        if part == model.tail:
            around = (
                model.rule.average(
                    lambda offset, k=k: model.selection(fiber, theta_i, offset)[0][
                        ..., k, None
                    ],
                    inclination,
                    fiber.eta,
                )[..., 0]
                / TURN
            )
        elif part == 0:
            around = jnp.cos(half) / 4 * chosen(half)
        else:
            b = jnp.pi / 2 - half
            lit = eta_p * jnp.cos(b) > 1
            gamma = jnp.atan2(eta_p * jnp.sin(b), eta_p * jnp.cos(b) - 1)
            gamma = jnp.where(lit, gamma, 0)
            cos_t = numerics.sqrt(1 - (jnp.sin(gamma) / eta_p) ** 2)
            slope = 2 - 2 * jnp.cos(gamma) / (eta_p * cos_t)
            around = jnp.where(lit, jnp.cos(gamma) / (2 * slope) * chosen(gamma), 0)
        total = total + along * around
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


_REACH = 9.0
"""Half-width of the range of theta_o in units of beta: exp(-_REACH^2/2) is 3e-18."""
_INCLINATIONS = 64


def _part_albedo(model: Model, fiber: Fiber, part, theta_i) -> Floats:
    """Energy of one part: the mean of 1/2 int A dh under M cos(theta_o)."""

    def around(inclination):
        def weight(offset):
            return model.attenuation(fiber, part, offset, inclination)

        return model.rule.average(weight, inclination, fiber.eta)

    if model.incidence == "theta_i":
        return around(theta_i)
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
        along = M(cone(theta_i, shape), theta_o, shape.beta_m**2) * jnp.cos(theta_o)
        energy = around(model.inclination(theta_i, theta_o))
        return ((high - low) * w * along)[..., None] * energy

    return weighted_sum(term, gauss_legendre_unit(_INCLINATIONS), theta_i.dtype)


@partial(jax.jit, static_argnames=("model", "per_lobe"))
def _albedo(model: Model, fiber: Fiber, theta_i, per_lobe) -> Floats:
    parts = [_part_albedo(model, fiber, part, theta_i) for part in model.parts]
    value = jnp.stack(parts) if per_lobe else sum(parts[1:], parts[0])
    return drop_color(value, fiber.sigma_a)


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
    with the usual widths it lies between .72 and 1.13 (see figures/furnace). This is
    the model as published: nothing is renormalized.

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
    return _albedo(model, fiber, theta_i, bool(per_lobe))
