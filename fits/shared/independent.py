"""The same optima by scipy, on the grid, from the error and the constraint alone."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy import optimize

from fiberjax.approximation import FitError, Problem, Vector, level


def _on_grid(problem: Problem, sign: float):
    points = jnp.asarray(problem.points)
    return jax.jit(lambda k: level(problem, k, points, sign) + jnp.zeros(len(points)))


def _value(found: optimize.OptimizeResult, method: str) -> float:
    """The optimum; FitError if scipy did not reach one."""
    if not found.success:
        raise FitError(f"scipy {method}: {found.message}")
    return float(found.fun)


def linear_program(problem: Problem, near: Vector) -> tuple[str, float]:
    """Least largest error where the error is linear in k: min E by HiGHS.

    The grid holds fewer conditions than the box, so this is a lower bound there.
    """
    start, rows, right = jnp.zeros(len(near)), [], []
    for sign in (1.0, -1.0, 0.0):
        f = _on_grid(problem, sign)
        slack = np.full(len(problem.points), -abs(sign))
        rows.append(np.column_stack([jax.jacfwd(f)(start), slack]))
        right.append(-np.asarray(f(start)))
    found = optimize.linprog(
        np.append(np.zeros(len(near)), 1.0),
        np.concatenate(rows),
        np.concatenate(right),
        bounds=(None, None),
    )
    return "linprog", _value(found, "linprog")


def differential_evolution(problem: Problem, near: Vector) -> tuple[str, float]:
    """Least largest error that a seeded global search around `near` finds."""
    f, near = _on_grid(problem, 1.0), np.asarray(near)
    reach = np.abs(near) / 2
    found = optimize.differential_evolution(
        lambda k: float(jnp.abs(f(k)).max()),
        list(zip(near - reach, near + reach, strict=True)),
        rng=0,
        tol=1e-8,
    )
    return "differential_evolution", _value(found, "differential_evolution")


def least_squares(problem: Problem, near: Vector) -> tuple[str, float]:
    """Least root mean square error, under the constraint, by SLSQP."""
    f, g = _on_grid(problem, 1.0), _on_grid(problem, 0.0)
    room = jax.jit(lambda k: -g(k).max())
    # Scaled so that SLSQP's absolute tolerance is far below the optimum.
    mean_square = jax.jit(lambda k: 1e4 * problem.weights @ f(k) ** 2)
    found = optimize.minimize(
        mean_square,
        near,
        jac=jax.grad(mean_square),
        method="SLSQP",
        constraints={"type": "ineq", "fun": room, "jac": jax.grad(room)},
        tol=1e-12,
    )
    return "SLSQP", _value(found, "SLSQP") ** 0.5 / 100
