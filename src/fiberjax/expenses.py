"""What the parts of a model cost, in operations."""

import math
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax.asking import NAMES
from fiberjax.choices import enough, predicted
from fiberjax.counting import cost, operations
from fiberjax.farfield import scattered
from fiberjax.fiber import Fiber
from fiberjax.measured import FULL, full_model
from fiberjax.model import Model
from fiberjax.planned import ByLobe, Planned
from fiberjax.probes import probe
from fiberjax.scenes import Scene
from fiberjax.windows import Windowed

_COUNT = 1 << 14
"""Directions that operations are counted for: what is of the fiber alone vanishes."""


def _example(scene: Scene) -> tuple[Fiber, list[Any]]:
    sample = probe(scene)
    fiber = jax.tree.map(lambda x: jnp.asarray(x[0]), sample.fiber)
    angles = (x.ravel() for x in (sample.theta_i, sample.theta_o, sample.phi))
    return fiber, [jnp.asarray(np.resize(x, _COUNT)) for x in angles]


def operations_of(
    model: Model, scene: Scene, parts: tuple[int, ...]
) -> dict[str, float]:
    """Operations of a value of some parts, in one color, for directions alone."""
    fiber, angles = _example(scene)
    return operations(partial(scattered, model, fiber, parts), *angles, per=_COUNT)


def _cost(model: Model, scene: Scene, *parts: int) -> float:
    return cost(operations_of(model, scene, parts))


def baseline(scene: Scene) -> Model:
    """The full model by the nodes or windows that `evaluate` takes in the scene.

    Those of the fiber that asks for most; `auto` itself decides when running.
    """

    def rule(lobe):
        count = predicted(scene, lobe, FULL)
        if count <= 5.5 * math.log(1 / FULL):
            return Planned(math.ceil(count), FULL, *scene.roughness("n", lobe))
        return Windowed(math.ceil(1.3 * math.log(1 / FULL)), FULL)

    rules = [((p,), rule(p)) for p in (0, 1, 2)]
    rest = Planned(enough(scene, FULL), FULL)
    return full_model(scene, ByLobe((*rules, ((None,), rest)), rest))


def costs(scene: Scene, model: Model) -> dict[str, tuple[float, float]]:
    """Flops of a value of each part by itself, in the full model and in another."""
    parts = dict(zip(NAMES, full_model(scene).parts, strict=True))
    full = baseline(scene)
    return {
        name: (
            _cost(full, scene, part),
            _cost(model, scene, part) if part in model.parts else 0.0,
        )
        for name, part in parts.items()
    }
