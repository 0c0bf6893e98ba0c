"""What a scene asks: a sample, the full model on it, and which parts are needed."""

from dataclasses import replace
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from fiberjax import measured
from fiberjax.measured import Exact, full_model
from fiberjax.probes import Probe, probe
from fiberjax.scenes import Scene

MARGIN = 2.0
"""Measured errors are taken this many times: the sample misses the worst."""

NAMES = "R", "TT", "TRT", "rest"
TAIL = 3

LEFT_OUT = 0.4
"""Share of the tolerance for parts that are left out."""


class Asked(NamedTuple):
    """The sample of a scene, what the full model is there, and its peaks (F, I)."""

    scene: Scene
    sample: Probe
    exact: Exact
    peak: Any


def _everywhere(scene: Scene) -> Scene:
    """The scene with all directions scattered into."""
    return replace(scene, theta_o=(-np.pi / 2, np.pi / 2), phi=(-np.pi, np.pi))


def ask(scene: Scene, start: int = 0) -> Asked:
    """The sample that begins at `start`, and what the full model is on it."""
    model, sample = full_model(scene), probe(scene, start)
    found = measured.exact(model, sample)
    peak = found.values.sum(1).max((-1, -2))
    wide = _everywhere(scene)
    if wide != scene:
        around = measured.exact(model, probe(wide, start)).values
        peak = jnp.maximum(peak, around.sum(1).max((-1, -2)))
    if not bool(jnp.isfinite(peak).all()):
        raise ValueError(f"scene = {scene}: S is not finite in all of it")
    return Asked(scene, sample, found, peak)


def lost(asked: Asked) -> tuple[np.ndarray, np.ndarray]:
    """What each part is at most, over the peak and over the albedo."""
    scale = jnp.where(asked.peak > 0, asked.peak, 1)[:, None]
    over_peak = (asked.exact.values.max((-1, -2)) / scale).max((0, 2))
    total = asked.exact.albedo.sum(1, keepdims=True)
    over_albedo = (asked.exact.albedo / jnp.where(total > 0, total, 1)).max((0, 2))
    return MARGIN * np.asarray(over_peak), MARGIN * np.asarray(over_albedo)


def kept(asked: Asked) -> list[int]:
    """The parts that are needed: the weakest go first, while they are few enough.

    The rest stands for all lobes above TRT: where TRT goes, it goes too.
    """
    by_peak, by_albedo = lost(asked)
    allowed, gone = LEFT_OUT * asked.scene.tolerance, []
    for part in sorted(range(len(NAMES)), key=lambda k: max(by_peak[k], by_albedo[k])):
        tried = sorted({*gone, part, *((TAIL,) if part == TAIL - 1 else ())})
        sums = by_peak[tried].sum(), by_albedo[tried].sum()
        if max(sums) <= allowed and len(tried) < len(NAMES):
            gone = tried
    return [k for k in range(len(NAMES)) if k not in gone]
