"""The rule for many directions of one fiber: a table of N made within the call."""

import math
from dataclasses import dataclass
from functools import reduce

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import programs
from fiberjax._types import Floats
from fiberjax.circular import sin_cos
from fiberjax.model import Attenuations
from fiberjax.quadrature import gauss_legendre_unit
from fiberjax.rules import Rule, whole_shape
from fiberjax.section import section_of, stacked
from fiberjax.series import many_phi, series_of, synthesis

_EXACT = jax.lax.Precision.HIGHEST
_MANY = 16
"""A table pays where there are so many directions to a polynomial."""


@dataclass(frozen=True)
class Tabled(Rule):
    """A table of N made within the call, where many directions share one fiber.

    Chebyshev polynomials in |cos theta_d| times a cosine series in phi, for each lobe
    by itself. N is analytic in |cos theta_d| up to sqrt(eta^2 - 1) off the real axis,
    so that few polynomials will do, and a value is a product of two short vectors with
    a matrix. Derivatives in the fiber pass through the table alone.

    Args:
        order: nodes on [0, pi/2] for each entry.
        degree: the highest polynomial.
        terms: the highest wave number.
        low, high: range of |cos theta_d|.
        otherwise: the rule where directions are few, or weights no `Attenuations`.
    """

    order: int
    degree: int
    terms: int
    low: float
    high: float
    otherwise: Rule

    def average(self, weight, section):
        return self.otherwise.average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        shape = whole_shape(seen, phi, section)
        one = section.eta.ndim == 0 and all(x.beta_n.ndim == 0 for x in seen)
        many = math.prod(shape) >= _MANY * (self.degree + 1)
        if not (one and many and isinstance(weights, Attenuations)) or detector.kink:
            return self.otherwise.convolve(seen, weights, phi, section, detector)
        here = section_of(self._cosines(phi.dtype), section.eta, section.sigma_a)
        nodes = gauss_legendre_unit(self.order)
        read = self._on_grid if many_phi(seen, phi, section) else self._at_each

        def one_lobe(k, lobe):
            light = weights.only([k]).at(here)
            terms = 0 if lobe.p is None else self.terms
            table = spectrum(series_of(lobe, light, here, nodes, terms))
            return read(table, section.cos, phi, lobe.factor)

        total = reduce(jnp.add, [one_lobe(k, lobe) for k, lobe in enumerate(seen)])
        return jnp.broadcast_to(total, (*shape, total.shape[-1]))

    def _cosines(self, dtype) -> Floats:
        """Where N is computed: Chebyshev's points of the range."""
        count = self.degree + 1
        at = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        half = (self.high - self.low) / 2
        return jnp.asarray(np.clip(self.low + half * (1 + at), 0, 1), dtype)

    def _polynomials(self, cos: Floats) -> Floats:
        """T_0 to T_degree at |cos theta_d|, on a first axis."""
        x = (2 * cos - (self.high + self.low)) / max(self.high - self.low, 1e-9)
        return jnp.stack(polynomials(x, self.degree + 1))

    def _on_grid(self, table: Floats, cos: Floats, phi: Floats, factor: Floats):
        """The table times a factor, with colors last, where many phi share a cosine."""
        at = self._polynomials(cos)
        rows = jnp.einsum("k...,kwc->w...c", at, table, precision=_EXACT)
        waves = jnp.stack(polynomials(sin_cos(phi)[1], table.shape[1]))
        shape = jnp.broadcast_shapes(cos.shape, phi.shape, factor.shape)
        return synthesis(waves, rows * factor[..., None], shape)

    def _at_each(self, table: Floats, cos: Floats, phi: Floats, factor: Floats):
        """The same at directions of any kind."""
        count, waves, colors = table.shape
        flat = table.reshape(count, -1).T

        def value(at, _):
            cos, phi, factor = at
            # Directions last: they are what is summed side by side.
            rows = jnp.tensordot(flat, self._polynomials(cos), 1, precision=_EXACT)
            ripple = polynomials(sin_cos(phi)[1], waves)
            each = [
                reduce(jnp.add, map(jnp.multiply, ripple, rows[color::colors]))
                for color in range(colors)
            ]
            return stacked([factor * one for one in each])

        return programs.in_blocks(value, (cos, phi, factor))


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
