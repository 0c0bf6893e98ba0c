"""The other far-field models: Lambert, Kajiya and Kay, Marschner 2003, R of 2014."""

import re
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import raytrace
import reference
from mpmath import mp as untyped_mp
from scipy import stats

import fiberjax as fj
from fiberjax import deon2014, kajiya_kay, lambert, marschner

untyped: Any = fj
mp: Any = untyped_mp  # it has no types
HALF_PI = np.pi / 2
FALSE_ALARM = 1e-3
COUNT = 400_000
DTYPES = [jnp.float32, jnp.float64]
RULE = fj.GaussGamma(32)
GLOSSY: Any = {"diffuse": (0.1, 0.05), "specular": 0.3, "exponent": 20.0}
HAIR: Any = fj.Fiber(1.55, 0.2, 0.3, 0.04, (0.2, 1.0))

MODELS = {
    "lambert": lambda *x: lambert.evaluate(*x, color=np.array((0.4, 0.8))),
    "kajiya_kay": lambda *x: kajiya_kay.evaluate(*x, **GLOSSY),
    "marschner": lambda *x: marschner.evaluate(HAIR, *x, lobes=(0, 1)),
    "deon2014": lambda *x: deon2014.evaluate(HAIR, *x, rule=RULE),
}


def uniforms(seed, count, dimensions):
    return jax.random.uniform(jax.random.key(seed), (count, dimensions))


def nodes(edges, order=8):
    """Gauss-Legendre nodes and weights, one row for each interval."""
    x, w = np.polynomial.legendre.leggauss(order)
    half = np.diff(edges)[:, None] / 2
    return edges[:-1, None] + half * (1 + x), half * w


def p_value(observed, expected):
    """Of a chi-square test; bins that expect less than 10 are one."""
    some = expected >= 10
    seen = np.append(observed[some], observed[~some].sum())
    mean = np.append(expected[some], expected[~some].sum())
    statistic = np.sum((seen - mean) ** 2 / np.maximum(mean, 1e-9))
    return stats.chi2.sf(statistic, len(mean) - 1)


def fit(density, sample, theta_edges, phi_edges):
    """p-value of samples against a density, with all outside the bins as another."""
    theta, w = nodes(theta_edges)
    phi, w_phi = nodes(phi_edges)
    at = density(theta[:, :, None, None], phi)
    mass = np.einsum("rk,rkcl,cl->rc", w * np.cos(theta), at, w_phi).ravel()
    where = np.asarray(sample.theta_o), np.asarray(sample.phi)
    observed = np.histogram2d(*where, (theta_edges, phi_edges))[0].ravel()
    count = len(sample.phi)
    observed = np.append(observed, count - observed.sum())
    return p_value(observed, count * np.append(mass, 1 - mass.sum()))


def truths(function, points, of_dtype):
    """Values at the numbers that the points are in a dtype."""
    cast = [np.asarray(x, of_dtype).astype(float) for x in points]
    with mp.workdps(40):
        return np.array([float(function(mp.mpf(x))) for x in cast[0]]), cast[0]


@pytest.mark.parametrize("model", MODELS)
def test_jit_vmap_dtype_and_derivatives(model):
    f, step = MODELS[model], 1e-5
    point = jnp.asarray((0.3, -0.5, 2.4))
    shifts = step * jnp.eye(3)
    moved = jnp.concatenate([point[None], point + shifts, point - shifts])
    values = jax.jit(jax.vmap(lambda x: f(*x)))(moved)
    value = f(*point)
    assert value.shape == (2,)
    np.testing.assert_allclose(values[0], value, rtol=1e-12)
    central = (values[1:4] - values[4:]) / (2 * step)
    slopes = jnp.stack(jax.jacfwd(f, (0, 1, 2))(*point))
    np.testing.assert_allclose(slopes, central, rtol=1e-6, atol=1e-9)
    angles = np.float32(0.3), np.float32(-0.5), np.full((4, 1), 2.4, np.float32)
    low = f(*angles)
    assert low.dtype == jnp.float32
    assert low.shape == (4, 1, 2)
    np.testing.assert_allclose(low[0, 0], value, rtol=3e-5)


def corners(dtype):
    """Poles, grazing, back and front, both signs and more than a turn."""
    top = [dtype(x) for x in (HALF_PI, 1.5707, 0.0)]
    theta = np.array([*top, *(-x for x in top)], dtype)
    phi = np.array([0, 1e-4, np.pi, -np.pi, 3 * np.pi, 3.1415, 7.0], dtype)
    return [x.ravel() for x in np.meshgrid(theta, theta, phi)]


EXTREMES = jax.vmap(lambda b, e, s: fj.Fiber(e, b, b, 0.04, s))(
    jnp.asarray((1e-4, 0.3, 30.0)),
    jnp.asarray((1.55, 1 + 1e-7, 1.0)),
    jnp.asarray(((0.0, 0.5), (1e3, 0.0), (0.0, 1e3))),
)
REFRACTING = eqx.tree_at(lambda f: f.eta, EXTREMES, jnp.asarray((1.55, 1.0001, 3.0)))
AT_EXTREMES = {
    "lambert": (
        lambda c, *x: lambert.evaluate(*x, color=c),
        jnp.asarray(((0.0, 1.0), (0.3, 0.4))),
    ),
    "kajiya_kay": (
        lambda n, *x: kajiya_kay.evaluate(
            *x, diffuse=n[0], specular=n[1], exponent=n[2]
        ),
        jnp.asarray(((0.1, 0.3, 1.0), (0.0, 0.3, 30.0), (0.1, 0.0, 1e4))),
    ),
    # A smooth TT of eta = 1 goes to phi = pi, and is infinite there.
    "R of marschner": (lambda f, *x: marschner.evaluate(f, *x, lobes=(0,)), EXTREMES),
    "marschner": (lambda f, *x: marschner.evaluate(f, *x), REFRACTING),
    "deon2014": (lambda f, *x: deon2014.evaluate(f, *x, rule=RULE), EXTREMES),
}


@pytest.mark.parametrize(
    "dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("model", AT_EXTREMES)
def test_values_and_gradients_are_finite_at_the_extremes(model, dtype):
    """In the angles and in all numbers of the model."""
    f, numbers = AT_EXTREMES[model]
    slope = jax.value_and_grad(lambda *x: f(*x).sum(), argnums=(0, 1, 2, 3))
    each = jax.vmap(slope, in_axes=(None, 0, 0, 0))
    found = jax.vmap(lambda n: each(n, *corners(dtype)))(numbers)
    for leaf in jax.tree.leaves(found):
        assert bool(jnp.isfinite(leaf).all())


# Lambert


@pytest.mark.parametrize("dtype", DTYPES)
def test_lambert_has_all_digits_up_to_the_dark_side(dtype):
    """Relative to the condition in phi, against 40 digits; the derivative too."""
    phi = np.array([0.0, 1e-3, 0.7, 2.14, 2.15, 3.0, 3.14, 3.14159, -1.0, 9.0, -40.0])

    def exact(x):
        d = mp.pi - abs(x - 2 * mp.pi * mp.nint(x / (2 * mp.pi)))
        return (mp.sin(d) - d * mp.cos(d)) / (4 * mp.pi)

    value, x = truths(exact, (phi,), dtype)
    slope = np.array([float(mp.diff(exact, float(t))) for t in x])
    eps = float(jnp.finfo(dtype).eps)

    def f(t):
        return lambert.pdf(dtype(0), dtype(0), t)

    found = jax.vmap(jax.value_and_grad(f))(jnp.asarray(x, dtype))
    # Wrapping leaves the rounding of phi itself, and pi has one in either dtype.
    moved = 4 * eps * (np.abs(x) + np.pi)
    for got, right, steep in (
        (found[0], value, np.abs(slope)),
        (found[1], slope, np.ones_like(slope)),
    ):
        assert np.all(
            abs(np.asarray(got) - right) <= 8 * eps * abs(right) + steep * moved
        )
    assert f(dtype(np.float64(np.pi))) == 0
    # As near as numbers come to pi the value is d^3/3, not the rounding of 1.
    d = 1e-3
    near = lambert.pdf(0.0, 0.0, np.pi - d)
    assert near == pytest.approx((d**3 / 3 - d**5 / 30) / (4 * np.pi), rel=1e-12)


def test_second_derivative_of_lambert_in_the_light():
    second = jax.grad(jax.grad(lambda t: lambert.pdf(0.0, 0.0, t)))
    np.testing.assert_allclose(second(0.0), -np.pi / (4 * np.pi), rtol=1e-12)


def test_lambert_returns_its_color():
    theta, w = nodes(np.linspace(-HALF_PI, HALF_PI, 9))
    phi, w_phi = nodes(np.linspace(-np.pi, np.pi, 9))
    weight = (w * np.cos(theta)).ravel()[:, None] * w_phi.ravel()
    for theta_i in (0.0, 1.2, HALF_PI):
        S = lambert.evaluate(theta_i, theta.reshape(-1, 1), phi.ravel(), color=0.7)
        assert np.sum(weight * S) == pytest.approx(0.7, rel=1e-12)


@pytest.mark.parametrize("dtype", DTYPES)
def test_lambert_sampler(dtype):
    u = uniforms(1, COUNT, 3).astype(dtype)
    s = lambert.sample(dtype(0.4), u, color=np.array((0.2, 0.9)))
    assert s.weight.dtype == s.phi.dtype == s.theta_o.dtype == dtype
    np.testing.assert_array_equal(s.weight[0], np.asarray((0.2, 0.9), dtype))
    edges = np.linspace(-HALF_PI, HALF_PI, 25), np.linspace(-np.pi, np.pi, 25)

    def density(theta, phi):
        return lambert.pdf(0.4, theta, phi)

    assert fit(density, s, *edges) > FALSE_ALARM
    # sin theta_o follows the semicircle; cos phi is the product of two means pi/4.
    for values, mean in (
        (jnp.sin(s.theta_o) ** 2, 1 / 4),
        (jnp.sin(s.theta_o) ** 4, 1 / 8),
        (jnp.cos(s.phi), (np.pi / 4) ** 2),
        (jnp.sin(s.phi), 0.0),
        (jnp.sin(s.theta_o) * jnp.sin(s.phi), 0.0),
    ):
        error = float(values.std()) / np.sqrt(COUNT)
        assert abs(float(values.mean()) - mean) < 4.5 * error
    broken = s._replace(phi=s.phi * 0.98)
    assert fit(density, broken, *edges) < 1e-9


def test_lambert_sampler_at_the_ends():
    for dtype in DTYPES:
        last = 1 - jnp.finfo(dtype).eps / 2
        u = jnp.stack(jnp.meshgrid(*[jnp.asarray([0, 0.5, last], dtype)] * 3), -1)

        def both(u, dtype=dtype):
            return lambert.sample(dtype(0), u, color=1.0)[:2]

        slopes = jax.vmap(jax.jacfwd(both))(u.reshape(-1, 3))
        for leaf in jax.tree.leaves((both(u), slopes)):
            assert bool(jnp.isfinite(leaf).all())


# Kajiya and Kay


def measured_rows(text):
    """The numbers of the rows of a table in a docstring."""
    rows = re.findall(r"^ +(\d[\d.]*(?: +\d+\.\d{3}){5})$", text, re.M)
    return [[float(x) for x in row.split()] for row in rows]


def test_energy_of_kajiya_kay_is_what_the_module_says():
    degrees = (0, 30, 60, 80, 90)
    rows = measured_rows(kajiya_kay.__doc__)
    assert len(rows) == 4
    for exponent, *shown in rows:
        for theta_i, albedo in zip(np.radians(degrees), shown, strict=True):
            t, w = nodes(np.array([-HALF_PI, HALF_PI - theta_i]), 400)
            S = kajiya_kay.evaluate(
                theta_i, t, 0.0, diffuse=0.0, specular=1.0, exponent=exponent
            )
            total = 2 * np.pi * np.sum(w * np.cos(t) * S)
            assert total == pytest.approx(albedo, abs=6e-4)
    t, w = nodes(np.array([-HALF_PI, HALF_PI]), 40)
    S = kajiya_kay.evaluate(0.3, t, 0.0, diffuse=0.4, specular=0.0, exponent=3.0)
    total = 2 * np.pi * np.sum(w * np.cos(t) * S)
    assert total == pytest.approx(0.4 * np.pi**2, rel=1e-12)
    assert total == pytest.approx(3.95, abs=5e-3)


@pytest.mark.parametrize("dtype", DTYPES)
def test_the_power_of_the_cosine(dtype):
    """Against 40 digits: the highlight is on the specular cone, and n is large."""
    angle = np.array([0.0, 1e-4, 0.01, 0.3, 0.8, 1.2, 1.57, 1.6, 3.0])
    for n in (1.0, 7.5, 1e3, 1e5):

        def exact(x, n=n):
            return mp.cos(x) ** n if mp.cos(x) > 0 else mp.mpf(0)

        right, x = truths(exact, (angle,), dtype)

        def f(n, x):
            return kajiya_kay.evaluate(
                dtype(0), x, dtype(0), diffuse=0.0, specular=1.0, exponent=n
            )

        found = np.asarray(f(dtype(n), jnp.asarray(x, dtype)))
        eps = float(jnp.finfo(dtype).eps)
        log = np.abs(n * np.log(np.maximum(np.cos(x), 1e-30)))
        # Next to a right angle the cosine has the rounding of its argument.
        budget = (8 + 8 * log) * eps + n * eps / np.maximum(np.cos(x), 1e-3)
        budget = np.where(x < 0.7, (8 + 8 * log) * eps, budget)
        tiny = float(jnp.finfo(dtype).tiny)
        assert np.all(abs(found - right) <= budget * right + tiny)
    mirror = kajiya_kay.evaluate(0.5, -0.5, 2.0, diffuse=0.0, specular=1.0, exponent=80)
    assert mirror == 1
    by_n = jax.grad(
        lambda n: kajiya_kay.evaluate(
            0.2, 0.3, 0.0, diffuse=0.0, specular=1.0, exponent=n
        )
    )
    right = np.cos(0.5) ** 30 * np.log(np.cos(0.5))
    np.testing.assert_allclose(by_n(30.0), right, rtol=1e-13)


# Marschner


def test_energy_of_the_gaussian_is_what_the_docstring_says():
    rows = measured_rows(marschner.evaluate.__doc__)
    assert len(rows) == 3
    phi, w_phi = nodes(np.linspace(-np.pi, np.pi, 3), 16)
    for beta, *shown in rows:
        of = fj.Fiber(1.55, beta, 0.3, None, None)
        for degrees, energy in zip((0, 30, 60, 80, 85), shown, strict=True):
            theta_i = np.radians(degrees)
            edges = -theta_i + beta * np.linspace(-10, 10, 21)
            t, w = (x.reshape(-1, 1) for x in nodes(np.clip(edges, -HALF_PI, HALF_PI)))
            S = marschner.evaluate(of, theta_i, t, phi.ravel(), lobes=(0,))
            N = fj.N_smooth(0, phi.ravel(), (t - theta_i) / 2, eta=1.55, sigma_a=None)
            share = (S @ w_phi.ravel()) / (N @ w_phi.ravel())
            found = np.sum(w * np.cos(t) * np.asarray(share)[:, None])
            assert found == pytest.approx(energy, abs=6e-4)


def test_marschner_is_gaussian_times_smooth_over_the_square_of_cos_theta_d():
    """Off the cones, tilted and colored, against 30 digits."""
    theta_i = np.array([0.3, -0.9, 1.2, 0.3, -0.4])
    theta_o = np.array([-0.1, 1.1, -0.8, -0.9, 0.9])
    phi = np.array([0.4, -2.9, 2.2, -0.1, 3.05])
    for p, (tilt, width) in enumerate(reference.LOBES):
        found = marschner.evaluate(HAIR, theta_i, theta_o, phi, lobes=(p,))
        expected = np.zeros((5, 2))
        for n, c in np.ndindex(5, 2):
            with mp.workdps(30):
                i, o, f = (mp.mpf(float(x[n])) for x in (theta_i, theta_o, phi))
                v = (width * mp.mpf(float(HAIR.beta_m))) ** 2
                off = o + i - tilt * mp.mpf(float(HAIR.alpha))
                M = mp.exp(-(off**2) / (2 * v)) / mp.sqrt(2 * mp.pi * v)
                optics = (
                    mp.mpf(float(x)) for x in (HAIR.eta, np.ravel(HAIR.sigma_a)[c])
                )
                N = reference.N_smooth(p, f, (o - i) / 2, *optics)
                expected[n, c] = M * N * mp.cos(o) / mp.cos((o - i) / 2) ** 2
        assert (expected > 0).any()
        np.testing.assert_allclose(found, expected, rtol=2e-12)


@pytest.mark.parametrize("dtype", DTYPES)
def test_marschner_without_refraction(dtype):
    """TT is infinite at phi = pi, where M is not 0; where it is, TT is 0."""
    for theta_o, value in ((0.03, 0.0), (-0.03, np.inf)):

        def f(fiber, *x):
            return marschner.evaluate(fiber, *x)

        narrow = fj.Fiber(dtype(1), dtype(1e-4), dtype(1e-4), dtype(0.03), dtype(0))
        at = dtype(0), dtype(theta_o), dtype(np.pi)
        if dtype == jnp.float64 or value == 0:
            assert f(narrow, *at) == value
        if value == 0:
            slopes = jax.grad(f, (0, 1, 2, 3))(narrow, *at)
            assert all(np.isfinite(x).all() for x in jax.tree.leaves(slopes))


def test_marschner_is_the_limit_of_the_reference():
    """Of narrow lobes of a smooth fiber; 1/cos^2 theta_d and the cosine cancel."""
    fiber = fj.Fiber(1.55, 1e-3, 1e-3, None, 0.3)
    theta_i = np.array([[0.0], [0.7], [1.2]])
    off = 1e-3 * np.linspace(-1, 1, 5)
    angles = theta_i, off - theta_i, np.pi - 0.3
    found = marschner.evaluate(fiber, *angles, lobes=(0, 1))
    limit = fj.evaluate(
        fiber, *angles, lobes=(0, 1), rest=False, rule=fj.Windowed(32, 1e-9)
    )
    np.testing.assert_allclose(found, limit, rtol=1e-2)
    # M as printed is in half angles: of unit integral there, it is twice as large.
    half = np.linspace(-0.5, 0.5, 2001)
    printed = np.exp(-(half**2) / (2 * 0.1**2)) / (0.1 * np.sqrt(2 * np.pi))
    np.testing.assert_allclose(2 * marschner.M(0.0, 2 * half, 0.2**2), printed)


def test_marschner_at_a_caustic():
    """TRT grows without bound towards it, and is 0 beyond: nothing is smoothed."""
    where = fj.caustics(2, 0.0, eta=1.55)
    off = jnp.asarray((1e-8, 1e-6, 1e-4, -1e-4))
    clear = fj.Fiber(1.55, 0.2, 0.3, None, None)
    # The light lies where |phi| is smaller.
    phi = jnp.abs(where.phi) - off
    found = marschner.evaluate(clear, 0.0, 0.0, phi, lobes=(2,))
    lit = found - marschner.evaluate(clear, 0.0, 0.0, phi[3], lobes=(2,))
    np.testing.assert_allclose(lit[0] / lit[1], 10, rtol=0.05)
    np.testing.assert_allclose(lit[1] / lit[2], 10, rtol=0.05)


def test_marschner_sums_its_lobes_and_follows_its_tilt():
    angles = 0.3, -0.2, 2.7
    narrow = fj.Fiber(1.55, 0.02, 0.3, 0.04, HAIR.sigma_a)
    theta = np.append(np.linspace(-0.6, 0.6, 4001), angles[1])
    total = 0.0
    for p, tilt in enumerate((2, -1)):
        S = marschner.evaluate(narrow, 0.3, theta, 2.7, lobes=(p,))
        total = total + S[-1]
        peak_of = theta[np.argmax(S[:-1, 0])]
        assert peak_of == pytest.approx(tilt * 0.04 - 0.3, abs=2e-3)
    both = marschner.evaluate(narrow, *angles, lobes=(0, 1))
    np.testing.assert_allclose(total, both)


# R of d'Eon et al. 2014


def traced(alpha, count=3000):
    """Mirrors that are turned by alpha: theta_i, and where the light goes."""
    rng = np.random.default_rng(3)
    h, theta_i = rng.uniform(-0.98, 0.98, count), rng.uniform(-1.2, 1.2, count)
    zero = np.zeros(count)
    x, y, z = raytrace.trace(0, h, theta_i, zero, np.full(count, 1.55), alpha).omega_o.T
    return theta_i, np.arcsin(x), np.arctan2(z, y)


def peak(fiber, theta_i, phi):
    """The cone, where M has its maximum in the angle from it."""
    return deon2014._cone(fiber, jnp.asarray(theta_i), jnp.asarray(phi))


def test_the_cone_is_where_tilted_mirrors_throw_light():
    """To first order in the tilt; the cone without azimuth is off by all of it."""
    worst = []
    for alpha in (0.02, 0.01):
        theta_i, theta_o, phi = traced(alpha)
        found = peak(fj.Fiber(alpha=alpha), theta_i, phi)
        worst.append(np.abs(found - theta_o).max())
        assert worst[-1] < 8 * alpha**2
        assert np.abs(-theta_i + 2 * alpha - theta_o).max() > alpha
    assert worst[1] < 0.27 * worst[0]
    # Exact where the mirror is in the plane of the light.
    zero = np.zeros(1)
    head_on = raytrace.trace(0, zero, zero + 0.4, zero, zero + 1.55, 0.05).omega_o
    cone = peak(fj.Fiber(alpha=0.05), 0.4, 0.0)
    np.testing.assert_allclose(cone, np.arcsin(head_on[0, 0]), rtol=1e-12)


def test_the_width_is_that_of_mirrors_of_random_tilt():
    """In proportion to cos(phi/2): a turn by delta moves theta_o by 2 delta cos."""
    delta = 1e-4
    theta_i, theta_o, phi = traced(delta)
    spread = (theta_o + theta_i) / (2 * delta)
    narrow = fj.Fiber(beta_m=0.01, alpha=None)
    width = deon2014._width(narrow, jnp.asarray(phi)) / (np.sqrt(2) * 0.01)
    np.testing.assert_allclose(width, spread, atol=2e-3)
    for phi_o in (0.0, 1.5, 2.8):
        t = -0.3 + 0.02 * np.linspace(-8, 8, 4001)
        density = np.asarray(deon2014.pdf(narrow, 0.3, t, phi_o, rule=RULE)) * np.cos(t)
        deviation = np.sqrt(np.average((t + 0.3) ** 2, weights=density))
        right = np.sqrt(2) * 0.01 * np.cos(phi_o / 2)
        assert deviation == pytest.approx(right, rel=1e-3)


def test_r_of_2014_agrees_with_that_of_2013_without_azimuth():
    """At phi = 0 it is a lobe of the width sqrt 2 beta."""
    wider = fj.Fiber(1.55, 0.2 * np.sqrt(2), 0.3, 0.04, (0.2, 1.0))
    for theta_i, theta_o in ((0.3, -0.1), (-1.0, 1.3)):
        expected = fj.lobe(wider, 0, theta_i, theta_o, 0.0, rule=RULE)
        found = deon2014.evaluate(HAIR, theta_i, theta_o, 0.0, rule=RULE)
        np.testing.assert_allclose(found, expected, rtol=1e-13)
    # All azimuths together reflect as much, if F is taken at theta_i.
    weight = deon2014.sample(
        HAIR, 0.5, uniforms(8, COUNT, 4), incidence="theta_i"
    ).weight[:, 0]
    albedo = fj.albedo(HAIR, 0.5, lobes=(0,), rest=False, incidence="theta_i")[0]
    assert abs(weight.mean() - albedo) < 4.5 * weight.std() / np.sqrt(COUNT)


@pytest.mark.parametrize(
    ("of", "theta_i", "choices"),
    [
        (HAIR, 0.4, {"rule": RULE}),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                (HAIR, -1.3, {"detector": "logistic", "rule": fj.GaussGamma(64)}),
                # By the default rule: a clear fiber, a narrow one, and at grazing.
                (fj.Fiber(1.55, 0.2, 0.3, 0.04, None), 0.4, {}),
                (fj.Fiber(1.55, 0.02, 0.05, 0.04, (0.2, 1.0)), -0.8, {}),
                (HAIR, np.radians(89.9), {}),
            )
        ),
    ],
)
def test_sampler_of_2014(of, theta_i, choices):
    u = uniforms(5, COUNT, 4)
    s = deon2014.sample(of, theta_i, u, **choices)
    assert s.weight.shape == (COUNT, *(() if of.sigma_a is None else (2,)))
    # What lies far off the cone is one bin, and what lies next to phi = pi, where the
    # width vanishes.
    reach = np.linspace(-8, 8, 49) * float(of.beta_m)
    edges = np.clip(0.04 - theta_i + reach, -HALF_PI, HALF_PI)
    edges = edges, np.linspace(-2.6, 2.6, 21)

    def density(theta, phi):
        return deon2014.pdf(of, theta_i, theta, phi, **choices)

    assert fit(density, s, *edges) > FALSE_ALARM / 5
    wrong = eqx.tree_at(lambda x: x.alpha, of, jnp.asarray(0.0))
    broken = deon2014.sample(wrong, theta_i, u, **choices)
    assert fit(density, broken, *edges) < 1e-9
    some = jax.tree.map(lambda x: x[:20_000], s)
    value = deon2014.evaluate(of, theta_i, some.theta_o, some.phi, **choices)
    weight, value = (np.reshape(x, (20_000, -1)) for x in (some.weight, value))
    residual = weight - value / np.asarray(density(some.theta_o, some.phi))[:, None]
    for test in (1.0, np.cos(some.phi), np.sin(3 * some.theta_o), np.cos(3 * some.phi)):
        z = np.ravel(test)[:, None] * np.asarray(residual)
        assert np.all(np.abs(z.mean(0)) < 4.5 * z.std(0) / np.sqrt(len(z)))
    assert residual.std() > 1e-3


@pytest.mark.slow
def test_sampler_of_2014_has_finite_gradients():
    for dtype in DTYPES:
        last = 1 - jnp.finfo(dtype).eps / 2
        u = jnp.stack(jnp.meshgrid(*[jnp.asarray([0, 0.5, last], dtype)] * 4), -1)

        def total(fiber, u):
            s = deon2014.sample(fiber, u[..., 0] * 0, u)
            assert s.weight.dtype == u.dtype
            return (s.theta_o + s.phi).sum() + s.weight.sum()

        for beta in (1e-4, 0.3, 30.0):
            slopes = jax.grad(total, argnums=(0, 1))(
                fj.Fiber(1.55, beta, beta, 0.04, 0.3), u
            )
            assert all(bool(jnp.isfinite(x).all()) for x in jax.tree.leaves(slopes))


BAD = {
    "color of lambert": (
        lambda: untyped.lambert.evaluate(0.0, 0.0, 0.0, color=np.ones((2, 3))),
        r"color has shape \(2, 3\)",
    ),
    "u of lambert": (
        lambda: untyped.lambert.sample(0.0, np.ones(2) / 2, color=1.0),
        "must end in 3",
    ),
    "exponent": (
        lambda: untyped.kajiya_kay.evaluate(
            0.0, 0.0, 0.0, diffuse=0.1, specular=0.1, exponent=np.ones(2)
        ),
        r"exponent has shape \(2,\)",
    ),
    "specular": (
        lambda: untyped.kajiya_kay.evaluate(
            0.0, 0.0, 0.0, diffuse=0.1, specular=np.ones((1, 3)), exponent=3.0
        ),
        r"specular has shape \(1, 3\)",
    ),
    "colors": (
        lambda: untyped.kajiya_kay.evaluate(
            0.0, 0.0, 0.0, diffuse=np.ones(2), specular=np.ones(3), exponent=3.0
        ),
        r"diffuse has shape \(2,\), specular has shape \(3,\): must broadcast",
    ),
    "lobes": (
        lambda: untyped.marschner.evaluate(HAIR, 0.0, 0.0, 0.0, lobes=2),
        "lobes = 2: must be a tuple",
    ),
    "twice": (
        lambda: untyped.marschner.evaluate(HAIR, 0.0, 0.0, 0.0, lobes=(0, 0)),
        "must not name a lobe twice",
    ),
    "no lobes": (
        lambda: untyped.marschner.evaluate(HAIR, 0.0, 0.0, 0.0, lobes=()),
        "at least one",
    ),
    "lobe": (
        lambda: untyped.marschner.evaluate(HAIR, 0.0, 0.0, 0.0, lobes=(-1,)),
        "lobes = -1",
    ),
    "u of deon2014": (
        lambda: untyped.deon2014.sample(HAIR, 0.0, np.ones(5) / 2),
        "must end in 4",
    ),
    "detector": (
        lambda: untyped.deon2014.pdf(HAIR, 0.0, 0.0, 0.0, detector="box"),
        "must be one of",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_says_what_is_allowed(case):
    call, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        call()
