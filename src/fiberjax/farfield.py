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

import jax

from fiberjax._types import Floats, Reals, choice, lobe_number
from fiberjax.auto import DEFAULT
from fiberjax.azimuthal import drop_color
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import Fiber
from fiberjax.model import Attenuations, Model, longitudinal, prepare
from fiberjax.rules import Rule
from fiberjax.section import colorless
from fiberjax.selection import DEFAULT_STRATEGY, STRATEGIES, direction_weights


def _scattered(model: Model, fiber: Fiber, parts, weights, section, *angles) -> Floats:
    """Sum over parts of M times the azimuthal integral of their weights."""
    theta_i, theta_o, phi = angles
    along = longitudinal(model, fiber, parts, theta_i, theta_o)
    seen = [model.seen(fiber, *both) for both in zip(parts, along, strict=True)]
    detector = DETECTORS[model.detector]
    return model.rule.total(seen, weights, phi, section, detector)


def scattered(model: Model, fiber: Fiber, parts, theta_i, theta_o, phi) -> Floats:
    """Sum of M N over some parts of the model, with a color axis."""
    section = model.section(fiber, theta_i, theta_o)
    weights = Attenuations(model, parts, section)
    return _scattered(model, fiber, parts, weights, section, theta_i, theta_o, phi)


def evaluate_model(model: Model, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    """`evaluate` by static choices of any kind."""
    value = scattered(model, fiber, model.parts, theta_i, theta_o, phi)
    return drop_color(value, fiber.sigma_a)


_evaluate = jax.jit(evaluate_model, static_argnames="model")


def pdf_model(model: Model, strategy, fiber: Fiber, theta_i, theta_o, phi) -> Floats:
    """`pdf` by static choices of any kind."""
    section = model.section(fiber, theta_i, theta_o)
    if strategy != "lobe_first":
        joint, factor = direction_weights(model, strategy, fiber, theta_i, theta_o)
        detector = DETECTORS[model.detector]
        seen = [model.seen(fiber, part, factor) for part in model.parts]
        return model.rule.total(seen, joint, phi, section, detector)[..., 0]

    def weights(offset):
        probability, _ = model.selection(fiber, theta_i, offset)
        return [colorless(probability[..., k]) for k in range(len(model.parts))]

    angles = theta_i, theta_o, phi
    return _scattered(model, fiber, model.parts, weights, section, *angles)[..., 0]


_pdf = jax.jit(pdf_model, static_argnames=("model", "strategy"))


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
    strategy: str = DEFAULT_STRATEGY,
) -> Floats:
    """Probability density, per steradian, with which `sample` chooses a direction.

    1/2 int sum_q W_q(h) D(phi - Phi(q, h)) dh, with what `sample` calls w, P and r:

        lobe_first   W_q = w_q M_q: `evaluate` with w in place of A
        lobe_again   W_q = (sum_p w_p M_p) P_q
        guided       W_q = r (sum_p w_p M_p) P_q

    int pdf d omega_o = 1, and the mean weight of samples that leave in one direction is
    evaluate/pdf there.

    Args:
        fiber, theta_i, theta_o, phi: as in `evaluate`.
        lobes, rest, rule, detector, incidence, strategy: static, as given to `sample`.

    Returns:
        Density per steradian, shape broadcast(angles); no color axis.

    Raises:
        ValueError: as `evaluate`.

    Reference: d'Eon et al. 2013, section 3.5. The single-root form given there for R
    and TT holds only without azimuthal roughness: `pdf_smooth`.
    """
    choice("strategy", strategy, STRATEGIES)
    model = Model(lobes, rest, rule, detector, incidence)
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _pdf(model, strategy, fiber, *angles)
