"""All constants of Karis' hair together, on what they are for: S over the sphere.

Exact: S cos(theta_o) of fiberjax.evaluate without rest, with absorption over Karis'
path 1/cos theta_d.
Approximation: R + TT + TRT of fiberjax.karis.
Published: Karis 2016.
Domain and norm: four colors, beta_m = beta_n = r^2 with r = .3, .5, .7, eta 1.55, no
tilt; root mean square over these of the relative L2 over both directions. Constants
that are free to be anything show what the forms can do; eta' and h no longer mean what
their names say, and lie in a flat valley: the error is found again to a thousandth, the
constants are not.
"""

import argparse
from pathlib import Path

import jax
import numpy as np
from shared import joint
from shared.cases import COLORS, ROUGH, fiber
from shared.report import CONSTANTS, progress, rounded, save
from shared.sphere import grid

from fiberjax import karis
from fiberjax.approximation import FitError

NODES = 32, 16
DENSER = 96, 48
TRIED = 8
STARTS = 8
STEPS = 256


def numbers(k):
    """Constants as a file has them."""
    return {
        name: [rounded(x, 9) for x in np.atleast_1d(value)]
        if np.ndim(value)
        else rounded(value, 9)
        for name, value in k._asdict().items()
    }


def main(argv=None):
    """Fit, print the table, write the constants."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for option, kind, default, metavar, text in (
        ("--output", Path, CONSTANTS, "DIR", "where to write; fits/constants"),
        ("--starts", int, STARTS, "N", f"start points; {STARTS}"),
        ("--max-steps", int, STEPS, "N", f"steps allowed to each; {STEPS}"),
    ):
        parser.add_argument(
            option, type=kind, default=default, metavar=metavar, help=text
        )
    options = parser.parse_args(argv)
    jax.config.update("jax_enable_x64", True)
    fibers = [fiber(c, w) for w in ROUGH.values() for c in COLORS.values()]
    goal, judge = (joint.target(fibers, grid(*n), "theta_d") for n in (NODES, DENSER))
    what = karis.lobe, karis.PUBLISHED, goal, judge, options.starts, options.max_steps
    try:
        found = joint.fit(*what)
        check = joint.by_scipy(karis.lobe, found, goal, judge, TRIED)
    except FitError as error:
        raise SystemExit(f"karis: {error}; nothing written") from error
    progress("")
    stored = {
        "published": karis.PUBLISHED,
        "unrounded": found.constants,
        "refitted": joint.as_float(found.constants, np.float32),
        "refitted in half": joint.as_float(found.constants, np.float16),
    }
    errors = {
        name: joint.mean_square(joint.relative(karis.lobe, joint.as_float(k), judge))
        for name, k in stored.items()
    }
    entry = {
        "form": "R + TT + TRT of Karis 2016",
        "norm": "root mean square over the cases of the relative L2 of S",
        "domain": "four colors, r = .3, .5, .7, eta = 1.55, path over cos theta_d",
        "constants": {
            "published": numbers(karis.PUBLISHED),
            "refitted": numbers(stored["refitted"]),
        },
        "error": {name: rounded(x, 4) for name, x in errors.items()},
        "starts": [rounded(x, 4) for x in found.errors],
        "check": {
            "method": f"scipy least_squares, trf, best of {TRIED}",
            "error": rounded(check, 4),
        },
    }
    save(options.output / "karis.json", entry)
    print(f"karis: {entry['norm']}")
    for name, error in entry["error"].items():
        print(f"  {name:20}{error:.4f}")
    print(f"  {entry['check']['method']}: {entry['check']['error']:.4f}")
    print(f"  from {len(found.errors)} of {options.starts} starts: {entry['starts']}")


if __name__ == "__main__":
    main()
