"""Constants of our real-time tiers, fitted to S over both directions.

Exact: S cos(theta_o) of fiberjax.evaluate without rest, R + TT + TRT.
Approximation: fiberjax.exponential, in the forms of fits/shared/forms.py.
Published: nothing in these forms; Karis 2016 is judged beside them.
Domain: eta 1.45 to 1.65, beta_m .09 to .49, beta_n .05 to .49, sigma_a to 1.15, tilts
to 2.5 degrees of both signs.
Norm: root mean square over fibers and colors of the relative L2 over both directions;
beside it the error of the albedo at every theta_i, that of TRT alone, and what a clear
fiber scatters of more than 1.

Each lobe is fitted from several starts, all together from the best of each and from
places around it, on few points, and from the best of these on many. Starts end when
three come within 3 % of the best; a second has to, every time.
Written: the constants, to src/fiberjax/data, and what is known of the fits, to
fits/constants.
"""

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from shared.fitted import clear, fibers
from shared.forms import FORMS, START, constants, moved, noise
from shared.importance import Samples, samples
from shared.report import CONSTANTS, progress, rounded, save
from shared.sphere import Grid, grid, sums
from shared.weighed import of_all, of_lobe, relative

from fiberjax import exponential, realtime
from fiberjax.approximation import FitError
from fiberjax.shading import of_angles, of_fiber

TOLERANCE, NEAR = 1e-4, 1e-3
STEPS = 64
STARTS = 4
TIMES = {"R": 1, "TT": 1, "TRT": 2}
TOGETHER = 4
SPREAD = 0.5
MOVED = 0.05
AGREE = 1.03
ENOUGH = 3
COUNTS = 32, 128
MARGIN = 0.003
ROUNDS = 4
GRID = 96, 48


@eqx.filter_jit
def _solve(residuals, unravel, start, at, max_steps, near):
    sizes = jnp.ones_like(start)
    if near:
        slopes = jax.jacfwd(lambda k: residuals(unravel(k), at))(start)
        sizes = jnp.linalg.norm(slopes, axis=0)
    unit = 1 / jnp.where(sizes > 0, sizes, 1)
    tolerance = NEAR if near else TOLERANCE
    solver = optx.LevenbergMarquardt(
        rtol=tolerance, atol=tolerance, linear_solver=lx.Normal(lx.Cholesky())
    )
    found = optx.least_squares(
        lambda x, at: residuals(unravel(unit * x), at),
        solver,
        start / unit,
        at,
        max_steps=max_steps,
        throw=False,
    )
    return unit * found.value


def solved(
    residuals: Callable, start: Any, at: Samples, max_steps: int, near: bool = False
) -> Any:
    """The nearest optimum; the root of its sum of squares, infinite if not finite.

    With `near`, for a start near an optimum, constants have units in which they change
    the residuals alike, so that steps are held back alike in all directions. It ends
    once no constant moves by more than `NEAR` of such a unit and of itself.
    """
    first, unravel = ravel_pytree(start)
    value = unravel(_solve(residuals, unravel, first, at, max_steps, near))
    error = float(jnp.linalg.norm(residuals(value, at)))
    return value, error if np.isfinite(error) else np.inf


class Fitted(NamedTuple):
    """Constants of a tier, errors of starts, the least first, and the excess.

    The starts of each lobe, by its name, and those of all "together".
    """

    constants: Any
    starts: dict[str, list[float]]
    excess: float


def ranked(
    residuals: Callable,
    starts: Sequence[Any],
    at: Samples,
    steps: int,
    near: bool = False,
) -> list[tuple[Any, float]]:
    """What each start comes to and its error, the least first.

    No more are tried once `ENOUGH` of them come near the least.
    """
    found = []
    for start in starts:
        progress(f"{', '.join(start)}: start {len(found) + 1} of {len(starts)}")
        found.append(solved(residuals, start, at, steps, near))
        least = min(error for _, error in found)
        agree = sum(error <= AGREE * least for _, error in found)
        if np.isfinite(least) and agree == ENOUGH:
            break
    return sorted(found, key=lambda one: one[1])


def agreed(name: str, found: list[tuple[Any, float]]) -> Any:
    """The best of several starts; FitError if none is finite, or it stands alone."""
    (best, least), *others = found
    if not np.isfinite(least):
        raise FitError(f"none of {len(found)} starts of {name} has a finite error")
    if others and others[0][1] > AGREE * least:
        errors = [error for _, error in found]
        raise FitError(f"one start of {name} alone comes near the least: {errors}")
    return best


def fit(form: Any, few: Samples, many: Samples, starts: int, max_steps: int) -> Fitted:
    """Each lobe from several starts on few points, all together from around the best.

    Then from the best on many. A clear fiber must give back no more than it gets: while
    one does, `excess`, the margin it has to keep on the points of the fit is raised by
    that.

    Raises FitError if the starts of a lobe, or of all together, do not agree or are not
    finite, or a clear fiber exceeds its limit after all rounds.
    """
    found, best = {}, {}
    for p, name in enumerate(exponential.NAMES):
        noises = (noise(seed, SPREAD) for seed in range(TIMES[name] * starts))
        tried = [{name: constants(form[name], START[name], one)} for one in noises]
        found[name] = ranked(partial(of_lobe, p=p), tried, few, max_steps)
        best = best | agreed(name, found[name])
    tried = [moved(best, seed, MOVED) for seed in range(min(TOGETHER, starts))]
    kept = few._replace(room=few.room - MARGIN)
    found["together"] = ranked(of_all, tried, kept, max_steps, near=True)
    errors = {name: [error for _, error in each] for name, each in found.items()}
    value = agreed("all lobes", found["together"])
    over, margin, too_much = grid(*GRID), MARGIN, np.inf
    for turn in range(ROUNDS):
        progress(f"all lobes: round {turn + 1}")
        kept = many._replace(room=many.room - margin)
        value, error = solved(of_all, value, kept, max_steps, near=True)
        if not np.isfinite(error):
            raise FitError("the error of all lobes together is not finite")
        too_much = excess(as_stored(value), over)
        if too_much <= 0:
            return Fitted(value, errors, too_much)
        margin += too_much + MARGIN
    raise FitError(f"a clear fiber still scatters {too_much} more than it may")


def excess(k: Any, over: Grid) -> float:
    """By how much the albedo of a clear fiber exceeds 1 and the exact one, both.

    The largest, over a grid of theta_i that the fit does not know.
    """

    def lobe(fiber, p, *angles):
        at = of_angles(*jnp.broadcast_arrays(*angles))
        return exponential.lobe(p, k, of_fiber(fiber), at)

    found = []
    for fiber in clear():
        progress(f"clear fiber {len(found) + 1}")
        one = sums(lobe, fiber, over, "theta_t")
        limit = jnp.maximum(one.albedo, 1)
        found.append(float((one.albedo_of_approximation - limit).max()))
    return max(found)


def as_stored(k: Any, digits: int = 7) -> Any:
    """Constants as a file has them: as many digits as float32 holds."""
    return jax.tree.map(lambda x: rounded(x, digits), k)


def report(found: Fitted, many: Samples, others: Samples) -> dict[str, Any]:
    """What is known of a fit."""
    k = as_stored(found.constants)

    def summary(dtype, at):
        errors = relative(jax.tree.map(lambda x: float(np.asarray(x, dtype)), k), at)
        return {"mean": rounded(errors.mean(), 4), "max": rounded(errors.max(), 4)}

    return {
        "form": "fiberjax.exponential",
        "norm": "relative L2 of S over both directions, over fibers and colors",
        "domain": {name: list(bounds) for name, bounds in exponential.DOMAIN.items()},
        "starts": {
            name: [rounded(x, 4) if np.isfinite(x) else None for x in errors]
            for name, errors in found.starts.items()
        },
        "error": {
            "float64": summary(np.float64, many),
            "float32": summary(np.float32, many),
            "half": summary(np.float16, many),
            "at other points": summary(np.float64, others),
        },
        "clear fiber above its limit": rounded(found.excess, 3),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Fit, print the table, write the constants and the report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for option, kind, default, metavar, text in (
        ("--output", Path, CONSTANTS, "DIR", "where to write reports; fits/constants"),
        ("--data", Path, realtime.DATA, "DIR", "and constants; those of the package"),
        (
            "--starts",
            int,
            STARTS,
            "N",
            f"starts of R and TT at most; {STARTS}; TRT has twice",
        ),
        ("--max-steps", int, STEPS, "N", f"steps allowed to each fit; {STEPS}"),
    ):
        parser.add_argument(
            option, type=kind, default=default, metavar=metavar, help=text
        )
    parser.add_argument(
        "--tiers",
        nargs="+",
        choices=tuple(FORMS),
        default=tuple(FORMS),
        metavar="TIER",
        help=f"which; {' '.join(FORMS)}",
    )
    options = parser.parse_args(argv)
    jax.config.update("jax_enable_x64", True)
    few, many = (samples(fibers(), count) for count in COUNTS)
    others = samples(fibers(), COUNTS[0], seed=1)
    for tier in options.tiers:
        try:
            found = fit(FORMS[tier], few, many, options.starts, options.max_steps)
        except FitError as error:
            raise SystemExit(f"{tier}: {error}; nothing written") from error
        progress("")
        entry = report(found, many, others)
        save(options.data / f"{tier}.json", as_stored(found.constants))
        save(options.output / f"{tier}.json", entry)
        print(f"{tier}: {entry['norm']}")
        for name, error in entry["error"].items():
            print(f"  {name:18}mean {error['mean']:.4f}  max {error['max']:.4f}")
        for name, errors in entry["starts"].items():
            print(f"  {name:9}from {len(errors)} starts: {errors}", flush=True)


if __name__ == "__main__":
    main()
