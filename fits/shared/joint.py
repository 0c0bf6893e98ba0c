"""All constants of a real-time model fitted together, on S over both directions."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from scipy import optimize
from shared.report import progress
from shared.sphere import Grid, exact_lobes

from fiberjax.approximation import FitError
from fiberjax.fiber import Fiber
from fiberjax.shading import LOBES, Directions, Hair, of_angles, of_fiber

TOLERANCE = 1e-6
AGREE = 1.01
"""The least error times this is near it: the valley is flat."""

REACH = 1.0
"""Of starts to both sides of a constant, or the constant itself if it is larger."""


class Target(NamedTuple):
    """S of some fibers over both directions, over its norm; a first axis of fibers."""

    hair: Hair
    at: Directions
    exact: Any
    weight: Any


def target(fibers: Sequence[Fiber], over: Grid, path: str) -> Target:
    """What is fitted. Fibers have no tilt: theta_i >= 0 serves for both signs."""
    theta, phi, in_theta, in_phi = over
    half = len(theta) // 2
    angles = theta[half:, None, None], theta[:, None], phi
    at = of_angles(*(jnp.asarray(x) for x in np.broadcast_arrays(*angles)))
    solid = (in_theta[half:, None] * in_theta)[..., None, None] * in_phi
    exact, hairs = [], []
    for fiber in fibers:
        progress(f"target {len(exact) + 1} of {len(fibers)}")
        S = np.asarray(exact_lobes(fiber, over, path).sum(0))[half:]
        weight = np.sqrt(solid / np.sum(solid * S * S))
        exact.append((S, weight))
        hairs.append(of_fiber(fiber))
    stacked = [jnp.asarray(np.stack(x)) for x in zip(*exact, strict=True)]
    return Target(jax.tree.map(lambda *x: jnp.stack(x), *hairs), at, *stacked)


def residuals(lobe: Callable, k: Any, goal: Target) -> Any:
    """Error of S; the sum of squares over a fiber is its squared relative L2."""

    def one(hair, exact, weight):
        S = sum(lobe(p, k, hair, goal.at) for p in LOBES)
        return (S - exact) * weight

    return jax.vmap(one)(goal.hair, goal.exact, goal.weight)


@eqx.filter_jit
def relative(lobe: Callable, k: Any, goal: Target) -> Any:
    """Relative L2 of S for each fiber."""
    square = residuals(lobe, k, goal) ** 2
    return jnp.sqrt(square.sum(tuple(range(1, square.ndim))))


@eqx.filter_jit
def _solve(lobe, unravel, start, goal, max_steps):
    return optx.least_squares(
        lambda k, goal: residuals(lobe, unravel(k), goal),
        optx.LevenbergMarquardt(rtol=TOLERANCE, atol=TOLERANCE),
        start,
        goal,
        max_steps=max_steps,
        throw=False,
    )


class Fitted(NamedTuple):
    """Constants, the mean relative L2 they have, and that of every start, least first.

    The means are root mean squares over the fibers: what is made least.
    """

    constants: Any
    error: float
    errors: list[float]


def fit(
    lobe: Callable,
    published: Any,
    goal: Target,
    judge: Target,
    starts: int,
    max_steps: int,
) -> Fitted:
    """The best of several starts: the published constants, and places around them.

    Errors are those on the points of `judge`, denser ones: some starts end with a spike
    between those of the fit.

    Raises FitError if no start converges, or of several one alone comes near the least
    error.
    """
    first, unravel = ravel_pytree(as_float(published))
    rng, found = np.random.default_rng(0), []
    for number in range(starts):
        progress(f"start {number + 1} of {starts}")
        away = _around(first, rng) if number else 0.0
        solution = _solve(lobe, unravel, first + away, goal, max_steps)
        if solution.result == optx.RESULTS.successful:
            value = unravel(solution.value)
            found.append((mean_square(relative(lobe, value, judge)), value))
    if not found:
        raise FitError(f"none of {starts} starts converges in {max_steps} steps")
    found.sort(key=lambda pair: pair[0])
    error, value = found[0]
    errors = [e for e, _ in found]
    if starts > 1 and sum(e <= AGREE * error for e in errors) < 2:
        raise FitError(f"one start of {starts} alone comes near the least: {errors}")
    return Fitted(value, error, errors)


def _around(k: Any, rng: np.random.Generator) -> np.ndarray:
    """A step from constants k to anywhere within reach, over a change of sign too."""
    return rng.uniform(-1, 1, len(k)) * np.maximum(np.abs(k), REACH)


def by_scipy(
    lobe: Callable, best: Fitted, goal: Target, judge: Target, starts: int
) -> float:
    """The least error that scipy's trf finds from anywhere around, by the same judge.

    FitError if it finds a better place than the best.
    """
    near, unravel = ravel_pytree(best.constants)
    rng, found = np.random.default_rng(1), []

    @jax.jit
    def f(k):
        return residuals(lobe, unravel(k), goal).ravel()

    slopes: Any = jax.jit(jax.jacfwd(f))
    for number in range(starts):
        progress(f"scipy: start {number + 1} of {starts}")
        start = near + _around(near, rng)
        with np.errstate(over="ignore"):  # a step that went too far is taken back
            one = optimize.least_squares(f, start, slopes, x_scale="jac", max_nfev=60)
        value = unravel(jnp.asarray(one.x))
        error = mean_square(relative(lobe, value, judge))
        # A start that ends at NaN has found nothing.
        found.append(error if np.isfinite(error) else np.inf)
    error = min(found)
    if error * AGREE < best.error:
        raise FitError(f"scipy finds an error of {error}, not {best.error}")
    return error


def mean_square(errors: Any) -> float:
    """Root mean square."""
    return float(jnp.sqrt((errors**2).mean()))


def as_float(k: Any, dtype: Any = float) -> Any:
    """Constants as numbers of a type, in float64."""
    return jax.tree.map(lambda x: jnp.asarray(np.asarray(x, dtype), float), k)
