"""The rule for grids: a cosine series in azimuth where many phi share all else."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax._types import Floats, lobe_number
from fiberjax.circular import TURN, sin_cos
from fiberjax.graded import GaussGamma, graded_offsets, grading, highest
from fiberjax.quadrature import Nodes, gauss_legendre_unit, sum_in_blocks
from fiberjax.rules import Rule, Seen, Uniform, Weights, answer, whole_shape
from fiberjax.section import Section, deflection

_BLOCK = 32
"""Wave numbers at a time: those that are not needed are left out by blocks."""

_NODES = 16
"""Nodes at a time, fewer for more than _AT_ONCE/_NODES sections."""

_AT_ONCE = 1 << 14

_EXACT = jax.lax.Precision.HIGHEST

_SHARED = 16
"""With this many phi to one theta_d a series takes less time than nodes for each."""


def many_phi(seen: Sequence[Seen | Uniform], phi: Floats, section: Section) -> bool:
    """Whether many phi share all else."""
    full = math.prod(whole_shape(seen, phi, section))
    each = math.prod(whole_shape(seen, jnp.zeros((), phi.dtype), section))
    return full >= _SHARED * each


def synthesis(waves: Floats, coefficients: Floats, shape: tuple[int, ...]) -> Floats:
    """sum_k waves[k] coefficients[k], with a trailing color axis and `shape` before.

    An axis that only one of the two has makes this a product of matrices.
    """
    letters = "abcdefghij"[: len(shape)]

    def axes(sizes):
        """Letters of the axes longer than 1, and the array without the others."""
        padded = (1,) * (len(shape) - len(sizes)) + tuple(sizes)
        kept = [(c, n) for c, n in zip(letters, padded, strict=True) if n > 1]
        return "".join(c for c, _ in kept), [n for _, n in kept]

    on_phi, phi_sizes = axes(waves.shape[1:])
    on_rest, rest_sizes = axes(coefficients.shape[1:-1])
    found = jnp.einsum(
        f"z{on_phi},z{on_rest}y->{''.join(sorted({*on_phi, *on_rest}))}y",
        waves.reshape(-1, *phi_sizes),
        coefficients.reshape(-1, *rest_sizes, coefficients.shape[-1]),
        precision=_EXACT,
    )
    return found.reshape(*shape, coefficients.shape[-1])


@dataclass(frozen=True)
class Series(Rule):
    """A cosine series in phi, from the nodes of `GaussGamma`.

    N = (c_0 + 2 sum_k D_k c_k cos(k (phi - p pi)))/(2 pi) with c_k = int_0^{pi/2} A
    cos(gamma) cos(k (Phi - p pi)) dgamma and D_k = exp(-k^2 beta_n^2/2), those of the
    detector. The c_k are found once for each theta_d, and a value costs one product a
    term: many phi should share theta_d. The trimmed logistic has a kink that no short
    series resolves; `GaussGamma` stands in for it.

    Args:
        order: number of nodes on [0, pi/2], >= 1.
        terms: number of terms beyond c_0, >= 1; sqrt(2 log(1/tolerance))/beta_n leave
            out less than the tolerance.

    Raises:
        ValueError: order or terms is not an integer >= 1.
    """

    order: int = 64
    terms: int = 48

    def __post_init__(self):
        for name in ("order", "terms"):
            number = lobe_number(name, getattr(self, name), lowest=1)
            object.__setattr__(self, name, number)

    def average(self, weight, section):
        return GaussGamma(self.order).average(weight, section)

    def convolve(self, seen, weights, phi, section, detector):
        if detector.kink:
            nodes = GaussGamma(self.order)
            return nodes.convolve(seen, weights, phi, section, detector)
        terms = self.terms
        nodes = gauss_legendre_unit(self.order)
        return series(seen, weights, phi, section, nodes, terms, terms)


def series(
    seen: Sequence[Seen],
    weights: Weights,
    phi: Floats,
    section: Section,
    nodes: Nodes,
    terms: Any,
    most: int,
) -> Floats:
    """The series of `Series` up to `terms`, a number <= most known when running."""
    like = answer(seen, weights, phi, section)
    offsets = graded_offsets(grading(section, highest(seen)))
    shared = whole_shape(seen, jnp.zeros((), phi.dtype), section)
    together = max(1, min(_NODES, _AT_ONCE // max(1, math.prod(shared))))
    block = (together, *(1,) * len(shared))

    def wave_numbers(k, x):
        return k.reshape(-1, *(1,) * jnp.ndim(x))

    def moments(k, lobe, light, offset, share):
        """Sum over nodes of cos(k (Phi - p pi)) A cos(gamma), every k on a first axis.

        As products of matrices, one for each section: XLA's reductions take longer.
        """
        weighted = jnp.moveaxis(light.stacked() * share[..., None], 0, -1)
        turn = deflection(lobe.p, offset, section)
        turn = jnp.broadcast_to(turn, light.common.shape)
        _, waves = sin_cos(jnp.moveaxis(turn, 0, -1)[..., None] * k)
        found = jnp.matmul(weighted, waves, precision=_EXACT)
        return jnp.moveaxis(found, -1, 0)

    def some_waves(k):
        """The part of the sum with these wave numbers."""

        def terms_of(t, w):
            offset, slope = offsets(t)
            each = zip(seen, weights(offset), strict=True)
            return [moments(k, lobe, light, offset, w * slope) for lobe, light in each]

        found = sum_in_blocks(terms_of, nodes, phi.dtype, block)
        total = 0.0
        for lobe, moment in zip(seen, found, strict=True):
            # The observer's phi - p pi turns the sign of every other term.
            n = wave_numbers(k, lobe.beta_n)
            sign = jnp.where((n * lobe.p) % 2 == 0, 1, -1)
            damp = sign * jnp.exp(-((n * lobe.beta_n) ** 2) / 2)
            size = max(jnp.ndim(lobe.factor), moment.ndim - 2, damp.ndim - 1)

            def padded(x, tail=0, size=size):
                """The wave numbers first, then axes that broadcast."""
                missing = (1,) * (size + 1 + tail - x.ndim)
                return x.reshape(x.shape[0], *missing, *x.shape[1:])

            weight = (padded(damp) * lobe.factor)[..., None]
            total = total + padded(moment, 1) * weight
        n = wave_numbers(k, phi)
        waves = sin_cos(n * phi)[1] * jnp.where(n == 0, 1, jnp.where(n > terms, 0, 2))
        return synthesis(waves, jnp.asarray(total), like.shape[:-1]) / TURN

    @partial(jax.checkpoint, prevent_cse=False)
    def step(total, k):
        needed = ~(k[0] > terms)  # and so where terms is NaN
        return jax.lax.cond(needed, lambda: total + some_waves(k), lambda: total), None

    blocks = jnp.arange(most + 1 + -(most + 1) % _BLOCK, dtype=phi.dtype)
    start = jnp.zeros(like.shape, like.dtype)
    return jax.lax.scan(step, start, blocks.reshape(-1, _BLOCK))[0]


def series_of(
    lobe: Seen, weights: Weights, section: Section, nodes: Nodes, terms: int
) -> Floats:
    """Coefficients of cos(k phi) in N of one lobe, k to `terms`: (J, terms + 1, C).

    For a section of J inclinations, by the nodes of `GaussGamma`, without the factor. R
    has one color: none of its light was inside.
    """
    p, dtype = lobe.p, section.cos.dtype
    t, w = (jnp.asarray(x, dtype)[:, None] for x in nodes[:2])
    offset, slope = graded_offsets(grading(section, p))(t)
    light = weights(offset)[0]
    light = (light.stacked() if p else light.common[..., None]) * (w * slope)[..., None]
    k = np.arange(terms + 1)
    turn = jnp.broadcast_to(deflection(p, offset, section), light.shape[:-1])
    _, waves = sin_cos(turn[..., None] * jnp.asarray(k, dtype))
    found = jnp.einsum("njk,njc->jkc", waves, light, precision=_EXACT)
    sign = np.where(k * p % 2 == 0, 1, -1) * np.where(k == 0, 1, 2) / TURN
    damp = jnp.asarray(sign, dtype)
    damp = damp * jnp.exp(-((jnp.asarray(k, dtype) * lobe.beta_n) ** 2) / 2)
    return found * damp[:, None]
