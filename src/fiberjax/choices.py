"""The rule of each part of a plan, by the tolerance that is left for it."""

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fiberjax.asking import MARGIN, TAIL, Asked, lost
from fiberjax.auto import Auto
from fiberjax.detectors import DETECTORS
from fiberjax.formulas import density_tolerance
from fiberjax.graded import grading, layer
from fiberjax.measured import ORDERS
from fiberjax.orders import REST, averaged, needed, turning
from fiberjax.planned import Closed, Planned
from fiberjax.rules import Rule
from fiberjax.scenes import Scene
from fiberjax.section import section_of
from fiberjax.tabled import Span, Tabled
from fiberjax.truncation import Size, cosines
from fiberjax.windows import Windowed

_NARROW = 0.1
"""Windows are for roughness below."""

_FIRST, _STRIDE = ORDERS.index(12), 5
"""Where a search begins, and how it goes on: many nodes take long to measure."""

_NODE, _ENTRY, _READ = 200.0, 2.0, 60.0
"""Flops of a node, of an entry of a table and of reading one, near what `operations`
counts: 59 to 266 for a node, by the lobe, the detector and absorption."""


@dataclass(frozen=True)
class Choice:
    """A rule for one part, the bound of its error, what to say of it, and its cost."""

    rule: Rule
    bound: float
    said: str
    flops: float = math.inf


def predicted(scene: Scene, lobe: int, tolerance: float) -> float:
    """Nodes that a lobe takes in the fiber that asks for most."""
    found, low = [], scene.roughness("n", lobe)[0]
    for eta in scene.ends("eta"):
        k = (eta - 1) * (eta + 1)
        delta = np.float64(max(math.sqrt(k), 1e-3))
        band = DETECTORS[scene.detector].bandwidth(tolerance) / low
        turns = band * turning(lobe, np.float64(0), np.float64(eta), delta, np)
        found.append(float(needed(turns, delta, lobe, math.log(1 / tolerance), np)))
    return max(found)


class Search:
    """Errors by the number of nodes, each measured once."""

    def __init__(self, measure: Callable[[int], np.ndarray]):
        self._measure, self._found = measure, {}

    def errors(self, k: int) -> np.ndarray:
        """`MARGIN` times the errors with ORDERS[k] nodes."""
        if k not in self._found:
            self._found[k] = MARGIN * np.asarray(self._measure(k), float)
        return self._found[k]

    def at(self, order: int) -> np.ndarray:
        """The same by the number itself, one of ORDERS."""
        return self.errors(ORDERS.index(order))

    def least(
        self, which: int, allowed: float, at_least: int = 0
    ) -> tuple[int, float] | None:
        """The smallest order for an error, and the error; None if none will do."""

        def enough(k):
            return self.errors(k)[which] <= allowed

        last = len(ORDERS) - 1
        low = min(bisect_left(ORDERS, at_least), last)
        high = max(low, _FIRST)
        while not enough(high):
            if high == last:
                return None
            low, high = high + 1, min(high + _STRIDE, last)
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if enough(middle) else (middle + 1, high)
        return ORDERS[low], float(self.errors(low)[which])


def averaging(
    scene: Scene, search: Search, which: int, size: float, allowed: float
) -> tuple[Planned, float] | None:
    """The rule of averages of some size, and the bound of its error.

    Half of what is allowed is for optics, a priori: a sample has too few of the small
    sigma_a that ask for most. Half is for what is measured, rounding included.
    """
    tolerance = min(max(float(allowed) / 2 / max(size, allowed), 1e-15), 1e-2)
    found = search.least(which, allowed / 2, enough(scene, tolerance))
    if found is None:
        return None
    order = max(found[0], enough(scene, tolerance))
    return Planned(order, tolerance), size * tolerance + found[1]


def enough(scene: Scene, tolerance: float) -> int:
    """Nodes of averages, a priori, in the fiber of a scene that asks for most."""
    low, high = scene.low("sigma_a"), scene.high("sigma_a")

    def worst(of, sigma_a):
        absorbing = None if scene.sigma_a is None else jnp.asarray(sigma_a)
        every = [jnp.asarray(eta) for eta in scene.ends("eta")]
        return min(float(of(section_of(jnp.ones(()), eta, absorbing))) for eta in every)

    delta = worst(lambda at: grading(at, REST), high)
    # The clearest color that absorbs may be of any kind.
    near = worst(lambda at: layer(at, tolerance), max(low, 1e-30))
    scales = np.float64(delta), np.float64(min(delta, near))
    return math.ceil(averaged(*scales, math.log(1 / tolerance), np))


def _planned(scene: Scene, lobe: int, order: int) -> Planned:
    low, high = scene.roughness("n", lobe)
    tolerance = density_tolerance(scene, lobe)
    terms = math.ceil(math.sqrt(2 * math.log(1 / tolerance)) / low) + 1
    # A series of more terms takes longer than the nodes by themselves.
    terms = 0 if terms > 512 or scene.detector != "normal" else terms
    return Planned(order, tolerance, low, high, terms)


def rounded(tolerance: float) -> float:
    """The power of ten below."""
    return 10.0 ** math.floor(math.log10(tolerance))


class Unreachable(Exception):
    """No rule meets what is allowed in the dtype of the scene."""


def rounding(scene: Scene, lobe: int) -> float:
    """What rounding costs over the peak of N, as `auto` says."""
    turns = 4 * math.pi / min(scene.roughness("n", lobe)[0], 1)
    turns += 4 * lobe * scene.high("sigma_a")
    return float(np.finfo(scene.dtype).eps) * turns


def _narrow(scene: Scene, lobe: int, allowed: float) -> Choice:
    """Windows, or the rule that chooses when running, by their own tolerance."""
    low, high = scene.roughness("n", lobe)
    floor = rounding(scene, lobe)
    if floor >= allowed:
        raise Unreachable
    # Less by a little, so that the bounds of a plan cannot add up to more by rounding.
    tolerance = max(0.99 * float(allowed - floor), 1e-15)
    if high < _NARROW and scene.detector == "normal":
        order = math.ceil(1.3 * math.log(1 / tolerance))
        rule = Windowed(order, tolerance)
        return Choice(rule, tolerance + floor, f"windows of {order} nodes")
    tolerance = max(rounded(tolerance), 1e-15)
    rule = Auto(tolerance, low / 1.01, high * 1.01)
    return Choice(rule, tolerance + floor, f"auto({tolerance:.0e})")


def _table(
    asked: Asked, part: int, size: Size | None, search: Search, allowed: float
) -> Choice | None:
    """The table of a part; None if none will do."""
    found = _fewest(asked, part, search, allowed / 2)
    blurred = part != TAIL and asked.scene.detector != "normal"
    if blurred or not size or not found:
        return None
    nodes, bound = found
    span = Span(None if part == TAIL else part, nodes.order, size.degree, size.terms)
    rule = Tabled((span,), *cosines(asked.scene), nodes)
    flops = _ENTRY * (size.degree + 3) * (size.terms + 3) + _READ
    said = f"table, {size.degree + 1} x {size.terms + 1}"
    return Choice(rule, size.bound + bound, said, flops)


def _fewest(
    asked: Asked, part: int, search: Search, allowed: float
) -> tuple[Planned, float] | None:
    """The fewest nodes of a part, and the bound; None if none will do.

    No fewer than what is known a priori: near the poles errors may be large at a few
    phi that the sample misses.
    """
    if part == TAIL:
        size = float(lost(asked)[0][TAIL])
        return averaging(asked.scene, search, TAIL, size, allowed)
    least = math.ceil(predicted(asked.scene, part, allowed))
    found = search.least(part, allowed, least)
    return found and (_planned(asked.scene, part, found[0]), found[1])


def choose(
    asked: Asked, part: int, search: Search, of_tables: Search, tables, closed, allowed
) -> Choice:
    """The rule of a part, the cheapest that meets what is allowed.

    Closed form, table or nodes, by their flops; windows, or a choice made when running,
    where roughness is too small for those; `Unreachable` if rounding hides it.
    """
    scene = asked.scene
    if closed is not None and part < 2 and closed[part] <= allowed:
        return Choice(Closed(8), float(closed[part]), "closed form")
    lobe = None if part == TAIL else part
    if lobe is not None and predicted(scene, lobe, allowed) > 2 * ORDERS[-1]:
        return _narrow(scene, lobe, allowed)
    both = []
    found = _fewest(asked, part, search, allowed)
    if found:
        rule, bound = found
        said = f"{rule.order} nodes"
        both.append(Choice(rule, bound, said, _NODE * rule.order))
    table = _table(asked, part, tables()[part], of_tables, allowed)
    if table:
        both.append(table)
    if both:
        return min(both, key=lambda choice: choice.flops)
    if lobe is None:
        raise Unreachable
    return _narrow(scene, lobe, allowed)
