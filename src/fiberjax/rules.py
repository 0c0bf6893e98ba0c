"""Rules for the integral over the offset h: static, hashable choices.

A rule answers two questions about a cross-section of a fiber:

    average     1/2 int_{-1}^{1} weight(h) dh
    convolve    sum over lobes of factor 1/2 int weight(h) D(phi - Phi(p, h)) dh

A weight maps an `Offset` to an array with a trailing color axis, which the answer has
too, and is even in h. D is a `Detector`, even and of period 2 pi. Phi - p pi is odd in
h, so half the range serves, with D seen from both sides at each offset.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import numerics
from fiberjax._types import Floats, lobe_number
from fiberjax.circular import TURN, Detector, Pair, wrap
from fiberjax.crossings import half_turns
from fiberjax.path import Offset, Section, refraction
from fiberjax.quadrature import gauss_legendre, gauss_legendre_unit, weighted_sum

Weight = Callable[[Offset], Floats]


class Seen(NamedTuple):
    """A lobe as it is seen: the roughness that blurs it, and a factor.

    p is None for what is uniform in azimuth; beta_n is not looked at then.
    """

    p: int | None
    beta_n: Floats
    factor: Floats


Weights = Callable[[Offset], Sequence[Floats]]
"""The weights of everything that is seen, in the same order."""


class Rule(ABC):
    """A way to integrate over the offset h; subclasses are frozen dataclasses."""

    @abstractmethod
    def average(self, weight: Weight, section: Section) -> Floats:
        """1/2 int weight(h) dh over [-1, 1]."""

    @abstractmethod
    def convolve(
        self,
        seen: Sequence[Seen],
        weights: Weights,
        phi: Floats,
        section: Section,
        detector: Detector,
    ) -> Floats:
        """Sum of factor 1/2 int weight(h) D(phi - Phi(p, h)) dh over what is seen."""


def pair(
    lobe: Seen, phi: Floats, detector: Detector, tolerance: float | None = None
) -> Pair:
    """Mean of the density at the azimuths of +h and -h, as a function of Phi - p pi."""
    if lobe.p is None:
        return lambda turn: jnp.full_like(turn, 1 / TURN)
    x = wrap(phi - (lobe.p % 2) * jnp.pi)
    precision = float(jnp.finfo(x.dtype).eps)
    return detector.pair(x, lobe.beta_n, max(tolerance or 0.0, precision))


def scattered(
    seen: Sequence[Seen],
    weights: Weights,
    pairs: Sequence[Pair],
    offset: Offset,
    share: Floats,
    section: Section,
) -> Floats:
    """What the lobes send to the observer from one offset, times a share."""
    gamma_t, total = refraction(offset, section), 0.0
    for lobe, weight, both in zip(seen, weights(offset), pairs, strict=True):
        p = lobe.p or 0
        density = share * (lobe.factor * both(2 * p * gamma_t - 2 * offset.gamma))
        total = total + weight * density[..., None]
    return jnp.asarray(total)


@dataclass(frozen=True)
class GaussH(Rule):
    """Gauss-Legendre in h over [-1, 1]: the textbook rule, kept as the baseline.

    Phi has infinite slope at |h| = 1, so that the error falls slowly with the order: at
    70 nodes it is 1e-3 of the peak for R at roughness 0.2, and below about 0.02 there
    is no correct digit.

    Args:
        order: number of nodes on [-1, 1], >= 1; 70 in the papers.

    Raises:
        ValueError: order is not an integer >= 1.

    Reference: d'Eon et al. 2011 and 2013, eq. 4.
    """

    order: int = 70

    def __post_init__(self):
        order = lobe_number("order", self.order, lowest=1)
        object.__setattr__(self, "order", order)

    def average(self, weight, section):
        def term(h, w):
            return w * weight(self._offset(h))

        return weighted_sum(term, self._half(), section.cos.dtype)

    def convolve(self, seen, weights, phi, section, detector):
        pairs = [pair(lobe, phi, detector) for lobe in seen]

        def term(h, w):
            return scattered(seen, weights, pairs, self._offset(h), w, section)

        return weighted_sum(term, self._half(), phi.dtype)

    def _half(self) -> tuple[np.ndarray, np.ndarray]:
        """The non-negative half of the rule, with half weight at h = 0."""
        x, w = gauss_legendre(self.order)
        half = self.order // 2
        return x[half:], np.where(x == 0, w / 2, w)[half:]

    def _offset(self, h: Floats) -> Offset:
        return Offset(jnp.arcsin(h), h, jnp.sqrt((1 - h) * (1 + h)))


@dataclass(frozen=True)
class GaussGamma(Rule):
    """Gauss-Legendre in gamma over half the range, graded towards grazing.

    h = sin gamma removes the infinite slope of Phi at |h| = 1, and
    pi/2 - gamma = delta sinh z resolves the fast change of the Fresnel terms and of the
    absorption there (`grading`): convergence is geometric once the spacing of the nodes
    is below the roughness. Where the density has a kink the range is split there, and
    the rule is applied to each of the parts: 2 for R and TT, 4 for TRT.

    Args:
        order: number of nodes on [0, pi/2], or on each part of it, >= 1.
        tolerance: error allowed in the density, relative to its peak; None for that of
            the dtype.

    Raises:
        ValueError: order is not an integer >= 1.
    """

    order: int = 64
    tolerance: float | None = None

    def __post_init__(self):
        order = lobe_number("order", self.order, lowest=1)
        object.__setattr__(self, "order", order)

    def average(self, weight, section):
        def term(offset, share):
            return weight(offset) * share[..., None]

        return sum_over(
            term, graded_offsets(grading(section, 1)), self.order, section.cos.dtype
        )

    def convolve(self, seen, weights, phi, section, detector):
        if detector.kink:
            return self._in_parts(seen, weights, phi, section, detector)
        pairs = [pair(lobe, phi, detector, self.tolerance) for lobe in seen]
        highest = max(lobe.p or 0 for lobe in seen)

        def term(offset, share):
            return scattered(seen, weights, pairs, offset, share, section)

        return sum_over(
            term, graded_offsets(grading(section, highest)), self.order, phi.dtype
        )

    def _in_parts(self, seen, weights, phi, section, detector):
        """Lobe by lobe, in parts that end where the slope of the density jumps."""
        total = 0.0
        for k, lobe in enumerate(seen):

            def weight(offset, k=k):
                return weights(offset)[k]

            if lobe.p is None:
                whole = self.average(weight, section) * lobe.factor[..., None] / TURN
            else:
                whole = self._split(lobe, weight, phi, section, detector)
            total = total + whole
        return jnp.asarray(total)

    def _split(self, lobe, weight, phi, section, detector):
        phi = jnp.broadcast_to(phi, whole_shape([lobe], phi, section))
        x = wrap(phi - (lobe.p % 2) * jnp.pi)
        breaks = half_turns(lobe.p, x, section)
        end = jnp.full((1, *phi.shape), jnp.pi / 2, phi.dtype)
        edges = jnp.concatenate([0 * end, breaks, end])
        both = pair(lobe, phi, detector)

        def term(offset, share):
            one = ([lobe], lambda offset: [weight(offset)], [both])
            return scattered(*one, offset, share, section)

        offsets = graded_offsets(grading(section, lobe.p), edges[:-1], edges[1:])
        return sum_over(term, offsets, self.order, phi.dtype).sum(0)


def sum_over(
    term: Callable[[Offset, Floats], Any],
    offsets: Callable[[Floats], tuple[Offset, Floats]],
    order: int,
    dtype: Any,
) -> Any:
    """Sum of term(offset, dh) over the nodes of a map from [0, 1] to offsets."""

    def at(t, w):
        offset, slope = offsets(t)
        return term(offset, w * slope)

    return weighted_sum(at, gauss_legendre_unit(order), dtype)


def whole_shape(seen: Sequence[Seen], phi: Floats, section: Section) -> tuple[int, ...]:
    """The shape of everything that broadcasts with phi; colors aside."""
    arrays = [phi, section.r, *(lobe.factor for lobe in seen)]
    arrays += [lobe.beta_n for lobe in seen if lobe.p is not None]
    return jnp.broadcast_shapes(*(x.shape for x in arrays))


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


def graded_offsets(
    delta: Floats, low: Floats | float = 0.0, high: Floats | float = np.pi / 2
) -> Callable[[Floats], tuple[Offset, Floats]]:
    """A map from t in [0, 1] to an offset and dh/dt, graded towards grazing.

    The distance from grazing is x = pi/2 - gamma = delta sinh z with z linear in t;
    gamma goes from low to high, element by element.
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


def check_rule(rule: Any) -> None:
    """ValueError unless `rule` is a `Rule`."""
    if not isinstance(rule, Rule):
        raise ValueError(
            f"rule = {rule!r}: must be fiberjax.auto(tolerance) or one of GaussH, "
            "GaussGamma, Windowed, Series"
        )
