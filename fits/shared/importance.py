"""R, TT and TRT of some fibers at points that lie where their light goes.

The points of a fiber are some theta_i, each with as many theta_o and phi, from a
mixture of what surrounds the lobes and of all directions, by a Sobol sequence; weighted
sums over them are integrals over the sphere.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtr, ndtri
from scipy.stats import qmc
from shared.report import progress

import fiberjax
from fiberjax.fiber import Fiber, cone, fold, lobe_shape
from fiberjax.shading import LOBES, Directions, Hair, of_angles, of_fiber

RULE = fiberjax.auto(1e-7)
THETA_I = 16
COMPONENTS = 4


class Samples(NamedTuple):
    """Fibers on the first axis, theta_i on the second, points on the third.

    weight is that of theta_o and phi, weight_i that of theta_i; exact has the lobes on
    the second axis and colors last; square, of the sum, and square_lobes are integrals
    over both directions, for each fiber and color; room is what the albedo of a clear
    fiber lacks of the larger of 1 and itself, at each theta_i.
    """

    hair: Hair
    at: Directions
    weight: Any
    weight_i: Any
    exact: Any
    square: Any
    square_lobes: Any
    room: Any


def _inclinations(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """theta_i, dense at grazing, one from each stratum, and weights, of cos theta."""
    t = 2 * (np.arange(THETA_I) + rng.random(THETA_I)) / THETA_I - 1
    theta = np.pi / 2 * np.sin(np.pi * t / 2)
    return theta, np.cos(theta) * np.pi**2 / 2 * np.cos(np.pi * t / 2) / THETA_I


class Around(NamedTuple):
    """A normal density cut off at both ends, which lie on either side of the center.

    scipy's own takes a minute for all that are needed here.
    """

    center: float
    width: float
    low: float
    high: float

    def _ends(self) -> tuple[float, float]:
        """The shares of the whole normal below both ends."""
        ends = np.array([self.low, self.high]) - self.center
        return tuple(ndtr(ends / self.width))

    def pdf(self, x: np.ndarray) -> np.ndarray:
        """The density inside."""
        low, high = self._ends()
        square = ((x - self.center) / self.width) ** 2
        peak = 1 / (np.sqrt(2 * np.pi) * self.width * (high - low))
        return peak * np.exp(-square / 2)

    def ppf(self, u: np.ndarray) -> np.ndarray:
        """Where a share u of it lies below."""
        low, high = self._ends()
        found = self.center + self.width * ndtri(low + u * (high - low))
        return np.clip(found, self.low, self.high)


def _points(fiber: Fiber, theta_i: float, count: int, rng: np.random.Generator) -> Any:
    """theta_o, phi and weights."""
    shapes = [lobe_shape(fiber, p) for p in LOBES]
    given = jnp.asarray(theta_i)
    cones = [float(fold(cone(given, shape))) for shape in shapes]
    beta_n = float(fiber.beta_n)
    half = np.pi / 2
    over_theta = [
        Around(c, 1.3 * float(shape.beta_m), -half, half)
        for c, shape in zip(cones, shapes, strict=True)
    ]
    over_phi = [
        Around(np.pi, 1.2 * beta_n + 0.1, 0, np.pi),
        Around(0.0, beta_n + 0.25, 0, np.pi),
    ]
    x = qmc.Sobol(2, rng=rng).random(count)
    # Neighbors in the sequence fill the square; every 16th point does not.
    block = np.arange(count) * COMPONENTS**2 // count
    which, number = block % COMPONENTS, block // COMPONENTS
    theta_o = np.select(
        [which == j for j in range(3)],
        [density.ppf(x[:, 0]) for density in over_theta],
        np.pi * (x[:, 0] - 0.5),
    )
    phi = np.select(
        [number == j for j in range(2)],
        [density.ppf(x[:, 1]) for density in over_phi],
        np.pi * x[:, 1],
    )
    in_theta = sum(density.pdf(theta_o) for density in over_theta) + 1 / np.pi
    in_phi = sum(density.pdf(phi) for density in over_phi) + 2 / np.pi
    # Both signs of phi.
    weight = 2 * np.cos(theta_o) * COMPONENTS**2 / (in_theta * in_phi * count)
    return theta_o, phi, weight


@jax.jit
def _exact(fiber: Fiber, theta_i: Any, theta_o: Any, phi: Any) -> Any:
    return jnp.stack(
        [fiberjax.lobe(fiber, p, theta_i, theta_o, phi, rule=RULE) for p in LOBES]
    )


@jax.jit
def _clear(fiber: Fiber, theta_i: Any) -> Any:
    clear = eqx.tree_at(lambda f: f.sigma_a, fiber, jnp.zeros(()))
    return fiberjax.albedo(clear, theta_i, rest=False, rule=RULE)


def samples(fibers: Sequence[Fiber], count: int, seed: int = 0) -> Samples:
    """`count` points for each theta_i of each fiber; a power of 2 times 16."""
    rng, found = np.random.default_rng(seed), []
    for fiber in fibers:
        progress(f"exact lobes of fiber {len(found) + 1} of {len(fibers)}")
        theta, weight_i = _inclinations(rng)
        at = [_points(fiber, one, count, rng) for one in theta]
        theta_o, phi, weight = map(np.stack, zip(*at, strict=True))
        theta_i = np.broadcast_to(theta[:, None], phi.shape)
        exact = _exact(fiber, theta_i, theta_o, phi)
        lobes, clear = np.asarray(exact), np.asarray(_clear(fiber, theta))
        found.append((theta_i, theta_o, phi, weight, weight_i, lobes, clear))
    *angles, weight, weight_i, exact, clear = map(np.stack, zip(*found, strict=True))
    both = weight * weight_i[..., None]
    return Samples(
        jax.tree.map(lambda *x: jnp.stack(x), *map(of_fiber, fibers)),
        of_angles(*map(jnp.asarray, angles)),
        weight,
        weight_i,
        exact,
        np.einsum("fij,fijc->fc", both, exact.sum(1) ** 2),
        np.einsum("fij,fpijc->fpc", both, exact**2),
        np.maximum(clear, 1) - clear,
    )
