"""Gauss-Legendre nodes, and sums over them that need no memory per node."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

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


@cache
def gauss_legendre_unit(order: int) -> tuple[np.ndarray, np.ndarray]:
    """The same rule on [0, 1]."""
    x, w = gauss_legendre(order)
    return (1 + x) / 2, w / 2


def weighted_sum(
    f: Callable[[Floats, Floats], Any], rule: tuple[np.ndarray, np.ndarray], dtype
) -> Any:
    """sum_k f(node_k, weight_k), one node at a time.

    `f` sees scalar nodes and weights and may return arrays of any shape in a PyTree. A
    scan keeps the program small and the memory independent of the number of nodes; the
    checkpoint does the same for reverse mode, by computing each term again instead of
    storing it.
    """
    nodes, weights = (jnp.asarray(x, dtype) for x in rule)
    terms = jax.eval_shape(f, nodes[0], weights[0])
    zeros = jax.tree.map(lambda term: jnp.zeros(term.shape, term.dtype), terms)

    @partial(jax.checkpoint, prevent_cse=False)
    def step(total, node):
        return jax.tree.map(jnp.add, total, f(*node)), None

    return jax.lax.scan(step, zeros, (nodes, weights))[0]
