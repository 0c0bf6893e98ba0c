"""The rules of plans, each against the rule that has all digits."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj
from fiberjax.farfield import evaluate_model
from fiberjax.model import Model
from fiberjax.planned import ByLobe, Closed, Planned, as_data, from_data
from fiberjax.tabled import Span, Tabled, spectrum

HAIR = fj.Fiber(1.55, 0.2, 0.3, -0.03, (0.3, 1.2))
NODES = Planned(64, 1e-16, 0.3, 0.3, 40)


def table(degree, low, high):
    """Tables of all parts, for cosines of a range."""
    spans = (*(Span(p, 64, degree, 40) for p in (0, 1, 2)), Span(None, 64, degree, 0))
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


def test_few_directions_or_many_fibers_take_the_other_rule():
    few = [x[:8] for x in ANGLES]
    found = evaluate_model(model(apart(TABLE)), HAIR, *few)
    expected = evaluate_model(model(apart(NODES)), HAIR, *few)
    np.testing.assert_array_equal(found, expected)


def test_the_closed_form_is_the_limit():
    """Off by less than beta_n away from TT's edge, and equal to N_smooth."""
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
        wide = replace(smooth, beta_n=0.3)
        np.testing.assert_allclose(found, evaluate_model(one, wide, *ANGLES))
        M = exact / fj.N(
            p, ANGLES[2], theta_d, eta=1.55, sigma_a=smooth.sigma_a, beta_n=1e-4
        )
        calm = np.isfinite(M) & (exact > 1e-6)
        np.testing.assert_allclose(found[calm], (M * N)[calm], rtol=1e-9)


def test_the_spectrum():
    """Coefficients of a polynomial from its values."""
    x = np.cos(np.pi * (np.arange(6) + 0.5) / 6)
    c = np.arange(1.0, 7)
    values = np.polynomial.chebyshev.chebval(x, c)
    np.testing.assert_allclose(spectrum(jnp.asarray(values)), c, rtol=1e-13)


def test_rules_as_data():
    rule = ByLobe((((0, 1), NODES), ((2,), TABLE), ((None,), Closed(8))), fj.auto(1e-3))
    assert from_data(as_data(rule)) == rule
    with pytest.raises(ValueError, match="rule = GaussH"):
        as_data(fj.GaussH())
    with pytest.raises(ValueError, match="rule = 'Simpson'"):
        from_data({"kind": "Simpson"})
