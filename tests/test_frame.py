"""Directions and angles."""

import jax
import jax.numpy as jnp
import numpy as np

import fiberjax as fj


def test_handedness():
    """With the tangent first, w = (sin theta, cos theta cos phi, cos theta sin phi)."""
    theta_i, theta_o, phi = 0.3, -0.8, 2.2

    def direction(theta, phi):
        return np.array(
            [np.sin(theta), np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi)]
        )

    wi, wo = direction(theta_i, 0.4), direction(theta_o, 0.4 + phi)
    found = fj.to_angles(wi, 3 * wo, np.array([2.0, 0, 0]))
    np.testing.assert_allclose(found, (theta_i, theta_o, phi), rtol=1e-14)


def test_there_and_back():
    rng = np.random.default_rng(3)
    theta = rng.uniform(-np.pi / 2, np.pi / 2, (2, 1000))
    phi = rng.uniform(-np.pi, np.pi, 1000)
    tangent = rng.normal(size=(1000, 3))
    tangent[:3] = np.eye(3)
    wi, wo = fj.from_angles(
        theta[0], theta[1], phi, tangent, phi_i=rng.uniform(-3, 3, 1000)
    )
    np.testing.assert_allclose(jnp.linalg.norm(wi, axis=-1), 1, rtol=1e-14)
    found = fj.to_angles(wi, wo, tangent)
    np.testing.assert_allclose(found[0], theta[0], atol=1e-13)
    np.testing.assert_allclose(found[1], theta[1], atol=1e-13)
    steep = np.cos(theta).min(0)
    assert np.all(np.abs(found[2] - phi) * steep < 1e-13)


def test_along_the_tangent():
    """The azimuth is 0 by definition there, and every derivative is finite."""
    tangent = jnp.asarray((0.0, 0.0, 2.0))
    across = jnp.asarray((1.0, 0.0, 0.5))
    for wi, wo in [(tangent, across), (across, -tangent), (tangent, tangent)]:
        theta_i, theta_o, phi = fj.to_angles(wi, wo, tangent)
        assert phi == 0
        if wi is tangent:
            assert theta_i == np.pi / 2
        if wo is not across:
            assert abs(theta_o) == np.pi / 2
        for k in range(3):
            jacobian = jax.jacrev(fj.to_angles, argnums=k)(wi, wo, tangent)
            assert all(bool(jnp.isfinite(x).all()) for x in jacobian)


def test_small_angles_from_the_tangent_are_kept():
    tilt = 1e-9
    w = jnp.asarray((1.0, tilt, 0.0))
    theta, _, _ = fj.to_angles(w, w, jnp.asarray((1.0, 0.0, 0.0)))
    np.testing.assert_allclose(np.pi / 2 - theta, tilt, rtol=1e-6)


def test_lengths_do_not_matter():
    """Down and up to where the squares leave the range of float32."""
    wi, wo, tangent = np.array([[1, 1, 0], [0, 1, 1], [1, 0, 0]], np.float32)
    expected = fj.to_angles(wi, wo, tangent)
    for scale in np.array([1e-30, 1e-12, 1e12, 1e30], np.float32):
        found = fj.to_angles(scale * wi, wo / scale, scale * tangent)
        np.testing.assert_allclose(found, expected, rtol=1e-6)
