"""The rule that chooses: as many nodes as roughness and optics ask for."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import jax.numpy as jnp
import numpy as np

from fiberjax._types import Floats
from fiberjax.cases import Case, by_case
from fiberjax.detectors import Detector
from fiberjax.graded import GaussGamma, grading, highest, layer
from fiberjax.orders import REST, averaged, needed, turning
from fiberjax.quadrature import TOGETHER, Nodes, chosen, gauss_legendre_unit
from fiberjax.rules import Rule, Seen, answer, check_tolerance
from fiberjax.section import Section
from fiberjax.series import many_phi, series
from fiberjax.windows import Windowed

_MANY = 5.5
"""With more nodes than this times log(1/tolerance) windows take less time."""

_ALIKE = 1.4
"""Lobes that need numbers of nodes with a smaller ratio are summed together."""

_LONG = 0.02
"""Below this roughness windows take less time than a series."""

_WIDE = 0.1
"""Up to this roughness windows are used: they must be narrower than half a turn."""

_SMALLEST = 1e-6
"""The smallest scale of `grading`."""

_STEP = 1.08
"""Between the orders that can be chosen when running."""


@dataclass(frozen=True)
class _Graded(GaussGamma):
    """`GaussGamma` with as many nodes as it takes, which is known when running."""

    tolerance: float = 1e-12
    s_min: float = _WIDE
    s_max: float = math.inf

    @property
    def precision(self) -> float:
        return self.tolerance

    def need(
        self, seen: Sequence[Seen], section: Section, detector: Detector
    ) -> Floats:
        """The number of nodes that lobes take, for the largest |theta_d| of all."""
        eta, delta = section.eta, grading(section, highest(seen))
        cos = jnp.min(section.cos)

        def of(lobe):
            band = detector.bandwidth(self.tolerance) / lobe.beta_n
            turns = band * turning(lobe.p, cos, eta, delta, jnp)
            return needed(turns, delta, lobe.p, self.digits, jnp)

        return reduce(jnp.maximum, map(of, seen))

    def most(
        self, p: int, detector: Detector, s: float, delta: float, eta: float
    ) -> int:
        """The number of nodes that one lobe takes at any inclination."""
        scale, band = np.float64(delta), detector.bandwidth(self.tolerance) / s
        turns = band * turning(p, 0.0, np.float64(eta), scale, np)
        return math.ceil(needed(turns, scale, p, self.digits, np))

    def longest(self, p: int, detector: Detector) -> int:
        """The largest number of nodes that is ever used."""
        every = self.most(p, detector, max(self.s_min, _WIDE), _SMALLEST, 1.0)
        return every if self.s_min >= _WIDE else max(every, self.many)

    @property
    def digits(self) -> float:
        """log(1/tolerance)."""
        return math.log(1 / self.tolerance)

    @property
    def many(self) -> int:
        """With more nodes than this windows take less time."""
        return math.ceil(_MANY * self.digits)

    def cases(self, weights, phi, section, detector):
        detector = detector.within(self.s_min, self.s_max)
        return super().cases(weights, phi, section, detector)

    def mean_nodes(self, section):
        near = layer(section, self.tolerance)
        need = averaged(grading(section, REST), near, self.digits, jnp)
        least = np.float64(_SMALLEST)
        longest = math.ceil(averaged(least, least, self.digits, np))
        return _enough(need, longest, section.cos.dtype)

    def nodes(self, seen, section, detector, at_least=0):
        longest = max(self.longest(highest(seen), detector), at_least)
        need = self.need(seen, section, detector)
        return _enough(need, longest, section.cos.dtype)


def _enough(need: Floats, longest: int, dtype: Any) -> Nodes:
    """At least as many nodes as are needed, of a few orders up to the longest."""
    ladder = [4]
    while ladder[-1] < longest:
        more = max(ladder[-1] // TOGETHER + 1, int(_STEP * ladder[-1] / TOGETHER))
        ladder.append(TOGETHER * more)
    # NaN asks for all nodes, which keeps the rest of the batch right.
    index = sum(1 - (jnp.max(need) <= order).astype(int) for order in ladder[:-1])
    rules = [gauss_legendre_unit(order) for order in ladder]
    return chosen(rules, index, dtype)


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
        # No detector is in an average.
        return self._graded(section.cos.dtype, 1.0).average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        graded = self._graded(phi.dtype, detector.care)
        what = weights, phi, section, detector
        shared = not detector.kink and many_phi(seen, phi, section)
        if shared:
            low, many, case = self._series(graded, seen, *what)
            cases = [case]
        else:
            low, many, cases = 0.0, graded.many, graded.cases(*what)
        like = answer(seen, weights, phi, section)
        if self.s_min >= _WIDE:
            return by_case(seen, cases, like)
        order = math.ceil(1.3 * graded.digits)
        windows = Windowed(order, graded.tolerance)

        def narrow(lobe):
            need = graded.need([lobe], section, detector)
            # Lobes nearly alike go one way: nodes that one of them takes serve all.
            crowd = (need > many / _ALIKE) & (
                graded.need(seen, section, detector) > many
            )
            return (lobe.beta_n < _WIDE) & (crowd | (lobe.beta_n < low))

        in_windows = Case(narrow, lambda some: windows.convolve(some, *what))
        return by_case(seen, [in_windows, *cases], like)

    def _graded(self, dtype: Any, care: float) -> _Graded:
        """The precision of the dtype if that is all the tolerance can be."""
        tolerance = max(self.tolerance / care, float(jnp.finfo(dtype).eps))
        return _Graded(tolerance=tolerance, s_min=self.s_min, s_max=self.s_max)

    def _series(self, graded, seen, weights, phi, section, detector):
        """Below what roughness, and above what number of nodes, it gives up; a case."""
        p, low = highest(seen), max(self.s_min, _LONG)
        many = graded.most(p, detector, low, 1.0, 1.5)
        band = detector.bandwidth(graded.tolerance)

        def value(some):
            terms = [jnp.max(band / lobe.beta_n) for lobe in some]
            nodes = graded.nodes(some, section, detector, many)
            what = some, weights, phi, section, nodes
            # One more: the first that is left out counts twice.
            last, most = reduce(jnp.maximum, terms) + 1, math.ceil(band / low) + 1
            return series(*what, last, most)

        return low, many, Case(lambda lobe: True, value)


def auto(tolerance: float, s_min: float = 1e-6, s_max: float = math.inf) -> Auto:
    """The rule that meets a tolerance for every roughness from s_min to s_max.

    Everything static is chosen beforehand, from the tolerance, the range of roughness,
    the lobes, the dtype and the shapes: a few orders of `GaussGamma`, or of `Series`
    where at least 16 phi share their theta_d, and `Windowed` below them. Which of these
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
