"""The scenes that plans are judged by, and directions of them that no plan has seen."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import fiberjax
from fiberjax.scene import Scene

HAIR = {"eta": 1.55, "beta_m": (0.15, 0.4), "beta_n": (0.15, 0.4)}
TILT = (-0.06, -0.02)

SCENES = {
    "black hair": Scene(**HAIR, alpha=TILT, sigma_a=(1, 4), tolerance=1e-3),
    "clear fiber": Scene(**HAIR, alpha=TILT, tolerance=1e-3),
    "no tilt": Scene(**HAIR, sigma_a=(0, 2), tolerance=1e-3),
    "R only": Scene(**HAIR, alpha=TILT, sigma_a=(20, 100), tolerance=1e-3),
    "one theta_i": Scene(
        **HAIR, alpha=TILT, sigma_a=(0, 2), theta_i=0.5, tolerance=1e-3
    ),
    "smooth": Scene(
        eta=1.55, beta_m=0.05, beta_n=1e-4, alpha=TILT, sigma_a=(0, 2), tolerance=1e-3
    ),
    "very rough": Scene(
        eta=1.55, beta_m=1.0, beta_n=1.0, alpha=TILT, sigma_a=(0, 2), tolerance=1e-3
    ),
    "game": Scene(
        eta=(1.45, 1.65),
        beta_m=(0.09, 0.5),
        beta_n=(0.09, 0.5),
        alpha=TILT,
        sigma_a=(0, 4),
        tolerance=1e-2,
        dtype="float32",
    ),
    "reference": Scene(
        eta=(1.4, 1.7),
        beta_m=(0.05, 0.6),
        beta_n=(0.1, 0.6),
        alpha=(-0.1, 0.1),
        sigma_a=(0, 8),
        tolerance=1e-10,
    ),
}
"""By name; the last is asked for all digits."""


def inside(scene, count, seed):
    """A fiber of the scene drawn evenly from its ranges, and directions of it."""
    rng = np.random.default_rng(seed)

    def one(name, size=None):
        if getattr(scene, name) is None:
            return None
        low, high = scene.ends(name)
        return low + (high - low) * rng.random(size)

    numbers: Any = {name: one(name) for name in ("eta", "beta_m", "beta_n", "alpha")}
    sigma_a = one("sigma_a", 3)
    factors = {name: getattr(scene, name) for name in ("widths_m", "widths_n", "tilts")}
    fiber = fiberjax.Fiber(**numbers, sigma_a=sigma_a, **factors)
    names = "theta_i", "theta_o", "phi"
    angles = [np.asarray(one(name, count), scene.dtype) for name in names]
    # Rounding must not lead beyond the ends.
    ends = [np.asarray(scene.ends(name), scene.dtype) for name in names]
    angles = [np.clip(x, *e) for x, e in zip(angles, ends, strict=True)]
    fiber = jax.tree.map(lambda x: jnp.asarray(x, scene.dtype), fiber)
    return fiber, [jnp.asarray(x) for x in angles]


def full(scene):
    """The function that a plan stands for."""
    choices = {"detector": scene.detector, "incidence": scene.incidence}
    return partial(fiberjax.evaluate, **choices)


def truth(scene):
    """The same with many nodes, where the roughness allows that."""
    wide = scene.low("beta_n") >= 0.05
    return partial(full(scene), rule=fiberjax.GaussGamma(160)) if wide else full(scene)


def _peaks(scene, fiber, theta_i):
    """About the peak of each color at every theta_i: never above the true one."""
    theta_o, phi = np.meshgrid(
        np.linspace(-1.55, 1.55, 24), np.linspace(0, np.pi, 12), indexing="ij"
    )
    tilts = 0.0 if fiber.alpha is None else fiber.tilts[:3] * fiber.alpha
    cones = -theta_i[:, None] + tilts
    # Beyond a pole it comes down on the other side.
    cones = 2 * jnp.clip(cones, -np.pi / 2, np.pi / 2) - cones
    bright = fiberjax.caustics(2, (cones - theta_i[:, None]) / 2, eta=fiber.eta).phi
    size = len(theta_i), theta_o.size
    places = [
        (jnp.broadcast_to(theta_o.ravel(), size), jnp.broadcast_to(phi.ravel(), size)),
        *((cones, x + 0 * cones) for x in (0.0, np.pi, bright)),
    ]
    at = [jnp.concatenate(x, 1) for x in zip(*places, strict=True)]
    return truth(scene)(fiber, theta_i[:, None], *at).max(1)


def achieved(f, scene, fiber, angles):
    """The largest error of values over the peak of each color, against float64."""
    wide = jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), (fiber, angles))
    exact = truth(scene)(wide[0], *wide[1])
    peak = jnp.maximum(_peaks(scene, wide[0], wide[1][0]), exact)
    found = f(fiber, *angles).astype(exact.dtype)
    # A fiber that does not reflect and absorbs all has no peak.
    return float((jnp.abs(found - exact) / jnp.where(peak > 0, peak, 1)).max())
