"""The rule for many directions of one fiber: a table of N made within the call."""

import math
from dataclasses import dataclass
from functools import partial, reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import programs
from fiberjax._types import Floats
from fiberjax.circular import sin_cos
from fiberjax.model import Attenuations
from fiberjax.quadrature import gauss_legendre_unit
from fiberjax.rules import Rule, Seen, Uniform, answer, name, whole_shape
from fiberjax.section import section_of
from fiberjax.series import many_phi, series_of, synthesis

_EXACT = jax.lax.Precision.HIGHEST
_MANY = 16
"""A table pays where there are so many directions to a polynomial."""

_NEAR = 1e-3
"""What is uniform changes fast near cos theta_d = 0 where little is absorbed: it is a
series in sqrt(cos theta_d + _NEAR), of about as many terms for any sigma_a."""


class Span(NamedTuple):
    """The size of the table of one lobe.

    p       the lobe; None for what is uniform in azimuth
    order   nodes on [0, pi/2] for each entry, if it has a p
    degree  the highest polynomial
    terms   the highest wave number
    """

    p: int | None
    order: int
    degree: int
    terms: int


@dataclass(frozen=True)
class Tabled(Rule):
    """Tables of N made within the call, where many directions share one fiber.

    Chebyshev polynomials in |cos theta_d| times a cosine series in phi, for each lobe
    by itself; what is uniform takes polynomials in a root of it. N of a lobe is
    analytic in |cos theta_d| up to sqrt(eta^2 - 1) off the real axis, so that few
    polynomials will do, and a value is a product of two short vectors with a matrix.
    Derivatives in the fiber pass through the tables alone.

    Args:
        spans: one for each lobe.
        low, high: range of |cos theta_d|.
        otherwise: the rule where directions are few, or weights no `Attenuations`, and
            for the entries of what is uniform.
    """

    spans: tuple[Span, ...]
    low: float
    high: float
    otherwise: Rule

    def average(self, weight, section):
        return self.otherwise.average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        return self.total(seen, weights, phi, section, detector)

    def total(self, seen, weights, phi, section, detector):
        shape = whole_shape(seen, phi, section)
        lobes = [x for x in seen if isinstance(x, Seen)]
        one = section.eta.ndim == 0 and all(x.beta_n.ndim == 0 for x in lobes)
        degrees = sum(span.degree + 1 for span in self.spans)
        many = math.prod(shape) * len(self.spans) >= _MANY * degrees
        kink = bool(lobes) and detector.kink
        if kink or not (one and many and isinstance(weights, Attenuations)):
            return self.otherwise.total(seen, weights, phi, section, detector)
        spans = {span.p: span for span in self.spans}

        def table(k, one):
            span = spans[name(one)]
            uniform = isinstance(one, Uniform)
            cos = points(span.degree + 1, self.low, self.high, uniform=uniform)
            cos = cos.astype(phi.dtype)
            here = section_of(cos, section.eta, section.sigma_a)
            light = weights.only([k]).at(here)
            if isinstance(one, Seen):
                nodes = gauss_legendre_unit(span.order)
                return spectrum(series_of(one, light, here, nodes, span.terms))
            alone = [Uniform(jnp.ones((), phi.dtype))]
            mean = self.otherwise.total(alone, light, 0 * cos, here, detector)
            return spectrum(mean[:, None])

        def place(one):
            uniform = isinstance(one, Uniform)
            return scaled(section.cos, self.low, self.high, uniform=uniform)

        tables = [table(k, one) for k, one in enumerate(seen)]
        factors = [one.factor for one in seen]
        read = partial(_on_grid, shape) if many_phi(seen, phi, section) else _read
        found = read(tables, [*map(place, seen)], sin_cos(phi)[1], factors)
        return jnp.broadcast_to(found, answer(seen, weights, phi, section).shape)


def _on_grid(shape, tables, x, ripple, factors):
    """`_read` where many phi share a cosine, for results of a shape without colors."""
    most = max(table.shape[1] for table in tables)

    def spread(at):
        # Waves come first, so that axes of others do not meet them.
        return at.reshape((1,) * (len(shape) - at.ndim) + at.shape)

    def rows(table, x, factor):
        """Coefficients of the waves, which come first."""
        at = jnp.stack(polynomials(spread(x), len(table)))
        found = jnp.einsum("k...,kwc->w...c", at, table, precision=_EXACT)
        found = found * spread(factor)[..., None]
        spare = [(0, most - len(found))] + [(0, 0)] * (found.ndim - 1)
        return jnp.pad(found, spare)

    total = reduce(jnp.add, map(rows, tables, x, factors))
    return synthesis(jnp.stack(polynomials(ripple, most)), total, shape)


@jax.custom_jvp
def _read(
    tables: list[Floats], x: list[Floats], ripple: Floats, factors: list[Floats]
) -> Floats:
    """Tables times factors at directions of any kind, with colors last.

    x of the polynomials of each, cos(phi) of the waves. One loop over colors and
    directions for each table, which stores nothing on its way.
    """
    # What they are computed from would be computed in every loop.
    x, ripple, factors = programs.apart((x, ripple, factors), ripple)
    waves = polynomials(ripple, max(table.shape[1] for table in tables))

    def color(table, x, factor):
        at = polynomials(x, len(table))
        rows = (reduce(jnp.add, map(jnp.multiply, at, row)) for row in table.T)
        return factor * reduce(jnp.add, map(jnp.multiply, waves, rows))

    def colors(table, x, factor):
        return jax.vmap(color, (2, None, None))(table, x, factor)

    # With colors last they would be loops that compute every color for each.
    found = programs.apart(list(map(colors, tables, x, factors)), ripple)
    return jnp.moveaxis(reduce(jnp.add, found), 0, -1)


def _read_in_blocks(tables, x, ripple, factors):
    """The same by products of matrices, a block at a time."""

    def value(at, _):
        x, ripple, factors = at
        waves = polynomials(ripple, max(table.shape[1] for table in tables))

        def colors(table, x, factor):
            # Directions last: they are what is summed side by side.
            flat = table.reshape(len(table), -1).T
            along = jnp.stack(polynomials(x, len(table)))
            rows = jnp.tensordot(flat, along, 1, precision=_EXACT)
            count = table.shape[2]
            each = (map(jnp.multiply, waves, rows[k::count]) for k in range(count))
            return jnp.stack([factor * reduce(jnp.add, one) for one in each])

        return jnp.moveaxis(reduce(jnp.add, map(colors, tables, x, factors)), 0, -1)

    return programs.in_blocks(value, (x, ripple, factors))


@_read.defjvp
def _read_jvp(primals, tangents):
    # The loops would keep all polynomials and waves for the reverse pass.
    return jax.jvp(_read_in_blocks, primals, tangents)


def points(count: int, low: float, high: float, *, uniform: bool) -> Floats:
    """Chebyshev's points of a range of cosines, for a lobe or what is uniform."""
    low, high = _bent(low, uniform), _bent(high, uniform)
    at = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    found = low + (high - low) / 2 * (1 + jnp.asarray(at))
    return jnp.clip(found * found - _NEAR if uniform else found, 0, 1)


def scaled(cos: Floats, low: float, high: float, *, uniform: bool) -> Floats:
    """What polynomials are in: a cosine of the range, bent and moved to [-1, 1]."""
    low, high = _bent(low, uniform), _bent(high, uniform)
    return (2 * _bent(cos, uniform) - (high + low)) / (high - low)


def _bent(cos: Any, uniform: bool) -> Any:
    """What polynomials are in, on the scale of the cosine."""
    return jnp.sqrt(cos + _NEAR) if uniform else cos


def spectrum(values: Floats) -> Floats:
    """Chebyshev coefficients, on the first axis, of what is known at the points."""
    count = values.shape[0]
    k = np.arange(count)
    waves = np.cos(np.pi * np.outer(k, k + 0.5) / count) * 2 / count
    waves[0] /= 2
    flat = values.reshape(count, -1)
    found = jnp.matmul(jnp.asarray(waves, values.dtype), flat, precision=_EXACT)
    return found.reshape(values.shape)


def polynomials(x: Floats, count: int) -> list[Floats]:
    """T_0 to T_(count - 1) of x."""
    found = [jnp.ones_like(x), x]
    for _ in range(count - 2):
        found.append(2 * x * found[-1] - found[-2])
    return found[:count]
