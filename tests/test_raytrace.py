"""The equations of one path, and the sign of the tilt, against traced rays."""

import numpy as np
import pytest
import raytrace

import fiberjax

LOBES = (0, 1, 2, 3, 4)
ALPHA = 1e-4  # small enough for the tilt to act linearly
TILTS = {0: 2.0, 1: -1.1, 2: -4.2}  # of theta_o, in units of alpha, at eta = 1.55


def rays(seed=0, count=2000):
    rng = np.random.default_rng(seed)
    h = rng.uniform(-0.999, 0.999, count)
    theta_i = rng.uniform(-1.45, 1.45, count)
    phi_i = rng.uniform(-np.pi, np.pi, count)
    eta = rng.uniform(1.05, 2.5, count)
    return h, theta_i, phi_i, eta


def wrapped(x):
    return np.arctan2(np.sin(x), np.cos(x))


@pytest.fixture(params=LOBES)
def path(request):
    h, theta_i, phi_i, eta = rays()
    traced = raytrace.trace(request.param, h, theta_i, phi_i, eta)
    # On the specular cone theta_o = -theta_i, so that theta_d = -theta_i.
    return request.param, h, theta_i, phi_i, eta, traced


def test_exit_direction(path):
    p, h, theta_i, phi_i, eta, traced = path
    x, y, z = traced.omega_o.T
    Phi = fiberjax.Phi(p, h, fiberjax.eta_prime(-theta_i, eta))
    off = wrapped(np.arctan2(z, y) - phi_i - Phi)
    np.testing.assert_allclose(off, 0, atol=1e-12)
    np.testing.assert_allclose(x, np.sin(-theta_i), rtol=0, atol=1e-13)
    omega_o = raytrace.direction(-theta_i, phi_i + np.asarray(Phi))
    np.testing.assert_allclose(traced.omega_o, omega_o, rtol=0, atol=1e-12)


def test_segments(path):
    p, h, theta_i, _, eta, traced = path
    depth = -np.log(fiberjax.transmittance(h, -theta_i, eta, 1.0))
    assert traced.segments.shape == ((p, h.size) if p else (0,))
    for length in traced.segments:
        np.testing.assert_allclose(length, depth, rtol=1e-11)


def test_incidence(path):
    p, h, theta_i, _, eta, traced = path
    cosine = np.cos(theta_i) * np.sqrt((1 - h) * (1 + h))
    assert len(traced.cosines) == p + 1
    for found in traced.cosines:
        np.testing.assert_allclose(found, cosine, rtol=1e-10)
    F = fiberjax.reflectance(cosine, eta)
    np.testing.assert_allclose(
        traced.kept, fiberjax.A(p, F, np.ones_like(h)), rtol=1e-9
    )


def test_side_of_the_offset():
    h, theta_i, phi_i, eta = rays(seed=1)
    traced = raytrace.trace(0, h, theta_i, phi_i, eta)
    increasing = raytrace.direction(np.zeros_like(phi_i), phi_i + np.pi / 2)
    np.testing.assert_allclose(np.sum(traced.entry * increasing, -1), -h, atol=1e-14)
    # Light that arrives at h > 0 is reflected to that side, phi < 0.
    _, theta_o, phi = fiberjax.to_angles(
        raytrace.direction(theta_i, phi_i), traced.omega_o, np.array([1.0, 0, 0])
    )
    assert np.all(np.sign(phi) == -np.sign(h))
    np.testing.assert_allclose(theta_o, -theta_i, atol=1e-13)


def traced_tilt(p, eta=1.55):
    """theta_o over alpha of the central ray at normal incidence."""
    zero = np.zeros(1)
    omega_o = raytrace.trace(p, zero, zero, zero, np.full(1, eta), ALPHA).omega_o
    return np.arcsin(omega_o[0, 0]) / ALPHA


@pytest.mark.parametrize("p", TILTS)
def test_tilted_normals(p):
    np.testing.assert_allclose(traced_tilt(p), TILTS[p], rtol=1e-6)


@pytest.mark.parametrize("p", TILTS)
def test_tilt_of_the_lobes(p):
    """The lobes lean to the side the rays lean to, by the same angle within 10 %."""
    alpha = 0.02
    fiber = fiberjax.Fiber(eta=1.55, beta_m=0.005, alpha=alpha, sigma_a=None)
    theta_o = np.linspace(-0.2, 0.2, 2001)
    density = fiberjax.lobe(fiber, p, 0.0, theta_o, p * np.pi)
    center = np.average(theta_o, weights=density) / alpha
    np.testing.assert_allclose(center, traced_tilt(p), rtol=0.1)
