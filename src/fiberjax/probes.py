"""The sample of a scene that errors are measured on."""

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from fiberjax.fiber import Fiber
from fiberjax.ranges import Interval
from fiberjax.scenes import NUMBERS, Scene, fiber_of

FIBERS, THETA_I, THETA_O, PHI = 64, 6, 16, 40
"""How many fibers, theta_i of each, theta_o of each of those, and phi of each fiber."""

_LOBES = (0, 1, 2)
_AROUND = (0.0, -1.2, 1.2)
_CURVE = 6.0
"""How much denser a range of sigma_a from 0 on is sampled at its low end, as a log."""


class Probe(NamedTuple):
    """Fibers (F,), theta_i (F, I, 1, 1), theta_o (F, I, J, 1), phi (F, 1, 1, K)."""

    fiber: Fiber
    theta_i: Any
    theta_o: Any
    phi: Any


def _between(name: str, ends: Interval, u: np.ndarray) -> np.ndarray:
    """From low to high as u goes from 0 to 1: roughness and absorption by orders."""
    low, high = ends
    if name in ("beta_m", "beta_n") or (name == "sigma_a" and low > 0):
        found = low * (high / low) ** u
    elif name == "sigma_a":
        found = high * np.expm1(_CURVE * u) / np.expm1(_CURVE)
    else:
        found = low + (high - low) * u
    return np.clip(found, low, high)


def _numbers(scene: Scene, start: int) -> dict[str, np.ndarray | None]:
    """All corners of the ranges, and points that fill them evenly."""
    ends = {name: getattr(scene, name) for name in NUMBERS}
    wide = [name for name, x in ends.items() if x is not None and x[0] < x[1]]
    points = np.zeros((FIBERS, 0))
    if wide:
        corners = np.array(list(product((0.0, 1.0), repeat=len(wide))))
        halton = qmc.Halton(len(wide), scramble=False)
        halton.fast_forward(1 + start)
        points = np.concatenate([corners, halton.random(FIBERS - len(corners))])
    found: dict[str, np.ndarray | None] = {}
    for name, x in ends.items():
        u = points[:, wide.index(name)] if name in wide else np.zeros(FIBERS)
        found[name] = None if x is None else _between(name, x, u)
    return found


def _folded(theta: np.ndarray) -> np.ndarray:
    return 2 * np.clip(theta, -np.pi / 2, np.pi / 2) - theta


def _spread(ends: Interval, shift: np.ndarray, count: int) -> np.ndarray:
    """`count` values evenly inside an interval, moved by a share of their distance."""
    at = (np.arange(count) + shift[..., None]) / count
    return ends[0] + (ends[1] - ends[0]) * at


def _theta_o(scene: Scene, theta_i: np.ndarray, numbers, shift) -> np.ndarray:
    """Around the cones of R, TT and TRT, both ends, and evenly between."""
    found = []
    for p in _LOBES:
        width = scene.roughness("m", p)[0] / scene.low("beta_m") * numbers["beta_m"]
        tilt = scene.tilts[min(p, len(scene.tilts) - 1)]
        alpha = numbers["alpha"]
        cone = -theta_i if alpha is None else -theta_i + tilt * alpha[:, None]
        found += [_folded(cone) + k * width[:, None] for k in _AROUND]
    around = np.clip(np.stack(found, -1), *scene.ends("theta_o"))
    ends = np.broadcast_to(scene.ends("theta_o"), (*theta_i.shape, 2))
    even = _spread(scene.ends("theta_o"), shift, THETA_O - 2 - around.shape[-1])
    return np.concatenate([around, ends, even], -1)


def _features(scene: Scene, numbers, shift: np.ndarray) -> np.ndarray:
    """Azimuths where lobes change: forward, backward, the caustic of TRT, TT's edge."""
    beta = numbers["beta_n"][:, None]
    near = np.concatenate([s * beta for s in (0.0, 0.7, 1.5, 3.0)], -1)
    theta_d = np.max(np.abs([scene.ends("theta_i"), scene.ends("theta_o")])) * np.array(
        [0, 0.4, 0.7, 0.9]
    )
    # Shifts keep two samples of a scene apart.
    cos = np.cos(theta_d * (0.9 + 0.2 * shift[:, None]))
    eta = numbers["eta"][:, None]
    square = (eta * eta - 1 + cos * cos) / (cos * cos)
    cos_gamma = np.sqrt(np.clip((square - 1) / 3, 0, 1))
    sin_gamma = np.sqrt(1 - cos_gamma**2)
    gamma_t = np.arcsin(sin_gamma / np.sqrt(square))
    caustic = 4 * gamma_t - 2 * np.arcsin(sin_gamma)
    edge = 2 * np.arcsin(1 / np.sqrt(square))
    bent = [caustic + s * beta for s in (-0.7, 0.0, 0.7)]
    return np.concatenate([near, np.pi - near, *bent, edge], -1)


def _phi(scene: Scene, numbers, shift: np.ndarray) -> np.ndarray:
    """Features that lie in the range of phi, by whole turns or mirrored, and evenly."""
    low, high = scene.ends("phi")
    wanted = _features(scene, numbers, shift)
    even = _spread(scene.ends("phi"), shift, PHI - wanted.shape[-1])
    found = np.full_like(wanted, np.nan)
    for sign in (1, -1):
        moved = low + np.mod(sign * wanted - low, 2 * np.pi)
        found = np.where(np.isnan(found) & (moved <= high), moved, found)
    spare = _spread(scene.ends("phi"), 1 - shift, wanted.shape[-1])
    return np.concatenate([np.where(np.isnan(found), spare, found), even], -1)


def probe(scene: Scene, start: int = 0) -> Probe:
    """`FIBERS` fibers of a scene with directions of their own, in its dtype.

    Fibers are the corners of the ranges, and points inside; directions are the ends of
    the ranges, those around the lobes, and between. Another `start`, another sample.
    """
    numbers = _numbers(scene, start)
    rng = qmc.Halton(4, scramble=False)
    rng.fast_forward(1 + start)
    shift = rng.random(FIBERS)
    ends = np.broadcast_to(scene.ends("theta_i"), (FIBERS, 2))
    inside = _spread(scene.ends("theta_i"), shift[:, 0], THETA_I - 2)
    theta_i = np.concatenate([ends, inside], -1)
    each = np.mod(shift[:, 1, None] + np.arange(THETA_I) / THETA_I, 1)
    theta_o = _theta_o(scene, theta_i, numbers, each)
    phi = _phi(scene, numbers, shift[:, 2])

    def rounded(x, ends):
        """In the dtype, and no rounding beyond the ends."""
        x = np.asarray(x, scene.dtype)
        low, high = np.asarray(ends, scene.dtype)
        return np.clip(x, low, high)

    return Probe(
        fiber_of(scene, numbers, scene.dtype),
        rounded(theta_i, scene.ends("theta_i"))[:, :, None, None],
        rounded(theta_o, scene.ends("theta_o"))[..., None],
        rounded(phi, scene.ends("phi"))[:, None, None, :],
    )
