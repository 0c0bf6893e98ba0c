"""The rule that chooses: as many nodes as roughness and optics ask for."""

import math
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import numerics
from fiberjax.crossings import offset_at
from fiberjax.rules import (
    GaussGamma,
    Rule,
    Seen,
    grading,
    whole_shape,
)
from fiberjax.series import Series
from fiberjax.windows import Windowed, check_tolerance

_SHARED = 8
"""With this many phi to one theta_d a series takes less time than nodes for each."""

_NARROW = {"nodes": 0.1, "series": 0.02}
"""Below this roughness windows take less time than either."""

_STEP = 2.8
"""Between the roughnesses for which there is a number of nodes of its own."""

_WIDE = 0.2
"""Up to this roughness windows are right: they must be narrower than half a turn."""

_SMALLEST = 1e-6
"""The smallest scale of `grading`."""


def _nodes(bandwidth: Any, delta: Any, eta: Any, p: int, tolerance: float, xp: Any):
    """Nodes that `GaussGamma` needs for an error below the tolerance.

    A fit to searches for the smallest order over the whole domain; tests/test_auto.py
    holds the rules to it. One term is for the detector, which is passed at the speed of
    Phi, and one for the optics, which change over `delta` at grazing.
    """
    digits = math.log(1 / tolerance)
    stretch = xp.arcsinh(math.pi / 2 / delta)
    speed = xp.sqrt(xp.maximum(1, p / eta - 1))
    length = xp.sqrt(stretch * xp.sqrt(delta * delta + math.pi**2 / 4))
    narrow = 0.64 * length * speed * bandwidth
    smooth = 3 + xp.maximum(0.4 * stretch, 0.7) * digits
    return 1.05 * (narrow**4 + smooth**4) ** 0.25 + 1


@dataclass(frozen=True)
class Auto(Rule):
    """The cheapest of the other rules that meets a tolerance; see `auto`."""

    tolerance: float
    s_min: float
    s_max: float

    def __post_init__(self):
        check_tolerance(self.tolerance)
        if not 0 < self.s_min < self.s_max:
            raise ValueError(
                f"s_min = {self.s_min!r}, s_max = {self.s_max!r}: must be numbers with "
                "0 < s_min < s_max"
            )

    def average(self, weight, section):
        tolerance = self._reachable(section.cos.dtype)
        worst = _nodes(0.0, _SMALLEST, 1.0, 1, tolerance, np)
        return GaussGamma(math.ceil(worst)).average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        tolerance = self._reachable(phi.dtype)
        highest = max(lobe.p or 0 for lobe in seen)
        rules = self._rules(seen, phi, section, detector, highest, tolerance)
        orders = [rule.order for rule in rules if not isinstance(rule, Windowed)]
        delta = grading(section, highest)

        def level(lobe):
            bandwidth = detector.bandwidth(tolerance) / lobe.beta_n
            need = _nodes(bandwidth, delta, section.eta, lobe.p, tolerance, jnp)
            index = sum((need > order).astype(int) for order in orders)
            return jnp.minimum(index, len(rules) - 1)

        levels: dict[Any, Any] = {
            lobe.p: level(lobe) for lobe in seen if lobe.p is not None
        }
        # What is uniform in azimuth goes with any of the others.
        levels[None] = next(iter(levels.values()))

        some_weight = jax.eval_shape(weights, offset_at(jnp.zeros((), phi.dtype)))[0]
        shape = (*whole_shape(seen, phi, section), some_weight.shape[-1])

        def part(index, rule):
            chosen = [levels[lobe.p] == index for lobe in seen]
            some = [_only(*each) for each in zip(seen, chosen, strict=True)]
            anywhere = jnp.any(jnp.stack([jnp.any(c) for c in chosen]))
            return numerics.computed_if(
                anywhere,
                lambda: jnp.broadcast_to(
                    rule.convolve(some, weights, phi, section, detector), shape
                ),
                shape,
                phi.dtype,
            )

        parts = [part(*each) for each in enumerate(rules)]
        return sum(parts[1:], parts[0])

    def _rules(self, seen, phi, section, detector, highest, tolerance) -> list[Any]:
        """Rules of ascending cost, each right where those before it are not."""
        full = math.prod(whole_shape(seen, phi, section))
        each = math.prod(whole_shape(seen, jnp.zeros((), phi.dtype), section))
        grid = not detector.kink and full >= _SHARED * each
        narrow = _NARROW["series" if grid else "nodes"]
        orders = self._orders(highest, detector.bandwidth(tolerance), tolerance, narrow)
        if grid:
            # Of all fibers that make do with n nodes none needs more terms than this.
            rules = [Series(n, math.ceil(n / 0.89)) for n in orders]
        else:
            rules = [GaussGamma(n, tolerance) for n in orders]
        if self.s_min >= narrow:
            return rules
        return [*rules, Windowed(math.ceil(1.5 * math.log(1 / tolerance)), tolerance)]

    def _orders(self, highest, bandwidth, tolerance, narrow) -> list[int]:
        """Orders for hair of roughness s, 2 s, 4 s, ..., and one for all else."""

        def need(s, delta, eta):
            return math.ceil(_nodes(bandwidth / s, delta, eta, highest, tolerance, np))

        low = max(self.s_min, narrow)
        steps = [low * _STEP**k for k in range(2)]
        hair = [need(s, 1.0, 1.5) for s in steps if s == low or s < self.s_max]
        others = need(_WIDE if self.s_min < narrow else low, _SMALLEST, 1.0)
        orders = [n for k, n in enumerate(hair) if k == 0 or n < 0.8 * hair[k - 1]]
        return sorted({*orders, max(others, hair[0])})

    def _reachable(self, dtype: Any) -> float:
        """The tolerance, or the precision of the dtype if that is larger."""
        return max(self.tolerance, float(jnp.finfo(dtype).eps))


def _only(lobe: Seen, chosen: Any) -> Seen:
    """The lobe where it is chosen; elsewhere nothing of it."""
    return lobe._replace(
        factor=jnp.where(chosen, lobe.factor, 0),
        beta_n=jnp.where(chosen, lobe.beta_n, 0.1),
    )


def auto(tolerance: float, s_min: float = 1e-6, s_max: float = math.inf) -> Auto:
    """The rule that meets a tolerance for every roughness from s_min to s_max.

    Everything static is chosen beforehand, from the tolerance, the range of roughness,
    the lobes, the dtype and the shapes: a few orders of `GaussGamma`, or of `Series`
    where at least 8 phi share their theta_d, and `Windowed` below them. Which of these
    is run is decided by the roughness, eta and sigma_a at hand, at no cost as long as a
    fiber's parameters are single numbers. Where they are arrays, or fibers are under
    jax.vmap, all that any element needs is run: narrow the range then.

    The error is below tolerance times the peak over phi, or below the rounding floor
    eps (4 pi/min(beta_n, 1) + 4 p sigma_a) times it, for theta_d to +-90 deg, eta 1 to
    3 and sigma_a 0 to 1e3. The second term is the rounding of the exponent of T.

    Args:
        tolerance: largest error relative to the peak of the lobe over phi, in (0, 1).
            Below eps of the dtype it means eps.
        s_min, s_max: the range of beta_n in radians, 0 < s_min < s_max. Outside it the
            tolerance is not met.

    Returns:
        A static, hashable rule for `N`, `evaluate`, `pdf` and `albedo`.

    Raises:
        ValueError: tolerance outside (0, 1), or no range.
    """
    return Auto(float(tolerance), float(s_min), float(s_max))


DEFAULT = auto(1e-12)
"""Right at every roughness."""
