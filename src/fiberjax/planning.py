"""How a scene becomes a plan: what is left out, and what the rest is computed with."""

import math
from bisect import bisect_left
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from fiberjax import measured
from fiberjax.asking import MARGIN, NAMES, TAIL, Asked, ask, kept, lost
from fiberjax.auto import Auto
from fiberjax.choices import (
    Search,
    Unreachable,
    averaging,
    choose,
    enough,
    predicted,
    rounded,
    rounding,
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


class _Search(NamedTuple):
    """What is asked on two samples and around them, and errors by numbers of nodes."""

    asked: Asked
    again: Asked
    nodes: Search
    of_tables: Search


def _density_rule(found: _Search, scene: Scene, kept: Model) -> tuple[Rule, float]:
    """One rule for the density that samples are drawn from."""

    def on(asked):
        @cache
        def expected():
            return measured.densities(kept, scene.strategy, asked.sample)

        def measure(k):
            what = scene.strategy, k, asked.sample, expected()
            return np.atleast_1d(measured.density_error(kept, *what))

        return Search(measure)

    search, again, tolerance = on(found.asked), on(found.again), 0.75 * scene.tolerance
    lobes = [p for p in kept.lobes if p < TAIL]
    low = min(scene.roughness("n", p)[0] for p in lobes)
    high = max(scene.roughness("n", p)[1] for p in lobes)
    if predicted(scene, max(lobes), tolerance) <= 2 * ORDERS[-1]:
        least = search.least(0, tolerance, enough(scene, tolerance))
        least = least and again.least(0, tolerance, least[0])
        errors = least and [x.at(least[0])[0] for x in (search, again)]
        if least and errors and max(errors) <= tolerance:
            density = min(density_tolerance(scene, p) for p in lobes)
            rule = Planned(least[0], density, low, high)
            return rule, float(max(errors)) + FORMS * scene.tolerance
    floor = max(rounding(scene, p) for p in lobes)
    if floor >= tolerance:
        raise Unreachable
    tolerance = max(rounded(tolerance - floor), 1e-15)
    return Auto(tolerance, low / 1.01, high * 1.01), tolerance + floor


def _coarser(tolerance: float) -> list[float]:
    """All of one digit, 1, 2 or 5, above a tolerance and below 1."""
    lowest = math.floor(math.log10(tolerance))
    every = (float(f"{d}e{k}") for k in range(lowest, 0) for d in (1, 2, 5))
    return [x for x in every if x > tolerance]


def plan(scene: Scene) -> Plan:
    """The smallest evaluator of a scene that meets its tolerance.

    Parts whose share of S and of the albedo is small enough are left out, the weakest
    first; each of the others gets the cheapest of a closed form, a table, nodes,
    windows and `auto` that meets its part of the tolerance. Bounds are `MARGIN` times
    the largest error on a sample of 64 fibers, the corners of the ranges and points
    between, of 6 theta_i, 16 theta_o and 40 phi each, against the full model in
    float64; those of formulas are a priori, and half of those of averages. They add up
    to less than the tolerance, and `MARGIN` times the error of the plan as a whole, on
    this sample and on a second one, is less too. That of the pdf is measured on every
    third fiber of both.

    Args:
        scene: what will be asked for.

    Returns:
        `Plan`, which says what became of each part.

    Raises:
        ValueError: float64 is not enabled, or the tolerance cannot be met in the dtype
            of the scene; the message has the smallest of one digit, 1, 2 or 5, that
            can.
    """
    if jnp.result_type(float) != jnp.float64:
        raise ValueError("jax_enable_x64 is False: must be True to plan, not to run")
    asked, again = ask(scene), ask(scene, _ELSEWHERE)
    whole = replace(scene, phi=(-math.pi, math.pi))
    around = asked if whole == scene else ask(whole)
    full = full_model(scene)
    nodes = _searching(full, asked)
    of_tables = nodes if around is asked else _searching(full, around)
    search = _Search(asked, again, nodes, of_tables)
    found = _met(search, scene)
    if found is not None:
        return found
    wanted = _coarser(scene.tolerance)

    def meets(tolerance):
        return _met(search, replace(scene, tolerance=tolerance)) is not None

    k = bisect_left(wanted, True, key=meets)
    said = f"must be >= {wanted[k]:g}" if k < len(wanted) else "there is none"
    raise ValueError(
        f"tolerance = {scene.tolerance:g}: {said} for this scene in {scene.dtype}"
    )


def _met(search: _Search, scene: Scene) -> Plan | None:
    """The plan of a scene as a whole; None if it does not meet the tolerance."""
    for k in range(_ATTEMPTS):
        try:
            found = _attempt(search, scene, scene.tolerance / 4**k)
        except Unreachable:
            return None
        # Unlike max, NaN stays.
        both = [_error(found.model, x) for x in (search.asked, search.again)]
        if MARGIN * float(np.max(both)) <= scene.tolerance:
            return found
    return None


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


def _attempt(search: _Search, promised: Scene, tolerance: float) -> Plan:
    """A plan whose bounds add up to less than a tolerance.

    A table holds all phi: its nodes are searched around the fiber.
    """
    scene = replace(promised, tolerance=tolerance)
    asked = search.asked._replace(scene=scene)
    full, needed = full_model(scene), kept(asked)
    by_peak, by_albedo = lost(asked)
    gone = [k for k in range(len(NAMES)) if k not in needed]
    form, by_form = along(scene)
    left = tolerance - by_peak[gone].sum() - by_form - FORMS * tolerance
    allowed = left / len(needed)

    closed = None
    if max(scene.roughness("n", p)[1] for p in (0, 1)) <= _SMOOTH:
        errors = measured.closed_errors(full, asked.sample, asked.exact, asked.peak)
        closed = MARGIN * np.asarray(errors)

    @cache
    def tables():
        return sizes(asked, full, allowed / 2)

    choices = {
        k: choose(asked, k, search.nodes, search.of_tables, tables, closed, allowed)
        for k in needed
    }
    left = tolerance - by_albedo[gone].sum()
    mean = averaging(scene, search.nodes, len(NAMES), 1.0, left)
    if mean is None:
        raise Unreachable
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
        search, scene, replace(model, rule=full.rule, along=None)
    )
    found = _rows(scene, model, choices, by_peak, by_form)
    bound = float(by_albedo[gone].sum() + mean[1])
    return Plan(promised, model, density, found, bound, pdf_bound)


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
