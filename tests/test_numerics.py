"""Elementary functions and sums of our own, against extended precision."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fiberjax import circular, numerics
from fiberjax.quadrature import (
    chosen,
    gauss_legendre_unit,
    sum_in_blocks,
    weighted_sum,
)

DTYPES = ("float32", "float64")


def spread(low, high, dtype):
    return np.linspace(low, high, 20001, dtype=dtype)


def off(found: Any, exact: Any, scale: Any = 1.0) -> float:
    """Largest error in eps of the dtype."""
    error = np.abs(np.asarray(found, np.longdouble) - exact) / scale
    return float(error.max() / np.finfo(found.dtype).eps)


@pytest.mark.parametrize("dtype", DTYPES)
def test_decay(dtype):
    x = spread(-700 if dtype == "float64" else -80, 0, dtype)
    exact = np.exp(x.astype(np.longdouble))
    assert off(numerics.decay(jnp.asarray(x)), exact, exact) < 2
    slope = jax.vmap(jax.grad(numerics.decay))(jnp.asarray(x))
    assert off(slope, exact, exact) < 2
    ends = jnp.asarray([0, -0.0, -1e4, -np.inf, np.nan], dtype)
    np.testing.assert_array_equal(numerics.decay(ends), [1, 1, 0, 0, np.nan])
    assert numerics.decay(ends).dtype == dtype


@pytest.mark.parametrize("dtype", DTYPES)
def test_sine_and_cosine(dtype):
    x = spread(-np.pi / 2, np.pi / 2, dtype)
    wide = x.astype(np.longdouble)
    sin, cos = numerics.sin_cos(jnp.asarray(x))
    assert off(sin, np.sin(wide), np.maximum(np.abs(wide), 1e-300)) < 2
    assert off(cos, np.cos(wide)) < 3
    # Of larger angles the rounding of the angle itself is what counts.
    x = spread(-50, 50, dtype)
    wide = x.astype(np.longdouble)
    sin, cos = circular.sin_cos(jnp.asarray(x))
    allowed = 4 + np.abs(wide)
    assert off(sin, np.sin(wide), allowed) < 1
    assert off(cos, np.cos(wide), allowed) < 1
    rate = jax.jvp(circular.sin_cos, (jnp.asarray(x),), (jnp.ones_like(x),))[1]
    assert off(rate[0], np.cos(wide), allowed) < 1
    assert off(rate[1], -np.sin(wide), allowed) < 1


@pytest.mark.parametrize("dtype", DTYPES)
def test_acute_angle(dtype):
    angle = spread(-np.pi / 2, np.pi / 2, dtype)
    y, x = np.sin(angle), np.abs(np.cos(angle))
    wide = [z.astype(np.longdouble) for z in (y, x)]
    r = np.hypot(*wide).astype(dtype)
    exact = np.arctan2(*wide)
    found = numerics.acute_angle(*map(jnp.asarray, (y, x, r)))
    assert off(found, exact, np.maximum(np.abs(exact), 1e-300)) < 4


def test_clenshaw():
    x, terms = jnp.linspace(-1, 1, 101), [0.7, -0.2, 0.05, 0.4]
    b, after = numerics.clenshaw(terms, x)
    a = np.arccos(np.asarray(x))
    cosines = sum(c * np.cos(n * a) for n, c in enumerate(terms, 1))
    np.testing.assert_allclose(x * b - after, cosines, atol=1e-14)
    within = a[1:-1]
    sines = sum(c * np.sin(n * within) for n, c in enumerate(terms, 1))
    np.testing.assert_allclose(b[1:-1], sines / np.sin(within), atol=1e-13)


def test_what_is_stored_has_the_same_derivatives():
    x = jnp.linspace(0.1, 2, 5)

    def direct(x, k):
        return jnp.sin(k * x) * x

    def held(x, k):
        return numerics.stored(lambda: direct(x, k), k)

    for order in (0, 1, 2):
        f, g = direct, held
        for _ in range(order):
            f, g = (jax.jacfwd(jax.jit(h), argnums=1) for h in (f, g))
        np.testing.assert_allclose(f(x, 3.0), g(x, jnp.asarray(3.0)), rtol=1e-12)
    each = jax.vmap(held, (0, None))(x, jnp.asarray(3.0))
    np.testing.assert_allclose(each, direct(x, 3.0), rtol=1e-15)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_sums_over_a_number_of_nodes_known_when_running(index):
    rules = [gauss_legendre_unit(order) for order in (3, 20, 37)]

    def total(c, index, add):
        rule = chosen(rules, index, jnp.float64)
        if add is weighted_sum:
            return weighted_sum(lambda x, w: w * jnp.cos(c * x), rule, c.dtype)

        def block(x, w):
            return (w * jnp.cos(c * x)).sum(0)

        return sum_in_blocks(block, rule, c.dtype, (8, 1))

    c = jnp.array([1.0, 12.0, 30.0])
    x, w, _ = rules[index]
    exact = (w * np.cos(np.asarray(c)[:, None] * x)).sum(1)
    slope = -(w * x * np.sin(np.asarray(c)[:, None] * x)).sum(1)
    for add in (weighted_sum, sum_in_blocks):
        found = jax.jit(total, static_argnums=2)(c, index, add)
        np.testing.assert_allclose(found, exact, atol=1e-15)
        rate = jax.grad(lambda c, add=add: total(c, index, add).sum())(c)
        np.testing.assert_allclose(rate, slope, atol=1e-14)
