"""Absorption from colors: the solver against the albedo, and the formulas."""

from dataclasses import replace
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from mpmath import mp as untyped_mp

import fiberjax as fj
from fiberjax import absorption

untyped: Any = absorption
mp: Any = untyped_mp  # it has no types
HAIR = fj.Fiber(beta_m=0.3, beta_n=0.2, alpha=-0.03)
COLOR = jnp.asarray((0.15, 0.4, 0.8))


def split(sigma_a, theta_i):
    """R's albedo, and that of all other lobes."""
    parts = fj.albedo(replace(HAIR, sigma_a=sigma_a), theta_i, per_lobe=True)
    return parts[0], parts[1:].sum(0)


def test_the_albedo_is_the_color_asked_for():
    """From next to R's, where a fiber is black, to that of the clear one."""
    ends = jnp.asarray((0.0, 1e-3, 1e3))
    for theta_i in (0.0, -0.9, 1.4):
        low, high = absorption.reach(HAIR, theta_i)
        R, inside = split(ends, theta_i)
        assert high == pytest.approx(float(R[0] + inside[0]), rel=1e-14)
        assert low == pytest.approx(float(R[2] + inside[2]), rel=1e-14)
        for share in (1e-9, 1e-4, 0.5):
            color = jnp.asarray((low + share * (high - low), (low + high) / 2, high))
            sigma_a = absorption.solve(HAIR, color, theta_i)
            R, inside = split(sigma_a, theta_i)
            np.testing.assert_allclose(R + inside, color, rtol=1e-13)
            # What is not reflected has the digits that the color leaves it.
            digits = 1e-15 * color / (color - low) + 1e-12
            assert np.all(abs(inside / (color - low) - 1) < digits)
            assert 0 <= sigma_a[2] < 1e-14


@pytest.mark.slow
def test_the_mean_over_inclinations():
    """Against Gauss-Legendre in theta_i, with the measure of the docstring."""
    sigma_a = absorption.solve(HAIR, COLOR)
    x, w = np.polynomial.legendre.leggauss(60)
    theta_i = np.pi / 2 * x
    found = fj.albedo(replace(HAIR, sigma_a=sigma_a), theta_i)
    mean = (w * np.cos(theta_i) ** 2) @ np.asarray(found)
    np.testing.assert_allclose(mean, COLOR, rtol=1e-12)
    ends = np.asarray([0.0, 1.0]) @ np.stack(absorption.reach(HAIR))
    clear = fj.albedo(replace(HAIR, sigma_a=None), theta_i)
    expected = (w * np.cos(theta_i) ** 2) @ np.asarray(clear)
    assert ends == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_the_mean_of_a_narrow_fiber():
    """As far as the docstring says that it is right, at the ends of that."""
    x, w = np.polynomial.legendre.leggauss(160)
    weight = jnp.asarray(w * np.cos(np.pi / 2 * x) ** 2)

    @jax.jit
    def off(eta, alpha, color):
        fiber = fj.Fiber(eta, 0.02, 0.2, alpha, None)
        low, high = absorption.reach(fiber)
        asked = low + (high - low) * color
        sigma_a = absorption.solve(fiber, asked)
        found = fj.albedo(replace(fiber, sigma_a=sigma_a), jnp.asarray(np.pi / 2 * x))
        return jnp.abs(weight @ found - asked).max()

    colors = jnp.asarray((1e-3, 0.1, 0.5, 1.0))
    for eta, alpha in product((1.05, 1.55), (-0.1, -0.035, 0.1)):
        assert off(eta, alpha, colors) < 1e-7


@pytest.mark.slow
def test_implicit_derivatives():
    """In the color, the inclination and every field that matters, by differences."""

    def total(fiber, color, theta_i):
        return absorption.solve(fiber, color, theta_i) @ jnp.asarray((1.0, 2.0, 3.0))

    bare = replace(HAIR, sigma_a=None)
    point = (bare, COLOR, jnp.asarray(0.7))
    slopes = jax.jit(jax.grad(total, (0, 1, 2)))(*point)
    leaves, tree = jax.tree.flatten(point)
    step = 1e-5
    for k, leaf in enumerate(leaves):
        for i in np.ndindex(leaf.shape):

            def moved(sign, k=k, i=i):
                some = list(leaves)
                some[k] = some[k].at[i].add(sign * step)
                return total(*jax.tree.unflatten(tree, some))

            central = (moved(1) - moved(-1)) / (2 * step)
            found = jax.tree.leaves(slopes)[k][i]
            np.testing.assert_allclose(found, central, rtol=1e-6, atol=1e-8)


def test_out_of_reach_is_an_error():
    low, high = map(float, absorption.reach(HAIR, 0.3))
    for bad in (low, 0.9 * low, high * (1 + 1e-10), np.nan):
        color = COLOR.at[1].set(bad)
        with pytest.raises(ValueError, match=rf"must lie in \({low:.6g}, {high:.6g}\]"):
            absorption.solve(HAIR, color, 0.3)


@pytest.mark.slow
def test_many_colors_by_vmap():
    """One out of reach is NaN, and leaves the values and gradients of others alone."""
    low, _ = absorption.reach(HAIR, 0.3)
    colors = jnp.stack([COLOR, COLOR.at[1].set(0.9 * low)])

    def one(color, theta_i):
        sigma_a = absorption.solve(HAIR, color, theta_i)
        return jnp.where(jnp.isnan(sigma_a), 0.0, sigma_a).sum(), sigma_a

    each = jax.vmap(jax.value_and_grad(one, has_aux=True))
    (_, found), slopes = each(colors, jnp.asarray((0.3, 0.3)))
    np.testing.assert_allclose(found[0], absorption.solve(HAIR, COLOR, 0.3), rtol=1e-12)
    assert np.isnan(found[1]).tolist() == [False, True, False]
    assert bool(jnp.isfinite(slopes).all())
    assert slopes[1, 1] == 0
    for k, shift in enumerate(1e-5 * jnp.eye(3)):
        ends = [absorption.solve(HAIR, COLOR + s * shift, 0.3)[k] for s in (1, -1)]
        assert float(slopes[0, k]) == pytest.approx(float(ends[0] - ends[1]) / 2e-5)


@pytest.mark.slow
def test_float32_and_shapes():
    theta_i = np.float32(0.3)
    sigma_a = absorption.solve(HAIR, COLOR.astype(jnp.float32), theta_i)
    assert sigma_a.dtype == jnp.float32
    np.testing.assert_allclose(sigma_a, absorption.solve(HAIR, COLOR, 0.3), rtol=3e-5)
    gray = absorption.solve(HAIR, 0.4, 0.3)
    assert gray.shape == ()
    np.testing.assert_allclose(gray, absorption.solve(HAIR, COLOR, 0.3)[1], rtol=1e-12)


@pytest.mark.slow
def test_extremes_of_the_fiber():
    """Rough, smooth, grazing and next to no refraction; incidence at theta_i."""
    for eta, beta_m, theta_i in (
        (1.55, 1e-3, 0.0),
        (1.55, 3.0, 1.2),
        (1.55, 0.3, 1.55),
        (1.0 + 1e-6, 0.3, 0.5),
        (3.0, 0.1, -1.5),
    ):
        fiber = fj.Fiber(eta, beta_m, 0.2, 0.04, None)
        for incidence in ("theta_d", "theta_i"):
            choices: Any = {"incidence": incidence}
            low, high = absorption.reach(fiber, theta_i, **choices)
            color = low + (high - low) * jnp.asarray((1e-6, 0.1, 0.7))
            sigma_a = absorption.solve(fiber, color, theta_i, **choices)
            found = fj.albedo(replace(fiber, sigma_a=sigma_a), theta_i, **choices)
            np.testing.assert_allclose(found, color, rtol=1e-12)


def test_one_fiber_is_not_the_hair_that_chiang_fits():
    """The numbers of the module's docstring."""
    text = absorption.__doc__ or ""
    for sigma_a, shown in (
        (absorption.from_color(0.1, 0.3), ".759"),
        (absorption.zeta(0.1), ".378"),
    ):
        found = float(fj.albedo(replace(fj.Fiber(), sigma_a=sigma_a), 0.0))
        assert found == pytest.approx(float(shown), abs=5e-4)
        assert f"{shown} " in text or f"{shown}." in text


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_formulas(dtype):
    """Against 40 digits; derivatives at C = 1, where Chiang's is 0 and Karis' -1/4."""
    eps = float(jnp.finfo(dtype).eps)
    with mp.workdps(40):
        for c in (1e-6, 0.1, 0.5, 0.99, 1.0):
            color = dtype(c)
            log = mp.log(mp.mpf(float(color)))
            b = mp.mpf(float(dtype(0.3)))
            fit = (5.969, -0.215, 2.532, -10.73, 5.574, 0.245)
            d = sum(mp.mpf(str(k)) * b**n for n, k in enumerate(fit))
            for found, right in (
                (absorption.from_color(color, 0.3), (log / d) ** 2),
                (absorption.zeta(color), -log / 4),
            ):
                assert found.dtype == dtype
                assert abs(float(found) - float(right)) <= 16 * eps * float(right)
    slope = jax.grad(lambda c: absorption.from_color(c, 0.3))
    assert slope(dtype(1)) == 0
    assert jax.grad(absorption.zeta)(dtype(1)) == -0.25
    mixed = absorption.from_melanin(dtype(1.3), dtype(0.2))
    right = 1.3 * np.array((0.419, 0.697, 1.37)) + 0.2 * np.array((0.187, 0.4, 1.05))
    np.testing.assert_allclose(mixed, right, rtol=4 * eps)
    assert mixed.dtype == dtype
    thick = absorption.per_radius(jnp.asarray((4.0, 12.0), dtype), 0.04)
    assert thick.dtype == dtype
    np.testing.assert_allclose(thick, (0.16, 0.48), rtol=2 * eps)


BAD = {
    "shape": (lambda: untyped.solve(HAIR, np.ones((2, 3)), 0.0), r"shape \(2, 3\)"),
    "lobes": (
        lambda: untyped.solve(HAIR, 0.5, 0.0, lobes=(0,), rest=False),
        "must name a lobe that is absorbed",
    ),
    "theta_i": (
        lambda: untyped.solve(HAIR, 0.5, np.zeros(3)),
        r"theta_i has shape \(3,\)",
    ),
    "incidence": (lambda: untyped.reach(HAIR, incidence="h"), "incidence = 'h'"),
    "fiber": (lambda: untyped.reach(fj.Fiber(eta=np.ones(2))), "jax.vmap"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_says_what_is_allowed(case):
    call, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        call()
