"""Azimuthal density of the TT lobe.

Exact: D(phi, .35, pi), the logistic density of scale s = .35 about phi = pi,
e^{x/s}/(s (1 + e^{x/s})^2) with x = phi - pi, not trimmed.
Approximation: exp(k0 cos phi + k1).
Published: k0 = -3.65, k1 = -3.98 (Karis 2016, Azimuthal TT).
Domain and norm: phi in [0, 2 pi], error relative to the peak 1/(4 s), mean square over
phi. `against_reference` fits the same form to N_TT itself.
"""

import jax.numpy as jnp
import numpy as np
from shared import lobes
from shared.independent import differential_evolution
from shared.lobes import Constants, approx
from shared.report import Claim, Study, run

from fiberjax.approximation import Problem, simpson

S = 0.35
PUBLISHED = Constants(-3.65, -3.98)


def exact(phi):
    """The logistic density he fitted."""
    return lobes.untrimmed_logistic(phi - jnp.pi, S)


def error(k, phi):
    """Error relative to the peak."""
    return (approx(k, phi) - exact(phi)) * (4 * S)


def cos_gamma(phi, a):
    """sqrt(1 - h^2) of the exact h: |sin(phi/2) - a|/sqrt(1 + a^2 - 2 a sin(phi/2))."""
    s = jnp.sin(phi / 2)
    return jnp.abs(s - a) / jnp.sqrt(1 + a * a - 2 * a * s)


def claims(entry):
    """A density integrates to 1 over a turn."""
    published = entry["also"]["integral"]["published"]
    target = lobes.integral(exact)
    return [
        Claim("a density: integral 1", f"{published:.4f}", abs(published - 1) < 1e-3),
        Claim("its target: integral 1", f"{target:.4f}", abs(target - 1) < 1e-3),
    ]


STUDY = Study(
    name="d_tt",
    form="exp(k0 cos phi + k1)",
    norm="error relative to the peak, mean square over phi",
    domain="phi in [0, 2 pi]",
    published=PUBLISHED,
    problem=Problem(
        Constants, error, lambda x: {"phi": x[..., 0]}, *simpson((0, np.pi, 1025))
    ),
    place=lambda x: {"phi": x[0]},
    check=differential_evolution,
    also={"integral": lambda k: lobes.integral(lambda phi: approx(k, phi))},
    claims=claims,
    further=lambda max_steps: lobes.against_reference(
        1, cos_gamma, PUBLISHED, exact, max_steps
    ),
)


def main(argv=None):
    """Fit, print the table, write the constants."""
    run(STUDY, __doc__, argv)


if __name__ == "__main__":
    main()
