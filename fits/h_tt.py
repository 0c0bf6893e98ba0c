"""Offset h of the ray that TT sends in direction phi.

Exact: h = cos(phi/2)/sqrt(1 + a^2 - 2 a sin(phi/2)), a = 1/eta'.
Approximation: h ~ (1 + a (k0 + k1 cos phi)) cos(phi/2).
Published: k0 = .6, k1 = -.8 (Karis 2016, Azimuthal TT). There the exact h carries
sign(phi) twice; on [0, 2 pi] it has none.
Domain and norm: absolute error for a in (0, 1/1.55] and phi in [2 asin a, pi], outside
which no ray leaves; mean square over a of the mean over phi. The fits never exceed 1,
where sqrt(1 - h^2) is not a number; without this condition the error could be smaller.
"""

from typing import NamedTuple

import jax.numpy as jnp
from shared.independent import linear_program
from shared.report import Study, rounded, run

from fiberjax.approximation import Problem, measure, simpson, unconstrained
from fiberjax.fitting import minimax

LARGEST_A = 1 / 1.55


class Constants(NamedTuple):
    """The constants of the approximation."""

    k0: float
    k1: float


PUBLISHED = Constants(0.6, -0.8)


def approx(k, a, phi):
    """Karis' form of h."""
    return (1 + a * (k.k0 + k.k1 * jnp.cos(phi))) * jnp.cos(phi / 2)


def exact(a, phi):
    """The root h of Phi(1, h) = phi."""
    return jnp.cos(phi / 2) / jnp.sqrt(1 + a * a - 2 * a * jnp.sin(phi / 2))


def error(k, a, phi):
    """Absolute error."""
    return approx(k, a, phi) - exact(a, phi)


def above_one(k, a, phi):
    """What must not be positive."""
    return approx(k, a, phi) - 1


def variables(x):
    """The region of the (a, phi) plane, from the unit interval in its second axis."""
    a, first = x[..., 0], 2 * jnp.arcsin(x[..., 0])
    return {"a": a, "phi": first + x[..., 1] * (jnp.pi - first)}


def without_condition(max_steps):
    """The smaller error of a fit that is allowed to exceed 1."""
    free = PROBLEM._replace(constraint=unconstrained)
    best = minimax(free, PUBLISHED, max_steps=max_steps)
    k = Constants(*map(rounded, best.k))
    found = {
        "constants": k._asdict(),
        "error": {"max": rounded(best.bound)},
        "largest h": rounded(measure(PROBLEM, k).constraint + 1),
    }
    line = (
        f"  were h > 1 allowed: k0 = {k.k0}, k1 = {k.k1}, max error "
        f"{found['error']['max']:.6f}, largest h {found['largest h']:.6f}"
    )
    return {"without_condition": found}, [line]


PROBLEM = Problem(
    Constants,
    error,
    variables,
    *simpson((0, LARGEST_A, 129), (0, 1, 257)),
    above_one,
)
STUDY = Study(
    name="h_tt",
    form="(1 + a (k0 + k1 cos phi)) cos(phi/2), a = 1/eta'",
    norm="absolute error, mean square over a of the mean over phi",
    domain="a in (0, 1/1.55], phi in [2 asin a, pi], h <= 1",
    published=PUBLISHED,
    problem=PROBLEM,
    place=variables,
    check=linear_program,
    also={"largest h": lambda k: measure(PROBLEM, k).constraint + 1},
    further=without_condition,
)


def main(argv=None):
    """Fit, print the table, write the constants."""
    run(STUDY, __doc__, argv)


if __name__ == "__main__":
    main()
