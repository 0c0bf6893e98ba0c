"""The rule that chooses: what it promises at every roughness, and what it chooses."""

import csv
import math
from functools import cache, partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj
from fiberjax.auto import _Graded
from fiberjax.detectors import DETECTORS
from fiberjax.graded import grading, layer
from fiberjax.orders import LAYER, REST, averaged
from fiberjax.rules import Seen
from fiberjax.section import section

NODES = Path(__file__).parents[1] / "figures" / "nodes.csv"
COUNT = 48
RANGES = ((1e-6, 0.06), (0.06, 0.3), (0.3, 100.0))
SPARE = (fj.Windowed(120), fj.GaussGamma(400), fj.GaussGamma(300))
"""For each range, a rule with nodes to spare that is not the one chosen by default."""


def draws(p, low, high, seed=0):
    """phi of shape (COUNT, 40) around what each fiber shows, and its parameters."""
    rng = np.random.default_rng(seed)
    near = np.pi / 2 - 10 ** rng.uniform(-8, 0, COUNT)
    theta_d = np.where(rng.random(COUNT) < 0.2, near, rng.uniform(0, np.pi / 2, COUNT))
    eta = np.where(
        rng.random(COUNT) < 0.5,
        rng.uniform(1.2, 1.8, COUNT),
        1 + 10 ** rng.uniform(-6, 0.3, COUNT),
    )
    sigma_a = np.where(rng.random(COUNT) < 0.2, 0, 10 ** rng.uniform(-3, 3, COUNT))
    beta_n = np.exp(rng.uniform(math.log(low), math.log(high), COUNT))
    edge = np.asarray(fj.caustics(p, theta_d, eta=eta).h)[:, None]
    h = np.concatenate(
        [
            np.sin(np.linspace(0, np.pi / 2, 32)) + 0 * edge,
            edge,
            rng.random((COUNT, 7)),
        ],
        1,
    )
    phi = fj.Phi(p, h, fj.eta_prime(theta_d, eta)[:, None])
    phi = (
        phi + rng.choice([0, 1], h.shape) * rng.normal(0, 3, h.shape) * beta_n[:, None]
    )
    # Numbers that float32 holds too; eta stays above 1.
    points = (phi, theta_d, np.maximum(eta, 1 + 2.0**-20), sigma_a, beta_n)
    return [np.asarray(x, np.float32).astype(float) for x in points]


@cache
def compiled(rule, p, detector):
    def one(x):
        phi, theta_d, eta, sigma_a, beta_n = x
        optics = {"eta": eta, "sigma_a": sigma_a, "beta_n": beta_n}
        return fj.N(p, phi, theta_d, **optics, rule=rule, detector=detector)

    # One fiber at a time: of all rules only the one that is chosen is run.
    return jax.jit(lambda points: jax.lax.map(one, points))


def values(rule, p, points, detector, dtype=jnp.float64):
    run = compiled(rule, p, detector)
    return np.asarray(run([jnp.asarray(x, dtype) for x in points]), float)


def excess(found, exact, points, p, tolerance, dtype):
    """Error over what is allowed, at worst."""
    sigma_a, beta_n = points[3], points[4]
    eps = float(jnp.finfo(dtype).eps)
    # The rounding floor of angles and of the exponent of the absorption.
    floor = 4 * eps * (np.pi / np.minimum(beta_n, 1) + p * sigma_a)
    allowed = np.maximum(tolerance, floor) * exact.max(1)
    allowed += 1e-290 if dtype == jnp.float64 else 1e-30
    return (np.abs(found - exact).max(1) / allowed).max()


CASES = [
    (1, "normal", jnp.float64),
    (2, "normal", jnp.float64),
    (2, "normal", jnp.float32),
]
MORE = [(p, "normal", jnp.float64) for p in (0, 3, 5)] + [(1, "logistic", jnp.float64)]


def check(p, detector, dtype, tolerance, promise):
    for (low, high), spare in zip(RANGES, SPARE, strict=True):
        points = draws(p, low, high)
        exact = values(spare, p, points, detector)
        found = values(fj.auto(tolerance), p, points, detector, dtype)
        assert excess(found, exact, points, p, promise, dtype) < 1


@pytest.mark.parametrize(("p", "detector", "dtype"), CASES)
def test_the_default_is_right_at_every_roughness(p, detector, dtype):
    check(p, detector, dtype, 1e-12, 1e-9 if dtype == jnp.float64 else 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("p", "detector", "dtype"), MORE)
def test_so_it_is_for_other_lobes(p, detector, dtype):
    check(p, detector, dtype, 1e-12, 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-9])
def test_the_tolerance_is_met(tolerance):
    check(2, "normal", jnp.float64, tolerance, tolerance)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-9])
def test_the_tolerance_is_met_with_long_tails(tolerance):
    """The logistic leaves more outside windows and between nodes than the normal."""
    check(1, "logistic", jnp.float64, tolerance, tolerance)


def test_grids_of_phi():
    """Where many phi share theta_d a series takes over; it gives the same."""
    phi, theta_d = np.linspace(-3, 3, 40)[:, None], np.radians([0, 40, 80])
    optics: Any = {"eta": 1.55, "sigma_a": jnp.array([0.1, 2.0])}
    for beta_n in (0.003, 0.05, 0.2, 0.7, 3.0):
        for p in (1, 2):
            found = fj.N(p, phi, theta_d, beta_n=beta_n, **optics)
            each = np.broadcast_to(theta_d, (40, 3))
            exact = fj.N(p, phi, each, beta_n=beta_n, **optics)
            assert found.shape == (40, 3, 2)
            np.testing.assert_allclose(found, exact, atol=2e-12 * float(exact.max()))


def test_grids_of_directions():
    """A grid of theta_o and phi, by series, against the same directions one by one."""
    fiber = fj.Fiber(beta_n=0.2)
    theta_o, phi = np.linspace(-1.5, 1.5, 4), np.linspace(-3, 3, 40)[:, None]
    found = fj.evaluate(fiber, 0.3, theta_o, phi)
    exact = fj.evaluate(fiber, 0.3, *np.broadcast_arrays(theta_o, phi))
    assert found.shape == exact.shape
    np.testing.assert_allclose(found, exact, atol=2e-12 * float(exact.max()))


def test_arrays_of_roughness_mix_rules():
    """Every element gets its own rule, whatever its neighbors need."""
    beta_n = np.array([1e-4, 0.05, 0.2, 0.6, 4.0])
    optics: Any = {"eta": 1.55, "sigma_a": 0.3}
    together = fj.N(2, 0.2, 0.4, beta_n=beta_n, **optics)
    for k, b in enumerate(beta_n):
        alone = fj.N(2, 0.2, 0.4, beta_n=b, **optics)
        assert together[k] == pytest.approx(float(alone), rel=1e-10)


def test_a_static_choice():
    assert fj.auto(1e-6) == fj.auto(1e-6, 1e-6) != fj.auto(1e-6, 0.25)
    assert len({fj.auto(1e-6), fj.auto(1e-6), fj.Windowed(), fj.Series()}) == 3
    for arguments in [(0.0,), (1.0,), (math.nan,), (1e-6, 0.0), (1e-6, 1.0, 0.5)]:
        with pytest.raises(ValueError, match=r"tolerance|s_min"):
            fj.auto(*arguments)
    with pytest.raises(ValueError, match="order = 0"):
        fj.Windowed(0)
    with pytest.raises(ValueError, match=r"tolerance = 2\.0"):
        fj.Windowed(20, 2.0)
    with pytest.raises(ValueError, match=r"tolerance = 1\.0"):
        fj.GaussGamma(20, 1.0)
    with pytest.raises(ValueError, match="terms = 0"):
        fj.Series(20, 0)


NARROWED = [(0.25, math.inf), (1e-6, 0.01), (0.5, 2.0), (2.0, math.inf)]


@pytest.mark.slow
@pytest.mark.parametrize("detector", ["normal", "logistic"])
@pytest.mark.parametrize(("s_min", "s_max"), NARROWED)
def test_a_narrow_range_of_roughness(s_min, s_max, detector):
    """What is left out is not needed between the limits, the limits included."""
    phi, theta_d = np.linspace(-3, 3, 40)[:, None], np.radians([[0, 40, 89.9]])
    turn = np.linspace(0, np.pi, 400)[:, None]
    optics: Any = {"eta": 1.55, "sigma_a": 0.3, "detector": detector}
    last = min(s_max, 10.0)
    for beta_n in (s_min, math.sqrt(s_min * last), last):
        for each in (theta_d, np.broadcast_to(theta_d, (40, 3))):
            rule = fj.auto(1e-9, s_min, s_max)
            found = fj.N(2, phi, each, beta_n=beta_n, rule=rule, **optics)
            exact = fj.N(2, phi, each, beta_n=beta_n, **optics)
            peak = fj.N(2, turn, theta_d, beta_n=beta_n, **optics).max(0)
            error = np.abs(np.asarray(found - exact)) / np.asarray(peak)
            assert error.max() < 1e-9 + 1e-14 / beta_n


def searched():
    """Rows of figures/nodes.csv: of lobes, of the rest, and the two of constants."""
    with NODES.open() as file:
        every = list(csv.DictReader(file))
    lobes = [row for row in every if row["p"].isdigit()]
    rest = [row for row in every if row["p"] == "rest"]
    assert len(lobes) + len(rest) + 2 == len(every)
    return lobes, rest, every[-2:]


def test_the_model_of_averages():
    """Against the searches of figures/nodes.py for the rest: never below them."""
    _, searches, (_, layer_row) = searched()
    assert len(searches) > 300
    assert float(layer_row["taken"]) < LAYER < 1.2 * float(layer_row["taken"])
    for row in searches:
        tolerance, eta, sigma_a = (
            float(row[name]) for name in ("tolerance", "eta", "sigma_a")
        )
        here = section(*(jnp.asarray(x) for x in (0.0, eta, sigma_a)))
        delta, near = float(grading(here, REST)), float(layer(here, tolerance))
        taken = averaged(delta, near, math.log(1 / tolerance), np)
        assert taken == pytest.approx(float(row["taken"]), abs=0.02)
        assert taken > float(row["needed"])


def test_the_model_of_the_orders():
    """Against the searches of figures/nodes.py: seldom below them, never by much."""
    searches, _, _ = searched()
    assert len(searches) > 1000
    detector, ratios = DETECTORS["normal"], []
    for row in searches:
        p, tolerance = int(row["p"]), float(row["tolerance"])
        eta, sigma_a, beta_n, theta_d = (
            float(row[name]) for name in ("eta", "sigma_a", "beta_n", "theta_d")
        )
        here = section(*(jnp.asarray(x) for x in (np.radians(theta_d), eta, sigma_a)))
        seen = [Seen(p, jnp.asarray(beta_n), jnp.ones(()))]
        taken = float(_Graded(tolerance=tolerance).need(seen, here, detector))
        assert taken == pytest.approx(float(row["taken"]), abs=0.02)
        ratios.append(taken / float(row["needed"]))
    assert min(ratios) > 0.95
    assert np.mean(np.array(ratios) < 1) < 0.01


CLEAR = (0.0, 1e-6, 1e-4, 1e-3, 0.01, 0.05, 0.3, 3.0)


@pytest.mark.parametrize("tolerance", [1e-12, 1e-4])
def test_averages_hold_however_little_is_absorbed(tolerance):
    """The rest changes at grazing over a distance that sigma_a sets."""
    theta_i = jnp.array([0.0, 0.5, 1.2, 1.5, 1.569])

    def both(rule):
        def albedo(sigma_a, eta):
            hair = fj.Fiber(eta, 0.3, 0.3, -0.035, sigma_a)
            return fj.albedo(hair, theta_i, rule=rule)

        def value(sigma_a, eta):
            by = partial(albedo, eta=eta)
            return jax.jvp(by, (sigma_a,), (jnp.ones_like(sigma_a),))

        return jax.jit(value)

    some, many = both(fj.auto(tolerance)), both(fj.GaussGamma(400))
    for eta in (1.05, 1.55, 3.0):
        for clear in CLEAR:
            # The first is clear: it has no layer.
            colors = jnp.array([0.0, clear, 40 * clear])
            for found, exact in zip(some(colors, eta), many(colors, eta), strict=True):
                scale = float(jnp.abs(exact).max())
                bound = scale * max(tolerance, 1e-14)
                np.testing.assert_allclose(found, exact, rtol=0, atol=bound)


@pytest.mark.parametrize("order", [12, 24, 64])
def test_few_nodes_are_not_spent_on_a_layer_they_cannot_resolve(order):
    """The error of R, TT and TRT stays that of the order, whatever sigma_a is."""
    theta_i = jnp.array([0.0, 0.5, 1.2])

    def albedo(sigma_a, rule):
        hair = fj.Fiber(1.55, 0.3, 0.3, -0.035, sigma_a)
        return fj.albedo(hair, theta_i, rest=False, rule=rule)

    bound = {12: 1e-8, 24: 1e-12, 64: 1e-14}[order]
    for clear in CLEAR:
        found = albedo(clear, fj.GaussGamma(order))
        exact = albedo(clear, fj.GaussGamma(400))
        np.testing.assert_allclose(found, exact, rtol=0, atol=bound)
