"""Elementary functions and sums of our own, against extended precision."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import special

from fiberjax import bessel, circular, numerics, programs
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
def test_log1p(dtype):
    """Next to -1, next to 0 and far from both."""
    eps = np.finfo(dtype).eps
    small = np.geomspace(1e-30, 1, 4001)
    x = np.concatenate([-small, small, 1e3 * small, small - 1])
    x = x.astype(dtype)[x.astype(dtype) > eps - 1]
    exact = np.log1p(x.astype(np.longdouble))
    found = jax.jit(numerics.log1p)(jnp.asarray(x))
    assert found.dtype == dtype
    some = exact != 0
    assert off(found[some], exact[some], np.abs(exact[some])) < 4
    assert numerics.log1p(jnp.zeros((), dtype)) == 0
    slope = jax.vmap(jax.grad(numerics.log1p))(jnp.asarray(x))
    exact = 1 / (1 + x.astype(np.longdouble))
    assert off(slope, exact, exact) < 2


@pytest.mark.parametrize("dtype", DTYPES)
def test_absorption(dtype):
    """What is left and what is lost, each to its last digits."""
    x = np.concatenate([[0.0], np.geomspace(1e-30, 80, 20001)]).astype(dtype)
    wide = x.astype(np.longdouble)
    left, lost = jax.jit(numerics.absorption)(jnp.asarray(x))
    assert left.dtype == lost.dtype == dtype
    assert off(left, np.exp(-wide), np.exp(-wide)) < 2
    assert off(lost[1:], -np.expm1(-wide[1:]), -np.expm1(-wide[1:])) < 2
    ends = jnp.asarray([0.0, 1e4, np.inf, np.nan], dtype)
    left, lost = numerics.absorption(ends)
    np.testing.assert_array_equal(left, [1, 0, 0, np.nan])
    np.testing.assert_array_equal(lost, [0, 1, 1, np.nan])
    slopes = jax.jvp(numerics.absorption, (ends[:3],), (jnp.ones_like(ends[:3]),))[1]
    np.testing.assert_array_equal(slopes, [[-1, 0, 0], [1, 0, 0]])


@pytest.mark.parametrize("dtype", DTYPES)
def test_scaled_I0(dtype):
    a = np.concatenate([np.linspace(0, 12, 20001), np.geomspace(12, 1e8, 2001)])
    a = np.concatenate([a, -a]).astype(dtype)
    exact = special.ive(0, np.abs(a).astype(np.float64)).astype(np.longdouble)
    # SciPy's own is good to some eps of float64.
    room = 3 if dtype == "float32" else 8
    found = jax.jit(bessel.scaled_I0)(jnp.asarray(a))
    assert found.dtype == dtype
    assert off(found, exact, exact) < room


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
        return programs.stored(lambda: direct(x, k), k)

    for order in (0, 1, 2):
        f, g = direct, held
        for _ in range(order):
            f, g = (jax.jacfwd(jax.jit(h), argnums=1) for h in (f, g))
        np.testing.assert_allclose(f(x, 3.0), g(x, jnp.asarray(3.0)), rtol=1e-12)
    each = jax.vmap(held, (0, None))(x, jnp.asarray(3.0))
    np.testing.assert_allclose(each, direct(x, 3.0), rtol=1e-15)


def test_what_is_kept_apart_has_the_same_derivatives():
    """Whole numbers, which have none, may be among it."""
    x = jnp.linspace(0.1, 2, 5)

    def direct(x, k):
        return jnp.sin(k * x) * x, jnp.arange(5)

    def held(x, k):
        return programs.apart(direct(x, k), x)

    for order in (0, 1, 2):
        f, g = direct, held
        for _ in range(order):
            f, g = (jax.jacfwd(lambda *at, h=h: jax.jit(h)(*at)[0], 0) for h in (f, g))
            f, g = ((lambda *at, h=h: (h(*at), 0)) for h in (f, g))
        np.testing.assert_allclose(f(x, 3.0)[0], g(x, 3.0)[0], rtol=1e-12)
    total = [jax.grad(lambda x, h=h: h(x, 3.0)[0].sum())(x) for h in (direct, held)]
    np.testing.assert_allclose(*total, rtol=1e-12)
    np.testing.assert_array_equal(jax.jit(held)(x, 3.0)[1], np.arange(5))
    each = jax.vmap(held, (None, 0))(x, jnp.asarray([3.0, 4.0]))[0]
    np.testing.assert_allclose(each[1], direct(x, 4.0)[0], rtol=1e-15)


@pytest.mark.parametrize("dtype", DTYPES)
def test_logistic_and_its_quantile(dtype):
    """A quantile to the last digits of its distance from either end and the middle."""
    eps = float(np.finfo(dtype).eps)
    u = np.concatenate([np.geomspace(eps, 0.5, 501), 0.5 + np.geomspace(eps, 0.4, 501)])
    u = u.astype(dtype)
    number = np.dtype(dtype).type
    for s in map(number, (1e-4, 0.05, 0.3, 3.0, 30.0)):
        of = circular.logistic(jnp.asarray(s))
        found = circular.logistic_quantile(jnp.asarray(u), of)
        assert found.dtype == dtype
        wide = u.astype(np.longdouble)
        c = 1 / np.expm1(min(np.longdouble(np.pi) / s, 99))
        less = np.minimum(wide, 1 - wide)
        exact = s * np.log1p((1 - 2 * less) / (less + c)) * np.sign(wide - 0.5)
        middle = exact == 0
        assert off(found[~middle], exact[~middle], np.abs(exact[~middle])) < 8
    for s in map(number, (0.3, 1.0)):
        slope = jax.grad(lambda x, s=s: circular.trimmed_logistic(x, s))
        assert slope(number(0)) == 0
        # -1/(2 s^2) of the peak.
        bend = jax.grad(slope)(number(0)) / circular.trimmed_logistic(number(0), s)
        assert bend == pytest.approx(-1 / (2 * s * s), rel=8 * eps)


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
