"""The smooth limit: roots and caustics of Phi, and N as beta_n -> 0."""

import math
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj

untyped: Any = fj  # for input that a type checker refuses
DTYPES = [jnp.float32, jnp.float64]
LOBES = range(6)
TURN = 2 * np.pi


def wrap(x):
    return np.remainder(x + np.pi, TURN) - np.pi


def eta_prime(theta_d, eta):
    """Without the cancellation of the printed form, which costs two digits here."""
    c = np.cos(theta_d)
    return np.sqrt((eta - 1) * (eta + 1) + c * c) / c


def Phi(p, gamma, eta_p):
    return 2 * p * np.arcsin(np.sin(gamma) / eta_p) - 2 * gamma + p * np.pi


def caustic_angle(p, eta_p):
    """gamma of the caustic, 0 without one."""
    square = (eta_p**2 - 1) / (p * p - 1) if p > 1 else 1 + 0 * eta_p
    return np.arccos(np.sqrt(np.minimum(square, 1)))


@cache
def draws(p, count=2000):
    """Over the whole domain, a quarter of it close to where the caustics merge."""
    rng = np.random.default_rng((3, p))
    phi = rng.uniform(-10, 10, count)
    theta_d = rng.uniform(-1.55, 1.55, count)
    eta = rng.uniform(1, 3, count)
    # eta' = p (1 + small) where 1 <= eta <= 3 allows it
    target = p * (1 + rng.choice([-1, 1], count) * 10 ** rng.uniform(-6, -2, count))
    merging = np.sqrt((target * np.cos(theta_d)) ** 2 + np.sin(theta_d) ** 2)
    close = (np.arange(count) % 4 == 0) & (merging > 1) & (merging < 3)
    eta = np.where(close, merging, eta)
    # and phi among the three roots there
    high = Phi(p, caustic_angle(p, eta_prime(theta_d, eta)), eta_prime(theta_d, eta))
    inside = p * np.pi + rng.uniform(-3, 1.2, count) * (high - p * np.pi)
    return np.where(close, inside, phi), theta_d, eta


@pytest.mark.parametrize("p", LOBES)
def test_roots_are_the_rays_of_this_azimuth(p):
    phi, theta_d, eta = draws(p)
    h, exists = fj.roots(p, phi, theta_d, eta=eta)
    assert h.shape == exists.shape == (max(2 * p - 1, 1), phi.size)
    eta_p = eta_prime(theta_d, eta)
    h, exists = np.asarray(h), np.asarray(exists)
    assert not h[~exists].any()
    left = np.abs(wrap(Phi(p, np.arcsin(h), eta_p) - phi))
    # A rounded phi moves Phi - phi by eps |phi|, a rounded h Phi by eps h/cos gamma,
    # and the naive formula is as sensitive inside the fiber.
    outside = np.sqrt((1 - h) * (1 + h)) + 1e-8
    inside = np.sqrt((1 - h / eta_p) * (1 + h / eta_p)) + 1e-8
    sensitive = np.abs(phi) + 1 / outside + p / inside
    allowed = np.finfo(float).eps * (8 * (p + 1) + 4 * sensitive)
    worst = np.max(np.where(exists, left / allowed, 0))
    assert worst < 1


@pytest.mark.parametrize("p", LOBES)
def test_no_root_is_missing_or_found_twice(p):
    phi, theta_d, eta = draws(p)
    h, exists = map(np.asarray, fj.roots(p, phi, theta_d, eta=eta))
    eta_p = eta_prime(theta_d, eta)
    # Signed angles, denser towards grazing and the caustics.
    small = np.geomspace(1e-7, 1, 250)
    top = caustic_angle(p, eta_p)[:, None]
    end = np.pi / 2
    half = np.concatenate(
        [top * (1 - small), top + 0 * small[:1], top + (end - top) * small], 1
    )
    half = np.concatenate([half, end - (end - top) * small, end + 0 * top], 1)
    half = np.sort(np.clip(half, 1e-9, end), 1)
    gamma = np.concatenate([-half[:, ::-1], half], 1)
    up = np.sin((Phi(p, gamma, eta_p[:, None]) - phi[:, None]) / 2) > 0
    count = (up[:, 1:] != up[:, :-1]).sum(1)
    np.testing.assert_array_equal(exists.sum(0), count)
    # Different rays have different offsets.
    ordered = np.sort(np.where(exists, h, 2 + np.arange(len(h))[:, None]), 0)
    assert np.diff(ordered, axis=0).min(initial=1) > 0


SYMMETRIC = {
    # p, phi, eta, number of rays at theta_d = 0
    "R, backwards": (0, 0.0, 1.5, 1),
    "R, forwards": (0, np.pi, 1.5, 1),
    "R, forwards from the other side": (0, -np.pi, 1.5, 1),
    "TT, forwards": (1, np.pi, 1.5, 1),
    "TT, backwards": (1, 0.0, 1.5, 0),
    "TRT, backwards": (2, 0.0, 1.5, 3),
    "TRT at eta' = p": (2, 0.0, 2.0, 1),
    "TRT, eta' > p": (2, 0.0, 2.5, 1),
    "TRT, forwards": (2, np.pi, 1.5, 0),
    "TRRT, forwards": (3, np.pi, 1.5, 1),
    "TRRT, forwards, with a falling piece": (3, np.pi, 2.5, 3),
    "TRRT, backwards": (3, 0.0, 1.01, 2),
}


@pytest.mark.parametrize("case", SYMMETRIC)
def test_roots_where_both_sides_of_the_fiber_send_light(case):
    """x = 0 and x = pi, where images of the observer coincide."""
    p, phi, eta, count = SYMMETRIC[case]
    h, exists = map(np.asarray, fj.roots(p, phi, 0.0, eta=eta))
    assert exists.sum() == count
    assert len(set(h[exists])) == count
    np.testing.assert_allclose(
        wrap(Phi(p, np.arcsin(h[exists]), eta) - phi + 1), 1, atol=1e-14
    )


def test_TT_in_closed_form():
    """h_TT of Karis 2016, which is physical where |sin(phi/2)| >= 1/eta'."""
    phi, theta_d, eta = draws(1)
    x = wrap(phi)
    a = 1 / eta_prime(theta_d, eta)
    size = np.abs(np.sin(x / 2))
    expected = np.sign(x) * np.cos(x / 2) / np.sqrt(1 + a * a - 2 * a * size)
    (h,), (exists,) = fj.roots(1, phi, theta_d, eta=eta)
    np.testing.assert_array_equal(exists, size >= a)
    # The formula cancels where eta' is close to 1.
    error = np.abs(h - np.where(size >= a, expected, 0))
    assert np.max(error * (1 - a)) < 1e-15


@pytest.mark.parametrize("p", LOBES)
def test_caustics_are_where_the_azimuth_turns(p):
    _, theta_d, eta = draws(p)
    eta_p = eta_prime(theta_d, eta)
    h, phi, exists = map(np.asarray, fj.caustics(p, theta_d, eta=eta))
    np.testing.assert_array_equal(exists, (eta_p < p) & (p >= 2))
    assert not h[~exists].any()
    np.testing.assert_allclose(
        wrap(Phi(p, np.arcsin(h), eta_p) - phi + 1), 1, atol=1e-13
    )
    if p >= 2:
        # 2 p cos gamma = 2 eta' cos gamma_t there
        gap = p * np.sqrt(1 - h**2) - np.sqrt(eta_p**2 - h**2)
        np.testing.assert_allclose(gap[exists] / p, 0, atol=1e-8)
        np.testing.assert_allclose(np.median(np.abs(gap[exists])), 0, atol=1e-15)
        assert exists.any()


def far_from_caustics(p):
    """Azimuths with light, at theta_d = 0.3, eta = 1.55."""
    lit = {0: (0.1, 1.0, 3.0), 1: (2.0, 2.6, 3.0), 2: (0.1, 0.15), 3: (2.0, 2.6)}
    return jnp.asarray(lit[p])


@pytest.mark.parametrize("p", range(4))
def test_N_tends_to_the_smooth_limit(p):
    """As beta_n^2, since the detector has no first moment."""
    phi, beta_n = far_from_caustics(p), jnp.asarray((1e-3, 1e-4, 1e-5))[:, None]
    limit = fj.N_smooth(p, phi, 0.3, eta=1.55, sigma_a=0.1)
    optics = {"eta": 1.55, "sigma_a": 0.1, "rule": fj.Windowed()}
    rough = untyped.N(p, phi, 0.3, beta_n=beta_n, **optics)
    first, second, third = np.abs(rough / limit - 1)
    np.testing.assert_allclose(first, 100 * second, rtol=0.01)
    assert np.max(second) < 5e-7
    assert np.max(third) < 5e-9


def test_the_default_rule_tends_to_the_smooth_limit():
    limit = fj.N_smooth(2, 0.1, 0.3, eta=1.55, sigma_a=0.1)
    rough = fj.N(2, 0.1, 0.3, eta=1.55, sigma_a=0.1, beta_n=1e-5)
    np.testing.assert_allclose(rough, limit, rtol=5e-9)


CAUSTICS = [(2, 0.3), (2, -0.6), (3, 0.2)]


@pytest.mark.parametrize(("p", "theta_d"), CAUSTICS)
def test_square_root_law_at_the_caustic(p, theta_d):
    """Phi = Phi_c - b u^2 with u = gamma - gamma_c, and A cos gamma constant.

    N_smooth is A cos gamma/(2 sqrt(b x)) at a distance x; N at the caustic is
    A cos gamma/2 int D(b u^2) du, which is 2^(1/4) Gamma(5/4)/sqrt(2 pi b beta_n) times
    A cos gamma.
    """
    eta, sigma_a = 1.55, 0.1
    h, phi, _ = fj.caustics(p, theta_d, eta=eta)
    c, cosine = math.cos(theta_d), math.sqrt(1 - float(h) ** 2)
    g = math.sqrt(eta * eta - 1 + (c * cosine) ** 2)
    b = p * c * float(h) * (eta * eta - 1) / g**3
    F = fj.reflectance(c * cosine, eta)
    light = fj.A(p, F, fj.transmittance(h, theta_d, eta, sigma_a)) * cosine
    rough = light * 2**0.25 * math.gamma(1.25) / math.sqrt(2 * math.pi * b)
    beta_n = jnp.asarray((1e-2, 1e-4, 1e-6))
    optics = {"eta": eta, "sigma_a": sigma_a, "rule": fj.Windowed()}
    found = untyped.N(p, phi, theta_d, beta_n=beta_n, **optics)
    error = np.abs(found * np.sqrt(beta_n) / rough - 1)
    # The third ray adds a constant to N.
    assert np.all(error < 1.5 * np.sqrt(beta_n))
    assert error[2] < error[0] / 50
    x = jnp.asarray((1e-4, 1e-6, 1e-8))
    # Two rays on the lit side, none of them on the other.
    lit, dark = (
        fj.N_smooth(p, phi + side * x, theta_d, eta=eta, sigma_a=sigma_a)
        * (2 * np.sqrt(x * b) / light)
        for side in (-1, 1)
    )
    assert np.all(np.abs(lit - 1) < 3 * np.sqrt(x))
    assert np.all(dark < 3 * np.sqrt(x))


def test_energy_of_the_smooth_limit():
    """int N_smooth dphi = 1/2 int A dh, in pieces between caustics and grazing."""
    eta, theta_d, p = 1.55, 0.3, 2
    caustic = float(fj.caustics(p, theta_d, eta=eta).phi)
    grazing = wrap(Phi(p, np.pi / 2, eta_prime(theta_d, eta)))
    edges = np.sort([caustic, -caustic, grazing, -grazing])
    # phi = middle + half width sin t takes out the square roots at both ends.
    t, w = np.polynomial.legendre.leggauss(48)
    t, w = t * np.pi / 2, w * np.pi / 2
    half = np.diff(edges)[:, None] / 2
    phi = edges[:-1, None] + half * (1 + np.sin(t))
    density = fj.N_smooth(p, phi, theta_d, eta=eta, sigma_a=0.1)
    total = np.sum(density * half * np.cos(t) * w)
    cosine, h = np.cos(t), np.sin(t)
    F = fj.reflectance(math.cos(theta_d) * cosine, eta)
    A = fj.A(p, F, fj.transmittance(h, theta_d, eta, 0.1))
    np.testing.assert_allclose(total, np.sum(A * cosine * w) / 2, rtol=1e-6)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("p", [1, 2])
def test_finite_values_and_gradients(p, dtype):
    rng = np.random.default_rng(5)
    count = 20_000
    points = (
        rng.uniform(-np.pi, np.pi, count),
        rng.uniform(-np.pi / 2, np.pi / 2, count),
        1 + 10 ** rng.uniform(-12, 0.3, count),
        10 ** rng.uniform(-6, 3, count),
    )
    nothing = 1e-30 if dtype == jnp.float32 else 1e-290
    # The ends of the domain; TT has all its light at phi = pi if eta = 1.
    ends = np.meshgrid(
        (0.0, 1.0, -np.pi, 3 * np.pi),
        (-np.pi / 2, 0.7, float(np.float32(np.pi / 2))),
        (1.0 + 2.0**-20 if p == 1 else 1.0, 1.55, 3.0),
        (0.0, 1e3),
    )
    points = [
        jnp.asarray(np.append(x, y), dtype) for x, y in zip(points, ends, strict=True)
    ]

    def value(phi, theta_d, eta, sigma_a):
        return fj.N_smooth(p, phi, theta_d, eta=eta, sigma_a=sigma_a)

    slope = jax.jit(jax.vmap(jax.value_and_grad(value, range(4))))
    N, gradients = slope(*points)
    assert N.dtype == dtype
    assert bool(jnp.isfinite(N).all())
    assert N.min() == 0
    for gradient in gradients:
        assert bool(jnp.isfinite(gradient).all())
        # Neither is there anything to differentiate where there is no light.
        assert jnp.abs(gradient[N == 0]).max() < nothing


@pytest.mark.parametrize("dtype", DTYPES)
def test_finite_caustics(dtype):
    theta_d = jnp.asarray((-np.pi / 2, 0.0, 0.7, np.arccos(0.5), np.pi / 2), dtype)
    eta = jnp.asarray((1.0, 1 + 2.0**-20, 1.55, 2.0, 3.0), dtype)[:, None]

    def value(theta_d, eta):
        h, phi, _ = fj.caustics(2, theta_d, eta=eta)
        return h.sum() + phi.sum()

    found = jax.jit(jax.value_and_grad(value, (0, 1)))(theta_d, eta)
    for gradient in jax.tree.leaves(found):
        assert gradient.dtype == dtype
        assert bool(jnp.isfinite(gradient).all())


def test_derivatives_where_images_coincide():
    """h is smooth at x = 0, where the ray of the axis leaves."""
    for p, phi in [(0, 0.0), (1, np.pi), (2, 0.0)]:
        slope = jax.jacfwd(lambda x, p=p: fj.roots(p, x, 0.2, eta=1.55).h)(phi)
        central = 2 * p / eta_prime(0.2, 1.55) - 2
        np.testing.assert_allclose(slope[0], 1 / central, rtol=1e-12)


def test_shapes_and_colors():
    phi, theta_d = jnp.linspace(0, 3, 5), jnp.linspace(-1, 1, 4)[:, None]
    assert fj.roots(2, phi, theta_d, eta=1.55).h.shape == (3, 4, 5)
    assert fj.caustics(3, theta_d, eta=1.55).h.shape == (4, 1)
    sigma_a = jnp.asarray((0.0, 0.3))
    colors = fj.N_smooth(1, phi, theta_d, eta=1.55, sigma_a=sigma_a)
    assert colors.shape == (4, 5, 2)
    clear = fj.N_smooth(1, phi, theta_d, eta=1.55, sigma_a=None)
    assert clear.shape == (4, 5)
    np.testing.assert_allclose(colors[..., 0], clear, rtol=1e-14)


BAD = {
    "roots": (lambda: untyped.roots(-1, 0.1, 0.1, eta=1.5), "p = -1: must be >= 0"),
    "caustics": (lambda: untyped.caustics(1.5, 0.1, eta=1.5), "p = 1.5: must be a st"),
    "p": (
        lambda: untyped.N_smooth(-1, 0.1, 0.1, eta=1.5, sigma_a=None),
        "p = -1: must be >= 0",
    ),
    "sigma_a": (
        lambda: untyped.N_smooth(1, 0.1, 0.1, eta=1.5, sigma_a=np.ones((2, 3))),
        r"sigma_a has shape \(2, 3\)",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_says_what_is_allowed(case):
    call, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        call()
