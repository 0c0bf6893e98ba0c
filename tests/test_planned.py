"""The rules of plans, each against the rule that has all digits."""

import json
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj
from fiberjax.choices import enough
from fiberjax.detectors import DETECTORS
from fiberjax.farfield import evaluate_model
from fiberjax.model import Attenuations, Model
from fiberjax.planned import ByLobe, Closed, Planned, as_data, from_data
from fiberjax.rules import Seen, Uniform
from fiberjax.scene import Scene
from fiberjax.section import section
from fiberjax.sharing import joined
from fiberjax.tabled import Span, Tabled, spectrum

HAIR = fj.Fiber(1.55, 0.2, 0.3, -0.03, (0.3, 1.2))
NODES = Planned(64, 1e-16, 0.3, 0.3, 40)


def table(degree, low, high):
    """Tables of all parts, for cosines of a range."""
    lobes = [Span(p, 64, degree + p, 40 - p) for p in (0, 1, 2)]
    spans = *lobes, Span(None, 64, degree + 9, 0)
    return Tabled(spans, low, high, NODES)


TABLE = table(63, 0.0, 1.0)
ANGLES = tuple(
    np.random.default_rng(0).uniform(low, high, 2048)
    for low, high in ((-1.5, 1.5), (-1.5, 1.5), (-7, 7))
)


PARTS = (0, 1, 2, None)
TOGETHER = ((PARTS, TABLE),)


def apart(rule):
    """A rule for every lobe by itself."""
    return tuple(((p,), rule) for p in PARTS)


def model(rules, incidence="theta_d"):
    return Model((0, 1, 2), True, ByLobe(rules, NODES), "normal", incidence)


def has_all_digits(rules, angles, incidence="theta_d"):
    """Values and derivatives of rules by lobe against the full model."""

    def both(f):
        def total(fiber, *angles):
            value = f(fiber, *angles)
            return (value**2).sum(), value

        gradient = jax.grad(total, argnums=(0, 1, 2, 3), has_aux=True)
        return jax.jit(gradient)(HAIR, *angles)

    slopes, value = both(lambda *x: evaluate_model(model(rules, incidence), *x))
    exactly, exact = both(partial(fj.evaluate, incidence=incidence))
    np.testing.assert_allclose(value, exact, rtol=0, atol=5e-13 * float(exact.max()))
    for a, b in zip(jax.tree.leaves(slopes), jax.tree.leaves(exactly), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-11 * float(jnp.abs(b).max()))


RULES = {"nodes": apart(NODES), "table": apart(TABLE), "together": TOGETHER}


@pytest.mark.parametrize("rules", RULES.values(), ids=RULES)
def test_rules_by_lobe_have_all_digits(rules):
    """Values, and derivatives in the fiber and in the angles."""
    has_all_digits(rules, ANGLES)


def test_a_table_of_a_part_of_the_range():
    """Only cosines of its range are asked for, and fewer polynomials will do."""
    narrow = table(24, 0.7, 1.0)
    theta_i, theta_o, phi = (x * 0.5 for x in ANGLES)
    found = evaluate_model(model(apart(narrow)), HAIR, theta_i, theta_o, phi)
    exact = fj.evaluate(HAIR, theta_i, theta_o, phi)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-12 * float(exact.max()))


@pytest.mark.parametrize("incidence", ["theta_d", "theta_i"])
def test_a_table_on_a_grid(incidence):
    """Many phi share the polynomials of their cosine, in reverse mode too."""
    grid = 0.4, ANGLES[1][:32, None], ANGLES[2][:64]
    has_all_digits(TOGETHER, grid, incidence)


def test_tables_of_a_clear_fiber_in_float32():
    clear = replace(HAIR, sigma_a=None)
    clear = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), clear)
    angles = [jnp.asarray(x, jnp.float32) for x in ANGLES]
    found = jax.jit(lambda *x: evaluate_model(model(TOGETHER), *x))(clear, *angles)
    assert found.dtype == jnp.float32
    exact = fj.evaluate(replace(HAIR, sigma_a=None), *ANGLES)
    np.testing.assert_allclose(found, exact, rtol=0, atol=2e-5 * float(exact.max()))


def test_a_direction_out_of_the_range_spoils_no_other():
    """Wherever it is among them: the first decides what XLA sees of branches."""
    narrow = ((PARTS, table(24, 0.9, 1.0)),)
    theta_i, theta_o, phi = (x * 0.2 for x in ANGLES)
    value = jax.jit(lambda *x: evaluate_model(model(narrow), HAIR, *x))
    inside = value(theta_i, theta_o, phi)
    theta_i[0], theta_o[0] = -1.5, 1.5
    found = value(theta_i, theta_o, phi)
    np.testing.assert_array_equal(found[1:], inside[1:])


@pytest.mark.parametrize("sigma_a", [0.0, 1e-5, 1e-3, 0.1, 2.0])
def test_what_is_uniform_takes_few_polynomials(sigma_a):
    """However fast it changes at grazing."""
    few = Tabled((Span(None, 64, 23, 0),), 0.0, 1.0, NODES)
    wide, grazing = jnp.linspace(0, 1.5, 300), jnp.linspace(1.5, 1.5707, 300)
    theta_d = jnp.append(wide, grazing)

    def rest(rule):
        here = section(theta_d, jnp.asarray(1.55), jnp.asarray([sigma_a]))
        light = Attenuations(model(TOGETHER), (3,), here)
        seen = [Uniform(jnp.ones(()))]
        return rule.total(seen, light, jnp.ones(600), here, DETECTORS["normal"])

    found, exact = rest(few), rest(NODES)
    assert bool((found != exact).any())
    np.testing.assert_allclose(found, exact, rtol=0, atol=3e-4 * float(exact.max()))


def test_lobes_share_nodes_where_that_holds():
    rules = [(p, Planned(n, 1e-6, 0.1, 0.5)) for p, n in ((0, 20), (1, 16), (2, 17))]
    every = joined(rules, lambda group: True)
    assert every == (((1, 2, 0), Planned(20, 1e-6, 0.1, 0.5)),)
    some = joined(rules, lambda group: 0 not in group[0])
    assert {lobes for lobes, _ in some} == {(1, 2), (0,)}
    none = joined(rules, lambda group: False)
    assert {lobes for lobes, _ in none} == {(0,), (1,), (2,)}
    assert joined([(None, Closed(8))], lambda group: True) == (((None,), Closed(8)),)


@pytest.mark.parametrize("sigma_a", [None, 0.0, (0.0, 2.0), (0.5, 50.0)])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-9])
def test_averages_of_a_scene_are_good_a_priori(sigma_a, tolerance):
    """For absorption that no sample has: it is what asks for most."""
    ends = {"eta": (1.3, 1.8), "beta_m": 0.3, "beta_n": 0.3}
    scene = Scene(**ends, sigma_a=sigma_a, tolerance=1e-3)
    rule = Planned(enough(scene, tolerance), tolerance)
    theta_i = jnp.array([0.0, 1.0, 1.5])
    low, high = scene.ends("sigma_a")
    for eta in (1.3, 1.8):
        for some in np.clip([0, 1e-7, 1e-4, 1e-3, 0.01, 0.1, 1, 50], low, high):
            given = None if sigma_a is None else jnp.asarray(some)
            hair = fj.Fiber(jnp.asarray(eta), 0.3, 0.3, -0.03, given)
            found = fj.albedo(hair, theta_i, rule=rule)
            exact = fj.albedo(hair, theta_i, rule=fj.GaussGamma(300))
            np.testing.assert_allclose(found, exact, rtol=tolerance)


def test_few_directions_or_many_fibers_take_the_other_rule():
    few = [x[:8] for x in ANGLES]
    found = evaluate_model(model(apart(TABLE)), HAIR, *few)
    expected = evaluate_model(model(apart(NODES)), HAIR, *few)
    np.testing.assert_array_equal(found, expected)
    many = replace(HAIR, eta=jnp.full(2048, 1.55))
    found = evaluate_model(model(apart(TABLE)), many, *ANGLES)
    expected = evaluate_model(model(apart(NODES)), many, *ANGLES)
    np.testing.assert_array_equal(found, expected)


def test_the_closed_form_is_the_limit():
    """Exact but at TT's edge, and equal to N_smooth away from where R is blurred."""
    smooth = replace(HAIR, beta_n=1e-4)
    closed = Closed(8)
    for p in (0, 1):
        one = Model((p,), False, ByLobe((((p,), closed),), closed), "normal", "theta_d")
        found = evaluate_model(one, smooth, *ANGLES)
        exact = fj.lobe(smooth, p, *ANGLES)
        off = np.abs(found - exact) / float(exact.max())
        assert np.quantile(off, 0.98) < 1e-6
        assert off.max() < 1e-2
        theta_d = (ANGLES[1] - ANGLES[0]) / 2
        N = fj.N_smooth(p, ANGLES[2], theta_d, eta=1.55, sigma_a=smooth.sigma_a)
        M = exact / fj.N(
            p, ANGLES[2], theta_d, eta=1.55, sigma_a=smooth.sigma_a, beta_n=1e-4
        )
        calm = np.isfinite(M) & (exact > 1e-6)
        # Straight behind the fiber R is blurred.
        calm &= (p > 0) | (np.cos(ANGLES[2]) > -0.99)[:, None]
        np.testing.assert_allclose(found[calm], (M * N)[calm], rtol=1e-9)
        if p:
            wide = replace(smooth, beta_n=0.3)
            np.testing.assert_allclose(found, evaluate_model(one, wide, *ANGLES))


@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("beta_n", [1e-4, 1e-2])
def test_both_sides_of_R_meet_behind_the_fiber(beta_n, detector):
    """To the order of beta_n^2, and its derivative to the order of beta_n."""
    theta_d, phi = jnp.asarray([0.0, 0.8])[:, None], jnp.linspace(-8, 8, 161)
    phi = jnp.pi + beta_n * phi
    here = section(theta_d, jnp.asarray(1.55), None)
    one = Model((0,), False, NODES, "normal", "theta_d")

    def closed(beta_n):
        seen, light = [Seen(0, beta_n, jnp.ones(()))], Attenuations(one, (0,), here)
        return Closed(8).convolve(seen, light, phi, here, DETECTORS[detector])[..., 0]

    def exact(beta_n):
        given = {"eta": 1.55, "sigma_a": None, "beta_n": beta_n}
        return fj.N(0, phi, theta_d, **given, detector=detector)

    both = (
        jax.jvp(f, (jnp.asarray(beta_n),), (jnp.ones(()),)) for f in (closed, exact)
    )
    (found, slope), (right, steep) = both
    np.testing.assert_allclose(found, right, rtol=0, atol=0.5 * beta_n**2)
    np.testing.assert_allclose(slope, steep, rtol=0, atol=beta_n)


def test_the_spectrum():
    """Coefficients of a polynomial from its values."""
    x = np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    c = np.arange(1.0, 7)
    values = np.polynomial.chebyshev.chebval(x, c)
    np.testing.assert_allclose(spectrum(jnp.asarray(values)), c, rtol=1e-13)


def test_rules_as_data():
    rule = ByLobe((((0, 1), NODES), ((2,), TABLE), ((None,), Closed(8))), fj.auto(1e-3))
    assert from_data(json.loads(json.dumps(as_data(rule)))) == rule
    with pytest.raises(ValueError, match="rule = GaussH"):
        as_data(fj.GaussH())
    with pytest.raises(ValueError, match="rule = 'Simpson'"):
        from_data({"kind": "Simpson"})
