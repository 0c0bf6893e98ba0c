"""The error of one approximation over many fibers, and what is said of it."""

from collections.abc import Callable, Iterable, Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from shared.report import rounded
from shared.sphere import Grid, Sums, sums

from fiberjax.fiber import Fiber

LOBES = ("R", "TT", "TRT", "S")
EDGES = 0, 30, 60, 80, 90
BANDS = (*pairwise(EDGES), (0, 80), (0, 90))
"""Degrees of |theta_i| between which the error of the albedo is told."""


class Case(NamedTuple):
    """What is found for one fiber.

    Fields:
        error: relative L2 of R, TT, TRT and S.
        albedo, exact: of the approximation and of the model, over theta_i and colors.
        worst: largest error of S over its largest value at the same theta_i.
        worst_at: theta_i, theta_o and phi of that, degrees.
    """

    error: np.ndarray
    albedo: np.ndarray
    exact: np.ndarray
    worst: float
    worst_at: np.ndarray


def relative(found: Sums) -> np.ndarray:
    """The error of each lobe and of the sum, relative to its own norm."""
    return np.sqrt(np.asarray(found.square_of_error / found.square))


def judged(
    model: Callable, over: Grid, path: str, fibers: Mapping[str, Fiber]
) -> dict[str, Case]:
    """A case for each fiber."""
    found = {}
    for name, fiber in fibers.items():
        one = sums(model, fiber, over, path)
        found[name] = Case(
            relative(one),
            np.asarray(one.albedo_of_approximation),
            np.asarray(one.albedo),
            float(one.worst),
            np.degrees(one.worst_at),
        )
    return found


def by_band(
    theta_i: np.ndarray, cases: Iterable[Case], bands: Iterable[tuple[int, int]] = BANDS
) -> dict[str, Any]:
    """Largest and mean error of the albedo between bounds of |theta_i|.

    At each theta_i that is the largest over cases and colors.
    """
    degrees, found = np.degrees(np.abs(theta_i)), {}
    error = np.max([np.abs(one.albedo - one.exact).max(-1) for one in cases], 0)
    for low, high in bands:
        here = error[(degrees > low) & (degrees <= high)]
        found[f"{low} to {high}"] = {
            "max": rounded(here.max(), 4),
            "mean": rounded(here.mean(), 4),
        }
    return found


def by_lobe(numbers: np.ndarray) -> dict[str, float]:
    """A number of each lobe and of the sum."""
    return {name: rounded(x, 4) for name, x in zip(LOBES, numbers, strict=True)}


def of_cases(cases: Mapping[str, Case]) -> dict[str, float]:
    """The error of S in each."""
    return {name: rounded(one.error[-1], 4) for name, one in cases.items()}


def summary(theta_i: np.ndarray, cases: Mapping[str, Case]) -> dict[str, Any]:
    """Mean and largest over cases, of each lobe and of S, and of the albedo."""
    errors = np.array([one.error for one in cases.values()])
    return {
        "mean": by_lobe(errors.mean(0)),
        "max": by_lobe(errors.max(0)),
        "cases": of_cases(cases),
        "albedo": by_band(theta_i, cases.values(), BANDS[-2:]),
    }


def worst(cases: Mapping[str, Case]) -> dict[str, Any]:
    """Where an error is largest over the largest value at the same theta_i."""
    name, one = max(cases.items(), key=lambda case: case[1].worst)
    places = zip(("theta_i", "theta_o", "phi"), one.worst_at, strict=True)
    return {
        "error over peak": rounded(one.worst, 4),
        "case": name,
        **{f"{angle} deg": rounded(x, 4) for angle, x in places},
    }


def clear(theta_i: np.ndarray, case: Case) -> dict[str, Any]:
    """The albedo of a fiber that absorbs nothing.

    "above" is how far it exceeds both 1 and the exact one, < 0 if nowhere.
    """
    above = case.albedo - np.maximum(1.0, case.exact)
    return {
        "largest": rounded(case.albedo.max(), 4),
        "largest exact": rounded(case.exact.max(), 4),
        "above": rounded(above.max(), 4),
        "error": by_band(theta_i, [case]),
    }
