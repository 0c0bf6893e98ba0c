"""The samplers: distribution, weights, moments, and the derivatives of estimates."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import fiberjax as fj

HALF_PI = np.pi / 2
FALSE_ALARM = 1e-3
"""Probability that a family of tests rejects a right sampler."""

COUNT = 1_000_000
ROWS, COLUMNS = 24, 24  # bins in theta_o and phi


def rule_for(beta_n):
    """Nodes enough for 1e-6 of the peak, and no more: the tests take millions."""
    return fj.GaussGamma(96 if beta_n < 0.1 else 32)


def uniforms(seed, count, dimensions=5, dtype=jnp.float64):
    return jax.random.uniform(jax.random.key(seed), (count, dimensions), dtype)


def nodes(edges, parts, order=4):
    """Composite Gauss-Legendre nodes and weights, one row for each bin."""
    x, w = np.polynomial.legendre.leggauss(order)
    fine = np.linspace(edges[:-1], edges[1:], parts + 1, axis=1)
    low, width = fine[:, :-1, None], np.diff(fine)[..., None]
    flat = (len(edges) - 1, parts * order)
    return (low + width * (1 + x) / 2).reshape(flat), (width * w / 2).reshape(flat)


def equal_edges(fiber, theta_i, count):
    """Edges in theta_o of intervals that are narrow where any lobe's M is large."""
    sine = np.linspace(-1, 1, 1 << 16)
    theta = np.arcsin((sine[1:] + sine[:-1]) / 2)
    tilt = 0.0 if fiber.alpha is None else float(fiber.alpha)
    lobes = [(2, 1), (-1, 0.5), (-4, 2), (0, 2)]
    M = np.zeros_like(theta)
    for k, w in lobes:
        M += np.asarray(fj.M(-theta_i + k * tilt, theta, (w * fiber.beta_m) ** 2))
    # A tenth in proportion to the sine, so that no interval is long.
    share = np.concatenate([[0], np.cumsum(M)]) / M.sum() * 0.9 + (1 + sine) / 20
    edges = np.interp(np.linspace(0, 1, count + 1), share, np.arcsin(sine))
    edges[0], edges[-1] = -HALF_PI, HALF_PI
    return edges


def bins(fiber, theta_i, choices):
    """Edges in theta_o and phi, and the integral of the density over every bin."""
    edges = equal_edges(fiber, theta_i, 8 * ROWS)
    theta, w_theta = (x.reshape(ROWS, -1) for x in nodes(edges, 1))
    edges = edges[::8]
    # The density is even in phi: half of the columns give all.
    phi_edges = np.linspace(0, np.pi, COLUMNS // 2 + 1)
    phi, w_phi = nodes(phi_edges, 4)
    # float32 is right to 1e-5 of the peak, a hundredth of what the test can see.
    angles = np.float32(theta_i), np.float32(theta[:, :, None, None]), np.float32(phi)
    rule = rule_for(float(fiber.beta_n))
    density = np.float64(fj.pdf(fiber, *angles, rule=rule, **choices))
    mass = np.einsum("rk,rkcl,cl->rc", w_theta * np.cos(theta), density, w_phi)
    mirrored = np.concatenate([mass[:, ::-1], mass], 1)
    return edges, np.concatenate([-phi_edges[:0:-1], phi_edges]), mirrored


def p_value(observed, expected):
    """Of Pearson's chi-square, with bins that expect fewer than 5 taken together."""
    rare = expected < 5
    observed = np.append(observed[~rare], observed[rare].sum())
    expected = np.append(expected[~rare], expected[rare].sum())
    if expected[-1] < 5:
        observed[-2] += observed[-1]
        expected[-2] += expected[-1]
        observed, expected = observed[:-1], expected[:-1]
    statistic = np.sum((observed - expected) ** 2 / expected)
    return stats.chi2.sf(statistic, len(expected) - 1)


def fit_of(samples, edges, phi_edges, mass):
    """p-value of samples in bins of theta_o and phi that have these probabilities."""
    where = np.asarray(samples.theta_o), np.asarray(samples.phi)
    observed, _, _ = np.histogram2d(*where, (edges, phi_edges))
    return p_value(observed.ravel(), mass.ravel() * len(samples.phi))


def chi_square(fiber, theta_i, samples, choices):
    edges, phi_edges, mass = bins(fiber, theta_i, choices)
    for angles, ends in ((samples.theta_o, edges), (samples.phi, phi_edges)):
        assert ends[0] <= angles.min()
        assert angles.max() <= ends[-1]
    assert mass.sum() == pytest.approx(1, abs=3e-5)
    return fit_of(samples, edges, phi_edges, mass)


def make_fiber(beta, sigma_a, alpha=0.0436):
    return fj.Fiber(1.55, beta, beta, alpha, sigma_a)


FAST = [
    (0.05, 40.0, 2.0, {}),
    (0.2, -85.0, None, {}),
    (0.9, 89.0, 2.0, {}),
    (0.3, 60.0, (0.1, 1.0, 4.0), {"incidence": "theta_i", "detector": "logistic"}),
    (0.2, 20.0, 0.3, {"lobes": (1, 2), "rest": False}),
]
THOROUGH = [
    (beta, theta_i, sigma_a, {})
    for beta in (0.05, 0.2, 0.5, 0.9)
    for theta_i in (-89.0, -70.0, 0.0, 45.0, 80.0, 89.0)
    for sigma_a in (None, 2.0)
]
CASES = [pytest.param(*case, len(FAST), id=f"fast{k}") for k, case in enumerate(FAST)]
CASES += [
    pytest.param(*case, len(THOROUGH), id=f"{k}", marks=pytest.mark.slow)
    for k, case in enumerate(THOROUGH)
]


@pytest.mark.parametrize(("beta", "degrees", "sigma_a", "choices", "family"), CASES)
def test_chi_square(beta, degrees, sigma_a, choices, family):
    fiber, theta_i = make_fiber(beta, sigma_a), np.radians(degrees)
    samples = fj.sample(fiber, theta_i, uniforms(family, COUNT), **choices)
    # Bonferroni: the family as a whole rejects a right sampler once in a thousand.
    assert chi_square(fiber, theta_i, samples, choices) > FALSE_ALARM / family


BROKEN = {
    "residual lobe at theta_o = 0": lambda s, f, u: s._replace(
        theta_o=jnp.where(s.p == 3, 0.0, s.theta_o)
    ),
    "azimuth of half the roughness": lambda s, f, u: fj.sample(
        fj.Fiber(f.eta, f.beta_m, f.beta_n / 2, f.alpha, f.sigma_a), 0.5, u
    ),
    "tilt forgotten": lambda s, f, u: fj.sample(
        fj.Fiber(f.eta, f.beta_m, f.beta_n, None, f.sigma_a), 0.5, u
    ),
    "one number used twice": lambda s, f, u: fj.sample(f, 0.5, u.at[:, 4].set(u[:, 0])),
    "widths of all lobes alike": lambda s, f, u: fj.sample(
        fj.Fiber(f.eta, f.beta_m, f.beta_n, f.alpha, f.sigma_a, widths_m=(1.0,)), 0.5, u
    ),
}


def test_chi_square_rejects_broken_samplers():
    fiber, u = make_fiber(0.3, 0.3), uniforms(7, COUNT)
    expected = bins(fiber, 0.5, {})
    right = fj.sample(fiber, 0.5, u)
    assert fit_of(right, *expected) > FALSE_ALARM
    for name, broken in BROKEN.items():
        assert fit_of(broken(right, fiber, u), *expected) < 1e-9, name


@pytest.mark.parametrize("incidence", ["theta_d", "theta_i"])
def test_pdf_integrates_to_one(incidence):
    for beta, theta_i, sigma_a in [
        (0.1, 1.3, None),
        (0.4, -1.55, 2.0),
        (0.9, 0.2, 0.5),
    ]:
        fiber = make_fiber(beta, sigma_a)
        theta, w = nodes(equal_edges(fiber, theta_i, 64), 1, order=8)
        # N is smooth and periodic: the mean over equally spaced phi is exact.
        phi = np.linspace(-np.pi, np.pi, 128, endpoint=False)
        choices = {"incidence": incidence, "rule": fj.GaussGamma(64)}
        density = fj.pdf(fiber, theta_i, theta[..., None], phi, **choices)
        total = 2 * np.pi * np.sum(w * np.cos(theta) * density.mean(-1))
        assert total == pytest.approx(1, abs=1e-8)


@pytest.mark.parametrize(
    ("detector", "incidence"),
    [
        ("normal", "theta_d"),
        ("logistic", "theta_i"),
        pytest.param("logistic", "theta_d", marks=pytest.mark.slow),
        pytest.param("normal", "theta_i", marks=pytest.mark.slow),
    ],
)
def test_mean_weight_in_a_direction_is_evaluate_over_pdf(detector, incidence):
    """By moments: any function of the direction has one mean by either route."""
    fiber = make_fiber(0.4, (0.2, 1.5), -0.05)
    choices = {"incidence": incidence, "detector": detector}
    s = fj.sample(fiber, 1.2, uniforms(11, 100_000), **choices)
    value = fj.evaluate(fiber, 1.2, s.theta_o, s.phi, rule=rule_for(0.4), **choices)
    density = fj.pdf(fiber, 1.2, s.theta_o, s.phi, rule=rule_for(0.4), **choices)
    residual = np.asarray(s.weight - value / density[:, None])
    tests = np.stack(
        [
            np.ones_like(s.phi),
            *(np.cos(k * s.phi) for k in (1, 2, 3)),
            np.sin(s.theta_o),
            np.sin(3 * s.theta_o),
            np.where(s.theta_o < -1.2, 1.0, 0.0),
            np.sin(s.theta_o) * np.cos(s.phi),
        ]
    )
    products = tests[:, :, None] * residual
    z = products.mean(1) / (products.std(1) / np.sqrt(len(residual)))
    # The weights do scatter about their mean: the test is not an identity.
    assert residual.std() > 0.05
    assert np.abs(z).max() < stats.norm.isf(FALSE_ALARM / z.size / 2)


@pytest.mark.parametrize("degrees", [-89.0, -60.0, 0.0, 70.0, 88.0])
def test_moments(degrees):
    """Of weight, theta_o and phi: a furnace alone cannot see a wrong sampler."""
    theta_i = np.radians(degrees)
    for beta, sigma_a in [(0.05, None), (0.2, 0.0), (0.6, 1.0)]:
        fiber = make_fiber(beta, sigma_a)
        s = fj.sample(fiber, theta_i, uniforms(5, 200_000))
        weight = np.asarray(s.weight)

        def agrees(values, expected):
            error = values.std() / np.sqrt(len(values))
            return abs(values.mean() - expected) < 4.5 * error + 1e-12

        assert agrees(weight, float(fj.albedo(fiber, theta_i)))
        theta, w = nodes(equal_edges(fiber, theta_i, 192), 1)
        phi = np.linspace(0, np.pi, 65)
        phi, w_phi = (phi[1:] + phi[:-1]) / 2, np.pi / 64
        S = fj.evaluate(fiber, theta_i, theta[..., None], phi, rule=rule_for(beta))
        S = 2 * w_phi * np.asarray(S) * (w * np.cos(theta))[..., None]
        for f in (
            lambda t, p: np.sin(t),
            lambda t, p: np.sin(t) ** 2,
            lambda t, p: np.cos(p),
            lambda t, p: np.cos(2 * p) * np.cos(t),
        ):
            values = weight * f(np.asarray(s.theta_o), np.asarray(s.phi))
            assert agrees(values, np.sum(S * f(theta[..., None], phi)))
        # The sine of phi averages to 0: the two sides are sampled alike.
        assert agrees(np.sin(np.asarray(s.phi)), 0.0)


def test_sample_M_follows_M():
    """Kolmogorov-Smirnov against the integral of M cos(theta_o)."""
    u = uniforms(3, 200_000, 2)
    cases = [
        (c, v) for c in (-HALF_PI, -1.2, 0.0, 1.65) for v in (1e-6, 0.01, 0.3, 9.0)
    ]
    for theta_c, v in cases:
        theta_o = np.sort(fj.sample_M(theta_c, v, u))
        center = 2 * np.clip(theta_c, -HALF_PI, HALF_PI) - theta_c
        edges = center + np.sqrt(v) * np.linspace(-10, 10, 801)
        edges = np.unique(np.clip(edges, -HALF_PI, HALF_PI))
        x, w = nodes(edges, 1)
        mass = np.sum(w * np.cos(x) * np.asarray(fj.M(theta_c, x, v)), 1)
        cumulative = np.interp(theta_o, edges, np.concatenate([[0], np.cumsum(mass)]))
        distance = stats.kstest(cumulative, "uniform")
        assert distance.pvalue > FALSE_ALARM / len(cases)


def test_smooth_limit_of_the_pdf():
    """beta_n = 0: the closed form is the density of R and TT, the limit of `pdf`."""
    fiber = fj.Fiber(1.55, 0.3, 0.0, 0.0436, 0.3)
    choices = {"lobes": (0, 1), "rest": False, "strategy": "lobe_first"}
    s = fj.sample(fiber, 0.7, uniforms(2, COUNT), **choices)
    edges = equal_edges(fiber, 0.7, ROWS)
    theta, w = nodes(edges, 4)
    phi_edges = np.linspace(-np.pi, np.pi, COLUMNS + 1)
    phi, w_phi = nodes(phi_edges, 32)
    density = fj.pdf_smooth(fiber, 0.7, theta[:, :, None, None], phi)
    mass = np.einsum("rk,rkcl,cl->rc", w * np.cos(theta), density, w_phi)
    assert mass.sum() == pytest.approx(1, abs=1e-4)
    assert fit_of(s, edges, phi_edges, mass) > FALSE_ALARM
    # All lobes differ in w only: away from the edge of TT the limit is smooth.
    near = fj.Fiber(1.55, 0.3, 1e-2, 0.0436, 0.3)
    for phi in (0.5, 2.2, 3.0):
        limit = fj.pdf_smooth(fiber, 0.7, -0.6, phi)
        rough = fj.pdf(near, 0.7, -0.6, phi, rule=fj.GaussGamma(800), **choices)
        np.testing.assert_allclose(rough, limit, rtol=1e-3)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize(
    ("detector", "gradient"),
    [
        ("normal", "reparameterized"),
        ("logistic", "detached"),
        pytest.param("logistic", "reparameterized", marks=pytest.mark.slow),
        pytest.param("normal", "detached", marks=pytest.mark.slow),
    ],
)
def test_ends_of_the_unit_interval(dtype, detector, gradient):
    """u = 0 and u = 1 - eps/2, in every combination: finite values and gradients."""
    last = 1 - jnp.finfo(dtype).eps / 2
    corners = jnp.stack(jnp.meshgrid(*[jnp.asarray([0, 0.5, last], dtype)] * 5), -1)
    u = corners.reshape(-1, 5)
    for theta_i in (0.0, 1.0, np.float32(HALF_PI)):
        for beta in (1e-4, 0.3, 30.0):

            def total(fiber, theta_i, u):
                s = fj.sample(fiber, theta_i, u, detector=detector, gradient=gradient)
                return s.weight.sum() + s.theta_o + s.phi, s

            fiber = fj.Fiber(1.55, beta, beta, 0.04, (0.3, 2.0))
            slope = jax.grad(total, argnums=(0, 1, 2), has_aux=True)
            theta = jnp.asarray(theta_i, dtype)
            gradients, s = jax.vmap(slope, in_axes=(None, None, 0))(fiber, theta, u)
            assert all(bool(jnp.isfinite(x).all()) for x in jax.tree.leaves(gradients))
            assert all(bool(jnp.isfinite(x).all()) for x in s)
            assert np.abs(s.theta_o).max() <= np.float32(HALF_PI)
            assert set(np.asarray(s.p)) <= {0, 1, 2, 3}


def test_no_light_left():
    """eta = 1 reflects nothing and sigma_a = 1e6 lets nothing through: weight 0."""
    fiber = fj.Fiber(1.0, 0.3, 0.3, None, 1e6)
    s = fj.sample(fiber, 0.3, uniforms(1, 40_000))
    assert np.all(np.asarray(s.weight) == 0)
    share = np.bincount(np.asarray(s.p)) / 40_000
    np.testing.assert_allclose(share, 0.25, atol=0.01)


def test_smooth_fibers_can_be_sampled_and_differentiated():
    """beta_m = beta_n = 0 puts every ray on its cone at Phi(p, h)."""
    fiber = fj.Fiber(1.55, 0.0, 0.0, 0.04, 0.3)
    u = uniforms(4, 1000)
    s = fj.sample(fiber, 0.5, u)
    cones = -0.5 + 0.04 * np.array([2, -1, -4, 0])
    np.testing.assert_allclose(s.theta_o, cones[s.p], atol=1e-12)
    first = fj.sample(fiber, 0.5, u, strategy="lobe_first")
    np.testing.assert_allclose(first.theta_o, cones[first.p], atol=1e-14)

    def mean(beta):
        s = fj.sample(fj.Fiber(1.55, beta, beta, 0.04, 0.3), 0.5, u)
        return jnp.mean(s.weight * jnp.cos(s.phi) * jnp.sin(s.theta_o))

    assert bool(jnp.isfinite(jax.grad(mean)(0.0)))


def test_clamping_loses_energy():
    """The paper says it loses none."""
    fiber = make_fiber(0.6, None)
    for degrees, lost in [(85, 0.297), (89, 0.414)]:
        theta_i = np.radians(degrees)
        u, first = uniforms(6, 400_000), "lobe_first"
        free = fj.sample(fiber, theta_i, u, strategy=first).weight.mean()
        clamped = fj.sample(fiber, theta_i, u, clamp=2.0, strategy=first).weight
        assert clamped.max() <= 2
        assert 1 - float(clamped.mean() / free) == pytest.approx(lost, abs=0.02)


def exact_gradient(f, theta_i, fiber):
    """Derivatives of int evaluate f d omega by quadrature, in every field."""
    theta, w = nodes(np.linspace(-HALF_PI, HALF_PI, 9), 4)
    # Edges at 0 and +-pi/2, where the discontinuous f jumps.
    phi, w_phi = (x.ravel() for x in nodes(np.linspace(-np.pi, np.pi, 9), 4))

    def integral(fiber):
        S = fj.evaluate(fiber, theta_i, theta[..., None], phi, rule=rule_for(0.4))
        values = (S * f(theta[..., None], phi)) @ w_phi
        return jnp.sum(w * np.cos(theta) * values)

    return jax.grad(integral)(fiber)


@pytest.mark.parametrize("gradient", ["reparameterized", "detached"])
def test_gradients_of_estimators(gradient):
    """Both modes estimate the derivative of the integral; tests of f smooth and not."""
    fiber = fj.Fiber(1.55, 0.4, 0.4, 0.05, 0.5)
    u = uniforms(9, 300_000).reshape(300, 1000, 5)

    def smooth(theta_o, phi):
        return jnp.exp(jnp.sin(theta_o) + jnp.cos(phi))

    def step(theta_o, phi):
        return jnp.where((theta_o > 0) & (jnp.cos(phi) < 0), 1.0, 0.0)

    def estimates(f):
        def mean(fiber, u):
            s = fj.sample(fiber, 0.3, u, gradient=gradient)
            return jnp.mean(s.weight * f(s.theta_o, s.phi))

        batches = jax.lax.map(lambda v: jax.grad(mean)(fiber, v), u)
        return [np.asarray(x).reshape(len(u), -1) for x in jax.tree.leaves(batches)]

    def deviations(f):
        exact = jax.tree.leaves(exact_gradient(f, 0.3, fiber))
        scores = []
        for found, expected in zip(estimates(f), exact, strict=True):
            error = found.std(0) / np.sqrt(len(found)) + 1e-9
            scores.append(np.abs(found.mean(0) - np.ravel(expected)) / error)
        return np.concatenate(scores)

    assert deviations(smooth).max() < 4.5
    if gradient == "detached":
        assert deviations(step).max() < 4.5
