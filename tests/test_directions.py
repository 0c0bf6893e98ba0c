"""The near field by direction vectors: values, samples and derivatives of angles."""

from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_nearfield import COLORS, HAIR, angles
from test_sampling import uniforms

import fiberjax as fj
from fiberjax import directions, nearfield


def vectors(theta, phi):
    return np.stack(
        [np.sin(theta), np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi)], -1
    )


def test_directions_are_angles():
    theta_i, theta_o, phi, h = angles(6, 500)
    turn = np.linspace(-3, 3, 500)
    omega = vectors(theta_i, turn), vectors(theta_o, turn + phi)
    for name in ("evaluate", "pdf"):
        by_angles = getattr(nearfield, name)(HAIR, theta_i, theta_o, phi, h)
        found = getattr(directions, name)(HAIR, *omega, h)
        np.testing.assert_allclose(found, by_angles, rtol=1e-11)
    u = uniforms(2, 500, 4)
    drawn = nearfield.sample(HAIR, theta_i, h, u)
    found = directions.sample(HAIR, omega[0], h, u)
    expected = vectors(np.asarray(drawn.theta_o), drawn.phi + turn)
    np.testing.assert_allclose(found.omega_o, expected, atol=1e-14)
    np.testing.assert_allclose(found.weight, drawn.weight, rtol=1e-10)
    assert (found.p == drawn.p).all()
    np.testing.assert_allclose(jnp.linalg.norm(found.omega_o, axis=-1), 1, rtol=1e-14)


def test_many_directions_are_those_of_few():
    """By blocks, the last of which is not full; arguments broadcast."""
    theta_i, theta_o, phi, h = angles(8, 9000)
    turn, u = np.linspace(-3, 3, 9000), uniforms(4, 9000, 4)
    given, out = vectors(theta_i, turn), vectors(theta_o, turn + phi)
    some = slice(8900, None)
    both = np.array([0.2, 0.4])
    many = directions.evaluate(HAIR, given[:, None], out[:, None], both)
    few = directions.evaluate(HAIR, given[some, None], out[some, None], both)
    assert many.shape == (9000, 2, len(COLORS))
    np.testing.assert_allclose(many[some], few, rtol=1e-12)
    many = directions.sample(HAIR, given, h, u)
    few = directions.sample(HAIR, given[some], h[some], u[some])
    for x, y in zip(many, few, strict=True):
        np.testing.assert_allclose(x[some], y, rtol=1e-10, atol=1e-13)

    @jax.jit
    @jax.grad
    def slope(of, *at):
        return directions.pdf(of, *at).sum()

    whole = slope(HAIR, given, out, h)
    parts = slice(4500), slice(4500, None)
    halves = [slope(HAIR, given[x], out[x], h[x]) for x in parts]
    added = jax.tree.map(jnp.add, *halves)
    for x, y in zip(*map(jax.tree.leaves, (whole, added)), strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-9, atol=1e-9)


TANGENT = np.array([1.0, 0.0, 0.0])


def value_by_vectors(of, at, u):
    theta_i, theta_o, phi, h = at
    given, out = fj.from_angles(theta_i, theta_o, phi, TANGENT)
    found = [f(of, given, out, h) for f in (directions.evaluate, directions.pdf)]
    return *found, *directions.sample(of, given, h, u)[:2]


def value_by_angles(of, at, u):
    found = [f(of, *at) for f in (nearfield.evaluate, nearfield.pdf)]
    drawn = nearfield.sample(of, at[0], at[3], u)
    _, omega_o = fj.from_angles(at[0], drawn.theta_o, drawn.phi, TANGENT)
    return *found, omega_o, drawn.weight


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_derivatives_are_those_by_angles(dtype):
    """Of 60 rays, each by itself, as angles, h and the fiber's numbers change."""
    at, u = jnp.asarray(np.stack(angles(6, 60)).T, dtype), uniforms(2, 60, 4, dtype)
    of = jax.tree.map(lambda x: x.astype(dtype), HAIR)
    rng = np.random.default_rng(7)

    def changed(x):
        return jnp.asarray(rng.normal(size=(60, *x.shape)), dtype)

    changes = jax.tree.map(changed, of), changed(at[0])

    def slopes(f):
        def one(at, u, change):
            return jax.jvp(lambda *x: f(*x, u), (of, at), change)[1]

        return jax.jit(jax.vmap(one))(at, u, changes)

    eps = float(np.finfo(dtype).eps)
    found, expected = slopes(value_by_vectors), slopes(value_by_angles)
    for one, other in zip(found, expected, strict=True):
        assert one.dtype == dtype
        off = np.abs(one - other).reshape(60, -1).max(1)
        size = np.abs(other).reshape(60, -1).max(1)
        assert (off <= 256 * eps * size + 1e-30).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_directions_along_the_tangent(dtype):
    """Finite, and so are the derivatives."""
    tangent, across = np.eye(3, dtype=dtype)[:2]

    def numbers(omega_i, omega_o):
        value = directions.evaluate(HAIR, omega_i, omega_o, dtype(0.3))
        u = jnp.asarray([0.4, 0.3, 0.2, 0.6], dtype)
        drawn = directions.sample(HAIR, omega_i, dtype(0.3), u)
        return value.sum(), drawn.omega_o.sum()

    for pair in product((tangent, -tangent, across), repeat=2):
        found = numbers(*pair), jax.jacrev(numbers, (0, 1))(*pair)
        assert all(np.isfinite(x).all() for x in jax.tree.leaves(found))
