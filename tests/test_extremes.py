"""No NaN and no infinity at the ends of every domain, in values and derivatives."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj

DTYPES = [jnp.float32, jnp.float64]
PAST_POLE = float(np.float32(np.pi / 2))  # just past pi/2
THETAS = (-PAST_POLE, -np.pi / 2, -1.2, 0.0, 0.7, np.pi / 2, PAST_POLE)
ETAS = (1.0, 1 + 2.0**-20, 1.55, 3.0)
SIGMAS = (0.0, 1e3)
BETAS = (1e-4, 0.3, 100.0)
PHIS = (0.0, 1.0, np.pi)

EQUATIONS = {
    "reflectance": (fj.reflectance, [(0.0, 1e-8, 0.5, 1.0), ETAS]),
    "eta_prime": (fj.eta_prime, [THETAS, ETAS]),
    "Phi": (lambda h, e: fj.Phi(3, h, e), [(-0.99, 0.0, 0.99), (1.0, 1.5, 1e16)]),
    "transmittance": (
        fj.transmittance,
        [(-1.0, 0.0, 0.6, 1.0), THETAS, ETAS, SIGMAS],
    ),
    "A": (lambda F, T: fj.A(2, F, T), [(0.0, 0.5, 1.0)] * 2),
    "A_1": (lambda F, T: fj.A(1, F, T), [(0.0, 0.5, 1.0)] * 2),
    "A_rest": (lambda F, T: fj.A_rest(3, F, T), [(0.0, 0.5, 1.0)] * 2),
    "M": (fj.M, [THETAS, THETAS, (1e-8, 1e-3, 1.0, 1e4)]),
    "wrapped_normal": (fj.wrapped_normal, [(*PHIS, -7.0, 40.0), BETAS]),
    "trimmed_logistic": (fj.trimmed_logistic, [(*PHIS, -7.0, 40.0), BETAS]),
}


def finite(tree):
    return all(bool(jnp.isfinite(x).all()) for x in jax.tree.leaves(tree))


def grid(values, dtype):
    return jnp.asarray(list(itertools.product(*values)), dtype).T


@pytest.mark.parametrize("name", EQUATIONS)
@pytest.mark.parametrize("dtype", DTYPES)
def test_equations(name, dtype):
    f, values = EQUATIONS[name]
    points = grid(values, dtype)
    every = tuple(range(len(points)))
    assert finite(jax.vmap(f)(*points))
    assert finite(jax.vmap(jax.grad(f, every))(*points))
    assert finite(jax.vmap(jax.jacfwd(f, every))(*points))
    if dtype == jnp.float64:
        assert finite(jax.vmap(jax.hessian(f, every))(*points))


def test_the_true_infinities_and_no_others():
    """dPhi/dh and d sqrt(1 - h^2)/dh at |h| = 1; all else is finite there."""
    for h in (-1.0, 1.0):
        by_h, by_eta = jax.grad(lambda h, e: fj.Phi(1, h, e), (0, 1))(h, 1.5)
        assert np.isneginf(by_h)
        assert np.isfinite(by_eta)


RULES = {
    "gamma": (fj.GaussGamma(24), "normal", (0, 1, 2, 3, 7)),
    "gamma, logistic": (fj.GaussGamma(16), "logistic", (0, 2)),
    "h": (fj.GaussH(24), "normal", (2,)),
}


@pytest.mark.parametrize("name", RULES)
@pytest.mark.parametrize("dtype", DTYPES)
def test_N(name, dtype):
    """At every corner of the domain."""
    points = grid([PHIS, THETAS, ETAS, SIGMAS, BETAS], dtype)
    rule, detector, lobes = RULES[name]
    for p in lobes:

        def value(phi, theta_d, eta, s, b, p=p):
            choices = {"rule": rule, "detector": detector}
            return fj.N(p, phi, theta_d, eta=eta, sigma_a=s, beta_n=b, **choices)

        slope = jax.value_and_grad(value, range(5))
        found, gradients = jax.jit(jax.vmap(slope))(*points)
        assert finite(found)
        assert found.min() >= 0
        assert finite(gradients)


FAR_FIELD = [
    ("evaluate", "theta_d", jnp.float32),
    ("evaluate", "theta_i", jnp.float64),
    ("pdf_smooth", "theta_d", jnp.float32),
    ("pdf_smooth", "theta_i", jnp.float64),
    ("pdf", "theta_d", jnp.float32),
    ("pdf", "theta_d", jnp.float64),
    ("pdf", "theta_i", jnp.float32),
    ("albedo", "theta_d", jnp.float32),
    ("albedo", "theta_i", jnp.float64),
]


@pytest.mark.parametrize(("function", "incidence", "dtype"), FAR_FIELD)
def test_far_field(function, incidence, dtype):
    points = grid([THETAS, THETAS, ETAS, SIGMAS, (1e-4, 0.3, 5.0)], dtype)
    f = getattr(fj, function)

    def value(theta_i, theta_o, eta, sigma_a, beta):
        fiber = fj.Fiber(eta, beta, beta, dtype(-0.05), sigma_a)
        angles = (theta_i,) if function == "albedo" else (theta_i, theta_o, dtype(2.0))
        choices = {"rule": fj.GaussGamma(16), "incidence": incidence}
        lobes = (0, 1) if function == "pdf_smooth" else (0, 2)
        return f(fiber, *angles, lobes=lobes, **choices)

    found, gradients = jax.jit(jax.vmap(jax.value_and_grad(value, range(5))))(*points)
    assert finite(found)
    assert found.min() >= 0
    assert finite(gradients)


EVERY_RULE = [
    fj.auto(1e-9),
    fj.GaussH(12),
    fj.GaussGamma(12),
    fj.Windowed(12),
    fj.Series(12),
]


@pytest.mark.parametrize("rule", EVERY_RULE, ids=str)
def test_nan_is_not_masked(rule):
    """Of one element it is the value; the others are what they are without it.

    Far from every ray, too.
    """
    for p, beta_n, far in itertools.product((0, 1), (0.01, 0.3, 3.0), (False, True)):

        def value(points, p=p):
            phi, theta_d, eta, beta_n, sigma_a = points
            optics = {"eta": eta, "beta_n": beta_n, "sigma_a": sigma_a[0]}
            return np.asarray(fj.N(p, phi, theta_d, rule=rule, **optics))

        phi = np.linspace(0.02, 0.1, 40) if far else np.linspace(2.9, 3.0, 40)
        clean = [phi, *np.tile([[0.1], [1.55], [beta_n], [0.1]], 40)]
        right = value(clean)
        assert np.isfinite(right).all()
        for k in range(4):
            spoiled = [x.copy() for x in clean]
            spoiled[k][7] = np.nan
            found = value(spoiled)
            assert np.isnan(found[7])
            rest = np.delete(found, 7), np.delete(right, 7)
            np.testing.assert_allclose(*rest, rtol=1e-6)
        if p > 0:
            assert np.isnan(value([*clean[:4], np.full(40, np.nan)])).all()


@pytest.mark.parametrize("beta_n", [0.003, 0.3, np.nan])
def test_nan_is_not_masked_on_grids(beta_n):
    phi = np.linspace(-3, 3, 40)[:, None]
    theta_d = np.array([np.nan, np.nan if np.isnan(beta_n) else 0.1])
    found = np.asarray(fj.N(1, phi, theta_d, eta=1.55, sigma_a=0.1, beta_n=beta_n))
    np.testing.assert_array_equal(np.isnan(found), np.isnan(theta_d + 0 * phi))


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["lobe_first", "guided"])
def test_nan_in_a_fiber_is_not_masked(strategy):
    u = np.random.default_rng(0).random((20, 5))
    usual = {"eta": 1.55, "beta_m": 0.3, "beta_n": 0.3, "alpha": -0.03, "sigma_a": 0.2}
    for name in usual:
        fiber = fj.Fiber(**(usual | {name: np.nan}))
        draw = fj.sample(fiber, 0.3, u, strategy=strategy)
        # Of beta_n it is the azimuth that depends, of the others the weight.
        spoiled = draw.phi if name == "beta_n" else draw.weight
        assert np.isnan(spoiled).all()
        assert np.isnan(fj.pdf(fiber, 0.3, 0.1, 0.4, strategy=strategy))
        assert np.isnan(fj.evaluate(fiber, 0.3, 0.1, 0.4))
