"""The rule in gamma, graded towards grazing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import numerics
from fiberjax._types import Floats, lobe_number
from fiberjax.cases import Case, by_case, by_form, lobe_by_lobe
from fiberjax.circular import wrap
from fiberjax.crossings import half_turns
from fiberjax.detectors import Detector
from fiberjax.orders import REST, resolved
from fiberjax.quadrature import Nodes, gauss_legendre_unit, weighted_sum
from fiberjax.rules import Rule, Seen, Weights, answer, check_tolerance, whole_shape
from fiberjax.section import Offset, Section, stacked


def sum_over(
    term: Callable[[Offset, Floats], Any],
    offsets: "Offsets",
    nodes: Nodes,
    dtype: Any,
) -> Any:
    """Sum of term(offset, dh) over the nodes of a map from [0, 1] to offsets."""

    def at(t, w):
        offset, slope = offsets(t)
        return term(offset, w * slope)

    return weighted_sum(at, nodes, dtype)


def grading(section: Section, p: int) -> Floats:
    """The distance from grazing over which the weights of lobe p change there.

    The Fresnel terms change over sqrt(eta^2 - 1)/cos theta_d, which is taken at theta_d
    = 0, so that one set of nodes serves all directions; p segments absorb a factor e
    more over a distance x with sqrt(k + x^2) - sqrt(k) = (k + 1)/(2 eta p sigma_a), k =
    eta^2 - 1. Where nodes lie is no function of the parameters: the integral does not
    depend on it. Closer to eta = 1 than the lower bound there is too little light in
    the region to matter.
    """
    scale = jnp.sqrt(section.k)
    if section.sigma_a is not None:
        depth = jnp.maximum(2 * section.eta * p * jnp.max(section.sigma_a), 1e-6)
        layer = (section.k + 1) / depth
        scale = jnp.minimum(scale, jnp.sqrt(layer * (2 * scale + layer)))
    return jax.lax.stop_gradient(jnp.maximum(scale, 1e-6))


def layer(section: Section, tolerance: float) -> Floats:
    """The distance from grazing over which the rest of a fiber changes there.

    As much light is absorbed as leaves, 1 - F T = 2 (1 - F), where x is about
    k/(eta (eta^2 + 1)) sigma_a at theta_d = 0, for the color that absorbs least. The
    rest is of order x^2 there, its derivative in sigma_a of order x: a layer below the
    tolerance to the power 2/5 cannot be seen in either.
    """
    scale = grading(section, REST)
    if section.sigma_a is None:
        return scale
    slope = section.k / (section.eta * (section.eta * section.eta + 1))
    # Not 0 times infinity at eta = 1.
    colors = jnp.atleast_1d(section.sigma_a)
    depths = [jnp.where(sigma_a > 0, slope * sigma_a, jnp.inf) for sigma_a in colors]
    found = jnp.maximum(reduce(jnp.minimum, depths), tolerance**0.4)
    return jax.lax.stop_gradient(jnp.minimum(scale, found))


Offsets = Callable[[Floats], tuple[Offset, Floats]]
"""A map from t in [0, 1] to an offset and dh/dt."""


def graded_offsets(
    delta: Floats, low: Floats | float = 0.0, high: Floats | float = np.pi / 2
) -> Offsets:
    """Offsets from gamma = low to high, graded towards grazing, element by element.

    The distance from grazing is x = pi/2 - gamma = delta sinh z with z linear in t.
    """
    start = jnp.arcsinh((jnp.pi / 2 - low) / delta)
    span = start - jnp.arcsinh((jnp.pi / 2 - high) / delta)

    def graded(t):
        grown = jnp.exp(start - span * t)
        shrunk = 1 / grown
        x = delta / 2 * (grown - shrunk)
        cos, sin = numerics.sin_cos(x)
        slope = span * (delta / 2) * (grown + shrunk) * cos
        return Offset(jnp.pi / 2 - x, sin, cos), slope

    return graded


def offsets_between(delta: Floats, low: Floats, high: Floats) -> Offsets:
    """The same, graded towards both ends of [-pi/2, pi/2].

    gamma = (pi/2 + delta) tanh(z/2) with z linear in t. From the nearer end it is x =
    (pi + 2 delta)/(1 + exp |z|) - delta away, which rounding spoils by eps delta only.
    """
    whole = jnp.pi + 2 * delta

    def level(gamma):
        above, below = jnp.pi / 2 - gamma, jnp.pi / 2 + gamma
        return jnp.log(below + delta) - jnp.log(above + delta)

    start, end = level(low), level(high)

    def graded(t):
        z = start + (end - start) * t
        far = numerics.decay(-jnp.abs(z))
        near = 1 / (1 + far)
        side = jnp.where(z < 0, -1, 1)
        x = jnp.maximum(whole * (far * near) - delta, 0)
        cos, sin = numerics.sin_cos(x)
        slope = (end - start) * whole * (far * near) * near * cos
        return Offset(side * (jnp.pi / 2 - x), side * sin, cos), slope

    return graded


@dataclass(frozen=True)
class GaussGamma(Rule):
    """Gauss-Legendre in gamma over half the range, graded towards grazing.

    h = sin gamma removes the infinite slope of Phi at |h| = 1, and
    pi/2 - gamma = delta sinh z resolves the fast change of the Fresnel terms and of the
    absorption there (`grading`, and for averages `layer`): convergence is geometric
    once the spacing of the nodes is below the roughness. Where the density has a kink
    the range is split there, and the rule is applied to each of the parts: 2 for R and
    TT, 4 for TRT.

    Args:
        order: number of nodes on [0, pi/2], or on each part of it, >= 1.
        tolerance: error allowed in the density, relative to its peak, and in averages,
            in (0, 1); None for that of the dtype, or of the order.

    Raises:
        ValueError: order is not an integer >= 1, or tolerance lies outside (0, 1).
    """

    order: int = 64
    tolerance: float | None = None

    def __post_init__(self):
        order = lobe_number("order", self.order, lowest=1)
        object.__setattr__(self, "order", order)
        if self.tolerance is not None:
            check_tolerance(self.tolerance)

    def average(self, weight, section):
        def term(offset, share):
            return weight(offset).times(share)

        dtype = section.cos.dtype
        precision = max(self.precision, float(jnp.finfo(dtype).eps))
        offsets = graded_offsets(layer(section, precision))
        nodes = self.mean_nodes(section)
        return stacked(sum_over(term, offsets, nodes, dtype))

    def convolve(self, seen, weights, phi, section, detector):
        cases = self.cases(weights, phi, section, detector)
        return by_case(seen, cases, answer(seen, weights, phi, section))

    @property
    def precision(self) -> float:
        """What an average can be good to: a layer below that is not looked at."""
        return max(self.tolerance or 0.0, resolved(self.order))

    def mean_nodes(self, section: Section) -> Nodes:
        """The nodes for an average."""
        del section
        return gauss_legendre_unit(self.order)

    def nodes(
        self, seen: Sequence[Seen], section: Section, detector: Detector
    ) -> Nodes:
        """The nodes for some lobes."""
        del seen, section, detector
        return gauss_legendre_unit(self.order)

    def cases(
        self, weights: Weights, phi: Floats, section: Section, detector: Detector
    ) -> list[Case]:
        """`convolve` in cases."""
        if detector.kink:

            def in_parts(seen):
                def split(lobe, weight):
                    return self._split(lobe, weight, phi, section, detector)

                return lobe_by_lobe(seen, weights, split)

            return [Case(lambda lobe: True, in_parts)]

        def total(seen, term):
            offsets = graded_offsets(grading(section, highest(seen)))
            return sum_over(
                term, offsets, self.nodes(seen, section, detector), phi.dtype
            )

        return by_form(weights, phi, section, detector, self.tolerance, total)

    def _split(self, lobe, weight, phi, section, detector):
        """One lobe, in parts that end where the slope of the density jumps."""
        phi = jnp.broadcast_to(phi, whole_shape([lobe], phi, section))
        x = wrap(phi - (lobe.p % 2) * jnp.pi)
        breaks = half_turns(lobe.p, x, section)
        end = jnp.full((1, *phi.shape), jnp.pi / 2, phi.dtype)
        edges = jnp.concatenate([0 * end, breaks, end])
        offsets = graded_offsets(grading(section, lobe.p), edges[:-1], edges[1:])
        nodes = self.nodes([lobe], section, detector)

        def total(_, term):
            parts = sum_over(term, offsets, nodes, phi.dtype)
            return [reduce(jnp.add, one) for one in parts]

        def weights(offset):
            return [weight(offset)]

        (case,) = by_form(weights, phi, section, detector, self.tolerance, total)
        return case.value([lobe])


def highest(seen: Sequence[Seen]) -> int:
    """The largest p of some lobes."""
    return max(lobe.p for lobe in seen)
