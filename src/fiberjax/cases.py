"""How rules sum over lobes: by the forms of a detector, each element by one."""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import programs
from fiberjax._types import Floats
from fiberjax.circular import wrap
from fiberjax.detectors import Detector, Pair
from fiberjax.rules import Seen, Weight, Weights
from fiberjax.section import Offset, Section, refraction, stacked


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
