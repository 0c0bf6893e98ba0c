"""The model against scipy, its energy, its symmetry, and what is not compiled."""

import itertools
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate, special

import fiberjax as fj

SHARED = Path(__file__).parents[2] / "shared" / "truth"
HALF_PI = np.pi / 2
CLEAR = {"alpha": None, "sigma_a": None}


def naive_attenuation(p, h, theta_d, eta, sigma_a, tail=False):
    """A_p or its sum from p on, as in the papers, in NumPy, 1 - F by subtraction."""
    mu = np.cos(theta_d) * np.sqrt(1 - h * h)
    refracted = np.sqrt(1 - (1 - mu * mu) / eta**2)
    r_s = (mu - eta * refracted) / (mu + eta * refracted)
    r_p = (eta * mu - refracted) / (eta * mu + refracted)
    F = (r_s**2 + r_p**2) / 2
    cos_t = np.sqrt(1 - (np.sin(theta_d) / eta) ** 2)
    eta_p = np.sqrt(eta**2 - np.sin(theta_d) ** 2) / np.cos(theta_d)
    T = np.exp(-sigma_a * 2 * np.sqrt(1 - (h / eta_p) ** 2) / cos_t)
    if p == 0:
        return F
    if tail and sigma_a == 0:
        return (1 - F) * F ** (p - 1)
    if tail:
        return (1 - F) ** 2 * F ** (p - 1) * T**p / (1 - F * T)
    return (1 - F) ** 2 * F ** (p - 1) * T**p


def naive_N(p, phi, theta_d, eta, sigma_a, beta):
    """N_p by scipy.quad in gamma over the whole range."""
    eta_p = np.sqrt(eta**2 - np.sin(theta_d) ** 2) / np.cos(theta_d)

    def integrand(gamma):
        h = np.sin(gamma)
        azimuth = 2 * p * np.arcsin(h / eta_p) - 2 * gamma + p * np.pi
        x = phi - azimuth + 2 * np.pi * np.arange(-6, 7)
        D = np.exp(-((x / beta) ** 2) / 2).sum() / (beta * np.sqrt(2 * np.pi))
        A = naive_attenuation(p, h, theta_d, eta, sigma_a)
        return A * D * np.cos(gamma) / 2

    points = np.linspace(-HALF_PI, HALF_PI, 9)
    return sum(
        integrate.quad(integrand, a, b, epsabs=1e-13, epsrel=1e-11)[0]
        for a, b in itertools.pairwise(points)
    )


@pytest.mark.parametrize("p", [0, 1, 2, 3])
def test_N_agrees_with_scipy_quad(p):
    for phi, theta_d, beta in [(0.2, 0.1, 0.15), (2.6, -0.7, 0.3), (-1.5, 1.3, 0.8)]:
        expected = naive_N(p, phi, theta_d, 1.55, 0.3, beta)
        found = fj.N(p, phi, theta_d, eta=1.55, sigma_a=0.3, beta_n=beta)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("v", [1e-6, 0.01, 0.3, 4.0, 1e4])
@pytest.mark.parametrize("theta_c", [-HALF_PI, -1.2, 0.0, 0.9, 1.7])
def test_M_integrates_to_one_by_scipy_quad(theta_c, v):
    center = 2 * np.clip(theta_c, -HALF_PI, HALF_PI) - theta_c
    edges = np.clip(center + np.sqrt(v) * np.linspace(-12, 12, 13), -HALF_PI, HALF_PI)
    f = jax.jit(lambda t: fj.M(theta_c, t, v) * jnp.cos(t))
    total = sum(
        integrate.quad(f, a, b, epsabs=1e-14, epsrel=1e-11)[0]
        for a, b in itertools.pairwise(edges)
        if b > a
    )
    # Twelve deviations hold all but e^-72 of a narrow M, and all of a wide one.
    assert total == pytest.approx(1, abs=2e-11)


@pytest.mark.parametrize("detector", ["normal", "logistic"])
@pytest.mark.parametrize("incidence", ["theta_d", "theta_i"])
def test_albedo_is_the_integral_over_the_sphere(detector, incidence):
    """By scipy over theta_o; over phi by the periodic mean, exact for smooth N."""
    fiber = fj.Fiber(beta_m=0.25, beta_n=0.5, alpha=-0.05, sigma_a=0.2)
    choices = {"detector": detector, "incidence": incidence}
    theta_i = 0.8
    phi = np.linspace(-np.pi, np.pi, 128, endpoint=False)
    S = jax.jit(lambda t: fj.evaluate(fiber, theta_i, t, phi, **choices).mean())
    total = integrate.quad_vec(
        lambda t: 2 * np.pi * float(S(t)) * np.cos(t), -HALF_PI, HALF_PI, epsabs=1e-9
    )[0]
    # The logistic has a kink at half a turn, which limits the mean over phi.
    tolerance = 1e-8 if detector == "normal" else 2e-5
    expected = fj.albedo(fiber, theta_i, **choices)
    assert total == pytest.approx(float(expected), abs=tolerance)


def independent_albedo(fiber, theta_i, parts):
    """The albedo of a clear or gray fiber by another quadrature, in NumPy.

    Tanh-sinh in both variables, attenuations as in the papers, M by scipy's i0e; part 3
    is the rest.
    """
    u = np.linspace(-3.6, 3.6, 361)
    x = np.tanh(HALF_PI * np.sinh(u))
    w = HALF_PI * np.cosh(u) / np.cosh(HALF_PI * np.sinh(u)) ** 2 * (u[1] - u[0])
    gamma, w_gamma = HALF_PI * x, HALF_PI * w
    total = 0.0
    sigma_a = 0.0 if fiber.sigma_a is None else float(fiber.sigma_a)
    alpha = 0.0 if fiber.alpha is None else float(fiber.alpha)
    tilts, widths = (2, -1, -4, 0), (1, 0.5, 2, 2)
    for p in parts:
        cone = -theta_i + tilts[p] * alpha
        beta = widths[p] * float(fiber.beta_m)
        center = 2 * np.clip(cone, -HALF_PI, HALF_PI) - cone
        reach = 2 * np.arcsin(min(4.5 * beta, 1.0))
        low = max(-HALF_PI, center - reach)
        high = min(HALF_PI, center + reach)
        edges = np.unique([low, min(max(center, low), high), high])
        for low, high in itertools.pairwise(edges):
            theta_o = (low + high) / 2 + (high - low) / 2 * x
            a = np.cos(cone) * np.cos(theta_o) / beta**2
            E = -2 * np.sin((theta_o - cone) / 2) ** 2 / beta**2 + np.abs(a) - a
            M = np.exp(E) * special.i0e(a) / (-(beta**2) * np.expm1(-2 / beta**2))
            M *= np.cos(theta_o)
            theta_d = (theta_o - theta_i)[:, None] / 2
            eta = float(fiber.eta)
            A = naive_attenuation(p, np.sin(gamma), theta_d, eta, sigma_a, p == 3)
            energy = (A * np.cos(gamma) / 2) @ w_gamma
            total += (high - low) / 2 * np.sum(w * M * energy)
    return total


@pytest.mark.parametrize("theta_i", np.radians([-89.9, -80, -30, 0, 40, 75, 89.9]))
@pytest.mark.parametrize("sigma_a", [None, 0.4])
def test_albedo_agrees_with_an_independent_double_quadrature(theta_i, sigma_a):
    for beta in (0.05, 0.3, 0.9):
        fiber = fj.Fiber(beta_m=beta, alpha=0.04, sigma_a=sigma_a)
        found = fj.albedo(fiber, theta_i)
        expected = independent_albedo(fiber, theta_i, (0, 1, 2, 3))
        assert float(found) == pytest.approx(expected, abs=1e-12)


def test_albedo_agrees_with_the_energies_of_the_truth():
    path = SHARED / "energy.json"
    if not path.exists():
        pytest.skip(f"{path.name} is kept beside the project, not in it")
    for point in json.loads(path.read_text())["points"]:
        beta = point["bm"]
        fiber = fj.Fiber(point["eta"], beta, beta, point["alpha"], point["sigma_a"])
        found = fj.albedo(fiber, point["theta_i"], rest=False, per_lobe=True)
        expected = [float(x) for x in point["energy_R_TT_TRT"]]
        np.testing.assert_allclose(found, expected, atol=1e-13)


THETA_I = np.radians([-89.9, -85, -60, -20, 0, 5, 45, 80, 89.9])


@pytest.mark.parametrize("beta", [0.05, 0.2, 0.6, 0.9])
def test_a_clear_fiber_returns_all_light(beta):
    """Energy: where the model conserves it, to 1e-12; elsewhere it is known not to."""
    for alpha in (None, -0.0436, 0.0436):
        fiber = fj.Fiber(1.55, beta, beta, alpha, None)
        for lobes in ((0, 1, 2), (0,), (0, 1, 2, 3, 4)):
            found = fj.albedo(fiber, THETA_I, lobes=lobes, incidence="theta_i")
            np.testing.assert_allclose(found, 1, atol=1e-12)
    even = fj.Fiber(1.55, beta, beta, None, None, widths_m=(1.0,))
    np.testing.assert_allclose(fj.albedo(even, THETA_I), 1, atol=1e-12)
    usual = fj.albedo(fj.Fiber(1.55, beta, beta, 0.0436, None), THETA_I)
    assert 0.72 < usual.min() < 0.99
    assert 1.0 < usual.max() < 1.13


def test_energy_lost_by_stopping_at_TRT():
    for theta_d, lost in [(0.0, 0.008), (1.2, 0.048), (np.radians(85), 0.14)]:
        fiber = fj.Fiber(1.55, 0.3, 0.3, None, None)
        kept = fj.albedo(fiber, theta_d, rest=False, incidence="theta_i")
        assert 1 - float(kept) == pytest.approx(lost, rel=0.07)


def test_symmetry():
    """Under exchange of the directions only untilted and at theta_d; always in phi."""
    a, b, phi = 0.9, -0.2, 2.1
    plain = fj.Fiber(alpha=None)
    forth, back = fj.evaluate(plain, a, b, phi), fj.evaluate(plain, b, a, phi)
    np.testing.assert_allclose(forth, back, rtol=1e-13)
    tilted = fj.Fiber(alpha=0.05)
    forth, back = fj.evaluate(tilted, a, b, phi), fj.evaluate(tilted, b, a, phi)
    assert np.all(np.abs(forth / back - 1) > 1e-3)
    forth = fj.evaluate(plain, a, b, phi, incidence="theta_i")
    back = fj.evaluate(plain, b, a, phi, incidence="theta_i")
    assert np.all(np.abs(forth / back - 1) > 1e-3)
    for fiber in (plain, tilted):
        mirrored = fj.evaluate(fiber, a, b, -phi)
        np.testing.assert_allclose(fj.evaluate(fiber, a, b, phi), mirrored, rtol=1e-13)
    # Turning the tangent round reverses both inclinations and the tilt.
    turned = fj.evaluate(fj.Fiber(alpha=-0.05), -a, -b, phi)
    np.testing.assert_allclose(fj.evaluate(tilted, a, b, phi), turned, rtol=1e-13)


def test_evaluate_is_the_sum_of_its_lobes_and_the_rest():
    fiber = fj.Fiber(sigma_a=(0.1, 1.0))
    point = (0.5, -0.3, 2.0)
    lobes = sum(fj.lobe(fiber, p, *point) for p in (0, 1, 2))
    np.testing.assert_allclose(
        fj.evaluate(fiber, *point, rest=False), lobes, rtol=1e-13
    )
    theta_d = (point[1] - point[0]) / 2
    energy = sum(
        np.asarray(
            [
                integrate.quad(
                    lambda g, p=p, s=s: (
                        naive_attenuation(p, np.sin(g), theta_d, 1.55, s) * np.cos(g)
                    ),
                    0,
                    HALF_PI,
                )[0]
                for s in (0.1, 1.0)
            ]
        )
        for p in range(3, 60)
    )
    M = fj.M(-point[0], point[1], (2 * fiber.beta_m) ** 2)
    expected = lobes + energy * M / (2 * np.pi)
    np.testing.assert_allclose(fj.evaluate(fiber, *point), expected, rtol=1e-9)


def test_rest_makes_the_split_into_lobes_irrelevant_to_energy():
    fiber = fj.Fiber(sigma_a=0.2)
    few = fj.albedo(fiber, 0.4, lobes=(0, 1, 2), incidence="theta_i")
    many = fj.albedo(fiber, 0.4, lobes=tuple(range(12)), incidence="theta_i")
    np.testing.assert_allclose(few, many, rtol=1e-13)


def operations(f, *arguments) -> dict[str, int]:
    """How often each costly operation stands in the lowered program."""
    text = jax.jit(f).lower(*arguments).as_text()
    names = ("exponential ", "sine", "multiply", "add")
    return {name.strip(): text.count(f"stablehlo.{name}") for name in names}


def test_what_is_None_is_not_compiled():
    def counts(**fields):
        fiber = fj.Fiber(**{"sigma_a": 0.3, "alpha": 0.05, **fields})
        angles = [np.float32(x) for x in (0.3, 0.1, 2.0)]
        return operations(lambda f: fj.evaluate(f, *angles), fiber)

    full, clear, plain = counts(), counts(sigma_a=None), counts(alpha=None)
    # T of each lobe but R is a polynomial of 7 terms, times a power of 2.
    assert clear["multiply"] <= full["multiply"] - 3 * 8
    assert plain["multiply"] < full["multiply"]
    assert plain["add"] < full["add"]


@pytest.mark.parametrize("field", ["eta", "beta_m", "beta_n", "alpha", "sigma_a"])
@pytest.mark.parametrize("value", [-2.0, float("nan"), float("inf")])
def test_check_names_field_and_value(field, value):
    with pytest.raises(ValueError, match=rf"{field} = {value}: must lie in"):
        fj.check(fj.Fiber(**{field: value}))


def test_check_passes_good_fibers_through():
    for fiber in (fj.Fiber(), fj.Fiber(sigma_a=None, alpha=None), fj.Fiber(eta=1.0)):
        assert fj.check(fiber) is fiber
    with pytest.raises(ValueError, match=r"eta = 0\.9: must lie in \[1, inf\)"):
        fj.check(jax.vmap(lambda e: fj.Fiber(eta=e))(jnp.asarray((1.5, 0.9))))
    with pytest.raises(ValueError, match="widths_m is empty"):
        fj.check(fj.Fiber(widths_m=()))
