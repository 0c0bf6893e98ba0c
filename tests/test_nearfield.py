"""The near field: values, energy, distribution, derivatives, and the far field."""

from functools import partial
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import reference
from mpmath import mp
from scipy import special

import fiberjax as fj
from fiberjax import compat, directions, nearfield, perceptual
from fiberjax.counting import operations

HALF_PI = np.pi / 2
GRAZING = np.radians(89.9)
SCALE = np.sqrt(np.pi / 8)
TILTS, WIDTHS = (2, -1, -4), (1.0, 0.5, 2.0, 2.0)
COLORS = (0.1, 0.4, 2.0)
HAIR: Any = fj.Fiber(1.55, 0.25, 0.3, -0.035, COLORS)


def fiber(beta, sigma_a: Any = None, alpha: Any = 0.0436) -> Any:
    """Of one roughness, or of beta_m and beta_n."""
    beta_m, beta_n = np.broadcast_to(beta, 2)
    return fj.Fiber(1.55, beta_m, beta_n, alpha, sigma_a)


def angles(seed, count) -> Any:
    rng = np.random.default_rng(seed)
    theta = rng.uniform(-HALF_PI, HALF_PI, (2, count))
    return (*theta, rng.uniform(-7, 7, count), rng.uniform(-1, 1, count))


def parts(of, theta_i, h) -> Any:
    """A_p, cone, width along and specular azimuth of R, TT, TRT and the rest.

    From the equations of floor one, none of which the near field calls.
    """
    eta_p = fj.eta_prime(theta_i, of.eta)
    cos = np.cos(theta_i) * np.sqrt((1 - h) * (1 + h))
    F = fj.reflectance(cos, of.eta)[..., None]
    sigma_a = np.atleast_1d(0.0 if of.sigma_a is None else of.sigma_a)
    inside, inclined = (np.asarray(x)[..., None] for x in (h, theta_i))
    T = fj.transmittance(inside, inclined, of.eta, sigma_a)
    A = [*(fj.A(p, F, T) for p in range(3)), fj.A_rest(3, F, T)]
    A = [np.broadcast_to(a, (*np.shape(h), len(sigma_a))) for a in A]
    alpha = 0.0 if of.alpha is None else float(of.alpha)
    cones = [-theta_i + k * alpha for k in (*TILTS, 0)]
    beta = [w * float(of.beta_m) for w in WIDTHS]
    return A, cones, beta, [fj.Phi(p, h, eta_p) for p in range(3)]


def composed(of, theta_i, theta_o, phi, h) -> Any:
    """evaluate and pdf from the public equations."""
    A, cones, beta, turns = parts(of, theta_i, h)
    D = [fj.trimmed_logistic(phi - turn, SCALE * of.beta_n) for turn in turns]
    D.append(np.full_like(phi, 1 / (2 * np.pi)))
    density = [
        fj.M(c, theta_o, b * b) * d for c, b, d in zip(cones, beta, D, strict=True)
    ]
    w = np.array([a.mean(-1) for a in A])
    value = sum(a * d[..., None] for a, d in zip(A, density, strict=True))
    return value, sum(w / w.sum(0) * np.array(density))


@pytest.mark.parametrize("beta", [0.01, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("sigma_a", [None, (0.0, 0.5, 30.0)])
def test_values_are_those_of_the_equations(beta, sigma_a):
    of, at = fiber(beta, sigma_a), angles(0, 2000)
    value, density = composed(of, *at)
    found = nearfield.evaluate(of, *at)
    # What rounding of the azimuth and of theta costs, in units of the widths.
    rtol = 1e-12 + 2e-15 / beta**2
    np.testing.assert_allclose(
        found if sigma_a else found[:, None], value, rtol=rtol, atol=1e-290
    )
    np.testing.assert_allclose(nearfield.pdf(of, *at), density, rtol=rtol, atol=1e-290)


@pytest.mark.parametrize("at", [(0.4, -0.3, 2.0, 0.6), (-1.2, 1.1, -2.5, -0.9)])
def test_values_are_those_of_50_digits(at):
    with mp.workdps(50):
        t, o, f, x, eta = map(mp.mpf, (*at, float(HAIR.eta)))
        alpha, beta_m, beta_n = (
            mp.mpf(float(x)) for x in (HAIR.alpha, HAIR.beta_m, HAIR.beta_n)
        )
        s = mp.sqrt(mp.pi / 8) * beta_n
        eta_p = mp.sqrt(eta**2 - mp.sin(t) ** 2) / mp.cos(t)
        gamma_i, gamma_t = mp.asin(x), mp.asin(x / eta_p)
        F = reference.reflectance(mp.cos(t) * mp.cos(gamma_i), eta)
        T = mp.exp(
            -mp.mpf(COLORS[1]) * 2 * mp.cos(gamma_t) / mp.cos(mp.asin(mp.sin(t) / eta))
        )
        exact = mp.mpf(0)
        for p, (k, w) in enumerate(zip(TILTS, WIDTHS, strict=False)):
            Phi = 2 * p * gamma_t - 2 * gamma_i + p * mp.pi
            away = f - Phi
            away -= 2 * mp.pi * mp.nint(away / (2 * mp.pi))
            e = mp.exp(-abs(away) / s)
            D = e / (1 + e) ** 2 / s / mp.tanh(mp.pi / (2 * s))
            A = F if p == 0 else (1 - F) ** 2 * F ** (p - 1) * T**p
            exact += A * reference.M(-t + k * alpha, o, (w * beta_m) ** 2) * D
        rest = (1 - F) ** 2 * F**2 * T**3 / (1 - F * T)
        exact += rest * reference.M(-t, o, (2 * beta_m) ** 2) / (2 * mp.pi)
        exact = float(exact)
    found = nearfield.evaluate(HAIR, *at)[1]
    np.testing.assert_allclose(found, exact, rtol=1e-13)


@pytest.mark.parametrize("beta", [0.05, 0.3, 1.0])
def test_single_precision(beta):
    of, at = fiber(beta, COLORS), angles(1, 5000)
    single = [np.float32(x) for x in at]
    at = [np.float64(x) for x in single]
    for f in (nearfield.evaluate, nearfield.pdf):
        double, found = np.asarray(f(of, *at)), np.asarray(f(of, *single))
        assert found.dtype == np.float32
        # Exponents are as large as log(peak/value); Phi and theta are rounded.
        room = 4e-6 * (1 + 1 / beta) * (1 + np.abs(np.log(double)))
        assert (np.abs(found - double) <= room * double + 1e-30).all()


def panels(centers, widths, low, high):
    """Edges of intervals that are short around each center."""
    steps = np.array([0, 0.5, 1, 2, 3, 4.5, 6, 8, 11, 15, 20, 28, 40])
    steps = np.concatenate([-steps[:0:-1], steps])
    edges = [c + w * steps for c, w in zip(centers, widths, strict=True)]
    return np.sort(np.clip(np.concatenate([*edges, [low, high]]), low, high))


def clustered(centers, widths, low, high):
    """Gauss-Legendre nodes of those intervals."""
    edges = panels(centers, widths, low, high)
    x, w = np.polynomial.legendre.leggauss(16)
    mid, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    return (mid[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel()


def sphere(of, theta_i, h):
    """theta_o and phi, and weights in solid angle, for the lobes of one fiber."""
    _, cones, beta, turns = parts(of, theta_i, h)
    folded = np.arcsin(np.sin(cones))
    theta, w_theta = clustered(folded, beta, -HALF_PI, HALF_PI)
    wrapped = [float(x) % (2 * np.pi) for turn in turns for x in (turn, turn + np.pi)]
    s = [SCALE * float(of.beta_n), 1e-300] * 3
    phi, w_phi = clustered(wrapped, s, 0, 2 * np.pi)
    return theta[:, None], phi, (w_theta * np.cos(theta))[:, None] * w_phi


@jax.jit
def integral(of, theta_i, theta_o, phi, h, weight):
    value = nearfield.evaluate(of, theta_i, theta_o, phi, h).astype(weight.dtype)
    return (weight * value).sum(), (
        weight * nearfield.pdf(of, theta_i, theta_o, phi, h)
    ).sum()


# What a perceptual roughness of .01 and of 1 stands for.
PERCEPTUAL = tuple(
    (float(perceptual.longitudinal(b)), float(perceptual.azimuthal(b)))
    for b in (0.01, 1.0)
)
FURNACE = list(
    product(
        (0.01, 0.1, 0.3, 1.0, *PERCEPTUAL),
        ((0.0, 0.2), (-1.0, -0.9), (GRAZING, 0.6)),
    )
)


@pytest.mark.parametrize(("beta", "at"), FURNACE)
def test_white_furnace(beta, at):
    """All light comes back at every offset; the density integrates to 1."""
    of, (theta_i, h) = fiber(beta), at
    theta_o, phi, weight = sphere(of, theta_i, h)
    scattered, mass = integral(of, theta_i, theta_o, phi, h, weight)
    assert abs(scattered - 1) < 1e-12
    assert abs(mass - 1) < 1e-12
    single = [np.float32(x) for x in (theta_i, theta_o, phi, h)]
    value = np.float64(nearfield.evaluate(of, *single))
    assert abs((weight * value).sum() - 1) < 2e-6 / np.min(beta)


def offsets(panels):
    """h and weights of the mean over it, by nodes in gamma."""
    x, w = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(-HALF_PI, HALF_PI, panels + 1)
    gamma = (edges[:-1, None] + np.diff(edges)[:, None] * (1 + x) / 2).ravel()
    weight = (np.diff(edges)[:, None] * w / 4).ravel() * np.cos(gamma)
    return np.sin(gamma), weight


@pytest.mark.parametrize(
    ("lobes", "beta", "sigma_a"),
    [
        ((0,), 0.15, 0.4),
        ((1,), 0.15, 0.4),
        ((2,), 0.15, 0.4),
        ((0, 1, 2), 0.15, COLORS),
        ((0, 1, 2), 0.06, None),
    ],
)
def test_the_far_field_is_the_mean_over_offsets(lobes, beta, sigma_a):
    """Each lobe and all with the rest, in values and along a step of all parameters.

    Of these fibers the kink of the detector where it wraps is below rounding.
    """
    given = fiber(beta, sigma_a), *map(jnp.asarray, angles(4, 12)[:3])
    h, weight = offsets(160)
    choices: Any = {"lobes": lobes, "rest": len(lobes) > 1, "detector": "logistic"}

    def near(of, *where):
        columns = [x[..., None] for x in where]
        value = nearfield.evaluate(of, *columns, h=h, **choices)
        return jnp.tensordot(value, weight, (1, 0))

    def far(of, *where):
        rule = fj.GaussGamma(512)
        return fj.evaluate(of, *where, incidence="theta_i", rule=rule, **choices)

    rng = np.random.default_rng(6)
    step = jax.tree.map(lambda x: rng.uniform(0.5, 1, np.shape(x)), given)
    pairs = [jax.jit(partial(jax.jvp, f))(given, step) for f in (near, far)]
    for mean, exact in zip(*pairs, strict=True):
        room = 2e-12 * np.abs(exact).max()
        np.testing.assert_allclose(mean, exact, atol=room, rtol=0)


FIELDS = "eta", "beta_m", "beta_n", "alpha", "sigma_a"


def shifted(of, name, by):
    values = {x: getattr(of, x) for x in FIELDS}
    return fj.Fiber(**values | {name: values[name] + by})


def test_derivatives_are_those_of_the_equations():
    """Central differences of what is composed, in every field and angle."""
    at = angles(5, 40)
    tangents = jax.jacfwd(nearfield.evaluate)(fj.Fiber(1.5, 0.3, 0.4, 0.03, 0.3), *at)
    of, step = fj.Fiber(1.5, 0.3, 0.4, 0.03, 0.3), 1e-5

    def value(of, *at):
        return composed(of, *at)[0][:, 0]

    for name in FIELDS:
        sides = [value(shifted(of, name, d), *at) for d in (step, -step)]
        expected = (sides[0] - sides[1]) / (2 * step)
        found = getattr(tangents, name)
        np.testing.assert_allclose(found, expected, atol=2e-8 * np.abs(expected).max())

    def total(k, x):
        return nearfield.evaluate(of, *(x if j == k else y for j, y in enumerate(at)))

    for k in range(4):
        moved = [[x + d * (j == k) for j, x in enumerate(at)] for d in (step, -step)]
        sides = [value(of, *x) for x in moved]
        expected = (sides[0] - sides[1]) / (2 * step)
        ones = np.ones_like(at[k])
        _, found = jax.jvp(
            partial(total, k), (jnp.asarray(at[k]),), (jnp.asarray(ones),)
        )
        inside = np.abs(at[3]) < 0.99
        room = 1e-6 * np.abs(expected).max()
        np.testing.assert_allclose(found[inside], expected[inside], atol=room)


EXTREMES = {
    "theta_i": (0.0, 1.0, GRAZING, HALF_PI, -HALF_PI),
    "h": (-1.0, -0.5, 0.0, 0.999999, 1.0),
    "eta": (1.0, 1.0 + 1e-6, 1.55, 3.0),
    "beta": (1e-4, 0.01, 1.0, 30.0),
    "sigma_a": (0.0, 1e-8, 1e3),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_extremes_are_finite_in_values_and_derivatives(dtype):
    rows = np.array(list(product(*EXTREMES.values())), dtype)
    u = jnp.asarray([0.3, 0.6, 0.2, 0.45], dtype)

    def numbers(row):
        theta_i, h, eta, beta, sigma_a = row
        of = fj.Fiber(eta, beta, beta, 0.03, sigma_a)
        drawn = nearfield.sample(of, theta_i, h, u)
        at = theta_i, drawn.theta_o, drawn.phi, h
        value, density = nearfield.evaluate(of, *at), nearfield.pdf(of, *at)
        return jnp.stack([value, density, drawn.weight, drawn.theta_o, drawn.phi])

    each = jax.jit(jax.vmap(lambda row: (numbers(row), jax.jacrev(numbers)(row))))
    for found in each(rows):
        assert found.dtype == dtype
        assert np.isfinite(found).all()
    values, _ = each(rows)
    assert (np.asarray(values)[:, :3] >= 0).all()


AWAY = {
    "theta_i": (0.0, GRAZING, -HALF_PI),
    "theta_o": (0.0, -GRAZING, HALF_PI, 1.0),
    "phi": (0.0, np.pi, -1.0, 7.0),
    "h": (-1.0, 0.0, 0.999999),
    "eta": (1.0, 1.0 + 1e-6, 1.55),
    "beta": (1e-4, 0.01, 1.0, 30.0),
    "sigma_a": (0.0, 1e3),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(
    "choices", [{}, {"detector": "normal"}, {"compat": "pbrt"}, {"compat": "mitsuba"}]
)
def test_extremes_away_from_the_lobes_are_finite(choices, dtype):
    """In values and derivatives, wherever the direction scattered into lies."""
    rows = np.array(list(product(*AWAY.values())), dtype)

    def numbers(row):
        *at, eta, beta, sigma_a = row
        of = fj.Fiber(eta, beta, beta, 0.03, sigma_a)
        both = (f(of, *at, **choices) for f in (nearfield.evaluate, nearfield.pdf))
        return jnp.stack(list(both))

    each = jax.jit(jax.vmap(lambda row: (numbers(row), jax.jacrev(numbers)(row))))
    values, derivatives = each(rows)
    assert values.dtype == derivatives.dtype == dtype
    assert np.isfinite(values).all()
    assert np.isfinite(derivatives).all()
    assert (np.asarray(values) >= 0).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("detector", ["logistic", "normal"])
def test_the_ends_of_u_draw_finite_directions(detector, dtype):
    """In values and derivatives, and none of them is lost."""
    ends = dtype(0), np.nextafter(dtype(1), dtype(0))
    u = np.array(list(product((*ends, dtype(0.5)), repeat=4)))
    corners = product((-1.2, GRAZING), (0.0, 0.99), (1e-3, 0.3, 2.0))
    rows = np.array([(*a, *b) for a in corners for b in u], dtype)

    def numbers(row):
        theta_i, h, beta, *u = row
        of = fj.Fiber(1.55, beta, beta, 0.03, 0.2)
        drawn = nearfield.sample(of, theta_i, h, jnp.stack(u), detector=detector)
        return jnp.stack([drawn.theta_o, drawn.phi, drawn.weight])

    each = jax.jit(jax.vmap(lambda row: (numbers(row), jax.jacfwd(numbers)(row))))
    values, derivatives = each(rows)
    assert values.dtype == derivatives.dtype == dtype
    assert np.isfinite(values).all()
    assert np.isfinite(derivatives).all()
    theta_o, _, weight = np.asarray(values).T
    assert (np.abs(theta_o) <= HALF_PI).all()
    assert (weight > 0).all()


def pbrt_M(cos_i, cos_o, sin_i, sin_o, v, terms):
    """Mp of pbrt's hair.cpp, a number at a time, by so many terms of I0."""
    a, b = cos_i * cos_o / v, sin_i * sin_o / v

    def i0(x):
        factors = (4**i * special.factorial(i) ** 2 for i in range(terms))
        return sum(x ** (2 * i) / factor for i, factor in enumerate(factors))

    def log_i0(x):
        if x > 12:
            return x + 0.5 * (-np.log(2 * np.pi) + np.log(1 / x) + 1 / (8 * x))
        return np.log(i0(x))

    if v <= 0.1:
        return np.exp(log_i0(a) - b - 1 / v + 0.6931 + np.log(1 / (2 * v)))
    return np.exp(-b) * i0(a) / (np.sinh(1 / v) * 2 * v)


@pytest.mark.parametrize(("compat", "terms"), [("pbrt", 10), ("mitsuba", 11)])
def test_compat_is_what_renderers_compute(compat, terms):
    theta_i, theta_o, phi, h = angles(8, 300)
    for beta in (0.05, 0.3, 0.35, 1.0):
        of = fiber(beta, 0.4, None)
        A, _, widths, turns = parts(of, theta_i, h)
        density: list[Any]
        density = [fj.trimmed_logistic(phi - t, SCALE * of.beta_n) for t in turns]
        density.append(np.full(300, 1 / (2 * np.pi)))
        expected = np.zeros(300)
        for a, b, D in zip(A, widths, density, strict=True):
            trig = (np.cos(theta_i), np.cos(theta_o), np.sin(theta_i), np.sin(theta_o))
            M = [pbrt_M(*x, b * b, terms) for x in zip(*trig, strict=True)]
            expected += a[:, 0] * M * np.asarray(D)
        found = nearfield.evaluate(of, theta_i, theta_o, phi, h, compat=compat)
        np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-280)


def test_the_error_of_renderers():
    """2 % where log I0 passes to its other form."""
    of, theta = fiber(0.28, 0.0, None), np.linspace(-1.4, 1.4, 400)
    choices = {"lobes": (0,), "rest": False}
    exact, theirs = (
        np.asarray(nearfield.evaluate(of, theta, -theta, 0.3, 0.1, compat=c, **choices))
        for c in (None, "pbrt")
    )
    worst = np.abs(theirs / exact - 1).max()
    assert 0.015 < worst < 0.0202


def test_derivatives_of_compat_are_finite():
    for beta, dtype in product((1e-3, 0.05, 0.4, 3.0), (np.float32, np.float64)):
        of = fiber(beta, 0.3)
        at = [dtype(x) for x in (0.4, -0.35, 0.2, 0.1)]
        evaluate = partial(nearfield.evaluate, compat="pbrt")
        found = jax.grad(evaluate, (0, 1, 2, 3, 4))(of, *at)
        assert all(np.isfinite(x).all() for x in jax.tree.leaves(found))


def test_shapes_and_errors():
    at = np.zeros((5, 1)), np.zeros(4), 0.3, 0.1
    assert nearfield.evaluate(HAIR, *at).shape == (5, 4, 3)
    assert nearfield.pdf(HAIR, *at).shape == (5, 4)
    drawn = nearfield.sample(HAIR, at[0], 0.2, np.full((4, 4), 0.5))
    assert drawn.theta_o.shape == drawn.phi.shape == drawn.p.shape == (5, 4)
    assert drawn.weight.shape == (5, 4, 3)
    for call, message in (
        (
            partial(nearfield.evaluate, HAIR, *at, compat="cycles"),
            "compat = 'cycles'",
        ),
        (partial(nearfield.evaluate, HAIR, *at, detector="box"), "detector = 'box'"),
        (partial(nearfield.sample, HAIR, 0.1, 0.2, np.zeros(5)), "u has shape"),
        (
            partial(nearfield.sample, HAIR, 0.1, 0.2, np.zeros(4), gradient="both"),
            "gradient = 'both'",
        ),
        (partial(directions.evaluate, HAIR, np.zeros(2), np.zeros(3), 0.1), "omega_i"),
        (
            partial(directions.pdf, HAIR, np.zeros((3, 3)), np.zeros((2, 3)), 0.1),
            r"omega_i.* \(3,\), omega_o.* \(2,\), h has shape \(\): must broadcast",
        ),
        (
            partial(directions.sample, HAIR, np.ones((3, 3)), 0.1, np.zeros((2, 4))),
            r"omega_i.* \(3,\), u.* \(2,\)",
        ),
        (
            partial(directions.sample, HAIR, np.zeros(3), 0.1, np.zeros(3)),
            "u has shape",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            call()


def test_what_is_None_is_not_compiled():
    """No cone is turned without a tilt, and nothing is absorbed in clear fibers."""
    at = (0.3, 0.1, 2.0, 0.4)

    def flops(**fields):
        fiber = fj.Fiber(**{"sigma_a": 0.3, "alpha": 0.05, **fields})
        return operations(lambda *x: nearfield.evaluate(fiber, *x), *at)["flop"]

    full, straight, clear = flops(), flops(alpha=None), flops(sigma_a=None)
    # Four products and two sums turn a cone, of R, TT and TRT.
    assert straight <= full - 3 * 6
    # T is a polynomial of 7 terms.
    assert clear <= full - 3 * 8


def test_all_choices_of_compat_have_an_M():
    assert tuple(compat.LONGITUDINAL) == (None, "pbrt", "mitsuba")
