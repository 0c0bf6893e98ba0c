"""Which lobes of a plan share nodes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise
from typing import Any

from fiberjax.planned import ByLobe, Planned
from fiberjax.rules import Rule
from fiberjax.tabled import Tabled

_RAY = 1.0
"""Operations of a ray at a node, which its lobes share, over those of a lobe."""

Group = tuple[tuple[int | None, ...], Rule]
"""Lobes, None for what is uniform in azimuth, and their rule."""


def joined(
    rules: Sequence[tuple[int | None, Rule]], holds: Callable[[Group], bool]
) -> tuple[Group, ...]:
    """Tables are read together; lobes with alike numbers of nodes share them.

    Those where that is cheaper, and holds: nodes are graded for the highest of the
    lobes, which others may not do with.
    """
    tables = {p: r for p, r in rules if isinstance(r, Tabled)}
    nodes = [(p, r) for p, r in rules if p is not None and isinstance(r, Planned)]
    apart = {p for p, _ in rules} - {*tables} - {p for p, _ in nodes}
    others: list[Group] = [((p,), r) for p, r in rules if p in apart]
    if tables:
        others.append((tuple(tables), _together(tables)))
    nodes.sort(key=lambda x: x[1].order)

    def shared(group: Sequence[tuple[int, Any]]) -> Group:
        each = [rule for _, rule in group]
        rule = replace(
            each[-1],
            tolerance=min(r.tolerance for r in each),
            low=min(r.low for r in each),
            high=max(r.high for r in each),
            terms=max(r.terms for r in each),
        )
        return tuple(p for p, _ in group), rule

    def cost(groups: Sequence[Sequence[tuple[int, Planned]]]) -> float:
        return sum(g[-1][1].order * (_RAY + len(g)) for g in groups)

    cuts = _cuts(len(nodes))
    ways = [[nodes[a:b] for a, b in pairwise(ends)] for ends in cuts]
    tried = ([shared(group) for group in way] for way in sorted(ways, key=cost))
    # Every lobe by itself holds.
    found = next(x for x in tried if all(len(g[0]) == 1 or holds(g) for g in x))
    return tuple(sorted([*found, *others], key=lambda x: str(x[0])))


def _together(tables: Mapping[int | None, Tabled]) -> Tabled:
    """One rule for the tables of some lobes."""
    first = next(iter(tables.values()))
    spans = tuple(span for table in tables.values() for span in table.spans)
    each = tuple(((p,), table.otherwise) for p, table in tables.items())
    otherwise = ByLobe(each, first.otherwise)
    return replace(first, spans=spans, otherwise=otherwise)


def _cuts(count: int) -> list[list[int]]:
    """All ways to cut a sequence, as places of the cuts with both ends."""
    inner = range(1, count)
    some = [x for k in range(max(count, 1)) for x in combinations(inner, k)]
    return [sorted({0, *x, count}) for x in some]
