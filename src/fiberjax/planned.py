"""Rules that know their roughness beforehand, and one that has a rule for each lobe."""

import math
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp

from fiberjax import numerics
from fiberjax.auto import Auto
from fiberjax.cases import lobe_by_lobe
from fiberjax.circular import wrap
from fiberjax.graded import GaussGamma
from fiberjax.model import Attenuations
from fiberjax.quadrature import Nodes, chosen, gauss_legendre_unit
from fiberjax.roots import rays
from fiberjax.rules import Rule, name
from fiberjax.section import stacked
from fiberjax.series import many_phi, series
from fiberjax.tabled import Span, Tabled
from fiberjax.windows import Windowed


@dataclass(frozen=True)
class Planned(GaussGamma):
    """`GaussGamma` for a range of roughness, or its series where many phi share.

    Args:
        order, tolerance: as in `GaussGamma`.
        low, high: the range of beta_n: formulas of the detector that it does not need
            are not compiled.
        terms: of the series of the same nodes; 0 for none.
    """

    low: float = 0.0
    high: float = float("inf")
    terms: int = 0

    def cases(self, weights, phi, section, detector):
        detector = detector.within(self.low, self.high)
        return super().cases(weights, phi, section, detector)

    def convolve(self, seen, weights, phi, section, detector):
        if self.terms and not detector.kink and many_phi(seen, phi, section):
            nodes = self.nodes(seen, section, detector)
            sums = self.terms, self.terms
            return series(seen, weights, phi, section, nodes, *sums)
        return super().convolve(seen, weights, phi, section, detector)


@dataclass(frozen=True)
class Tried(Planned):
    """`Planned` of one of several orders, by an index that is known when running."""

    orders: tuple[int, ...] = ()
    index: Any = 0

    def mean_nodes(self, section):
        rules: list[Nodes] = [gauss_legendre_unit(order) for order in self.orders]
        return chosen(rules, self.index, section.cos.dtype)

    def nodes(self, seen, section, detector):
        del seen, detector
        return self.mean_nodes(section)


@dataclass(frozen=True)
class Closed(Rule):
    """The closed form of a smooth fiber, for R and TT: no detector blurs it.

    Straight behind the fiber, where the two sides of R meet at an angle, R is that of
    the mean distance from there. The error is of the order of beta_n^2 but at TT's
    edge. What is averaged takes `GaussGamma` of an order.
    """

    order: int

    def average(self, weight, section):
        return GaussGamma(self.order).average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        def smooth(lobe, weight):
            at = phi
            if lobe.p == 0:
                away = jnp.pi - jnp.abs(wrap(phi))
                at = jnp.pi - detector.distance(away, lobe.beta_n)
            found = rays(lobe.p, at, section)
            # dPhi/dh is the slope over cos gamma.
            share = numerics.quotient(found.offset.cos / 2, found.slope, 0.0)
            share = jnp.where(found.exists, share, 0)
            light = stacked(weight(found.offset).times(share)).sum(0)
            return light * lobe.factor[..., None]

        return lobe_by_lobe(seen, weights, smooth)


@dataclass(frozen=True)
class ByLobe(Rule):
    """A rule for each lobe; those of one rule share its nodes.

    TypeError if the weights are no `Attenuations`, as those of a density are not.

    Args:
        rules: pairs of lobes, None for what is uniform in azimuth, and their rule.
        mean: for averages.
    """

    rules: tuple[tuple[tuple[int | None, ...], Rule], ...]
    mean: Rule

    def average(self, weight, section):
        return self.mean.average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        return self.total(seen, weights, phi, section, detector)

    def total(self, seen, weights, phi, section, detector):
        if not isinstance(weights, Attenuations):
            raise TypeError(f"weights = {weights!r}: must be Attenuations")
        total = 0.0
        for lobes, rule in self.rules:
            which = [k for k, one in enumerate(seen) if name(one) in lobes]

            if which:
                part, some = [seen[k] for k in which], weights.only(which)
                total += rule.total(part, some, phi, section, detector)
        return jnp.asarray(total)


def as_data(rule: Rule) -> dict[str, Any]:
    """A rule as JSON has it."""
    if isinstance(rule, ByLobe):
        rules = [{"lobes": list(p), "rule": as_data(r)} for p, r in rule.rules]
        return {"kind": "ByLobe", "rules": rules, "mean": as_data(rule.mean)}
    kind = type(rule).__name__
    if isinstance(rule, Tabled):
        return {"kind": kind, **vars(rule), "otherwise": as_data(rule.otherwise)}
    if kind not in _KINDS:
        raise ValueError(f"rule = {rule!r}: must be one of {tuple(_KINDS)}")
    # JSON has no infinity.
    values = {k: None if x == math.inf else x for k, x in vars(rule).items()}
    return {"kind": kind, **values}


def from_data(found: dict[str, Any]) -> Rule:
    """The rule of `as_data`."""
    given = dict(found)
    kind = given.pop("kind")
    if kind == "ByLobe":
        rules = [(tuple(x["lobes"]), from_data(x["rule"])) for x in given["rules"]]
        return ByLobe(tuple(rules), from_data(given["mean"]))
    if kind == "Tabled":
        spans = tuple(Span(*span) for span in given["spans"])
        otherwise = from_data(given["otherwise"])
        return Tabled(spans, given["low"], given["high"], otherwise)
    if kind not in _KINDS:
        raise ValueError(f"rule = {kind!r}: must be one of {tuple(_KINDS)}")
    return _KINDS[kind](**{k: math.inf if x is None else x for k, x in given.items()})


_KINDS: dict[str, type[Rule]] = {
    kind.__name__: kind for kind in (Planned, Closed, Windowed, Auto)
}
