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

from fiberjax._types import Floats
from fiberjax.circular import TURN
from fiberjax.detectors import Detector
from fiberjax.section import Light, Offset, Section

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
