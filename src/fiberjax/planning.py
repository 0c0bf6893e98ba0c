"""How a scene becomes a plan: what is left out, and what the rest is computed with."""

import math
from dataclasses import replace
from functools import cache

import jax.numpy as jnp
import numpy as np

from fiberjax import measured
from fiberjax.asking import MARGIN, NAMES, TAIL, Asked, ask, kept, lost
from fiberjax.auto import Auto
from fiberjax.choices import (
    Search,
    averaging,
    choose,
    enough,
    predicted,
    rounded,
    unreachable,
)
from fiberjax.formulas import FORMS, along, density_tolerance, formulas_said
from fiberjax.measured import ORDERS, full_model
from fiberjax.model import Model
from fiberjax.planned import ByLobe, Planned
from fiberjax.plans import Plan, Row
from fiberjax.rules import Rule
from fiberjax.scenes import Scene
from fiberjax.sharing import joined
from fiberjax.truncation import sizes

_SMOOTH = 0.05
"""Above this roughness the closed form is not tried."""

_ATTEMPTS = 3

_ELSEWHERE = 96
"""Where the second sample begins."""


def _density_rule(asked: Asked, kept: Model) -> tuple[Rule, float]:
    """One rule for the density that samples are drawn from."""
    scene = asked.scene
    expected = measured.densities(kept, asked.sample)

    def measure(k):
        return np.atleast_1d(measured.density_error(kept, k, asked.sample, expected))

    search, tolerance = Search(measure), 0.75 * scene.tolerance
    lobes = [p for p in kept.lobes if p < TAIL]
    low = min(scene.roughness("n", p)[0] for p in lobes)
    high = max(scene.roughness("n", p)[1] for p in lobes)
    if predicted(scene, max(lobes), tolerance) <= 2 * ORDERS[-1]:
        found = search.least(0, tolerance, enough(scene, tolerance))
        if found is not None:
            order, bound = found
            density = min(density_tolerance(scene, p) for p in lobes)
            return Planned(order, density, low, high), bound + FORMS * scene.tolerance
    tolerance = max(rounded(tolerance), 1e-15)
    return Auto(tolerance, low / 1.01, high * 1.01), tolerance


def plan(scene: Scene) -> Plan:
    """The smallest evaluator of a scene that meets its tolerance.

    Parts whose share of S and of the albedo is small enough are left out, the weakest
    first; each of the others gets the cheapest of a closed form, a table, nodes,
    windows and `auto` that meets its part of the tolerance. Bounds are `MARGIN` times
    the largest error on a sample of 64 fibers, the corners of the ranges and points
    between, of 6 theta_i, 16 theta_o and 40 phi each, against the full model in
    float64; those of formulas are a priori, and half of those of averages. They add up
    to less than the tolerance, and `MARGIN` times the error of the plan as a whole, on
    this sample and on a second one, is less too.

    Args:
        scene: what will be asked for.

    Returns:
        `Plan`, which says what became of each part.

    Raises:
        ValueError: float64 is not enabled, or the tolerance cannot be met in the dtype
            of the scene; the message has the one that can.
    """
    if jnp.result_type(float) != jnp.float64:
        raise ValueError("jax_enable_x64 is False: must be True to plan, not to run")
    asked, again = ask(scene), ask(scene, _ELSEWHERE)
    whole = replace(scene, phi=(-math.pi, math.pi))
    around = asked if whole == scene else ask(whole)
    error = math.inf
    for k in range(_ATTEMPTS):
        found = _attempt(asked, around, scene.tolerance / 4**k)
        # Unlike max, NaN stays.
        error = MARGIN * float(np.max([_error(found.model, x) for x in (asked, again)]))
        if error <= scene.tolerance:
            return found
    raise unreachable(scene, error)


def _error(model: Model, asked: Asked) -> float:
    """The largest error over the peak on a sample."""
    expected = asked.exact.values.sum(1)
    return float(measured.plan_error(model, asked.sample, expected, asked.peak))


def _searching(full: Model, asked: Asked) -> Search:
    """Errors by the number of nodes on a sample."""

    def measure(k):
        values, albedo = measured.node_errors(
            full, k, asked.sample, asked.exact, asked.peak
        )
        return np.append(values, albedo)

    return Search(measure)


def _attempt(asked: Asked, around: Asked, tolerance: float) -> Plan:
    """A plan whose bounds add up to less than a tolerance.

    A table holds all phi: its nodes are searched `around` the fiber.
    """
    scene = replace(asked.scene, tolerance=tolerance)
    asked = asked._replace(scene=scene)
    full, needed = full_model(scene), kept(asked)
    by_peak, by_albedo = lost(asked)
    gone = [k for k in range(len(NAMES)) if k not in needed]
    form, by_form = along(scene)
    left = tolerance - by_peak[gone].sum() - by_form - FORMS * tolerance
    allowed = left / len(needed)

    search = _searching(full, asked)
    of_tables = search if around.sample is asked.sample else _searching(full, around)
    closed = None
    if max(scene.roughness("n", p)[1] for p in (0, 1)) <= _SMOOTH:
        errors = measured.closed_errors(full, asked.sample, asked.exact, asked.peak)
        closed = MARGIN * np.asarray(errors)

    @cache
    def tables():
        return sizes(asked, full, allowed / 2)

    choices = {
        k: choose(asked, k, search, of_tables, tables, closed, allowed) for k in needed
    }
    left = tolerance - by_albedo[gone].sum()
    mean = averaging(scene, search, len(NAMES), 1.0, left)
    if mean is None:
        raise unreachable(scene, 2 * float(search.errors(len(ORDERS) - 1)[-1]))
    rules = [(None if k == TAIL else k, c.rule) for k, c in choices.items()]
    lobes = tuple(k for k in needed if k != TAIL)
    sample, peak = asked.sample, asked.peak

    def holds(group):
        some = list(group[0])
        together = replace(full, lobes=group[0], rest=False, rule=group[1])
        expected = asked.exact.values[:, some].sum(1)
        error = measured.plan_error(together, sample, expected, peak)
        return MARGIN * float(error) <= sum(choices[k].bound for k in some)

    rule = ByLobe(joined(rules, holds), mean[0])
    model = replace(full, lobes=lobes, rest=TAIL in needed, rule=rule, along=form)
    density, pdf_bound = _density_rule(
        asked, replace(model, rule=full.rule, along=None)
    )
    found = _rows(scene, model, choices, by_peak, by_form)
    bound = float(by_albedo[gone].sum() + mean[1])
    return Plan(asked.scene, model, density, found, bound, pdf_bound)


def _rows(scene, model, choices, by_peak, by_form) -> tuple[Row, ...]:
    """What became of each part."""
    found = []
    for k, name in enumerate(NAMES):
        left_out = Row(name, "left out", float(by_peak[k]))
        chosen = choices.get(k)
        found.append(Row(name, chosen.said, chosen.bound) if chosen else left_out)
    form = "exact"
    if model.along is not None:
        form = f"I0 of {model.along.terms} terms, polynomial angles"
    found.append(Row("M and angles", form, float(by_form)))
    forms = FORMS * scene.tolerance
    found.append(Row("detector", formulas_said(scene, model.lobes), forms))
    for name, what in (("alpha", "tilt"), ("sigma_a", "absorption")):
        absent = getattr(scene, name) is None
        found.append(Row(what, "absent" if absent else "kept", 0.0))
    return tuple(found)
