"""The sampler of the near field: energy, distribution, weights and derivatives.

Roughness goes from .01 to 1, as deviations in radians and as what Chiang et al. 2016
call so, whose ends are deviations of .0073 and .0028, and of 5.2 and 6.8.
"""

from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import special
from test_nearfield import (
    FIELDS,
    GRAZING,
    HALF_PI,
    PERCEPTUAL,
    SCALE,
    clustered,
    fiber,
    panels,
    parts,
)
from test_nearfield import sphere as sphere_of
from test_sampling import FALSE_ALARM, fit_of, uniforms

import fiberjax as fj
from fiberjax import nearfield

DTYPES = [np.float32, np.float64]
BETAS: tuple[Any, ...] = (0.01, 0.05, 0.2, 0.6, 1.0, *PERCEPTUAL)
AT = (0.0, 0.1), (0.8, -0.5), (-GRAZING, 0.95), (1.3, 0.99)


def cells(of, theta_i, h):
    """Edges of cells in sin(theta_o) and phi, small where a lobe is narrow."""
    _, cones, beta, turns = parts(of, theta_i, h)
    theta = panels(np.arcsin(np.sin(cones)), beta, -HALF_PI, HALF_PI)
    wrapped = [float(x) % (2 * np.pi) for turn in turns for x in (turn, turn + np.pi)]
    s = [SCALE * float(of.beta_n)] * 6
    phi = panels(wrapped, s, 0, 2 * np.pi)
    split = np.linspace(0, 1, 5)[:-1]
    return [
        np.append((x[:-1, None] + np.diff(x)[:, None] * split).ravel(), x[-1])
        for x in (np.sin(theta), phi)
    ]


@jax.jit
def uniform_furnace(of, theta_i, h, sine, phi, keys):
    """One direction in every cell, uniform in solid angle; an estimate for each key."""

    def estimate(key):
        u = jax.random.uniform(key, (2, len(sine) - 1, len(phi) - 1), jnp.float64)
        z = sine[:-1, None] + jnp.diff(sine)[:, None] * u[0]
        at = jnp.arcsin(z), phi[:-1] + jnp.diff(phi) * u[1]
        theta_o, azimuth = (x.astype(theta_i.dtype) for x in at)
        value = nearfield.evaluate(of, theta_i, theta_o, azimuth, h)
        value = value.astype(jnp.float64)
        return (value * jnp.diff(sine)[:, None] * jnp.diff(phi)).sum()

    return jax.lax.map(estimate, keys)


@pytest.mark.parametrize(
    "dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)]
)
def test_white_furnace_by_uniform_directions(dtype):
    """All light comes back, with a standard error below 1 %."""
    keys = jax.random.split(jax.random.key(3), 8)
    for beta, (theta_i, h) in product(BETAS, AT):
        of = fiber(beta)
        edges = cells(of, theta_i, h)
        each = np.asarray(uniform_furnace(of, dtype(theta_i), dtype(h), *edges, keys))
        error = each.std(ddof=1) / np.sqrt(len(each))
        assert error < 0.01
        narrowest = min(float(of.beta_m), float(of.beta_n), 1.0)
        rounding = 20 * float(np.finfo(dtype).eps) / narrowest
        assert abs(each.mean() - 1) < 7 * error + rounding


@pytest.mark.parametrize("dtype", DTYPES)
def test_white_furnace_by_drawn_directions(dtype):
    """All weights are 1."""
    u = uniforms(3, 20_000, 4, dtype)
    for beta, (theta_i, h) in product(BETAS, AT):
        drawn = nearfield.sample(fiber(beta), dtype(theta_i), dtype(h), u)
        assert drawn.weight.dtype == dtype
        room = 200 * np.finfo(dtype).eps
        np.testing.assert_allclose(drawn.weight, 1, atol=room)


def logistic_mass(edges, turn, s):
    """Of the trimmed logistic around `turn` in bins of [-pi, pi], by its integral."""
    away = edges - turn
    turns = np.round(away / (2 * np.pi))
    inside = away - 2 * np.pi * turns
    low, high = special.expit(-np.pi / s), special.expit(np.pi / s)
    return np.diff(turns + (special.expit(inside / s) - low) / (high - low))


def chi_square(of, theta_i, h, drawn):
    """p-value in bins of which the exact integrals are known."""
    A, cones, beta, turns = parts(of, theta_i, h)
    w = np.array([a.mean() for a in A])
    phi_edges = np.linspace(-np.pi, np.pi, 37)
    sine = np.linspace(-1, 1, 1 << 15)
    fine = np.arcsin(sine)
    x, gauss = np.polynomial.legendre.leggauss(6)
    density: Any = sum(
        share * np.asarray(fj.M(c, fine[1:], b * b))
        for share, c, b in zip(w / w.sum(), cones, beta, strict=True)
    )
    share = np.concatenate([[0], np.cumsum(density)]) / density.sum()
    edges = np.interp(np.linspace(0, 1, 25), 0.9 * share + (1 + sine) / 20, fine)
    edges[0], edges[-1] = -HALF_PI, HALF_PI
    parts_of = np.linspace(edges[:-1], edges[1:], 129)
    mid, half = (parts_of[1:] + parts_of[:-1]) / 2, np.diff(parts_of, axis=0) / 2
    theta = mid[..., None] + half[..., None] * x
    mass = np.zeros((24, 36))
    for k, (share, c, b) in enumerate(zip(w / w.sum(), cones, beta, strict=True)):
        along = np.asarray(fj.M(c, theta, b * b)) * np.cos(theta) * gauss
        along = (half * along.sum(-1)).sum(0)
        around = np.full(36, 1 / 36)
        if k < 3:
            around = logistic_mass(phi_edges, float(turns[k]), SCALE * float(of.beta_n))
        mass += share * np.outer(along, around)
    assert mass.sum() == pytest.approx(1, abs=1e-9)
    # float32 has a pi that lies beyond.
    return fit_of(drawn, edges, np.append(phi_edges[:-1], 3.1416), mass)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("sigma_a", [None, 1.0])
def test_chi_square(dtype, sigma_a):
    """At every roughness and direction, a clear fiber included."""
    worst = 1.0
    u = uniforms(7, 200_000, 4, dtype)
    for beta, (theta_i, h) in product(BETAS, AT):
        of = fiber(beta, sigma_a)
        drawn = nearfield.sample(of, dtype(theta_i), dtype(h), u)
        worst = min(worst, chi_square(of, theta_i, h, drawn))
    assert worst > FALSE_ALARM / (4 * len(BETAS) * len(AT))


def test_chi_square_rejects_broken_samplers():
    u = uniforms(8, 200_000, 4)
    for beta in (0.3, 2.0):
        of, theta_i, h = fiber(beta), 0.8, -0.9
        right = nearfield.sample(of, theta_i, h, u)
        assert chi_square(of, theta_i, h, right) > FALSE_ALARM
        # One number for two purposes, and the rest of renderers, at theta_o = 0.
        reused = nearfield.sample(of, theta_i, h, u.at[:, 3].set(u[:, 0]))
        flat = right._replace(theta_o=jnp.where(right.p == 3, 0, right.theta_o))
        mirrored = nearfield.sample(of, theta_i, -h, u)
        # phi as it is left by adding the deviate, and a deviate that is not trimmed.
        turn = jnp.asarray([*parts(of, theta_i, h)[3], 0.0])[right.p]
        away = right.phi - turn
        added = turn + away - 2 * jnp.pi * jnp.round(away / (2 * jnp.pi))
        unwrapped = right._replace(phi=added)
        v, s = u[:, 3], SCALE * beta
        whole = turn + s * jnp.log(v / (1 - v))
        whole = jnp.where(right.p == 3, right.phi, whole)
        untrimmed = right._replace(phi=jnp.arctan2(jnp.sin(whole), jnp.cos(whole)))
        broken = [reused, flat, mirrored, unwrapped]
        # Of a narrow detector there is nothing to trim.
        for one in broken + [untrimmed] * (beta == 2.0):
            assert chi_square(of, theta_i, h, one) < 1e-9


MOMENTS: tuple[Any, ...] = (
    (np.ones_like, np.ones_like),
    (np.sin, np.ones_like),
    (lambda t: np.cos(t) ** 2, np.cos),
    (np.cos, np.sin),
    (np.ones_like, lambda p: np.cos(2 * p)),
)


def moments(of, theta_i, h):
    """int S a(theta_o) b(phi) d omega_o: sums of products, for S is one."""
    A, cones, beta, turns = parts(of, theta_i, h)
    total = np.zeros(len(MOMENTS))
    for k, (a, c, b) in enumerate(zip(A, cones, beta, strict=True)):
        t, w = clustered([np.arcsin(np.sin(c))], [b], -HALF_PI, HALF_PI)
        along = w * np.cos(t) * np.asarray(fj.M(c, t, b * b))
        x, around = clustered([0.0], [SCALE * float(of.beta_n)], -np.pi, np.pi)
        if k < 3:
            around = around * np.asarray(fj.trimmed_logistic(x, SCALE * of.beta_n))
            x = x + float(turns[k])
        else:
            around = around / (2 * np.pi)
        each = [(along @ f(t)) * (around @ g(x)) for f, g in MOMENTS]
        total += a.mean() * np.array(each)
    return total


@pytest.mark.parametrize(
    ("dtype", "sigma_a"),
    [
        (np.float32, None),
        (np.float64, 1.0),
        pytest.param(np.float32, 1.0, marks=pytest.mark.slow),
        pytest.param(np.float64, None, marks=pytest.mark.slow),
    ],
)
def test_samples_and_density_are_consistent(dtype, sigma_a):
    """Weights are evaluate/pdf; integrals by samples are those by quadrature."""
    u, eps = uniforms(9, 200_000, 4, dtype), float(np.finfo(dtype).eps)
    for beta, (theta_i, h) in product(BETAS, AT):
        of, given = fiber(beta, sigma_a), (dtype(theta_i), dtype(h))
        drawn = nearfield.sample(of, *given, u)
        theta_o, phi, weight = (np.asarray(x, float) for x in drawn[:3])
        at = given[0], drawn.theta_o[:4096], drawn.phi[:4096], given[1]
        ratio = nearfield.evaluate(of, *at) / nearfield.pdf(of, *at)
        np.testing.assert_allclose(drawn.weight[:4096], ratio, rtol=16 * eps)
        exact = moments(of, theta_i, h)
        each = [weight * f(theta_o) * g(phi) for f, g in MOMENTS]
        off = np.abs(np.mean(each, 1) - exact)
        assert (off < 5 * np.std(each, 1) / np.sqrt(len(u)) + 1e3 * eps).all()


def test_no_light_left():
    """A ray of p >= 1 at grazing in a black fiber: lobes are equally likely."""
    of = fiber(0.3, 1e30)
    u = uniforms(1, 1000, 4)
    drawn = nearfield.sample(of, 0.3, 0.2, u, lobes=(1, 2), rest=False)
    assert (np.asarray(drawn.weight) == 0).all()
    assert np.bincount(np.asarray(drawn.p))[1:] == pytest.approx([500, 500], abs=80)


def gradients(f, mode, theta_i, h, u):
    def mean(of):
        drawn = nearfield.sample(of, theta_i, h, u, gradient=mode)
        return (drawn.weight * f(drawn.theta_o, drawn.phi)).mean()

    return jax.grad(mean)(fj.Fiber(1.5, 0.3, 0.4, 0.03, 0.3))


@pytest.mark.parametrize("mode", ["reparameterized", "detached"])
def test_gradients_of_estimators(mode):
    of, theta_i, h = fj.Fiber(1.5, 0.3, 0.4, 0.03, 0.3), 0.5, 0.3

    def f(theta_o, phi):
        return jnp.cos(theta_o + 0.3) ** 2 * (1.5 + jnp.cos(phi - 1))

    theta_o, phi, weight = sphere_of(of, theta_i, h)

    def exact(of):
        value = nearfield.evaluate(of, theta_i, theta_o, phi, h)
        return (weight * value * f(theta_o, phi)).sum()

    expected, batches = jax.grad(exact)(of), []
    for seed in range(16):
        batches.append(gradients(f, mode, theta_i, h, uniforms(seed, 20_000, 4)))
    for name in FIELDS:
        each = np.array([getattr(one, name) for one in batches])
        error = each.std(ddof=1) / np.sqrt(len(each))
        assert abs(each.mean() - getattr(expected, name)) < 5 * error
        assert error < 0.1 * (1e-3 + abs(getattr(expected, name)))
