"""The error of an approximation of R + TT + TRT over both directions.

Both inclinations lie on one grid of midpoints, so theta_d takes as many values: N is
made once for each, and multiplied by M.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import fiberjax
from fiberjax.fiber import Fiber, cone, lobe_shape
from fiberjax.shading import LOBES, of_fiber

PATHS = ("theta_t", "theta_d")
"""Length of a pass: 2 cos gamma_t over the cosine of theta_t, as light goes, or of
theta_d, as Karis has it."""

RULE = fiberjax.auto(1e-9)


class Grid(NamedTuple):
    """Midpoints of theta in (-pi/2, pi/2), for both directions, and of phi in (0, pi).

    The weights are those of the solid angle, both signs of phi taken together.
    """

    theta: np.ndarray
    phi: np.ndarray
    in_theta: np.ndarray
    in_phi: float


def grid(n_theta: int, n_phi: int) -> Grid:
    """A grid of so many points of each."""
    theta = np.pi * ((np.arange(n_theta) + 0.5) / n_theta - 0.5)
    phi = np.pi * (np.arange(n_phi) + 0.5) / n_phi
    return Grid(theta, phi, np.cos(theta) * np.pi / n_theta, 2 * np.pi / n_phi)


class Sums(NamedTuple):
    """What integrals over the sphere give; the first axis of squares is R, TT, TRT, S.

    Mean squares over both directions, summed over colors; the albedo over theta_i and
    colors; the largest error of S over S's largest value at each theta_i, and where.
    """

    square: Any
    square_of_error: Any
    albedo: Any
    albedo_of_approximation: Any
    worst: Any
    worst_at: Any


@partial(jax.jit, static_argnames="path")
def azimuthal(fiber: Fiber, theta_d, phi, path: str):
    """N of the lobes over theta_d and phi, colors last."""
    eta, sigma_a = of_fiber(fiber)[:2]

    def at(theta_d):
        cos = jnp.cos(theta_d)
        cos_t = jnp.sqrt((eta - 1) * (eta + 1) + cos * cos) / eta
        longer = cos_t / cos if path == "theta_d" else 1.0
        return [
            fiberjax.N(
                p,
                phi,
                theta_d,
                eta=eta,
                sigma_a=None if sigma_a is None else sigma_a * longer,
                beta_n=lobe_shape(fiber, p).beta_n,
                rule=RULE,
            )
            for p in LOBES
        ]

    return jnp.stack(jax.lax.map(at, theta_d), 0)


def _row(fiber: Fiber, over: Grid, N: Any, i: Any) -> list[Any]:
    """M N of the lobes at one theta_i, over theta_o and phi, colors last."""
    theta = jnp.asarray(over.theta)
    apart = jnp.abs(jnp.arange(len(theta)) - i)
    found = []
    for p in LOBES:
        shape = lobe_shape(fiber, p)
        M = fiberjax.M(cone(theta[i], shape), theta, shape.beta_m**2)
        found.append(M[:, None, None] * N[p][apart])
    return found


def _azimuthal_on(over: Grid, fiber: Fiber, path: str) -> Any:
    """N at every |theta_d| that the grid has."""
    n = len(over.theta)
    theta_d = jnp.arange(n, dtype=float) * (jnp.pi / 2 / n)
    return azimuthal(fiber, theta_d, jnp.asarray(over.phi), path)


@partial(jax.jit, static_argnames="path")
def exact_lobes(fiber: Fiber, over: Grid, path: str) -> Any:
    """M N of R, TT, TRT; axes: lobe, theta_i, theta_o, phi, color."""
    N = _azimuthal_on(over, fiber, path)
    each = jax.lax.map(
        lambda i: jnp.stack(_row(fiber, over, N, i)), jnp.arange(len(over.theta))
    )
    return jnp.moveaxis(each, 1, 0)


def sums(approximation: Callable, fiber: Fiber, over: Grid, path: str) -> Sums:
    """All integrals of the error of approximation(fiber, p, *angles).

    Compiled once for each approximation, whatever the numbers of the fiber.
    """
    return _sums(approximation, fiber, over, _azimuthal_on(over, fiber, path))


@partial(jax.jit, static_argnames="approximation")
def _sums(approximation: Callable, fiber: Fiber, over: Grid, N: Any) -> Sums:
    theta, phi, in_theta, in_phi = map(jnp.asarray, over)

    def row(i):
        theta_i, exact = theta[i], _row(fiber, over, N, i)
        angles = theta_i, theta[:, None], phi
        close = [approximation(fiber, p, *angles) for p in LOBES]
        exact, close = (
            jnp.stack(jnp.broadcast_arrays(*x, sum(x))) for x in (exact, close)
        )
        error = close - exact
        there = in_theta[:, None] * in_phi

        def square(x):
            return in_theta[i] * (there * (x * x).sum(-1)).sum((-1, -2))

        def albedo(x):
            return (there[..., None] * x[-1]).sum((0, 1))

        size = jnp.abs(error[-1]).max(-1)
        at = jnp.unravel_index(size.argmax(), size.shape)
        return Sums(
            square(exact),
            square(error),
            albedo(exact),
            albedo(close),
            size.max() / exact[-1].max(),
            jnp.stack([theta_i, theta[at[0]], phi[at[1]]]),
        )

    found = jax.lax.map(row, jnp.arange(len(theta)))
    most = found.worst.argmax()
    return Sums(
        found.square.sum(0),
        found.square_of_error.sum(0),
        found.albedo,
        found.albedo_of_approximation,
        found.worst[most],
        found.worst_at[most],
    )
