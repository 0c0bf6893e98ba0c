"""Azimuthal density of the TRT lobe.

Exact: 3/4 D(phi, .15, 0), the logistic density of scale s = .15 about phi = 0,
e^{x/s}/(s (1 + e^{x/s})^2) with x = phi, not trimmed.
Approximation: exp(k0 cos phi + k1).
Published: k0 = 17, k1 = -16.78 (Karis 2016, Azimuthal TRT).
Domain and norm: phi in [-pi, pi], error relative to the peak 3/(16 s), mean square over
phi. `against_reference` fits the same form to N_TRT itself.
"""

import numpy as np
from shared import lobes
from shared.independent import differential_evolution
from shared.lobes import Constants, approx
from shared.report import Claim, Study, run

from fiberjax.approximation import Problem, simpson

S = 0.15
ENERGY = 0.75
PUBLISHED = Constants(17.0, -16.78)


def exact(phi):
    """The logistic density he fitted."""
    return ENERGY * lobes.untrimmed_logistic(phi, S)


def error(k, phi):
    """Error relative to the peak."""
    return (approx(k, phi) - exact(phi)) * (4 * S / ENERGY)


def cos_gamma(phi, a):
    """sqrt(1 - h^2) of his constant h = sqrt(3)/2."""
    return 0.5


def claims(entry):
    """3/4 of a density integrates to 3/4 over a turn."""
    published = entry["also"]["integral"]["published"]
    target = lobes.integral(exact)
    return [
        Claim(
            "3/4 of a density: integral .75",
            f"{published:.4f}",
            abs(published - ENERGY) < 1e-3,
        ),
        Claim("its target: integral .75", f"{target:.4f}", abs(target - ENERGY) < 1e-3),
    ]


STUDY = Study(
    name="d_trt",
    form="exp(k0 cos phi + k1)",
    norm="error relative to the peak, mean square over phi",
    domain="phi in [-pi, pi]",
    published=PUBLISHED,
    problem=Problem(
        Constants, error, lambda x: {"phi": x[..., 0]}, *simpson((0, np.pi, 1025))
    ),
    place=lambda x: {"phi": x[0]},
    check=differential_evolution,
    also={"integral": lambda k: lobes.integral(lambda phi: approx(k, phi))},
    claims=claims,
    further=lambda max_steps: lobes.against_reference(
        2, cos_gamma, PUBLISHED, exact, max_steps
    ),
)


def main(argv=None):
    """Fit, print the table, write the constants."""
    run(STUDY, __doc__, argv)


if __name__ == "__main__":
    main()
