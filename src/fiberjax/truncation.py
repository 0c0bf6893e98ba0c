"""The smallest tables of N for a scene, by the errors of tables that are cut."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax._types import Floats
from fiberjax.asking import MARGIN, Asked
from fiberjax.circular import TURN
from fiberjax.graded import GaussGamma
from fiberjax.measured import ORDERS, Exact, in_float64, worst
from fiberjax.model import Attenuations, Model, longitudinal
from fiberjax.probes import Probe
from fiberjax.quadrature import gauss_legendre_unit
from fiberjax.rules import Seen
from fiberjax.scenes import Scene
from fiberjax.section import section_of
from fiberjax.series import series_of
from fiberjax.tabled import points, polynomials, scaled, spectrum

DEGREES, WAVES = 32, 64
"""Polynomials and wave numbers of the tables that are looked at."""

_UNIFORM = 64
"""Polynomials for what has no waves."""


class Tables(NamedTuple):
    """Of each part the bounds of tables by size, and the largest table of each fiber.

    bounds   (degrees, waves): entry (j, k) is for all polynomials below j + 1 and
             waves to k, over the peak: twice the sum of the coefficients that are left
             out, interpolation included, and of what lies beyond the last wave, times
             the largest M over the peak
    largest  (F, degrees, waves)
    """

    bounds: list[Floats]
    largest: list[Floats]


@partial(jax.jit, static_argnames="model")
def _tables(model: Model, ends: tuple[Any, Any], sample: Probe, peak: Floats) -> Tables:
    """Tables of every part over a range of |cos theta_d|."""
    nodes = gauss_legendre_unit(ORDERS[-1])
    eps = float(jnp.finfo(sample.phi.dtype).eps)

    def table(at, part):
        count, waves = (_UNIFORM, 0) if part == model.tail else (DEGREES, WAVES)
        cos = points(count, *ends, uniform=part == model.tail)
        here = section_of(cos, at.fiber.eta, at.fiber.sigma_a)
        light = Attenuations(model, (part,), here)
        beta = model.shape(at.fiber, part).beta_n
        if waves:
            lobe = Seen(part, beta, jnp.ones((), beta.dtype))
            return spectrum(series_of(lobe, light, here, nodes, waves)[..., 0])
        mean = GaussGamma(ORDERS[-1]).average(lambda at: light(at)[0], here)
        return spectrum(mean / TURN)

    def bound(values, beta):
        kept = jnp.abs(values).cumsum(0).cumsum(1)
        more = jnp.arange(WAVES + 1, 4 * WAVES, dtype=beta.dtype)
        damped = jnp.exp(-((more * beta) ** 2) / 2).sum()
        beyond = 2 * kept[-1, 0] * damped if values.shape[1] > 1 else 0.0
        return 2 * (kept[-1, -1] - kept) + beyond + 8 * eps * kept[-1, -1]

    def one(both):
        at, exact = both
        wide = in_float64(at)
        each = longitudinal(model, wide.fiber, model.parts, wide.theta_i, wide.theta_o)
        bounds, largest = [], []
        for part, along in zip(model.parts, each, strict=True):
            steep = (along.max((-1, -2)) / jnp.where(exact > 0, exact, 1)).max()
            largest.append(table(wide, part))
            beta = model.shape(wide.fiber, part).beta_n
            bounds.append(bound(largest[-1], beta) * steep)
        return Tables(bounds, largest)

    found = jax.lax.map(one, (sample, peak))
    return found._replace(bounds=[x.max(0) for x in found.bounds])


@partial(jax.jit, static_argnames="model")
def _errors(
    model: Model,
    ends: tuple[Any, Any],
    tables: Sequence[Floats],
    sizes: Any,
    sample: Probe,
    at: Exact,
    peak: Floats,
) -> list[Floats]:
    """For each part twice the largest error over the peak of a table cut to its size.

    Twice, since a table that has no more nodes takes what is left out for what is not.
    `sizes` are the highest polynomial and wave number of each part.
    """

    def one(both):
        at, exact, peak, tables = both
        wide = in_float64(at)
        where = wide.theta_i, wide.theta_o
        cos = model.section(wide.fiber, *where).cos[..., 0]
        found = []
        each = longitudinal(model, wide.fiber, model.parts, *where)
        for at_part, (part, along) in enumerate(zip(model.parts, each, strict=True)):
            x = scaled(cos, *ends, uniform=part == model.tail)
            values, (degree, terms) = tables[at_part], sizes[at_part]
            j, k = (jnp.arange(n, dtype=x.dtype) for n in values.shape)
            kept = jnp.where((j[:, None] <= degree) & (k <= terms), values, 0)
            at_cos = jnp.stack(polynomials(x, len(j)))
            waves = jnp.cos(k[:, None] * wide.phi[0, 0])
            N = jnp.einsum("jab,jk,kc->abc", at_cos, kept, waves)
            found.append(2 * worst(N * along, exact.values[at_part], peak))
        return found

    return [x.max(0) for x in jax.lax.map(one, (sample, at, peak, tables))]


def cosines(scene: Scene) -> tuple[float, float]:
    """The range of |cos theta_d|, or of |cos theta_i|, from below and above."""
    ends, out = scene.ends("theta_i"), scene.ends("theta_o")
    if scene.incidence == "theta_d":
        ends = (out[0] - ends[1]) / 2, (out[1] - ends[0]) / 2
    largest = min(max(map(abs, ends)), math.pi / 2)
    smallest = 0.0 if ends[0] <= 0 <= ends[1] else min(map(abs, ends))
    return max(math.cos(largest) - 1e-6, 0.0), min(math.cos(smallest) + 1e-6, 1.0)


_WIDEST = 3 / 4, 7 / 8
"""Larger tables, by their share of the largest that is measured, are not looked at:
what lies beyond would be seen too late."""

_LOOSER = tuple(1.5**k for k in range(14))
"""How many times bounds may exceed what is allowed: the sum of all coefficients that
are left out is never reached."""


class Size(NamedTuple):
    """The highest polynomial and wave number of a table, and the bound of its error."""

    degree: int
    terms: int
    bound: float


def _smallest(bounds: np.ndarray, allowed: float) -> tuple[int, int] | None:
    """The size of the smallest table of a bound; None if none has it."""
    widest = (math.ceil(x * n) for x, n in zip(_WIDEST, bounds.shape, strict=True))
    fits = bounds[tuple(map(slice, widest))] <= allowed
    degree, waves = np.indices(fits.shape)
    entries = np.where(fits, (degree + 3) * (waves + 3), np.inf)
    best = np.unravel_index(np.argmin(entries), fits.shape)
    return (int(best[0]), int(best[1])) if fits[best] else None


def sizes(asked: Asked, full: Model, allowed: float) -> list[Size | None]:
    """Of each part the smallest table whose error, as measured, is allowed.

    By bounds a table of some size is found, by its error it is taken.
    """
    ends = cosines(asked.scene)
    bounds, largest = _tables(full, ends, asked.sample, asked.peak)
    bounds = [MARGIN * np.asarray(x) for x in bounds]
    found: list[Size | None] = [None] * len(bounds)
    for looser in _LOOSER:
        tried = [_smallest(x, looser * allowed) for x in bounds]
        whole = [
            x or (y.shape[0], y.shape[1]) for x, y in zip(tried, bounds, strict=True)
        ]
        errors = _errors(
            full, ends, largest, whole, asked.sample, asked.exact, asked.peak
        )
        for k, size in enumerate(tried):
            # What the largest table lacks is rounding, and waves that nothing has.
            error = MARGIN * float(errors[k]) + float(bounds[k][-1, -1])
            if size and error <= allowed:
                found[k] = Size(*size, error)
    return found
