"""The rule for small roughness: nodes only where a narrow detector sees anything."""

import math
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp

from fiberjax import programs
from fiberjax._types import lobe_number
from fiberjax.cases import lobe_by_lobe
from fiberjax.circular import TURN, wrap
from fiberjax.crossings import Piece, inverse, pieces
from fiberjax.graded import GaussGamma, grading, offsets_between, sum_over
from fiberjax.quadrature import chosen, gauss_legendre_unit, stretched_unit
from fiberjax.rules import Rule, answer, check_tolerance
from fiberjax.section import deflection, stacked

_SMOOTH = GaussGamma(96)
"""For what does not depend on azimuth."""

_CALM = 0.6
"""With a grading wider than this, grazing asks for no nodes of its own."""


def _targets(p: int) -> list[tuple[int, float, int]]:
    """(sign, shift, number of a piece): its deflections sign x + shift may be seen.

    Those that lie in the range of the piece for some x in [0, pi], some eta and some
    theta_d, and the nearest ones on either side of it.
    """
    if p < 2:
        return [(1, -TURN, 0), (1, 0.0, 0)]
    rising = [(1, TURN * m, 0) for m in range(-(p // 2), (p + 1) // 2)]
    turns = [(sign, TURN * m, 1) for m in range(p // 2 + 1) for sign in (-1, 1)]
    return [*rising, (1, -TURN, 1), *turns[: p + 1]]


@dataclass(frozen=True)
class Windowed(Rule):
    """Gauss-Legendre over windows around the rays that leave near the observer.

    [-pi/2, pi/2] is split where Phi turns back. For each image of the observer's
    azimuth that a piece can show, the window is where |Phi - image| <= sqrt(d^2 + w^2),
    d the distance of the image from the range of Phi and w = reach * beta_n; images so
    far away that the density is below tolerance^4 of its peak are skipped. Edges and
    nodes move with the parameters, by the implicit function theorem, which keeps
    derivatives as accurate as values however small beta_n is. As beta_n -> 0 the result
    tends to `N_smooth`.

    Args:
        order: number of nodes of a window of TRT, >= 1; R and TT take 0.8 of it, more
            where the optics change fast at grazing, and the logistic more.
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
        def in_windows(lobe, weight):
            return self._lobe(lobe, weight, phi, section, detector)

        return lobe_by_lobe(seen, weights, in_windows)

    def _lobe(self, lobe, weight, phi, section, detector):
        p = lobe.p
        like = answer([lobe], lambda offset: [weight(offset)], phi, section)
        x = jnp.abs(wrap(jnp.broadcast_to(phi, like.shape[:-1]) - (p % 2) * jnp.pi))
        reach = detector.reach(self.tolerance) * lobe.beta_n
        sight = detector.reach(self.tolerance**4) * lobe.beta_n
        delta = grading(section, p)
        nodes = self._nodes(p, delta, detector, phi.dtype)
        every = Piece(*map(jnp.stack, zip(*pieces(p, section), strict=True)))

        @partial(jax.checkpoint, prevent_cse=False)
        def window(target, off, piece):
            """The integral over what one image shows of one piece."""
            half = piece.side * jnp.sqrt(off * off + reach * reach)
            goals = jnp.stack([target + half, target - half])
            edges = inverse(p, goals, piece, section)
            factor = jnp.where(off >= sight, 0, lobe.factor)

            def term(offset, share):
                def common():
                    away = target - deflection(p, offset, section)
                    density = detector.image(away, lobe.beta_n) / 2
                    return weight(offset).common * (share * factor * density)

                light = weight(offset)
                sent = programs.stored(common, section.k)
                return light._replace(common=sent).times(1)

            return sum_over(term, offsets_between(delta, *edges), nodes, phi.dtype)

        def step(total, image):
            sign, shift, number = image
            piece = Piece(*(field[number] for field in every))
            target = sign * x + shift
            off = jnp.maximum(jnp.maximum(target - piece.high, piece.low - target), 0)

            def more():
                return jax.tree.map(jnp.add, total, window(target, off, piece))

            # NaN is seen too, in the optics as well: it must reach the result.
            seen = jnp.any(~((off >= sight) & (delta > 0)))
            return jax.lax.cond(seen, more, lambda: total), None

        signs, shifts, numbers = zip(*_targets(p), strict=True)
        images = (
            *(jnp.array(x, phi.dtype) for x in (signs, shifts)),
            jnp.array(numbers),
        )
        start = (jnp.zeros(like.shape[:-1], like.dtype),) * like.shape[-1]
        return stacked(jax.lax.scan(step, start, images)[0])

    def _nodes(self, p, delta, detector, dtype):
        """The nodes of a window of lobe p."""
        effort = detector.effort(self.tolerance) * (1 if p > 1 else 0.8)
        order = math.ceil(self.order * effort)
        # A window may reach over all that changes at grazing, those of R and TT over
        # both ends.
        many = (2 if p > 1 else 5) * order + 8
        rules = stretched_unit(order, self.tolerance), gauss_legendre_unit(many)
        return chosen(rules, jnp.any(delta <= _CALM).astype(int), dtype)
