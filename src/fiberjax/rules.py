"""What a rule for the integral over the offset h is: a static, hashable choice.

A rule answers three questions about a cross-section of a fiber:

    average     1/2 int_{-1}^{1} weight(h) dh
    convolve    sum over lobes of factor 1/2 int weight(h) D(phi - Phi(p, h)) dh
    total       the same of lobes and of what is uniform in azimuth

A weight maps an `Offset` to `Light` and is even in h; answers have a trailing color
axis. D is a `Detector`, even and of period 2 pi. Phi - p pi is odd in
h, so half the range serves, with D seen from both sides at each offset.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import programs
from fiberjax._types import Floats
from fiberjax.circular import TURN, wrap
from fiberjax.detectors import Detector, Pair
from fiberjax.section import Light, Offset, Section, refraction, stacked

Weight = Callable[[Offset], Light]


class Seen(NamedTuple):
    """A lobe as it is seen: the roughness that blurs it, and a factor."""

    p: int
    beta_n: Floats
    factor: Floats


class Uniform(NamedTuple):
    """What is uniform in azimuth, as it is seen: a factor."""

    factor: Floats


def name(one: Seen | Uniform) -> int | None:
    """The lobe p, or None for what is uniform in azimuth."""
    return one.p if isinstance(one, Seen) else None


Weights = Callable[[Offset], Sequence[Light]]
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
        """Sum of factor 1/2 int weight(h) D(phi - Phi(p, h)) dh over lobes."""

    def total(
        self,
        seen: Sequence[Seen | Uniform],
        weights: Weights,
        phi: Floats,
        section: Section,
        detector: Detector,
    ) -> Floats:
        """The same over all that is seen, with an average for what is uniform.

        That has nodes of its own: the rest changes faster at grazing than lobes do.
        """
        lobes = {k: one for k, one in enumerate(seen) if isinstance(one, Seen)}

        def of_lobes(offset):
            each = weights(offset)
            return [each[k] for k in lobes]

        def mean(k):
            average = self.average(lambda offset: weights(offset)[k], section)
            return average * seen[k].factor[..., None] / TURN

        found = [mean(k) for k in range(len(seen)) if k not in lobes]
        if lobes:
            each = list(lobes.values())
            found.append(self.convolve(each, of_lobes, phi, section, detector))
        like = answer(seen, weights, phi, section)
        return jnp.broadcast_to(reduce(jnp.add, found), like.shape)


class Case(NamedTuple):
    """A way to sum over lobes, and for which of them it serves, element by element."""

    serves: Callable[[Seen], Any]
    value: Callable[[Sequence[Seen]], Floats]


def by_case(seen: Sequence[Seen], cases: Sequence[Case], like: Any) -> Floats:
    """Lobes, each element by one case; `like` has the shape.

    That is the first that serves it, and the last for all that is left, NaN too. A case
    that takes nothing costs nothing, as long as that is one decision, as it is for
    roughness that is one number and not under jax.vmap.
    """
    if len(cases) == 1:
        return cases[-1].value(seen)

    # Every case reads the factors: none is to compute them anew.
    factors = programs.stored(lambda: [x.factor for x in seen], abs(seen[0].beta_n))
    seen = [x._replace(factor=f) for x, f in zip(seen, factors, strict=True)]

    def takes(lobe):
        """What of a lobe each case takes."""
        found, left = [], jnp.asarray(True)
        for case in cases[:-1]:
            found.append(left & case.serves(lobe))
            left = left & ~found[-1]
        return [*found, left]

    taken = {lobe.p: takes(lobe) for lobe in seen}

    def part(k, case):
        anywhere = jnp.stack([jnp.any(each[k]) for each in taken.values()])

        def value():
            some = [_only(lobe, taken[lobe.p][k]) for lobe in seen]
            return jnp.broadcast_to(case.value(some), like.shape)

        return programs.computed_if(jnp.any(anywhere), value, like)

    return reduce(jnp.add, [part(k, case) for k, case in enumerate(cases)])


def _only(lobe: Seen, served: Any) -> Seen:
    """The lobe where it is served; elsewhere nothing of it, and easy."""
    return lobe._replace(
        factor=jnp.where(served, lobe.factor, 0),
        beta_n=jnp.where(served, lobe.beta_n, 1),
    )


def lobe_by_lobe(
    seen: Sequence[Seen],
    weights: Weights,
    convolved: Callable[[Seen, Weight], Floats],
) -> Floats:
    """Lobes of which each has nodes of its own."""

    def part(k, lobe):
        return convolved(lobe, lambda offset: weights(offset)[k])

    return reduce(jnp.add, [part(k, lobe) for k, lobe in enumerate(seen)])


def whole_shape(
    seen: Sequence[Seen | Uniform], phi: Floats, section: Section
) -> tuple[int, ...]:
    """The shape of everything that broadcasts with phi; colors aside."""
    arrays = [phi, section.r, *(lobe.factor for lobe in seen)]
    arrays += [lobe.beta_n for lobe in seen if isinstance(lobe, Seen)]
    return jnp.broadcast_shapes(*(x.shape for x in arrays))


def answer(
    seen: Sequence[Seen | Uniform], weights: Weights, phi: Floats, section: Section
) -> jax.ShapeDtypeStruct:
    """Shape and dtype of what `Rule.total` and `Rule.convolve` return."""
    number = jnp.zeros((), phi.dtype)
    some = jax.eval_shape(weights, Offset(number, number, number))[0]
    shape = (*whole_shape(seen, phi, section), len(some.colors))
    return jax.ShapeDtypeStruct(shape, phi.dtype)


def scattered(
    seen: Sequence[Seen],
    weights: Weights,
    pairs: Sequence[Pair],
    offset: Offset,
    share: Floats,
    section: Section,
) -> tuple[Floats, ...]:
    """What the lobes send to the observer from one offset, times a share, by color."""

    def common():
        """All that does not depend on color."""
        gamma_t = refraction(offset, section)
        turns = (2 * lobe.p * gamma_t - 2 * offset.gamma for lobe in seen)
        each = zip(seen, pairs, turns, weights(offset), strict=True)
        return [
            (share * light.common) * (lobe.factor * both(turn))
            for lobe, both, turn, light in each
        ]

    sent = programs.stored(common, section.k)
    each = zip(sent, weights(offset), strict=True)
    lights = [light._replace(common=one).times(1) for one, light in each]
    return tuple(reduce(jnp.add, colors) for colors in zip(*lights, strict=True))


Term = Callable[[Offset, Floats], tuple[Floats, ...]]
"""What one offset adds to each color, times a share."""


def by_form(
    weights: Weights,
    phi: Floats,
    section: Section,
    detector: Detector,
    tolerance: float | None,
    total: Callable[[Sequence[Seen], Term], Sequence[Floats]],
) -> list[Case]:
    """A case for every form of the detector; `total` sums a term over nodes."""
    precision = max(tolerance or 0.0, float(jnp.finfo(phi.dtype).eps))

    def case(form):
        def pair(lobe):
            return form.pair(wrap(phi - (lobe.p % 2) * jnp.pi), lobe.beta_n)

        def value(seen):
            pairs = [pair(lobe) for lobe in seen]

            def term(offset, share):
                return scattered(seen, weights, pairs, offset, share, section)

            return stacked(total(seen, term))

        return Case(lambda lobe: form.serves(lobe.beta_n), value)

    return [case(form) for form in detector.forms(precision)]


def check_rule(rule: Any) -> None:
    """ValueError unless `rule` is a `Rule`."""
    if not isinstance(rule, Rule):
        raise ValueError(
            f"rule = {rule!r}: must be fiberjax.auto(tolerance) or one of GaussH, "
            "GaussGamma, Windowed, Series"
        )


def check_tolerance(tolerance) -> None:
    """ValueError unless the tolerance is a number in (0, 1)."""
    if not isinstance(tolerance, float) or not 0 < tolerance < 1:
        raise ValueError(f"tolerance = {tolerance!r}: must be a number in (0, 1)")
