"""The rule for small roughness: nodes only where a narrow detector sees anything."""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, lobe_number
from fiberjax.circular import TURN, wrap
from fiberjax.crossings import Piece, images, inverse, pieces
from fiberjax.path import deflection
from fiberjax.rules import (
    GaussGamma,
    Rule,
    graded_offsets,
    grading,
    sum_over,
    whole_shape,
)

_SMOOTH = GaussGamma(64)
"""For what does not depend on azimuth."""

_CALM = 0.3
"""With a grading wider than this, grazing asks for no nodes of its own."""


def _distance(target: Floats, piece: Piece) -> Floats:
    """How far a deflection lies outside the range of the piece."""
    return jnp.maximum(jnp.maximum(target - piece.high, piece.low - target), 0)


def _nearest(p: int, x: Floats, piece: Piece) -> list[Floats]:
    """The images that can matter: as many in a row as a range of (p - 1) pi shows."""
    seen = images(p, x, piece)
    count = max(2, p + p % 2)
    best = seen[:count]
    off = sum(_distance(target, piece) for target in best)
    for k in range(1, len(seen) - count + 1):
        these = seen[k : k + count]
        further = sum(_distance(target, piece) for target in these)
        better = further < off
        best = [jnp.where(better, a, b) for a, b in zip(these, best, strict=True)]
        off = jnp.where(better, further, off)
    return best


@dataclass(frozen=True)
class Windowed(Rule):
    """Gauss-Legendre over windows around the rays that leave near the observer.

    [0, pi/2] is split where Phi turns back. For each image of the observer's azimuth
    that a piece can show, the window is where |Phi - image| <= sqrt(d^2 + w^2), d the
    distance of the image from the range of Phi and w = reach * beta_n. Edges and nodes
    move with the parameters, by the implicit function theorem, which keeps derivatives
    as accurate as values however small beta_n is. As beta_n -> 0 the result tends to
    `N_smooth`.

    Args:
        order: number of nodes of a window of TRT, >= 1; R and TT take 0.8 of it, twice
            that where the optics change fast at grazing, the logistic more.
        tolerance: of the peak of the detector, what it may be outside; in (0, 1).

    Raises:
        ValueError: order is not an integer >= 1, or tolerance lies outside (0, 1).
    """

    order: int = 48
    tolerance: float = 1e-16

    def __post_init__(self):
        order = lobe_number("order", self.order, lowest=1)
        object.__setattr__(self, "order", order)
        check_tolerance(self.tolerance)

    def average(self, weight, section):
        return _SMOOTH.average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        total = 0.0
        for k, lobe in enumerate(seen):

            def weight(offset, k=k):
                return weights(offset)[k]

            if lobe.p is None:
                whole = _SMOOTH.average(weight, section)
                whole = whole * lobe.factor[..., None] / TURN
            else:
                whole = self._lobe(lobe, weight, phi, section, detector)
            total = total + whole
        return jnp.asarray(total)

    def _lobe(self, lobe, weight, phi, section, detector):
        p = lobe.p
        phi = jnp.broadcast_to(phi, whole_shape([lobe], phi, section))
        x = jnp.abs(wrap(phi - (p % 2) * jnp.pi))
        reach = detector.reach(self.tolerance) * lobe.beta_n
        targets, lows, highs = [], [], []
        for piece in pieces(p, section):
            target = jnp.stack(_nearest(p, x, piece))
            off = _distance(target, piece)
            half = jnp.sqrt(off * off + reach * reach)
            if not piece.rising:
                half = -half
            goals = jnp.stack([target - half, target + half])
            low, high = inverse(p, goals, piece, section)
            targets.append(target)
            lows.append(low)
            highs.append(high)
        target, low, high = map(jnp.concatenate, (targets, lows, highs))

        def term(offset, share):
            away = target - deflection(p, offset, section)
            share = share * lobe.factor * detector.image(away, lobe.beta_n) / 2
            return weight(offset) * share[..., None]

        delta = grading(section, p)
        offsets = graded_offsets(delta, low, high)
        effort = detector.effort(self.tolerance) * (1 if p > 1 else 0.8)
        order = math.ceil(self.order * effort)

        def by(order):
            return lambda: sum_over(term, offsets, order, phi.dtype).sum(0)

        if p > 1:
            return by(order)()
        # A window of R or TT may reach over all that changes at grazing.
        calm = jnp.all(delta > _CALM)
        return jax.lax.cond(calm, by(order), by(2 * order + 8))


def check_tolerance(tolerance) -> None:
    """ValueError unless the tolerance is a number in (0, 1)."""
    if not isinstance(tolerance, float) or not 0 < tolerance < 1:
        raise ValueError(f"tolerance = {tolerance!r}: must be a number in (0, 1)")
