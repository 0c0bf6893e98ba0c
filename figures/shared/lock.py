"""A lock of hair: where its fibers are, and what a camera sees of them.

Fibers hang along a loose curl, drawn together in wisps and thinning towards the tips;
all randomness is seeded. The camera is orthographic and looks along -z, y is up.
"""

from typing import NamedTuple

import numpy as np

SEED = 2016
FIBERS = 5000
WISPS = 60
ASPECT = 2.2
"""Height over width of the picture, which is 2 wide."""

LENGTH, RADIUS, CURL = 4.24, 0.6, np.array([0.17, 0.07])
DEPTH = 0.8
"""Of light that goes through one radius of the lock, exp(-DEPTH) arrives."""


class Fibers(NamedTuple):
    """Points along fibers, and where they are in the lock.

    point is (fibers, points, 3); place, across the lock in radii of it, (fibers,
    points, 2); shade, a factor for each fiber, (fibers,).
    """

    point: np.ndarray
    place: np.ndarray
    shade: np.ndarray


class Seen(NamedTuple):
    """The picture's points that a fiber covers, and of each of them, in order.

    covered (rows, columns); the unit tangent from root to tip (n, 3), place (n, 2) and
    shade (n,) of the nearest fiber.
    """

    covered: np.ndarray
    tangent: np.ndarray
    place: np.ndarray
    shade: np.ndarray


def _between(x, low, high):
    """0 below, 1 above, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _disc(random, count):
    """Points in the unit disc."""
    radius, angle = np.sqrt(random.random(count)), random.random(count) * 2 * np.pi
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)


def _waves(random, count, low, high):
    """Number and phase of waves along the lock, in two directions."""
    number = random.uniform(low, high, (count, 1, 2))
    return number, 2 * np.pi * random.random((count, 1, 2))


def _wave(number, phase, s):
    return np.sin(2 * np.pi * number * s[..., None] + phase)


def _turned(x, angle):
    """Vectors in the plane, turned."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack(
        [cos * x[..., 0] - sin * x[..., 1], sin * x[..., 0] + cos * x[..., 1]], -1
    )


def fibers(count: int = FIBERS, points: int = 160, seed: int = SEED) -> Fibers:
    """The fibers of the lock."""
    random = np.random.default_rng(seed)
    own, centers = _disc(random, count), _disc(random, WISPS)
    wisp = np.argmin(((own[:, None] - centers) ** 2).sum(-1), -1)
    end = 1 - 0.13 * random.random(WISPS)[wisp] - 0.1 * random.random(count) ** 2
    s = np.linspace(0, 1, points) * end[:, None]
    together = (0.1 + 0.5 * _between(s, 0.2, 1.0))[..., None]
    drawn = own[:, None] + together * (centers[wisp] - own)[:, None]
    place = _turned(drawn, 0.9 * s)
    number, phase = _waves(random, WISPS, 1.0, 2.2)
    opened = _between(s, 0.1, 0.9)[..., None]
    place += 0.12 * opened * _wave(number[wisp], phase[wisp], s)
    stray = 0.008 + 0.12 * random.random((count, 1, 1)) ** 8
    place += stray * _wave(*_waves(random, count, 2.0, 5.0), s)
    turn = 2 * np.pi * 1.5 * s**0.9 + 0.5
    curl = (0.15 + 0.85 * _between(s, 0, 0.6))[..., None] * CURL
    curl = curl * np.stack([np.sin(turn), np.cos(turn)], -1)
    wide = RADIUS * (0.75 + 0.25 * _between(s, 0, 0.35))
    wide = wide * (1 - 0.6 * _between(s, 0.55, 1.05))
    across = curl + wide[..., None] * place * np.array([1.0, 0.75])
    point = np.stack([across[..., 0], LENGTH * (0.5 - s), across[..., 1]], -1)
    spread = 0.2 * random.standard_normal(count)
    spread += 0.12 * random.standard_normal(WISPS)[wisp]
    return Fibers(point, place, np.exp(spread))


def seen(lock: Fibers, width: int, height: int) -> Seen:
    """The nearest fiber in every point of a picture of so many points."""
    step = np.diff(lock.point, axis=1)
    parts = 1 + int(1.1 * width / 2 * np.abs(step[..., 1]).max())
    nearest = np.full(width * height, -1)
    depth = np.full(width * height, -np.inf)
    each = np.arange(step[..., 0].size)
    for t in (np.arange(parts) + 0.5) / parts:
        x, y, z = np.moveaxis((lock.point[:, :-1] + t * step).reshape(-1, 3), -1, 0)
        column = np.floor((x + 1) / 2 * width).astype(int)
        row = np.floor((ASPECT - y) / 2 * width).astype(int)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        at, z, one = (row * width + column)[inside], z[inside], each[inside]
        # Of those in one point, the last written is the nearest.
        order = np.argsort(z, kind="stable")
        at, z, one = at[order], z[order], one[order]
        best = np.full(width * height, -1)
        best[at] = np.arange(len(at))
        there = np.flatnonzero(best >= 0)
        closer = there[z[best[there]] > depth[there]]
        depth[closer], nearest[closer] = z[best[closer]], one[best[closer]]
    covered = nearest >= 0
    fiber, part = np.unravel_index(nearest[covered], step.shape[:2])
    tangent = step[fiber, part]
    tangent = tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)
    place = lock.place[fiber, part]
    return Seen(covered.reshape(height, width), tangent, place, lock.shade[fiber])


def arriving(at: Seen, light: np.ndarray) -> np.ndarray:
    """The factor common to all models: shade, and exp(-DEPTH) a radius to the edge."""
    towards = light[[0, 2]] / np.hypot(light[0], light[2])
    along = at.place @ towards
    rest = np.maximum(1 - (at.place**2).sum(-1), 0)
    return at.shade * np.exp(-DEPTH * (np.sqrt(along**2 + rest) - along))
