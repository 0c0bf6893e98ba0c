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

from fiberjax._types import Floats, Reals, lobe_number
from fiberjax.azimuthal import drop_color
from fiberjax.circular import DETECTORS, TURN
from fiberjax.fiber import Fiber
from fiberjax.model import Model, longitudinal, prepare
from fiberjax.rules import DEFAULT, Rule


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
        along = longitudinal(model, fiber, part, theta_i, theta_o)[..., None]
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
    model = Model((lobe_number("p", p),), False, rule, detector, incidence)
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
