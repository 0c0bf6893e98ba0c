"""An approximation's error over a box, and what it is at its worst.

A `Problem` is a signed error and, where there is one, a constraint. `fitting` finds its
constants; `measure` says how good any constants are; `to_float32` rounds them to what a
shader stores.
"""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

Vector: TypeAlias = Array | np.ndarray | Sequence[float]

PARTS = 8


class FitError(RuntimeError):
    """A fit that did not reach an optimum; the text says why."""


def unconstrained(k: Any, **_: Any) -> Array:
    """The constraint that every set of constants meets."""
    return jnp.full((), -1.0)


class Problem(NamedTuple):
    """The signed error e(k, x) of an approximation over a box, with g(k, x) <= 0.

    Args:
        constants: type of k, a NamedTuple of numbers.
        error: e(k, **variables), relative or absolute as the norm says.
        variables: the quantities at points x of shape (..., d), each of shape (...).
        points: grid over the box that includes its faces, shape (n, d).
        weights: weight of each point in the mean square, shape (n,), of sum 1.
        steps: grid spacing, shape (d,): the radius in which a largest value on the
            grid is refined. 0 where the points are all there is.
        constraint: g(k, **variables).
    """

    constants: Callable[..., Any]
    error: Callable[..., Array]
    variables: Callable[[Array], dict[str, Array]]
    points: np.ndarray
    weights: np.ndarray
    steps: np.ndarray
    constraint: Callable[..., Array] = unconstrained


def simpson(
    *axes: tuple[float, float, int],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, weights and steps of Simpson's rule on a box; the weights sum to 1.

    Args:
        axes: (from, to, number of points) for each dimension, the number odd and >= 3.

    Returns:
        points (n, d), weights (n,) and steps (d,) of a `Problem`.

    Raises:
        ValueError: a number of points is even or below 3.
    """
    for *_, n in axes:
        if n < 3 or n % 2 == 0:
            raise ValueError(f"axes: {n} points, must be an odd number >= 3")

    def weights(n):
        w = np.where(np.arange(n) % 2, 4.0, 2.0)
        w[[0, -1]] = 1
        return w / w.sum()

    def tensor(vectors):
        return np.stack(np.meshgrid(*vectors, indexing="ij"), -1).reshape(-1, len(axes))

    points = tensor([np.linspace(a, b, n) for a, b, n in axes])
    steps = np.array([(b - a) / (n - 1) for a, b, n in axes])
    return points, tensor([weights(n) for *_, n in axes]).prod(axis=-1), steps


def level(problem: Problem, k: Array, x: Array, sign: Array | float) -> Array:
    """The error times the sign (+1, -1), or the constraint where the sign is 0."""
    k, v, sign = problem.constants(*k), problem.variables(x), jnp.asarray(sign)
    free = 1 - jnp.abs(sign)
    return sign * problem.error(k, **v) + free * problem.constraint(k, **v)


def _refine(problem: Problem, k: Array, x: Array, sign: Array) -> Array:
    """The point near x, shape (d,), where the level is largest.

    Nested grids of 9 points a dimension, each a third as wide as the last: they need no
    derivative, and a largest value on a face of the box is no special case.
    """
    d = x.shape[0]
    offsets = jnp.stack(jnp.meshgrid(*[jnp.linspace(-1.0, 1.0, 9)] * d), -1)
    offsets = offsets.reshape(-1, d) * problem.steps
    low, high = problem.points.min(axis=0), problem.points.max(axis=0)

    def zoom(i, x):
        trial = jnp.clip(x + offsets / 3.0**i, low, high)
        return trial[jnp.argmax(level(problem, k, trial, sign))]

    return jax.lax.fori_loop(0, 20, zoom, x)


def peaks(problem: Problem, k: Array, sign: Array) -> Array:
    """Points of largest level, one for each part of the grid, refined; (PARTS, d).

    The largest value on the grid alone would miss a higher peak between two points.
    """
    n, d = problem.points.shape
    parts = jnp.pad(problem.points, ((0, -n % PARTS), (0, 0)), mode="edge")

    def peak(part):
        start = part[jnp.argmax(level(problem, k, part, sign))]
        return _refine(problem, k, start, sign)

    return jax.vmap(peak)(parts.reshape(PARTS, -1, d))


def largest(problem: Problem, k: Array, sign: Array) -> tuple[Array, Array]:
    """The largest level over the box and its point.

    Its derivative in k is the derivative at the point held fixed (envelope theorem).
    """
    x = jax.lax.stop_gradient(peaks(problem, jax.lax.stop_gradient(k), sign))
    levels = level(problem, k, x, sign)
    return levels.max(), x[levels.argmax()]


class Measure(NamedTuple):
    """Largest |error| and its point, root mean square error, largest constraint."""

    max: Array
    at: Array
    rms: Array
    constraint: Array


@eqx.filter_jit
def measure(problem: Problem, k: Vector) -> Measure:
    """Error of the constants k over the box, refined between the points of its grid."""
    k = jnp.asarray(k)
    signs = jnp.array([1.0, -1.0, 0.0])
    levels, at = jax.vmap(lambda sign: largest(problem, k, sign))(signs)
    error = level(problem, k, jnp.asarray(problem.points), 1.0)
    rms = jnp.sqrt(problem.weights @ error**2)
    return Measure(levels[:2].max(), at[levels[:2].argmax()], rms, levels[2])


def to_float32(
    problem: Problem, k: Vector, objective: Callable[[Measure], Array]
) -> np.ndarray:
    """The float32 neighbor of k that meets the constraint and is best by `objective`.

    Tries the nearest number and the two beside it for each constant: the nearest can
    lie on the wrong side of the constraint.

    Args:
        problem: error and constraint.
        k: constants in float64.
        objective: what to make small, of a `Measure`.

    Returns:
        float64 numbers that float32 holds exactly.

    Raises:
        FitError: no neighbor meets the constraint.
    """
    nearest = np.asarray(k, np.float32)
    beside = [np.nextafter(nearest, np.float32(end)) for end in (np.inf, -np.inf)]
    allowed = []
    for neighbor in product(*np.stack([nearest, *beside], axis=1)):
        rounded = np.array(neighbor, float)
        measured = measure(problem, rounded)
        if measured.constraint <= 0:
            allowed.append((float(objective(measured)), rounded))
    if not allowed:
        raise FitError(f"no float32 neighbor of {k} meets the constraint")
    return min(allowed, key=lambda pair: pair[0])[1]
