"""Write the tables of exact values that the equations are tested against.

Each point of tests/tables/NAME.json holds arguments that float32 represents exactly,
and to 20 digits the value, the gradient and the Hessian in them, from `reference.py` in
mpmath. A derivative that is infinite, or finite from one side only, is left out.
"""

import argparse
import itertools
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import reference
from reference import mp, mpf

TABLES = Path(__file__).parent / "tables"
POLE = float(np.float32(np.pi / 2))  # just past pi/2
BELOW = float(np.nextafter(np.float32(np.pi / 2), np.float32(0)))
CELL = 2.0**-24  # half of float32's eps
CELLS = 2**23
KINDS = {"p": int, "detector": str}  # static arguments; the others are real


def text(x, digits=20):
    # Rounding may put the argument of an arcsine past 1.
    x = mp.re(x)
    return mp.nstr(x, digits) if x else "0"


def derivatives(f, names, arguments, without=()):
    """Value, gradient and Hessian of `f` as text.

    `without` names the arguments in which it has no derivative.
    """
    value = f(*arguments)
    # Zeros come out as rounding noise, far below 20 digits of anything.
    noise = (abs(value) or 1) * mpf(10) ** -30

    def derivative(*which):
        orders = [which.count(name) for name in names]
        found = mp.diff(f, tuple(arguments), tuple(orders))
        return text(found if abs(found) > noise else 0)

    smooth = [name for name in names if name not in without]
    pairs = itertools.combinations_with_replacement(smooth, 2)
    return {
        "value": text(value),
        "grad": {name: derivative(name) for name in smooth},
        "hess": {f"{one},{two}": derivative(one, two) for one, two in pairs},
    }


def table(f, inputs, without=lambda **_: (), extra=lambda **_: {}):
    """Points of a function: `inputs` are dictionaries of its arguments, in order."""
    for given in inputs:
        given = rounded(given)
        static = {name: x for name, x in given.items() if name in KINDS}
        real = [name for name in given if name not in KINDS]
        arguments = [mpf(given[name]) for name in real]

        def g(*x, static=static, real=real):
            return f(**static, **dict(zip(real, x, strict=True)))

        exact = derivatives(g, real, arguments, without(**given))
        yield {"in": shown(given), **exact, **extra(**given)}


def rounded(given):
    """The arguments with every real one rounded to float32."""
    return {n: x if n in KINDS else float(np.float32(x)) for n, x in given.items()}


def shown(given):
    """The arguments as they are stored."""
    return {n: x if n in KINDS else repr(x) for n, x in given.items()}


def uniform(rng, low, high):
    return float(rng.uniform(low, high))


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def inclinations(rng, count):
    """Both poles, next to them, 0, and the rest at random."""
    edges = [0.0, POLE, -POLE, BELOW, -BELOW, 1.57, -1.5]
    return (edges + [uniform(rng, -1.57, 1.57) for _ in range(count)])[:count]


def make_reflectance(rng):
    etas = [1.0, 1 + 2.0**-20, 1.001, 1.3, 1.55, 3.0]
    cosines = [0.0, 1e-6, 1e-2, 0.3, 0.8, 1.0]
    grid = itertools.product(cosines, etas)
    inputs = [{"cos_theta_i": mu, "eta": eta} for mu, eta in grid]
    inputs += [
        {"cos_theta_i": uniform(rng, 0, 1), "eta": uniform(rng, 1, 3)}
        for _ in range(20)
    ]
    singular = ("cos_theta_i", "eta")
    return table(
        reference.reflectance,
        inputs,
        lambda cos_theta_i, eta: singular if (cos_theta_i, eta) == (0, 1) else (),
    )


def make_eta_prime(rng):
    edges = itertools.product([0.0, POLE, -POLE, BELOW], [1.0, 1 + 2.0**-20, 1.55, 3.0])
    inputs = [{"theta_d": theta, "eta": eta} for theta, eta in edges]
    inputs += [
        {"theta_d": theta, "eta": uniform(rng, 1, 3)} for theta in inclinations(rng, 30)
    ]
    return table(reference.eta_prime, inputs)


def make_Phi(rng):
    offsets = [0.0, 1.0, -1.0, 0.5, -0.99, 1 - CELL, 1e-6]
    indices = [1.0, 1 + 2.0**-20, 1.2, 1.55, 4.0, 2.0**25]
    inputs = [
        {"p": (0, 1, 2, 7)[k % 4], "h": h, "eta_p": eta_p}
        for k, (h, eta_p) in enumerate(itertools.product(offsets, indices))
    ]
    inputs += [
        {"p": k % 4, "h": uniform(rng, -1, 1), "eta_p": 1 / uniform(rng, 0, 1)}
        for k in range(16)
    ]

    def without(p, h, eta_p):
        if abs(h) < 1:
            return ()
        return ("h", "eta_p") if eta_p == 1 else ("h",)

    return table(reference.Phi, inputs, without)


def make_transmittance(rng):
    inputs = []
    for theta in inclinations(rng, 12):
        for eta in (1.0, 1 + 2.0**-20, 1.55, 3.0):
            h = float(rng.choice([0.0, 1.0, -1.0, 0.999, uniform(rng, -1, 1)]))
            # At eta = 1 a segment is as long as 1/cos(theta_d).
            longest = 2 / (eta - 1 + abs(np.cos(theta))) ** (1 if eta == 1 else 0.5)
            sigma = float(rng.choice([0.0, 0.1, 1.0, 10.0])) * min(1, 10 / longest)
            inputs.append({"h": h, "theta_d": theta, "eta": eta, "sigma_a": sigma})
    inputs += [
        {"h": h, "theta_d": theta, "eta": 1.55, "sigma_a": 1e3}
        for h, theta in [(0.0, 0.0), (0.9, 1.2), (1.0, POLE), (-1.0, -0.4)]
    ]

    def without(h, theta_d, eta, sigma_a):
        return ("h", "theta_d", "eta") if (abs(h), eta) == (1, 1) else ()

    def extra(**given):
        exact = {name: mpf(x) for name, x in given.items()}
        E = {"E": text(mp.log(reference.transmittance(**exact)), 6)}
        # The length of a segment grows as 1/cos(theta_d) in a fiber of index 1, and
        # the terms of its second derivatives past the largest float32.
        steep = given["eta"] == 1 and abs(np.cos(given["theta_d"])) < 1e-6
        return E | ({"second": "float64"} if steep else {})

    return table(reference.transmittance, inputs, without, extra)


def fractions(rng, count):
    """Pairs (F, T) in [0, 1], with the ends and their neighborhoods."""
    edges = [0.0, 1.0, 1 - CELL, 1e-6, 0.04]
    pairs = list(itertools.product(edges, edges))
    return pairs + [tuple(rng.uniform(0, 1, 2).tolist()) for _ in range(count)]


def make_A(rng):
    return table(
        reference.A,
        [
            {"p": p, "F": F, "T": T}
            for (F, T), p in zip(
                fractions(rng, 31), itertools.cycle(range(8)), strict=False
            )
        ],
    )


def make_A_rest(rng):
    inputs = [
        {"p": p, "F": F, "T": T}
        for (F, T), p in zip(
            fractions(rng, 31), itertools.cycle((1, 2, 3, 4, 7)), strict=False
        )
        if (F, T) != (1, 1)
    ]
    for given in inputs:
        p, F, T = given["p"], mpf(given["F"]), mpf(given["T"])
        if F * T < 0.9:
            closed = reference.A_rest(p, F, T)
            partial = reference.A_rest_partial(p, F, T, 2000)
            assert abs(closed - partial) <= mpf(10) ** -45 * closed
    return table(reference.A_rest, inputs)


VARIANCES = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.0225, 0.05, 0.1, 0.3]
VARIANCES += [0.499, 0.501, 1.0, 2.0, 10.0, 100.0, 1e3, 1e4]


def tail(rng, v, lowest):
    """Two inclinations whose exponent E is about `lowest`, or less far apart."""
    theta_c = float(
        rng.choice([POLE, -POLE, -BELOW, 0.0, *rng.uniform(-1.57, 1.57, 6)])
    )
    apart = 2 * np.arcsin(min(1.0, np.sqrt(-lowest * v / 2)))
    theta_o = theta_c - np.copysign(apart, theta_c)
    return theta_c, float(np.clip(theta_o, -POLE, POLE))


def make_M(rng):
    inputs = [{"theta_cone": 0.0, "theta_o": 0.0, "v": v} for v in (1e-8, 0.3, 1e4)]
    inputs += [
        {"theta_cone": one, "theta_o": two, "v": v}
        for one, two, v in [
            (POLE, POLE, 1e-8),
            (POLE, -POLE, 1.0),
            (-BELOW, -POLE, 1e-3),
            (0.5, 0.5, 1e-6),
            # a and x on either side of 2, where the derivatives change form
            (0.3, -0.2, 0.468),
            (0.3, -0.2, 0.469),
            (1.2, 0.1, 0.18),
            (1.2, 0.1, 0.181),
        ]
    ]
    for v in VARIANCES:
        one, two = tail(rng, v, -uniform(rng, 0, 3))
        inputs.append({"theta_cone": one, "theta_o": two, "v": v})
        one, two = tail(rng, v, -uniform(rng, 3, 80))
        inputs.append({"theta_cone": two, "theta_o": one, "v": v})
    for lowest in np.linspace(5, 80, 14):
        v = log_uniform(rng, 1e-8, 0.03)
        one, two = tail(rng, v, -float(lowest))
        inputs.append({"theta_cone": one, "theta_o": two, "v": v})
    for lowest in np.linspace(100, 700, 8):
        v = log_uniform(rng, 1e-8, 3e-3)
        one, two = tail(rng, v, -float(lowest))
        inputs.append({"theta_cone": one, "theta_o": two, "v": v})

    def extra(theta_cone, theta_o, v):
        E = -2 * mp.sin((mpf(theta_o) - mpf(theta_cone)) / 2) ** 2 / mpf(v)
        return {"E": text(E, 6), **({"only": "float64"} if E < -81 else {})}

    return table(reference.M, inputs, extra=extra)


def make_sample_M(rng):
    def xi(u):
        return (2 * min(int(u * CELLS), CELLS - 2) + 1) * CELL

    inputs = []
    for k, v in enumerate([*VARIANCES, *VARIANCES, *VARIANCES[::3]]):
        theta = (0.0, POLE, -POLE, -1.5, *rng.uniform(-1.57, 1.57, 3))[k % 7]
        u = (0.0, 1.0, 1e-3, *rng.uniform(0, 1, 5))[k % 8]
        u1 = (0.0, 0.5, 0.0, 0.25, *rng.uniform(0, 1, 6))[k % 10]
        inputs.append({"theta_cone": theta, "v": v, "xi": xi(u), "u1": u1})
    return table(reference.sample_M, inputs)


def make_wrapped_normal(rng):
    inputs = [
        {"phi": phi, "beta": beta}
        for phi, beta in [
            (0.0, 1e-4),
            (0.0, 1.25),
            (0.0, 100.0),
            (3.1, 100.0),
            (3.0, 1.49),
            (3.0, 1.51),
            (3.14, 0.5),
            (-3.14, 3.0),
            (2e-3, 1e-4),
            (5.0, 10.0),
        ]
    ]
    for _ in range(20):
        inputs.append({"phi": uniform(rng, -4, 4), "beta": log_uniform(rng, 0.2, 5)})
    for turns in (-3, -2, -1, 1, 2, 3):
        for low, high in ((1e-4, 0.01), (0.01, 0.3), (0.3, 3)):
            beta = log_uniform(rng, low, high)
            phi = 2 * np.pi * turns + beta * rng.normal(scale=2)
            inputs.append({"phi": phi, "beta": beta})

    def extra(phi, beta):
        return {"E": text(-((reference.wrap(mpf(phi)) / beta) ** 2) / 2, 6)}

    return table(reference.wrapped_normal, inputs, extra=extra)


def make_trimmed_logistic(rng):
    inputs = [
        {"phi": phi, "s": s}
        for phi, s in [
            (0.0, 1e-4),
            (0.0, 1.0),
            (0.0, 100.0),
            (3.1, 100.0),
            (3.14, 0.5),
            (-3.14, 3.0),
            (5e-3, 1e-4),
            (5.0, 10.0),
            (2.0, 0.05),
            (0.5, 1e-3),
        ]
    ]
    for _ in range(20):
        inputs.append({"phi": uniform(rng, -4, 4), "s": log_uniform(rng, 0.1, 5)})
    for turns in (-3, -2, -1, 1, 2, 3):
        for low, high in ((1e-4, 0.01), (0.01, 0.3), (0.3, 3)):
            s = log_uniform(rng, low, high)
            phi = 2 * np.pi * turns + s * rng.normal(scale=4)
            inputs.append({"phi": phi, "s": s})

    def extra(phi, s):
        return {"E": text(-abs(reference.wrap(mpf(phi))) / s, 6)}

    return table(reference.trimmed_logistic, inputs, extra=extra)


def make_N(rng):
    inputs = list(moderate(rng, "normal", 0.15))
    specs = anywhere(rng, [0.3, 0.5, 1.0, 5.0, 100.0])
    return N_points([*inputs, *placed("normal", specs)])


def make_N_logistic(rng):
    # A width of 0.24 is a scale of 0.15.
    inputs = list(moderate(rng, "logistic", 0.24))
    specs = [*anywhere(rng, [0.3, 1.0, 5.0]), *kinks([0.5, 5.0])]
    # Next to eta = 1 float32 has fewer digits: NEAR_1 stands in the other table.
    specs = [spec for spec in specs if spec[2] > 1.01]
    return N_points([*inputs, *placed("logistic", specs)])


def make_N_narrow(rng):
    specs = [
        *anywhere(rng, [1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.02, 0.05, 0.1]),
        *CAUSTICS,
        *merges([1e-6, 1e-3, 0.05]),
        *GRAZING,
        *TAILS,
        *ABSORBING,
    ]
    return N_points(placed("normal", specs))


def make_N_logistic_narrow(rng):
    specs = [
        *anywhere(rng, [1e-4, 1e-3, 0.01, 0.05, 0.2]),
        *merges([1e-3]),
        *kinks([0.01, 0.05, 0.2]),
        *PLACES_LOGISTIC,
        *NEAR_1,
    ]
    return N_points(placed("logistic", specs))


def moderate(rng, detector, narrowest):
    """Arguments of `N` at random, with roughness from `narrowest` on."""
    fixed = [
        {"theta_d": POLE, "eta": 1.55, "sigma_a": 0.0},
        {"theta_d": -POLE, "eta": 1.25, "sigma_a": 0.5},
        {"theta_d": -0.7, "eta": 1.0, "sigma_a": 0.25},
        {"theta_d": 0.0, "eta": 1.55, "sigma_a": 0.0},
        {"theta_d": 0.4, "eta": 1 + 2.0**-10, "sigma_a": 1.0},
        {"theta_d": 1.0, "eta": 3.0, "sigma_a": 30.0},
        {"theta_d": -0.3, "eta": 1.7, "sigma_a": 1e3},
    ]
    for k in range(42):
        fiber = {
            "theta_d": uniform(rng, -1.4, 1.4),
            "eta": uniform(rng, 1.2, 2.2),
            "sigma_a": float(rng.choice([0.0, log_uniform(rng, 0.01, 10)])),
        }
        if k < 2 * len(fixed):
            fiber = fixed[k // 2]
        yield {
            "p": (0, 1, 2, 4)[(k + k // 8) % 4],
            "phi": uniform(rng, -np.pi, np.pi),
            **fiber,
            "beta_n": log_uniform(rng, narrowest, 3 if k % 4 else narrowest),
            "detector": detector,
        }


# Places of `N`: (p, theta_d, eta, sigma_a, beta_n, offset, widths), and phi is `widths`
# times beta_n past the azimuth at the offset h, or at the caustic.
STEEP = float(np.radians(89))
STEEPER = float(np.radians(89.9))
CAUSTICS = [
    *((2, 0.3, 1.55, 0.0, 1e-6, "caustic", widths) for widths in (-3, -1, 0, 1, 3)),
    *((2, -0.6, 1.3, 0.3, 1e-3, "caustic", widths) for widths in (-3, -1, 0, 1, 3)),
    *((3, 0.2, 1.55, 3.0, 1e-4, "caustic", widths) for widths in (-1, 0, 1)),
    *((3, 1.0, 1.3, 0.0, 0.1, "caustic", widths) for widths in (-1, 1, 3)),
    *((5, 0.0, 1.55, 0.3, 0.01, "caustic", widths) for widths in (-1, 0, 1)),
    (5, 1.1, 2.0, 0.0, 1e-5, "caustic", -1),
    (5, 0.9, 1.05, 0.0, 3e-3, 0.4, 1),
    (5, 0.5, 3.0, 0.3, 0.05, 0.8, -2),
]
GRAZING = [
    *((1, 0.0, 1.55, 0.3, 1e-4, 1.0, widths) for widths in (-2, 0, 2)),
    *((2, 0.7, 1.55, 0.3, 1e-3, 1.0, widths) for widths in (-2, 0, 2)),
    (3, 0.7, 2.0, 0.0, 0.02, 1.0, 0),
    (1, STEEPER, 1.05, 0.3, 0.02, 1.0, -1),
    (0, 0.0, 1.55, 0.0, 1e-6, 1.0, 0),
    (0, 1.0, 1.0001, 0.0, 0.01, 1.0, -1),
    (0, 0.5, 1.0001, 0.0, 1e-3, 0.99999, 2),
    (0, POLE, 3.0, 0.0, 0.1, 1.0, 3),
]
TAILS = [
    (1, 0.0, 1.55, 0.0, 1e-4, 1.0, -6),
    (1, 0.8, 1.3, 3.0, 0.02, 1.0, -8),
    (1, STEEP, 2.0, 0.3, 0.05, 1.0, -5),
    (2, 1.2, 2.0, 0.0, 1e-3, 1.0, -5),
    (2, 0.3, 1.55, 0.0, 1e-5, "caustic", 8),
    (2, 0.0, 1.55, 0.3, 0.1, "caustic", 7),
    (3, 1.0, 2.0, 0.3, 3e-3, 1.0, -7),
    (3, 1.0, 1.55, 30.0, 0.02, "caustic", 6),
]
# s |d ln A/d Phi| of 8 and more moves the mass out of the window of the detector.
ABSORBING = [
    (1, 0.0, 1.55, 30.0, 0.1, 0.0, 0),
    (1, 0.5, 1.3, 100.0, 0.1, 0.5, 0),
    (1, 0.0, 1.55, 300.0, 0.02, 0.0, 0),
    (1, 0.3, 2.0, 300.0, 0.1, 0.8, 0),
    (1, -1.0, 1.05, 300.0, 0.05, 1.0, 2),
    (2, 0.3, 1.55, 100.0, 0.05, 0.5, 0),
    (2, 1.2, 1.55, 100.0, 0.1, 0.0, 0),
    (2, 0.0, 1.3, 30.0, 0.1, "caustic", 0),
    (3, 0.0, 1.55, 30.0, 0.1, 0.0, 0),
    (3, 0.4, 1.3, 100.0, 0.02, 1.0, 1),
    (1, 0.0, 1.0001, 1000.0, 0.02, 1.0, 0),
    (1, 0.4, 1.0001, 1000.0, 1e-3, 0.9999, 1),
    (1, 0.0, 1.05, 1000.0, 0.05, 1.0, 1),
    (2, 0.0, 1.0001, 1000.0, 0.1, 1.0, -2),
    (3, 0.6, 1.0001, 1000.0, 0.01, 1.0, 0),
]
PLACES_LOGISTIC = [
    (1, 0.0, 1.55, 0.0, 1e-4, 1.0, -40),
    (1, 0.8, 1.3, 3.0, 0.02, 1.0, -15),
    (2, 0.3, 1.55, 0.3, 1e-3, "caustic", 200),
    (2, 0.3, 1.55, 0.0, 0.01, "caustic", 0),
    (3, 0.2, 1.55, 0.3, 0.1, "caustic", -1),
    (1, 0.0, 1.55, 100.0, 0.1, 0.5, 0),
    (2, 0.0, 1.55, 30.0, 0.02, 0.8, 1),
    (1, 0.2, 1.0001, 1000.0, 0.01, 1.0, 0),
]
NEAR_1 = [
    (2, 0.0, 1.0001, 30.0, 5.0, 0.0, -0.4217876434),
    (2, STEEPER, 1.0001, 1.0, 0.3, 0.5, -1),
    (3, STEEP, 1.0001, 2.0, 5.0, 0.8, 0),
]


def anywhere(rng, widths):
    """Places all over the domain, four for each roughness."""
    for beta_n, p in itertools.product(widths, range(4)):
        theta_d = rng.choice([0.0, 0.3, -0.7, 1.0, 1.3, STEEP, STEEPER, POLE])
        eta = rng.choice([1.0001, 1.05, 1.3, 1.55, 2.0, 3.0])
        # A segment is up to 2/cos(theta_t) long; N is to stay above 1e-290.
        cos_t = np.sqrt(1 - (np.sin(theta_d) / eta) ** 2)
        sigma_a = min(rng.choice([0.0, 0.3, 3.0, 30.0]), 80 * cos_t)
        # The center is the azimuth p pi, where the two halves of the range meet.
        offset = rng.choice([0.0, 1.0, *rng.uniform(0, 1, 4)])
        yield p, theta_d, eta, sigma_a, beta_n, offset, rng.normal(scale=2)


def merges(widths):
    """Places where the caustics merge: `eta_prime` just below p, at p and above."""
    for beta_n, p in itertools.product(widths, (2, 3)):
        for eta, away in [(1.55, -0.03), (1.55, 0.0), (1.55, 0.01)]:
            theta_d = np.arccos(np.sqrt((eta**2 - 1) / (p**2 - 1))) + away
            yield p, theta_d, eta, 0.3, beta_n, 0.1, 0
        # Here it is p exactly.
        yield p, 0.0, float(p), 0.0, beta_n, 0.0, 1


def kinks(widths):
    """Places half a turn from an azimuth, where the logistic has its kink."""
    rays = [(1, 0.3, 1.55, 0.1), (2, 0.3, 1.55, 0.5), (3, 1.2, 1.3, 0.3)]
    for beta_n in widths:
        for p, theta_d, eta, offset in rays:
            yield p, theta_d, eta, 0.3, beta_n, offset, np.pi / beta_n


def placed(detector, specs):
    """Arguments of `N` at the places."""
    for p, theta_d, eta, sigma_a, beta_n, offset, widths in specs:
        fiber = {"theta_d": theta_d, "eta": eta, "sigma_a": sigma_a, "beta_n": beta_n}
        fiber = rounded(fiber)
        axis = mpf(fiber["theta_d"]), mpf(fiber["eta"])
        gamma = caustic(p, *axis) if offset == "caustic" else mp.asin(offset)
        Phi = reference.ray(p, gamma, *axis, mpf(0))[1]
        phi = float(reference.wrap(Phi + widths * mpf(beta_n)))
        yield {"p": p, "phi": phi, **fiber, "detector": detector}


def caustic(p, theta_d, eta):
    """The angle gamma > 0 at which Phi turns back."""
    eta_p = reference.eta_prime(theta_d, eta)
    return mp.acos(mp.sqrt((eta_p**2 - 1) / (p**2 - 1)))


def N_points(inputs):
    for given in map(rounded, inputs):
        # At eta = 1 that derivative is one-sided.
        names = [name for name in REAL if (name, given[name]) != ("eta", 1)]
        yield {
            "in": shown(given),
            **N_derivatives(names, **given),
            "peak": N_peaks(names, **given),
        }


REAL = ("phi", "theta_d", "eta", "sigma_a", "beta_n")  # real arguments of `N`


def N_derivatives(names, **given):
    """Value and gradient of `N`."""
    with mp.workdps(45):
        (value, _), *slopes = reference.N_jet(**given)
        found = {n: text(significant(*x)) for n, x in zip(REAL, slopes, strict=True)}
    return {"value": text(value), "grad": {name: found[name] for name in names}}


def significant(integral, size):
    """The integral, or 0 where nothing is left of an integrand of that size."""
    if abs(integral) <= size * mpf(10) ** -35:
        return mpf(0)
    # The integral of modulus `size` is right to 38 digits.
    assert abs(integral) > size * mpf(10) ** -17, "the derivative has no 20 digits"
    return integral


def N_peaks(names, phi, p, detector, theta_d, eta, sigma_a, beta_n):
    """Largest |N| and |dN| over phi, from double precision, to about 2 %.

    At places as close as a third of beta_n where the features are that small: at 0 and
    pi, at the caustic, at grazing and at the point itself. Elsewhere they are evenly
    spaced in phi, and more closely in the azimuths of rays near grazing.
    """
    fiber = (theta_d, eta, sigma_a)
    gamma = np.pi / 2 - np.geomspace(1e-5, np.pi / 2, 24)
    if 1 < reference.eta_prime(theta_d, eta) < p:
        gamma = np.append(gamma, float(caustic(p, theta_d, eta)))
    azimuths = ray_in_doubles(p, gamma, *fiber)[1].real
    corners = [0.0, np.pi, azimuths[0], azimuths[-1]]
    around = np.add.outer(corners, beta_n * np.linspace(-3, 3, 19)).ravel()
    even = np.linspace(0, np.pi, 65)
    places = np.unique(abs(wrapped(np.concatenate([[phi], azimuths, around, even]))))
    with mp.workdps(15):
        jets = [N_in_doubles(p, x, *fiber, beta_n, detector) for x in places]
    peaks = dict(zip(("value", *REAL), np.abs(jets).max(0), strict=True))
    return {name: f"{peaks[name]:.3g}" for name in ("value", *names)}


def N_in_doubles(p, phi, theta_d, eta, sigma_a, beta_n, detector):
    """`N` and its derivatives, as `reference.N_jet` in double precision."""
    breaks = reference.N_breaks(p, phi, theta_d, eta, beta_n, detector)
    edges = np.array(breaks, float)
    x, w = np.polynomial.legendre.leggauss(16)
    half = np.diff(edges)[:, None] / 2
    gamma = (edges[:-1, None] + half * (1 + x)).ravel()
    fiber = np.array([theta_d, eta, sigma_a])[:, None, None]
    step = 1e-30
    A, Phi = ray_in_doubles(p, gamma, *(fiber + step * 1j * np.eye(3)[..., None]))
    turn = wrapped(phi - Phi[0].real)
    by_turn = density_in_doubles(detector, turn + step * 1j, beta_n)
    by_beta = density_in_doubles(detector, turn, beta_n + step * 1j)
    D, D_turn = by_turn.real, by_turn.imag / step
    rows = [
        A[0].real * D,
        A[0].real * D_turn,
        *(A.imag * D - A[0].real * D_turn * Phi.imag) / step,
        A[0].real * by_beta.imag / step,
    ]
    return np.array(rows) @ ((half * w).ravel() * np.cos(gamma) / 2)


def ray_in_doubles(p, gamma, theta_d, eta, sigma_a):
    """`reference.ray`, of complex arrays."""
    cos_d = np.sqrt(np.cos(theta_d) ** 2 + 0j)
    past_1 = (eta - 1) * (eta + 1)
    slow = np.sqrt(past_1 + cos_d**2)
    mu = cos_d * np.cos(gamma)
    nu = np.sqrt(past_1 + mu**2)
    r_s = -past_1 / (mu + nu) ** 2
    r_p = past_1 * (mu - 1 / (mu + nu)) / (eta**2 * mu + nu)
    F = (r_s**2 + r_p**2) / 2
    gamma_t = np.arcsin(np.sin(gamma) * cos_d / slow)
    T = np.exp(-2 * sigma_a * eta * np.cos(gamma_t) / slow)
    A = F if p == 0 else (1 - F) ** 2 * F ** (p - 1) * T**p
    return A, 2 * p * gamma_t - 2 * gamma + p * np.pi


def density_in_doubles(detector, x, beta):
    """`reference.detector_density` of a wrapped angle, of complex arrays."""
    if detector == "logistic":
        s = np.sqrt(np.pi / 8) * beta
        tail = np.exp(-x * np.sign(x.real) / s)
        return tail / (s * (1 + tail) ** 2) / np.tanh(np.pi / (2 * s))
    k = np.arange(1, 9)[:, None]
    if np.real(beta) > 1:
        return (1 + 2 * (np.exp(-((k * beta) ** 2) / 2) * np.cos(k * x)).sum(0)) / (
            2 * np.pi
        )
    k = np.arange(-2, 3)[:, None]
    images = np.exp(-(((x - 2 * np.pi * k) / beta) ** 2) / 2)
    return images.sum(0) / (beta * np.sqrt(2 * np.pi))


def wrapped(x):
    return x - 2 * np.pi * np.round(x / (2 * np.pi))


S_NAMES = (
    "theta_i",
    "theta_o",
    "phi",
    "h",
    "eta",
    "beta_m",
    "beta_n",
    "alpha",
    "sigma_a",
)


def make_S(rng):
    """Near the peaks of each lobe, and anywhere."""
    for k in range(64):
        spread = k % 4 == 3
        least = 0.2 if spread else 0.02
        beta_m, beta_n = log_uniform(rng, least, 1), log_uniform(rng, least, 1)
        theta_i, h = uniform(rng, -1.5, 1.5), uniform(rng, -0.95, 0.95)
        eta, alpha = uniform(rng, 1.1, 2), uniform(rng, -0.1, 0.1)
        p = k % 3
        tilt, width = reference.LOBES[p]
        theta_o = -theta_i + tilt * alpha + rng.normal() * float(width) * beta_m
        turn = reference.Phi(p, mpf(h), reference.eta_prime(mpf(theta_i), mpf(eta)))
        phi = float(reference.wrap(turn + rng.normal() * beta_n))
        theta_o = float(np.clip(theta_o, -1.5, 1.5))
        if spread:
            theta_o, phi = uniform(rng, -1.5, 1.5), uniform(rng, -7, 7)
        sigma_a = float(rng.choice([0.0, *rng.uniform(0, 3, 3)]))
        values = theta_i, theta_o, phi, h, eta, beta_m, beta_n, alpha, sigma_a
        given = rounded(dict(zip(S_NAMES, values, strict=True)))
        yield {"in": shown(given), **S_point(*(mpf(x) for x in given.values()))}


def S_point(*x):
    """Value and gradient of the sum, and the size of their rounding errors.

    An error of eps in an angle moves a lobe of width w by eps/w of itself, and its
    derivative in that angle, which is 1/w times as large, as well.
    """
    theta_i, theta_o, phi, h, eta, beta_m, beta_n, alpha, _ = x
    s = mp.sqrt(mp.pi / 8) * beta_n

    def turn(p, theta_i, h, eta):
        return reference.Phi(p, h, reference.eta_prime(theta_i, eta))

    parts = list(reference.S_parts(*x))
    slopes = [
        reference.complex_step(lambda *y: tuple(reference.S_parts(*y)), x, k)[1]
        for k in range(len(x))
    ]
    sizes: dict[str, Any] = dict.fromkeys(("", *S_NAMES), mpf(0))
    for p, part in enumerate(parts):
        tilt, width = (*reference.LOBES, (0, 2))[p]
        w = width * beta_m
        off = 2 * mp.sin((theta_o + theta_i - tilt * alpha) / 2) ** 2 / w**2
        around = 0 if p == 3 else 1 / s
        angles = abs(phi) + (2 * p + 1) * mp.pi
        digits = 4 + 4 * off + 1 / w + angles * around
        moved: dict[str, Any] = dict.fromkeys(S_NAMES, mpf(1))
        for name, by in (("theta_i", 1), ("theta_o", 1), ("alpha", abs(tilt))):
            moved[name] += by / w
        moved["beta_m"], moved["beta_n"] = (1 + off) / beta_m, 1 / beta_n
        if p < 3:
            at = theta_i, h, eta
            for k, name in enumerate(("theta_i", "h", "eta")):
                by: Any = reference.complex_step(lambda *y, p=p: turn(p, *y), at, k)[1]
                moved[name] += abs(by) * around
            moved["phi"] += around
        sizes[""] += digits * part
        for name, slope in zip(S_NAMES, slopes, strict=True):
            sizes[name] += digits * (abs(slope[p]) + moved[name] * part)
    return {
        "value": text(mp.fsum(parts)),
        "grad": {
            name: text(mp.fsum(slope))
            for name, slope in zip(S_NAMES, slopes, strict=True)
        },
        "size": {name: f"{float(size):.3g}" for name, size in sizes.items()},
    }


MAKERS = {
    "reflectance": make_reflectance,
    "eta_prime": make_eta_prime,
    "Phi": make_Phi,
    "transmittance": make_transmittance,
    "A": make_A,
    "A_rest": make_A_rest,
    "M": make_M,
    "sample_M": make_sample_M,
    "wrapped_normal": make_wrapped_normal,
    "trimmed_logistic": make_trimmed_logistic,
    "N": make_N,
    "N_logistic": make_N_logistic,
    "N_narrow": make_N_narrow,
    "N_logistic_narrow": make_N_logistic_narrow,
    "S": make_S,
}

PEAK = " peak: largest modulus over phi of the value and each derivative, to about 2 %."
NOTES = {
    "transmittance": " E = log T.",
    "M": " E is the exponent -2 sin^2((theta_o - theta_cone)/2)/v.",
    "sample_M": " xi is the number in (0, 1) after the move to a cell's center.",
    "wrapped_normal": " E is the exponent of the nearest image.",
    "trimmed_logistic": " E = -|wrapped phi|/s.",
    "N": PEAK,
    "N_logistic": PEAK,
    "N_narrow": PEAK,
    "N_logistic_narrow": PEAK,
    "S": " size: of the rounding errors of the value and each derivative, over eps.",
}


def main():
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=MAKERS, metavar="NAME", help="one table")
    only = parser.parse_args().only
    mp.dps = 60
    TABLES.mkdir(exist_ok=True)
    for seed, (name, make) in enumerate(MAKERS.items()):
        if only not in (None, name):
            continue
        points = []
        for point in make(np.random.default_rng(seed)):
            points.append(json.dumps(point))
            if sys.stderr.isatty():
                print(f"\r{name}: {len(points)} points", end="", file=sys.stderr)
        if sys.stderr.isatty():
            print(file=sys.stderr)
        arguments = list(json.loads(points[0])["in"])
        note = "Inputs are exact in float32; values have 20 digits." + NOTES.get(
            name, ""
        )
        (TABLES / f"{name}.json").write_text(
            f'{{"note": {json.dumps(note)},\n"arguments": {json.dumps(arguments)},\n'
            '"points": [\n' + ",\n".join(points) + "\n]}\n"
        )


if __name__ == "__main__":
    main()
