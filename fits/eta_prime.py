"""Modified index of refraction eta' of a fiber with eta = 1.55.

Exact: eta' = sqrt(eta^2 - sin^2 theta_d)/cos theta_d.
Approximation: eta' ~ a/c + b c, c = cos theta_d.
Published: a = 1.19, b = .36, "error < 0.68 %" (Karis 2016, Azimuthal TT).
Domain and norm: relative error for c in (0, 1], mean square over c. As c -> 0 it tends
to a/sqrt(eta^2 - 1) - 1, which is what its value at c = 0 means here.
"""

from typing import NamedTuple

import jax.numpy as jnp
from shared.independent import linear_program
from shared.report import Claim, Study, run

import fiberjax
from fiberjax.approximation import Problem, measure, simpson

ETA = 1.55


class Constants(NamedTuple):
    """The constants of the approximation."""

    a: float
    b: float


PUBLISHED = Constants(1.19, 0.36)


def approx(k, c):
    """Karis' form of eta'."""
    return k.a / c + k.b * c


def exact(theta_d):
    """eta' itself."""
    return fiberjax.eta_prime(theta_d, ETA)


def error(k, c, theta_d):
    """Relative error."""
    return approx(k, c) / exact(theta_d) - 1


def variables(x):
    """theta_d = acos x, and its own cosine, which is above 0 in floating point."""
    theta_d = jnp.arccos(x[..., 0])
    return {"c": jnp.cos(theta_d), "theta_d": theta_d}


def taylor():
    """Two terms of sqrt(eta^2 - 1 + c^2), divided by c."""
    root = (ETA**2 - 1) ** 0.5
    return Constants(root, 1 / (2 * root))


def claims(entry):
    """The deck's claims."""
    published = entry["error"]["published"]["max"]
    series = float(measure(PROBLEM, taylor()).max)
    return [
        Claim('"error < 0.68 %"', f"{published:.3%}", published < 0.0068),
        Claim(
            '"a better fit" than the Taylor series',
            f"series {series:.3%}",
            published < series,
        ),
    ]


PROBLEM = Problem(Constants, error, variables, *simpson((0, 1, 1025)))
STUDY = Study(
    name="eta_prime",
    form="a/c + b c, c = cos theta_d",
    norm="relative error, mean square over c",
    domain=f"c in (0, 1], eta = {ETA}",
    published=PUBLISHED,
    problem=PROBLEM,
    place=lambda x: {"c": x[0]},
    check=linear_program,
    also={"relative error as c -> 0": lambda k: k.a / (ETA**2 - 1) ** 0.5 - 1},
    claims=claims,
)


def main(argv=None):
    """Fit, print the table, write the constants."""
    run(STUDY, __doc__, argv)


if __name__ == "__main__":
    main()
