"""Constants fitted in the least-squares and in the minimax sense.

Both start from a `Problem` of `fiberjax.approximation` and run in float64, which the
caller switches on (`jax_enable_x64`).
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array

from fiberjax.approximation import (
    PARTS,
    FitError,
    Problem,
    Vector,
    largest,
    level,
    measure,
    peaks,
)

STEPS = 256
TOLERANCE = 1e-12
STIFFNESS = 100.0
UPDATES = 40
EXCHANGES = 40
GAP = 1e-13


def _float64(start: Vector) -> Array:
    """The start point; ValueError unless the fit can run in float64."""
    k = jnp.asarray(start, float)
    if k.dtype != jnp.float64:
        raise ValueError("jax_enable_x64 is off: the fits run in float64")
    return k


def _solution(what: str, found: optx.Solution) -> Array:
    """The value of a solution, or FitError with the reason why it is none."""
    if not np.isfinite(found.value).all():
        raise FitError(f"{what}: constants {found.value} are not finite")
    if found.result != optx.RESULTS.successful:
        raise FitError(f"{what}: {optx.RESULTS[found.result]}")
    return found.value


def _residuals(k, args):
    problem, multiplier = args
    g, _ = largest(problem, k, jnp.zeros(()))
    pull = jnp.sqrt(STIFFNESS) * jax.nn.relu(g + multiplier / STIFFNESS)
    error = level(problem, k, jnp.asarray(problem.points), 1.0)
    return jnp.append(jnp.sqrt(problem.weights) * error, pull), g


@eqx.filter_jit
def _levenberg_marquardt(problem, k, multiplier, max_steps):
    return optx.least_squares(
        _residuals,
        optx.LevenbergMarquardt(rtol=TOLERANCE, atol=TOLERANCE),
        k,
        (problem, multiplier),
        has_aux=True,
        max_steps=max_steps,
        throw=False,
    )


def _from_start(problem: Problem, start: Vector, max_steps: int) -> Array:
    k, multiplier = _float64(start), jnp.zeros(())
    # A solver may call it success to stay where the error is not a number.
    if not jnp.isfinite(measure(problem, k).rms):
        raise FitError("least squares: the error is not finite")
    for _ in range(UPDATES):
        found = _levenberg_marquardt(problem, k, multiplier, max_steps)
        k = _solution("least squares", found)
        change = jax.nn.relu(multiplier + STIFFNESS * found.aux) - multiplier
        if abs(change) <= 1e-8:
            return k
        multiplier = multiplier + change
    raise FitError(f"least squares: the constraint is not met after {UPDATES} updates")


def least_squares(
    problem: Problem, starts: Sequence[Vector], *, max_steps: int = STEPS
) -> np.ndarray:
    """Constants of least mean square error, the best from all start points.

    min_k sum_i w_i e(k, x_i)^2 subject to g(k, x) <= 0 over the box. By
    Levenberg-Marquardt on the augmented Lagrangian, which is a sum of squares too.

    Args:
        problem: error, constraint and points.
        starts: start points for the constants.
        max_steps: Levenberg-Marquardt steps allowed.

    Returns:
        The constants in float64.

    Raises:
        FitError: no start point leads to an optimum; the text says why for each.
        ValueError: jax_enable_x64 is off.
    """
    found, reasons = [], []
    for start in starts:
        try:
            found.append(np.asarray(_from_start(problem, start, max_steps)))
        except FitError as error:
            reasons.append(f"from {tuple(map(float, start))}: {error}")
    if not found:
        raise FitError("; ".join(reasons))
    return min(found, key=lambda k: float(measure(problem, k).rms))


class Minimax(NamedTuple):
    """A minimax fit and the evidence for it.

    At the n + 1 points the error is signs * bound, or the constraint is active where
    the sign is 0. The multipliers are non-negative and balance the derivatives:
    sum_i multipliers_i d(level_i)/dk = 0, sum_i multipliers_i |signs_i| = 1.

    Where the error is linear in k, sum_i multipliers_i level_i = bound for every k, so
    nothing has an error below `bound`. Where the approximation is a monotone function
    of k0 t + k1, the same follows if the signs alternate along t: a better one would
    differ from it by a linear function with two zeros.

    `reached` is the largest error of k over the box.
    """

    k: np.ndarray
    bound: float
    reached: float
    points: np.ndarray
    signs: np.ndarray
    multipliers: np.ndarray


@eqx.filter_jit
def _cuts(problem, k, x, signs):
    """The points x and the peaks of every sign: point, sign, level, gradient."""
    every = jnp.array([1.0, -1.0, 0.0])
    found = jax.vmap(lambda sign: peaks(problem, k, sign))(every)
    x = jnp.concatenate([x, found.reshape(-1, x.shape[1])])
    signs = jnp.concatenate([signs, jnp.repeat(every, PARTS)])
    at = jax.vmap(jax.value_and_grad(level, argnums=1), (None, None, 0, 0))
    return x, signs, *at(problem, k, x, signs)


def _tightest(signs, levels, gradients):
    """The n + 1 cuts that bound the error best from below, their multipliers, bound.

    A linear program: min E subject to level_i + gradient_i . dk <= |sign_i| E. It has
    so few unknowns that every vertex of its dual can be tried.
    """
    n = gradients.shape[1]
    subsets = np.array(list(combinations(range(len(signs)), n + 1)))
    system = np.concatenate([gradients, np.abs(signs)[:, None]], axis=1)[subsets]
    regular = np.abs(np.linalg.det(system)) > 1e-14
    subsets, system = subsets[regular], system[regular].swapaxes(1, 2)
    right = np.broadcast_to(np.eye(n + 1)[:, n:], (len(subsets), n + 1, 1))
    multipliers = np.linalg.solve(system, right)[..., 0]
    bounds = (multipliers * levels[subsets]).sum(axis=1)
    bounds[(multipliers < 0).any(axis=1)] = -np.inf
    if not np.isfinite(bounds).any():
        raise FitError("minimax: no set of points bounds the error from below")
    best = bounds.argmax()
    return subsets[best], multipliers[best], bounds[best]


def _unequal(unknown, args):
    problem, x, signs = args
    k, bound = unknown[:-1], unknown[-1]
    levels = jax.vmap(lambda x, sign: level(problem, k, x, sign))(x, signs)
    return levels - jnp.abs(signs) * bound


@eqx.filter_jit
def _newton(problem, unknown, x, signs, max_steps):
    return optx.root_find(
        _unequal,
        optx.Newton(rtol=TOLERANCE, atol=TOLERANCE),
        unknown,
        (problem, x, signs),
        max_steps=max_steps,
        throw=False,
    )


def minimax(problem: Problem, start: Vector, *, max_steps: int = STEPS) -> Minimax:
    """Constants of least largest error.

    min_k max_x |e(k, x)| subject to g(k, x) <= 0 over the box. By exchange: of the
    points where the error peaks, take the n + 1 that bound it best from below, make the
    error equal there (Newton), and look for peaks again. This is Remez's algorithm
    without an order of the points, so that two dimensions and a constraint are no
    special case, and it ends with its own proof. A p-norm of high order does neither.

    Args:
        problem: error, constraint and points.
        start: constants from which to begin, best those of `least_squares`.
        max_steps: Newton steps allowed in each exchange.

    Returns:
        The fit; its largest error exceeds the bound by at most 1e-13.

    Raises:
        FitError: a value is not finite, or the exchange does not end.
        ValueError: jax_enable_x64 is off.
    """
    k, gap = _float64(start), jnp.inf
    # Points all over the box, so that there is a bound wherever k starts.
    spread = np.linspace(0, len(problem.points) - 1, PARTS).astype(int)
    x = problem.points[np.tile(spread, 2)]
    signs = np.repeat([1.0, -1.0], PARTS)
    for _ in range(EXCHANGES):
        cuts = [np.asarray(a) for a in _cuts(problem, k, x, signs)]
        if not all(np.isfinite(a).all() for a in cuts):
            raise FitError(f"minimax: the error is not finite at constants {k}")
        active, multipliers, bound = _tightest(*cuts[1:])
        x, signs = cuts[0][active], cuts[1][active]
        unknown = _newton(problem, jnp.append(k, bound), x, signs, max_steps)
        *k, bound = np.asarray(_solution("minimax", unknown))
        k, now = np.array(k), measure(problem, np.array(k))
        gap = max(float(now.max) - bound, float(now.constraint))
        if gap <= GAP:
            return Minimax(k, bound, float(now.max), x, signs, multipliers)
    raise FitError(f"minimax: error still {gap:.1e} above its bound")
