"""Errors on the sample of a scene, against the full model in float64."""

import math
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax._types import Floats
from fiberjax.auto import Auto, auto
from fiberjax.energy import albedo_model
from fiberjax.farfield import evaluate_model, pdf_model, scattered
from fiberjax.graded import GaussGamma
from fiberjax.model import Model
from fiberjax.planned import Closed, Tried
from fiberjax.probes import Probe
from fiberjax.ranges import Interval
from fiberjax.rules import Rule
from fiberjax.scenes import Scene

ORDERS = (*range(3, 13), *range(14, 25, 2), 28, 32, 36, 40, 44, 48, 56, 64, 80, 96)
"""The numbers of nodes that are tried."""

_AVERAGES = GaussGamma(192)
"""For what has no azimuth: not the rule whose numbers of nodes are to be found."""

_SOME = 3
"""Every so many fibers are enough for a density: an odd stride meets both ends of all
numbers among the corners."""


class Exact(NamedTuple):
    """The full model: values (F, P, I, J, K) of parts, and albedos (F, P, I)."""

    values: Floats
    albedo: Floats


FULL = 1e-12
"""The tolerance of `evaluate`, which stands for the truth."""

_BANDS = (1e-6, 0.1), (0.36, 0.73, math.inf)
"""Roughness where what is compiled for it changes, from below and from above."""


def band(scene: Scene) -> Interval:
    """A range of roughness around that of a scene, of few that there are.

    What is compiled for it serves other scenes too.
    """
    ends = [scene.roughness("n", p) for p in (0, 1, 2)]
    low, high = min(x for x, _ in ends), max(x for _, x in ends)
    below = max((x for x in _BANDS[0] if x <= low), default=low)
    return below, min(x for x in _BANDS[1] if x >= high)


def full_model(scene: Scene, rule: Rule | None = None) -> Model:
    """R, TT, TRT and the rest, by a rule or to all digits."""
    rule = auto(FULL, *band(scene)) if rule is None else rule
    return Model((0, 1, 2), True, rule, scene.detector, scene.incidence)


def _tried(model: Model, index: Any) -> Model:
    """The model with ORDERS[index] nodes."""
    assert isinstance(model.rule, Auto)
    low, high = model.rule.s_min, model.rule.s_max
    return replace(model, rule=Tried(low=low, high=high, orders=ORDERS, index=index))


def _angles(sample: Probe) -> tuple[Any, Any, Any]:
    return sample.theta_i, sample.theta_o, sample.phi


def in_float64(sample: Probe) -> Probe:
    """The same numbers, in float64."""
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), sample)


def _parts(model: Model, one: Probe, rest: Rule | None = None) -> Floats:
    """M N of each part; `rest` is a rule for the last of them."""

    def part(p):
        rule = model.rule if rest is None or p != model.tail else rest
        return scattered(replace(model, rule=rule), one.fiber, (p,), *_angles(one))

    return jnp.stack(jnp.broadcast_arrays(*map(part, model.parts)))[..., 0]


def _plain(theta_i: Floats) -> Floats:
    """Without the axes of theta_o and phi."""
    return theta_i[..., 0, 0]


@partial(jax.jit, static_argnames="model")
def exact(model: Model, sample: Probe) -> Exact:
    """What parts of a model are on a sample, fiber by fiber."""
    averages = replace(model, rule=_AVERAGES)

    def one(at):
        albedo = albedo_model(averages, at.fiber, _plain(at.theta_i), True)
        return Exact(_parts(model, at, _AVERAGES), albedo)

    return jax.lax.map(one, in_float64(sample))


def worst(found: Floats, expected: Floats, scale: Floats) -> Floats:
    """Largest error over a scale (I,), of each of the first axis; NaN stays."""
    error = jnp.abs(found.astype(expected.dtype) - expected)
    error = error.max((-1, -2)) / jnp.where(scale > 0, scale, 1)
    return error.max(-1)


@partial(jax.jit, static_argnames="model")
def node_errors(model: Model, index: Any, sample: Probe, at: Exact, peak: Floats):
    """For each part the largest error over the peak, and that of the mean albedo.

    With ORDERS[index] nodes, in the dtype of the sample.
    """
    tried = _tried(model, index)

    def one(both):
        at, exact, peak = both
        values = worst(_parts(tried, at), exact.values, peak)
        albedo = albedo_model(tried, at.fiber, _plain(at.theta_i), True)
        total = exact.albedo.sum(0)
        away = jnp.abs(albedo.astype(total.dtype) - exact.albedo).sum(0)
        # A fiber that does not reflect and absorbs all has none.
        return values, (away / jnp.where(total > 0, total, 1)).max()

    values, albedo = jax.lax.map(one, (sample, at, peak))
    return values.max(0), albedo.max()


@partial(jax.jit, static_argnames="model")
def closed_errors(model: Model, sample: Probe, at: Exact, peak: Floats):
    """For R and TT the largest error of the closed form over the peak."""
    closed = replace(model, rule=Closed(8))

    def one(both):
        at, exact, peak = both
        each = [scattered(closed, at.fiber, (p,), *_angles(at)) for p in (0, 1)]
        found = jnp.stack(jnp.broadcast_arrays(*each))[..., 0]
        return worst(found, exact.values[:2], peak)

    return jax.lax.map(one, (sample, at, peak)).max(0)


def _few(sample: Probe) -> Probe:
    return jax.tree.map(lambda x: x[::_SOME], sample)


@partial(jax.jit, static_argnames=("model", "strategy"))
def densities(model: Model, strategy: str, sample: Probe) -> Floats:
    """The pdf on every third fiber, (F/3, I, J, K)."""

    def one(at):
        return pdf_model(model, strategy, at.fiber, *_angles(at))

    return jax.lax.map(one, _few(in_float64(sample)))


@partial(jax.jit, static_argnames=("model", "strategy"))
def density_error(
    model: Model, strategy: str, index: Any, sample: Probe, at: Floats
) -> Floats:
    """The largest error of the pdf over its peak with ORDERS[index] nodes."""
    tried = _tried(model, index)

    def one(both):
        where, expected = both
        found = pdf_model(tried, strategy, where.fiber, *_angles(where))
        peak = expected.max((-1, -2))
        return worst(found[None], expected[None], peak)[0]

    return jax.lax.map(one, (_few(sample), at)).max()


@partial(jax.jit, static_argnames="model")
def plan_error(model: Model, sample: Probe, expected: Floats, peak: Floats) -> Floats:
    """The largest error over the peak of a plan, as it will be run."""

    def one(both):
        at, expected, peak = both
        found = evaluate_model(model, at.fiber, *_angles(at))
        return worst(found[None], expected[None], peak)[0]

    return jax.lax.map(one, (sample, expected, peak)).max()
