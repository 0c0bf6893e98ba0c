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
from fiberjax.section import section_of
from fiberjax.series import series_of

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

        def read(k, lobe):
            light = weights.only([k]).at(here)
            terms = 0 if lobe.p is None else self.terms
            table = spectrum(series_of(lobe, light, here, nodes, terms))
            return self._read(table, section.cos, phi, lobe.factor)

        total = reduce(jnp.add, [read(k, lobe) for k, lobe in enumerate(seen)])
        return jnp.broadcast_to(total, (*shape, total.shape[-1]))

    def _cosines(self, dtype) -> Floats:
        """Where N is computed: Chebyshev's points of the range."""
        count = self.degree + 1
        at = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        half = (self.high - self.low) / 2
        return jnp.asarray(np.clip(self.low + half * (1 + at), 0, 1), dtype)

    def _read(self, table: Floats, cos: Floats, phi: Floats, factor: Floats) -> Floats:
        """The table at directions, times a factor, with a trailing color axis."""
        count, waves, colors = table.shape
        flat = table.reshape(count, -1)

        def value(at, _):
            cos, phi, factor = at
            s = (2 * cos - (self.high + self.low)) / max(self.high - self.low, 1e-9)
            rows = jnp.matmul(polynomials(s, count), flat, precision=_EXACT)
            rows = rows.reshape(*s.shape, waves, colors)
            if waves > 1:
                ripple = polynomials(sin_cos(phi)[1], waves)
                found = (ripple[..., None] * rows).sum(-2)
            else:
                found = rows[..., 0, :]
            return found * factor[..., None]

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


def polynomials(x: Floats, count: int) -> Floats:
    """T_0 to T_(count - 1) of x, on a last axis."""
    found = [jnp.ones_like(x), x]
    for _ in range(count - 2):
        found.append(2 * x * found[-1] - found[-2])
    return jnp.stack(found[:count], -1)
