"""A lock shaded in every pixel by a model, as an engine does it, and a tone map."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from shared.fits import script
from shared.lock import ASPECT, Fibers, arriving, fibers, seen

import fiberjax
from fiberjax import realtime

COLORS: Mapping[str, Any] = script("shared.cases").COLORS
ETA = script("shared.cases").ETA
ROUGHNESS = 0.5
ALPHA = -2.5
"""Degrees; tangents go from root to tip."""

REFERENCE = "reference"
RULE = fiberjax.auto(1e-6)
EYE = np.array([0.0, 0.0, 1.0])
SAMPLES = 3
"""Points of a pixel, in each direction."""

GROUND = np.array([0.020, 0.023, 0.029])
"""Linear."""

BRIGHT = 98.0
"""Percent of the reference's pixels that the exposure leaves below white."""


class Scene(NamedTuple):
    """What the camera sees under one light, angles and the factor common to models."""

    covered: np.ndarray
    theta_i: np.ndarray
    theta_o: np.ndarray
    phi: np.ndarray
    arriving: np.ndarray


def direction(azimuth: float, elevation: float) -> np.ndarray:
    """Unit vector; degrees from the eye about the vertical, and above the horizon."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def hair() -> fiberjax.Fiber:
    """The fiber in all colors at once: three channels of each."""
    width = ROUGHNESS**2
    colors = np.ravel(list(COLORS.values()))
    sigma_a = -np.log(colors) / script("shared.cases").PASS
    return fiberjax.Fiber(ETA, width, width, np.radians(ALPHA), sigma_a)


def scenes(
    width: int, lights: Sequence[np.ndarray], lock: Fibers | None = None
) -> list[Scene]:
    """The lock, so many pixels wide, under each light."""
    columns, rows = width * SAMPLES, round(ASPECT * width) * SAMPLES
    at = seen(fibers() if lock is None else lock, columns, rows)
    found = []
    for light in lights:
        theta_i, theta_o, phi = map(
            np.asarray, fiberjax.to_angles(light, EYE, at.tangent)
        )
        factor = arriving(at, light)
        found.append(Scene(at.covered, theta_i, theta_o, phi, factor))
    return found


@partial(jax.jit, static_argnames=("model", "p"))
def lobe(model: str, p: int, fiber: fiberjax.Fiber, *angles: Any) -> jax.Array:
    """A lobe of the reference or of a tier."""
    if model == REFERENCE:
        return fiberjax.lobe(fiber, p, *angles, rule=RULE)
    return realtime.lobe(model, fiber, p, *angles)


def radiance(model: str, p: int, scene: Scene) -> dict[str, np.ma.MaskedArray]:
    """Linear pictures (rows, columns, 3) of one lobe by color, masked without a fiber.

    Every point of a pixel has its own; shape is that of scene.covered.
    """
    angles = (jnp.asarray(x) for x in (scene.theta_i, scene.theta_o, scene.phi))
    value = np.asarray(lobe(model, p, hair(), *angles))
    value = value.reshape(-1, len(COLORS), 3) * scene.arriving[:, None, None]
    found = {}
    for k, name in enumerate(COLORS):
        found[name] = np.ma.array(np.zeros((*scene.covered.shape, 3)), mask=True)
        found[name][scene.covered] = value[:, k]
    return found


def exposure(reference: np.ma.MaskedArray) -> float:
    """The factor that brings the brightest pixels to white."""
    return 1 / float(np.percentile(reference.max(-1).compressed(), BRIGHT))


def _pixels(points: np.ndarray) -> np.ndarray:
    rows, columns = (n // SAMPLES for n in points.shape[:2])
    return points.reshape(rows, SAMPLES, columns, SAMPLES, 3).mean((1, 3))


def srgb(linear: np.ndarray) -> np.ndarray:
    """The curve of sRGB."""
    x = np.clip(linear, 0, 1)
    return np.where(x < 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def developed(points: np.ma.MaskedArray, exposed: float) -> np.ndarray:
    """Exposed, cut at white, averaged over pixels, in sRGB."""
    ground = np.ma.getmaskarray(points)
    shown = np.where(ground, GROUND, np.minimum(points.data * exposed, 1))
    return srgb(_pixels(shown))


def difference(
    points: np.ma.MaskedArray, reference: np.ma.MaskedArray, exposed: float
) -> np.ndarray:
    """Mean over channels of the exposed difference, (rows, columns); 0 beside."""
    return _pixels((points - reference).filled(0) * exposed).mean(-1)


def off(points: np.ma.MaskedArray, reference: np.ma.MaskedArray) -> float:
    """Relative L2 of the difference over the lock."""
    error, size = ((x.compressed() ** 2).sum() for x in (points - reference, reference))
    return float(np.sqrt(error / size))
