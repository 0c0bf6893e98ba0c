"""All constants of a real-time model fitted together, on S over both directions."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from shared.report import progress
from shared.sphere import Grid, exact_lobes

from fiberjax.approximation import FitError
from fiberjax.fiber import Fiber
from fiberjax.shading import LOBES, Directions, Hair, of_angles, of_fiber

TOLERANCE = 1e-6
SPREAD = 0.3
"""Factors of the other starts, log-normal of this deviation."""


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
    lobe: Callable, published: Any, goal: Target, starts: int, max_steps: int
) -> Fitted:
    """The best of several starts: the published constants, and those times factors.

    Raises FitError if no start converges.
    """
    first, unravel = ravel_pytree(as_float(published))
    rng, found = np.random.default_rng(0), []
    for number in range(starts):
        progress(f"start {number + 1} of {starts}")
        factors = np.exp(SPREAD * rng.standard_normal(first.size)) if number else 1.0
        solution = _solve(lobe, unravel, first * factors, goal, max_steps)
        if solution.result == optx.RESULTS.successful:
            value = unravel(solution.value)
            found.append((mean_square(relative(lobe, value, goal)), value))
    if not found:
        raise FitError(f"none of {starts} starts converges in {max_steps} steps")
    found.sort(key=lambda pair: pair[0])
    error, value = found[0]
    return Fitted(value, error, [e for e, _ in found])


def mean_square(errors: Any) -> float:
    """Root mean square."""
    return float(jnp.sqrt((errors**2).mean()))


def as_float(k: Any, dtype: Any = float) -> Any:
    """Constants as numbers of a type, in float64."""
    return jax.tree.map(lambda x: jnp.asarray(np.asarray(x, dtype), float), k)
