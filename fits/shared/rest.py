"""The rest of the reference, all lobes above TRT, and the error of a form of it.

It is M a/(2 pi): a hangs on theta_d alone, and is what `fiberjax.albedo` has of the
rest at incidence="theta_i".
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import qmc
from shared.report import rounded
from shared.sphere import Grid, grid

import fiberjax
from fiberjax import realtime, tail
from fiberjax.fiber import Fiber, rest_shape
from fiberjax.shading import Directions, Hair, of_angles, of_fiber

FLOOR = 0.01
"""Of a clear fiber's norm: what is darker need not be right to its own last digit."""

ALBEDO = 40.0
"""Weight of an error of the albedo beside one of the relative L2."""


OUTSIDE = (
    *((eta, 0.3, sigma_a) for eta in (1.3, 2.0) for sigma_a in (0.0, 0.3)),
    *((eta, beta_m, 0.0) for eta in (1.3, 1.55, 2.0) for beta_m in (0.02, 1.0)),
    *((1.55, 0.3, sigma_a) for sigma_a in (5.0, 1e4)),
    (2.0, 0.02, 1e4),
)
"""eta, beta_m and sigma_a beyond the domain."""

GRAZING = np.radians((60, 70, 75, 80, 82.5, 85, 87.5, 89, 90))


class Cases(NamedTuple):
    """Numbers of fibers, of shape (n,); radians, per radius."""

    eta: Any
    beta_m: Any
    sigma_a: Any


def spread(n: int, seed: int) -> Cases:
    """2 n fibers of the domain, n of them clear, by Sobol's points.

    eta 1.4 to 1.7, beta_m .05 to .55 in its logarithm, sigma_a 0 to 1.2 in its root.
    """
    clear = qmc.Sobol(2, rng=seed).random(n)
    dark = qmc.Sobol(3, rng=seed + 1).random(n)
    eta, width = np.concatenate([clear, dark[:, :2]]).T
    sigma_a = np.append(np.zeros(n), 1.2 * dark[:, 2] ** 2)
    return Cases(1.4 + 0.3 * eta, 0.05 * 11**width, sigma_a)


class Target(NamedTuple):
    """The rest of some fibers over both directions, theta_i >= 0; first axis fibers.

    scale is 1 over the norm, floored; solid the weight of a value in the integral over
    both directions, out that over theta_o and phi alone.
    """

    hair: Hair
    at: Directions
    exact: Any
    scale: Any
    solid: Any
    out: Any


@jax.jit
def _exact(theta: Any, eta: Any, beta_m: Any, sigma_a: Any) -> tuple[Any, Any]:
    """The rest over theta_i >= 0 and theta_o, and a clear fiber's."""
    n = len(theta)
    theta_i = theta[n // 2 :, None]
    # Midpoints: theta_d takes as many values as theta.
    theta_d = jnp.arange(n, dtype=float) * (jnp.pi / 2 / n)
    apart = jnp.abs(jnp.arange(n) - jnp.arange(n // 2, n)[:, None])

    def of(sigma_a):
        fiber = Fiber(eta, beta_m, 0.3, None, sigma_a)
        a = fiberjax.albedo(fiber, theta_d, per_lobe=True, incidence="theta_i")[-1]
        M = fiberjax.M(-theta_i, theta, rest_shape(fiber).beta_m ** 2)
        return M * a[apart] / (2 * jnp.pi)

    return of(sigma_a), of(jnp.zeros_like(sigma_a))


def target(cases: Cases, over: Grid) -> Target:
    """What is fitted, or judged."""
    theta = jnp.asarray(over.theta)
    n, columns = len(over.theta), [jnp.asarray(x) for x in cases]
    exact, clear = jax.lax.map(lambda case: _exact(theta, *case), columns)
    out = jnp.asarray(2 * np.pi * over.in_theta)
    solid = jnp.asarray(over.in_theta)[n // 2 :, None] * out

    def square(x):
        return (solid * x * x).sum((-1, -2))

    scale = 1 / jnp.sqrt(square(exact) + FLOOR**2 * square(clear))
    hair = jax.vmap(lambda e, b, s: of_fiber(Fiber(e, b, 0.3, None, s)))(*columns)
    angles = theta[n // 2 :, None], theta, jnp.zeros(())
    return Target(hair, _at(*angles), exact, scale, solid, out)


def _at(*angles: Any) -> Directions:
    return of_angles(*jnp.broadcast_arrays(*angles))


def errors(k: tail.Constants, goal: Target) -> Any:
    """The error of the form; axes: fiber, theta_i, theta_o."""
    found = jax.vmap(lambda hair: tail.rest(k, hair, goal.at)[..., 0])(goal.hair)
    return found - goal.exact


def residuals(k: tail.Constants, goal: Target) -> tuple[Any, Any]:
    """What is made small; their squares are added and divided by the fibers.

    The squares of a fiber's are that of its relative L2, and the mean over theta_i of
    that of `ALBEDO` times the error of the albedo.
    """
    error = errors(k, goal)
    over = jnp.sqrt(goal.solid) * error * goal.scale[:, None, None]
    n_fibers, n_theta, _ = error.shape
    albedo = ALBEDO / n_theta**0.5 * (error * goal.out).sum(-1)
    return over / n_fibers**0.5, albedo / n_fibers**0.5


class Judged(NamedTuple):
    """Of each fiber: relative L2, error of the albedo over theta_i, largest value."""

    relative: Any
    albedo: Any
    peak: Any


@jax.jit
def judged(k: tail.Constants, goal: Target) -> Judged:
    """The errors of the form, and its largest value. L2 is relative to the norm."""
    error = errors(k, goal)
    square = (goal.solid * error * error).sum((-1, -2))
    albedo = (error * goal.out).sum(-1)
    return Judged(
        jnp.sqrt(square) * goal.scale, albedo, (error + goal.exact).max((-1, -2))
    )


def placed(x: Any) -> float:
    """To four places: below are rounding errors, and what nothing is left of."""
    return round(float(x), 4)


def summary(k: tail.Constants, goal: Target, over: Any) -> dict[str, Any]:
    """Errors over the fibers of a target, the first half of them clear."""
    relative, albedo, _ = map(np.asarray, judged(k, goal))
    half, at = len(relative) // 2, np.abs(albedo).max(0).argmax()
    return {
        "relative L2": rounded(relative.mean(), 4),
        "clear": rounded(relative[:half].mean(), 4),
        "largest": rounded(relative.max(), 4),
        "albedo": rounded(np.abs(albedo).max(), 4),
        "albedo at deg": rounded(np.degrees(over.theta[len(over.theta) // 2 + at]), 3),
        "albedo mean": rounded(np.abs(albedo).mean(), 4),
    }


def unseen(k: tail.Constants) -> dict[str, Any]:
    """The errors on fibers and a grid of which the fit knows nothing."""
    over = grid(120, 1)
    return summary(k, target(spread(32, 7), over), over)


@jax.jit
def _rest_albedo(k, fiber: Fiber, theta_i: Any) -> Any:
    over = grid(720, 1)
    value = realtime.rest(fiber, theta_i[:, None], over.theta, 0.0, constants=k)
    return (value * (2 * np.pi * over.in_theta)).sum(-1)


def furnace(k: tail.Constants, widths: Any) -> dict[str, float]:
    """Albedo of a clear fiber, untilted, less 1: largest over eta, beta_m, theta_i."""
    theta_i, off = jnp.asarray(np.radians(np.arange(0, 90, 2.5))), []
    for eta in (1.4, 1.55, 1.7):
        for beta_m in (0.1, 0.25, 0.55):
            fiber = Fiber(eta, beta_m, 0.3, None, None, widths_m=widths)
            each = fiberjax.albedo(fiber, theta_i, per_lobe=True)
            told, ours = each[:-1].sum(0), _rest_albedo(k, fiber, theta_i)
            off.append([told - 1, told + each[-1] - 1, told + ours - 1])
    most = np.abs(off).max((0, 2))
    return {
        name: placed(x)
        for name, x in zip(("without", "exact", "this"), most, strict=True)
    }


def grazing(k: tail.Constants) -> dict[str, Any]:
    """The energy of the rest of a clear fiber at grazing light, exact and this."""
    fiber = Fiber(1.55, 0.05, 0.3, None, None)
    exact = fiberjax.albedo(fiber, GRAZING, per_lobe=True)[-1]
    close = _rest_albedo(k, fiber, jnp.asarray(GRAZING))
    return {
        f"{angle:g} deg": {"exact": rounded(a, 4), "this": rounded(b, 4)}
        for angle, a, b in zip(np.degrees(GRAZING).round(1), exact, close, strict=True)
    }


def outside(k: tail.Constants) -> dict[str, Any]:
    """Errors beyond the domain, and the largest value over that of a clear fiber.

    What nothing is left of has its L2 over the floor of the norm.
    """
    over, (eta, beta_m, sigma_a) = grid(360, 1), np.array(OUTSIDE).T
    goal = target(Cases(eta, beta_m, sigma_a), over)
    clear = target(Cases(eta, beta_m, 0 * sigma_a), over)
    found, most = judged(k, goal), np.asarray(clear.exact).max((1, 2))
    return {
        "eta {:g}, beta_m {:g}, sigma_a {:g}".format(*case): {
            "relative L2": placed(found.relative[n]),
            "albedo": placed(np.abs(found.albedo[n]).max()),
            "peak": placed(found.peak[n] / most[n]),
        }
        for n, case in enumerate(OUTSIDE)
    }
