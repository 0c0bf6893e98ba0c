"""Gauss-Legendre nodes, and sums over them that need no memory per node."""

import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax._types import Floats


def _newton_step(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Better zeros of the Legendre polynomial of degree len(x), and weights at x."""
    order = len(x)
    before, now = np.ones_like(x), x
    for k in range(2, order + 1):
        before, now = now, ((2 * k - 1) * x * now - (k - 1) * before) / k
    slope = order * (before - x * now) / ((1 - x) * (1 + x))
    return x - now / slope, 2 / ((1 - x) * (1 + x) * slope**2)


@cache
def gauss_legendre(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the Gauss-Legendre rule on [-1, 1], in float64.

    By Newton's method in extended precision. NumPy's weights next to the ends are off
    by up to 1e-13, which a density concentrated there would show.
    """
    k = np.arange(order, 0, -1, dtype=np.longdouble)
    x = np.cos(np.pi * (k - 0.25) / (order + 0.5))
    for _ in range(5):
        x, _ = _newton_step(x)
        x = (x - x[::-1]) / 2  # symmetric, with the middle one at 0
    weights = _newton_step(x)[1]
    return x.astype(np.float64), weights.astype(np.float64)


class Nodes(NamedTuple):
    """Nodes and weights of a rule on [0, 1]; only the first `count` count, None: all.

    With a count that is known only when running, one program serves every order.
    """

    at: Any
    weight: Any
    count: Any = None


@cache
def gauss_legendre_unit(order: int) -> Nodes:
    """Gauss-Legendre on [0, 1]."""
    x, w = gauss_legendre(order)
    return Nodes((1 + x) / 2, w / 2)


@cache
def stretched_unit(order: int, tolerance: float) -> Nodes:
    """Gauss-Legendre on [0, 1] through x = asin(a t)/asin a, for bumps.

    Nodes lie nearly evenly: bumps that vanish at both ends need fewer of them. The map
    is singular outside [-1, 1]; a is chosen such that this leaves an error of the order
    of the tolerance.

    Reference: Kosloff and Tal-Ezer 1993.
    """
    x, w = gauss_legendre(order)
    rho = tolerance ** (-0.5 / order)
    a = 2 / (rho + 1 / rho)
    stretch = math.asin(a)
    at = np.arcsin(a * x) / stretch
    return Nodes((1 + at) / 2, w * a / np.sqrt(1 - (a * x) ** 2) / stretch / 2)


TOGETHER = 2
"""Where the count is known only when running nodes are left out by so many."""

_BLOCK = 16
"""And by so many."""


def chosen(rules: Sequence[Nodes], index: Any, dtype: Any) -> Nodes:
    """One of several rules, by an index that is known only when running."""
    counts = np.array([len(rule.at) for rule in rules])
    longest = int(counts.max())
    starts = np.cumsum(counts) - counts
    spare = np.zeros(longest - counts[-1])

    def one(arrays):
        row = jnp.asarray(np.concatenate([*arrays, spare]), dtype)
        return jax.lax.dynamic_slice(row, (jnp.asarray(starts)[index],), (longest,))

    at, weight = (one(arrays) for arrays in zip(*(r[:2] for r in rules), strict=True))
    return Nodes(at, weight, jnp.asarray(counts)[index])


def weighted_sum(f: Callable[[Floats, Floats], Any], rule: Nodes, dtype: Any) -> Any:
    """sum_k f(node_k, weight_k), one node at a time.

    `f` sees scalar nodes and weights and may return arrays of any shape in a PyTree. A
    scan keeps the program small and the memory independent of the number of nodes; the
    checkpoint does the same for reverse mode, by computing each term again instead of
    storing it. Nodes beyond the count cost nothing.
    """
    nodes, weights = jnp.asarray(rule.at, dtype), jnp.asarray(rule.weight, dtype)
    again = partial(jax.checkpoint, prevent_cse=False)
    terms = jax.eval_shape(f, nodes[0], weights[0])
    zeros = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), terms)

    @again
    def add(total, node):
        return jax.tree.map(jnp.add, total, f(*node)), None

    if rule.count is None:
        return jax.lax.scan(add, zeros, (nodes, weights))[0]

    def some(step):
        """Several steps, left out where the first node is beyond the count."""

        @again
        def steps(total, nodes):
            return jax.lax.cond(
                nodes[1].ravel()[0] > 0,
                lambda: jax.lax.scan(step, total, nodes)[0],
                lambda: total,
            ), None

        return steps

    # Reverse mode adds up zeros for all that is left out: few and large steps.
    shape = _BLOCK // TOGETHER, TOGETHER
    blocks = _in_blocks(nodes, weights, rule.count, shape)
    return jax.lax.scan(some(some(add)), zeros, blocks)[0]


def _in_blocks(
    nodes: Floats, weights: Floats, count: Any, shape: tuple[int, ...]
) -> tuple[Floats, Floats]:
    """Both along a first axis of blocks; no weight beyond the count."""
    spare = 0, -len(nodes) % math.prod(shape)
    nodes, weights = jnp.pad(nodes, spare, mode="edge"), jnp.pad(weights, spare)
    if count is not None:
        weights = jnp.where(jnp.arange(len(weights)) < count, weights, 0)
    return nodes.reshape(-1, *shape), weights.reshape(-1, *shape)


def sum_in_blocks(
    f: Callable[[Floats, Floats], Any],
    rule: Nodes,
    dtype: Any,
    shape: tuple[int, ...],
) -> Any:
    """Sum of f(nodes, weights), which adds up a block of nodes of a shape itself."""
    nodes, weights = (jnp.asarray(x, dtype) for x in rule[:2])
    blocks = _in_blocks(nodes, weights, rule.count, shape)
    terms = jax.eval_shape(f, *(x[0] for x in blocks))
    zeros = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), terms)

    @partial(jax.checkpoint, prevent_cse=False)
    def add(total, some):
        return jax.lax.cond(
            some[1].ravel()[0] > 0,
            lambda: jax.tree.map(jnp.add, total, f(*some)),
            lambda: total,
        ), None

    return jax.lax.scan(add, zeros, blocks)[0]
