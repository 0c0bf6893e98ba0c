"""The rule of each part of a plan, by the tolerance that is left for it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fiberjax import measured
from fiberjax.asking import LEFT_OUT, MARGIN, NAMES, TAIL, Asked
from fiberjax.auto import Auto
from fiberjax.formulas import FORMS, density_tolerance
from fiberjax.measured import ORDERS
from fiberjax.orders import needed, turning
from fiberjax.planned import Closed, Planned
from fiberjax.rules import Rule
from fiberjax.scenes import Scene
from fiberjax.tabled import Tabled
from fiberjax.windows import Windowed

_NARROW = 0.1
"""Windows are for roughness below."""

_FIRST, _STRIDE = ORDERS.index(12), 5
"""Where a search begins, and how it goes on: many nodes take long to measure."""

_NODE, _ENTRY, _READ = 200.0, 2.0, 60.0
"""Flops of a node, of an entry of a table and of reading one, near what `operations`
counts: 59 to 266 for a node, by the lobe, the detector and absorption."""

_RAY = 1.0
"""Operations of a ray at a node, which its lobes share, over those of a lobe."""


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
        band = math.sqrt(2 * math.log(1 / tolerance)) / low
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

    def least(self, which: int, allowed: float) -> tuple[int, float] | None:
        """The smallest order for an error, and the error; None if none will do."""

        def enough(k):
            return self.errors(k)[which] <= allowed

        low, high, last = 0, _FIRST, len(ORDERS) - 1
        while not enough(high):
            if high == last:
                return None
            low, high = high + 1, min(high + _STRIDE, last)
        while low < high:
            middle = (low + high) // 2
            low, high = (low, middle) if enough(middle) else (middle + 1, high)
        return ORDERS[low], float(self.errors(low)[which])


def _planned(scene: Scene, lobe: int, order: int) -> Planned:
    if lobe == TAIL:
        return Planned(order)
    low, high = scene.roughness("n", lobe)
    tolerance = density_tolerance(scene, lobe)
    terms = math.ceil(math.sqrt(2 * math.log(1 / tolerance)) / low) + 1
    # A series of more terms takes longer than the nodes by themselves.
    terms = 0 if terms > 512 or scene.detector != "normal" else terms
    return Planned(order, tolerance, low, high, terms)


def rounded(tolerance: float) -> float:
    """The power of ten below."""
    return 10.0 ** math.floor(math.log10(tolerance))


def _narrow(scene: Scene, lobe: int, allowed: float) -> Choice:
    """Windows, or the rule that chooses when running, by their own tolerance."""
    low, high = scene.roughness("n", lobe)
    turns = 4 * math.pi / min(low, 1) + 4 * lobe * scene.high("sigma_a")
    rounding = float(np.finfo(scene.dtype).eps) * turns
    if rounding >= allowed:
        raise unreachable(scene, rounding)
    tolerance = max(rounded(allowed - rounding), 1e-15)
    bound = tolerance + rounding
    if high < _NARROW and scene.detector == "normal":
        order = math.ceil(1.3 * math.log(1 / tolerance))
        return Choice(Windowed(order, tolerance), bound, f"windows of {order} nodes")
    rule = Auto(tolerance, low / 1.01, high * 1.01)
    return Choice(rule, bound, f"auto({tolerance:.0e})")


def cosines(scene: Scene) -> tuple[float, float]:
    """The range of |cos theta_d|, or of |cos theta_i|, from below and above."""
    ends, out = scene.ends("theta_i"), scene.ends("theta_o")
    if scene.incidence == "theta_d":
        ends = (out[0] - ends[1]) / 2, (out[1] - ends[0]) / 2
    largest = min(max(map(abs, ends)), math.pi / 2)
    smallest = 0.0 if ends[0] <= 0 <= ends[1] else min(map(abs, ends))
    return max(math.cos(largest) - 1e-6, 0.0), min(math.cos(smallest) + 1e-6, 1.0)


_WIDEST = 3 * measured.DEGREES // 4, 7 * measured.WAVES // 8
"""Larger tables are not looked at: what lies beyond would be seen too late."""


def _table(asked: Asked, part: int, errors, search: Search, allowed) -> Choice | None:
    """The smallest table of a part; None if none will do."""
    scene = asked.scene
    fits = MARGIN * np.asarray(errors[part])[: _WIDEST[0], : _WIDEST[1]]
    degree, waves = np.indices(fits.shape)
    entries = np.where(fits <= allowed / 2, (degree + 3) * (waves + 3), np.inf)
    if part == TAIL:
        entries[:, 1:] = np.inf
    best = int(np.argmin(entries))
    found = search.least(part, allowed / 2)
    if scene.detector != "normal" or not np.isfinite(entries.flat[best]) or not found:
        return None
    j, k = (int(x) for x in np.unravel_index(best, fits.shape))
    rule = Tabled(found[0], j, k, *cosines(scene), _planned(scene, part, found[0]))
    flops = _ENTRY * float(entries[j, k]) + _READ
    said = f"table, {j + 1} x {k + 1}"
    return Choice(rule, float(fits[j, k]) + found[1], said, flops)


def _nodes(scene: Scene, part: int, search: Search, allowed: float) -> Choice | None:
    """The fewest nodes of a part; None if none will do."""
    found = search.least(part, allowed)
    if found is None:
        return None
    order, bound = found
    rule = _planned(scene, part, order)
    return Choice(rule, bound, f"{order} nodes", _NODE * order)


def choose(asked: Asked, part: int, search: Search, tables, closed, allowed) -> Choice:
    """The rule of a part, the cheapest that meets what is allowed.

    Closed form, table or nodes, by their flops; windows, or a choice made when running,
    where roughness is too small for those.
    """
    scene = asked.scene
    if closed is not None and part < 2 and closed[part] <= allowed:
        return Choice(Closed(8), float(closed[part]), "closed form")
    lobe = None if part == TAIL else part
    if lobe is not None and predicted(scene, lobe, allowed) > 2 * ORDERS[-1]:
        return _narrow(scene, lobe, allowed)
    nodes = _nodes(scene, part, search, allowed)
    table = _table(asked, part, tables(), search, allowed)
    both = [choice for choice in (nodes, table) if choice is not None]
    if both:
        return min(both, key=lambda choice: choice.flops)
    if lobe is None:
        raise unreachable(scene, search.errors(len(ORDERS) - 1)[part])
    return _narrow(scene, lobe, allowed)


def unreachable(scene: Scene, error: float) -> ValueError:
    """The error of a tolerance that one part alone exceeds, at the least."""
    reached = error / (1 - LEFT_OUT - 2 * FORMS)
    return ValueError(
        f"tolerance = {scene.tolerance:g}: must be >= {1.2 * len(NAMES) * reached:.1g} "
        f"for this scene in {scene.dtype}"
    )


def joined(
    rules: Sequence[tuple[int | None, Rule]],
) -> tuple[tuple[tuple[int | None, ...], Rule], ...]:
    """Lobes with alike numbers of nodes share them where that is cheaper."""
    nodes = [(p, r) for p, r in rules if isinstance(r, Planned)]
    others = [((p,), r) for p, r in rules if not isinstance(r, Planned)]
    nodes.sort(key=lambda x: x[1].order)
    best: tuple[float, list] = (math.inf, [])
    for cuts in range(2 ** max(len(nodes) - 1, 0)):
        ends = [k + 1 for k in range(len(nodes) - 1) if cuts >> k & 1]
        groups = [nodes[a:b] for a, b in pairwise([0, *ends, len(nodes)])]
        total = sum(g[-1][1].order * (_RAY + len(g)) for g in groups if g)
        if total < best[0]:
            best = total, groups
    found = []
    for group in filter(None, best[1]):
        rule, lobes = group[-1][1], tuple(p for p, _ in group)
        shaped = [r for p, r in group if p is not None]
        if shaped:
            rule = replace(
                rule,
                tolerance=min(r.tolerance for r in shaped),
                low=min(r.low for r in shaped),
                high=max(r.high for r in shaped),
                terms=max(r.terms for r in shaped),
            )
        found.append((lobes, rule))
    return tuple(sorted([*found, *others], key=lambda x: str(x[0])))
