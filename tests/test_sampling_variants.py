"""What `strategy` of `sample` and `pdf` promises, beside what the default does."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from test_sampling import (
    COUNT,
    FALSE_ALARM,
    HALF_PI,
    chi_square,
    equal_edges,
    exact_gradient,
    make_fiber,
    nodes,
    rule_for,
    uniforms,
)

import fiberjax as fj
from fiberjax.selection import DEFAULT_STRATEGY, STRATEGIES, OffsetDensity

OTHERS = tuple(s for s in STRATEGIES if s != DEFAULT_STRATEGY)
RED, LOGISTIC = (0.1, 1.0, 4.0), {"incidence": "theta_i", "detector": "logistic"}
CASES = [
    (0.2, -85.0, 2.0, {}),
    (0.6, 40.0, RED, {}),
    (0.3, 60.0, RED, LOGISTIC),
    (0.2, 20.0, 0.3, {"lobes": (1, 2), "rest": False}),
]
CHI_SQUARE = [
    pytest.param(
        strategy, *case, marks=[pytest.mark.slow] if k or strategy != OTHERS[1] else []
    )
    for strategy in OTHERS
    for k, case in enumerate(CASES)
]


@pytest.mark.parametrize(
    ("strategy", "beta", "degrees", "sigma_a", "choices"), CHI_SQUARE
)
def test_chi_square(strategy, beta, degrees, sigma_a, choices):
    fiber, theta_i = make_fiber(beta, sigma_a), np.radians(degrees)
    choices = {**choices, "strategy": strategy}
    samples = fj.sample(fiber, theta_i, uniforms(21, COUNT), **choices)
    found = chi_square(fiber, theta_i, samples, choices)
    assert found > FALSE_ALARM / len(CHI_SQUARE)


@pytest.mark.slow
def test_chi_square_tells_the_strategies_apart():
    """None is the density of another's samples."""
    fiber, u = make_fiber(0.5, 2.0), uniforms(22, COUNT)
    samples = {s: fj.sample(fiber, 1.3, u, strategy=s) for s in STRATEGIES}
    for mine, other in zip(STRATEGIES, STRATEGIES[1:] + STRATEGIES[:1], strict=True):
        assert chi_square(fiber, 1.3, samples[mine], {"strategy": other}) < 1e-9


@pytest.mark.parametrize("strategy", OTHERS)
def test_pdf_integrates_to_one(strategy):
    fiber = make_fiber(0.4, (0.2, 2.0))
    theta, w = nodes(equal_edges(fiber, -1.5, 48), 1, order=6)
    phi = np.linspace(-np.pi, np.pi, 64, endpoint=False)
    choices = {"strategy": strategy, "rule": fj.GaussGamma(48)}
    density = fj.pdf(fiber, -1.5, theta[..., None], phi, **choices)
    total = 2 * np.pi * np.sum(w * np.cos(theta) * density.mean(-1))
    assert total == pytest.approx(1, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("strategy", OTHERS)
def test_mean_weight_in_a_direction_is_evaluate_over_pdf(strategy):
    fiber = make_fiber(0.4, (0.2, 1.5), -0.05)
    s = fj.sample(fiber, 1.2, uniforms(23, 50_000), strategy=strategy)
    value = fj.evaluate(fiber, 1.2, s.theta_o, s.phi, rule=rule_for(0.4))
    choices = {"rule": rule_for(0.4), "strategy": strategy}
    density = fj.pdf(fiber, 1.2, s.theta_o, s.phi, **choices)
    residual = np.asarray(s.weight - value / density[:, None])
    tests = np.stack([np.ones_like(s.phi), np.cos(s.phi), np.sin(s.theta_o)])
    products = tests[:, :, None] * residual
    z = products.mean(1) / (products.std(1) / np.sqrt(len(residual)))
    assert np.abs(z).max() < stats.norm.isf(FALSE_ALARM / z.size / 2)


@pytest.mark.slow
def test_the_density_of_h_does_not_cost_digits():
    """It is smooth: the default rule meets its tolerance with it as without."""
    for sigma_a, theta_i in [(0.3, 0.2), (3.0, -1.4), (30.0, 0.9)]:
        fiber = fj.Fiber(1.55, 0.4, 0.3, -0.03, sigma_a)
        phi = np.linspace(0, np.pi, 7)
        truth = fj.pdf(fiber, theta_i, -0.5, phi, rule=fj.GaussGamma(400))
        found = fj.pdf(fiber, theta_i, -0.5, phi)
        np.testing.assert_allclose(found, truth, rtol=0, atol=1e-9 * float(truth.max()))


def test_quantiles_of_the_density_of_h():
    rng = np.random.default_rng(0)
    b = 10 ** rng.uniform(np.log10(0.02), 0, (4, 20_000))
    b /= np.arange(1, 5) @ b / 10
    density = OffsetDensity(tuple(jnp.asarray(b)))
    s = np.sqrt(rng.uniform(0, 1, b.shape[1]))
    y = np.asarray(density.quantile(jnp.asarray(s)))
    # Of int_0^y 2 t q(t) dt by quadrature; q is a cubic.
    x, w = np.polynomial.legendre.leggauss(3)
    t = y * (1 + x[:, None]) / 2
    mass = w @ (t * y * np.asarray(density._q(jnp.asarray(t))))
    np.testing.assert_allclose(mass, s * s, atol=1e-5)
    assert np.mean(np.abs(mass - s * s) > 1e-14) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("strategy", ["lobe_again", "guided"])
def test_extremes(strategy, dtype):
    """Corners of u, eta = 1, poles, opaque, smooth and rough; in both modes."""
    last = 1 - jnp.finfo(dtype).eps / 2
    ends = jnp.asarray([0, last], dtype)
    u = jnp.stack(jnp.meshgrid(*[ends] * 5), -1).reshape(-1, 5)
    points = [
        (e, b, s, t)
        for e in (1.0, 1.55)
        for b in (1e-4, 0.3, 5.0)
        for s in (0.0, 1e3)
        for t in (-float(np.float32(HALF_PI)), 0.0, float(np.float32(HALF_PI)))
    ]
    points = jnp.asarray(points, dtype)
    for gradient, detector, incidence, rest in (
        ("reparameterized", "normal", "theta_d", True),
        ("detached", "logistic", "theta_i", False),
    ):
        choices = {"gradient": gradient, "detector": detector, "rest": rest}
        choices = {**choices, "incidence": incidence, "strategy": strategy}

        def total(point, u, choices=choices):
            eta, beta, sigma_a, theta_i = point
            fiber = fj.Fiber(eta, beta, beta, dtype(0.04), sigma_a)
            s = fj.sample(fiber, theta_i, u, **choices)
            return s.weight + s.theta_o + s.phi, s

        slope = jax.vmap(jax.grad(total, (0, 1), has_aux=True), (None, 0))
        gradients, s = jax.jit(jax.vmap(slope, (0, None)))(points, u)
        assert all(bool(jnp.isfinite(x).all()) for x in jax.tree.leaves(gradients))
        assert all(bool(jnp.isfinite(x).all()) for x in s)
        assert np.abs(s.theta_o).max() <= np.float32(HALF_PI)


@pytest.mark.slow
@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("incidence", ["theta_d", "theta_i"])
def test_pdf_at_the_extremes(dtype, incidence):
    pole = float(np.float32(HALF_PI))
    points = [
        (e, b, s, i, o)
        for e in (1.0, 1.55)
        for b in (1e-4, 0.3, 5.0)
        for s in (0.0, 1e3)
        for i in (-pole, 0.7, pole)
        for o in (-pole, -1.2, 0.0, pole)
    ]

    def value(point):
        eta, beta, sigma_a, theta_i, theta_o = point
        fiber = fj.Fiber(eta, beta, beta, dtype(-0.05), sigma_a)
        choices = {"incidence": incidence, "rule": fj.GaussGamma(16)}
        return fj.pdf(fiber, theta_i, theta_o, dtype(2.0), lobes=(0, 2), **choices)

    slope = jax.jit(jax.vmap(jax.value_and_grad(value)))
    found, gradients = slope(jnp.asarray(points, dtype))
    assert bool(jnp.isfinite(found).all())
    assert found.min() >= 0
    assert bool(jnp.isfinite(gradients).all())


@pytest.mark.slow
def test_smooth_fibers_whose_cones_coincide():
    """beta_m = 0 without tilt: every lobe has M where the others do."""
    fiber = fj.Fiber(1.55, 0.0, 0.2, None, 0.3)
    s = fj.sample(fiber, 0.5, uniforms(4, 100_000))
    np.testing.assert_allclose(s.theta_o, -0.5, atol=1e-12)
    for p, energy in zip((0, 1, 2, 3), albedos(fiber, 0.5), strict=True):
        values = np.where(np.asarray(s.p) == p, s.weight, 0)
        assert abs(values.mean() - energy) < 4.5 * values.std() / np.sqrt(1e5)


def albedos(fiber, theta_i):
    """Energy of every part on its cone."""
    narrow = fj.Fiber(fiber.eta, 1e-4, fiber.beta_n, None, fiber.sigma_a)
    return np.asarray(fj.albedo(narrow, theta_i, per_lobe=True))


GRADIENTS = [
    pytest.param("lobe_again", "reparameterized", marks=pytest.mark.slow),
    pytest.param("lobe_again", "detached", marks=pytest.mark.slow),
    pytest.param("lobe_first", "reparameterized", marks=pytest.mark.slow),
    pytest.param("lobe_first", "detached", marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("strategy", "gradient"), GRADIENTS)
def test_gradients_of_estimators(strategy, gradient):
    fiber = fj.Fiber(1.55, 0.4, 0.4, 0.05, 0.5)
    u = uniforms(24, 100_000).reshape(100, 1000, 5)

    def smooth(theta_o, phi):
        return jnp.exp(jnp.sin(theta_o) + jnp.cos(phi))

    def mean(fiber, u):
        s = fj.sample(fiber, 0.9, u, gradient=gradient, strategy=strategy)
        return jnp.mean(s.weight * smooth(s.theta_o, s.phi))

    batches = jax.lax.map(lambda v: jax.grad(mean)(fiber, v), u)
    exact = jax.tree.leaves(exact_gradient(smooth, 0.9, fiber))
    for x, expected in zip(jax.tree.leaves(batches), exact, strict=True):
        found = np.asarray(x).reshape(len(u), -1)
        error = found.std(0) / np.sqrt(len(found)) + 1e-9
        assert np.max(np.abs(found.mean(0) - np.ravel(expected)) / error) < 4.5


def test_unknown_strategy():
    for call in (
        lambda: fj.sample(fj.Fiber(), 0.1, np.ones(5) / 2, strategy="best"),
        lambda: fj.pdf(fj.Fiber(), 0.1, 0.1, 0.1, strategy="best"),
    ):
        with pytest.raises(ValueError, match=r"strategy = 'best'.*lobe_again"):
            call()


REACHED = {"lobe_again": (0.62, 0.15), "guided": (0.15, 0.11)}
"""Geometric means against lobe_first, to 75 degrees and beyond, at most."""


def test_variance_at_equal_count():
    """Of the weight; figures/variance has more places, and the times."""
    u, ratios = uniforms(25, 40_000), {s: ([], []) for s in STRATEGIES}
    draw = jax.jit(fj.sample, static_argnames="strategy")
    for beta in (0.05, 0.2, 0.5, 0.9):
        for degrees in (0, 45, 70, 80, 85, 89):
            for sigma_a in (0.0, 0.3, 2.0):
                fiber = fj.Fiber(1.55, beta, beta, -0.035, sigma_a)
                at = {
                    s: float(
                        draw(fiber, np.radians(degrees), u, strategy=s).weight.var()
                    )
                    for s in STRATEGIES
                }
                for s in STRATEGIES:
                    ratios[s][degrees > 75].append(at[s] / at["lobe_first"])
    for s, reached in REACHED.items():
        found = [np.exp(np.mean(np.log(group))) for group in ratios[s]]
        assert all(f <= g for f, g in zip(found, reached, strict=True)), found
