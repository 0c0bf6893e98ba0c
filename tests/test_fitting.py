"""The fitting tools on problems with known answers."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fiberjax.approximation import FitError, Problem, measure, simpson, to_float32
from fiberjax.fitting import least_squares, minimax


class Line(NamedTuple):
    slope: float
    offset: float


class Number(NamedTuple):
    value: float


def line(k, x):
    return k.slope * x + k.offset


def coordinate(x):
    return {"x": x[..., 0]}


def problem(error, constants: Callable = Line, **more):
    return Problem(constants, error, coordinate, *simpson((0, 1, 33)), **more)


PARABOLA = problem(lambda k, x: line(k, x) - x**2)
BELOW = PARABOLA._replace(constraint=lambda k, x: line(k, x) - x**2)
EXPONENTIAL = problem(lambda k, x: jnp.exp(line(k, x)) - jnp.exp(2 * x - 1))
LOGARITHM = problem(lambda k, x: jnp.log(k.slope * (x + 1)) + k.offset - x)


def test_simpson_is_exact_for_cubics_on_a_box():
    points, weights, steps = simpson((0, 1, 5), (-1, 3, 3))
    x, y = points.T
    assert weights @ (x**3 * y**2) == pytest.approx(1 / 4 * 28 / 3 / 4, rel=1e-14)
    assert steps.tolist() == [0.25, 2.0]


@pytest.mark.parametrize("n", [1, 2, 4])
def test_simpson_needs_an_odd_number_of_points(n):
    with pytest.raises(ValueError, match=f"{n} points, must be an odd number >= 3"):
        simpson((0, 1, n))


def test_measure_finds_a_peak_between_points():
    m = measure(problem(lambda k, x: k.slope - (x - 0.4142) ** 2), (1.0, 0.0))
    assert float(m.max) == pytest.approx(1, abs=1e-14)
    assert float(m.at[0]) == pytest.approx(0.4142, abs=1e-7)


def test_measure_finds_the_higher_of_two_peaks_that_the_grid_ranks_wrongly():
    def error(k, x):
        low, high = jnp.abs(x - 0.25), jnp.abs(x - 0.765625)
        return jax.nn.relu(jnp.maximum(0.9 - 4 * low, k.slope - 40 * high))

    assert float(measure(problem(error), (1.0, 0.0)).max) == pytest.approx(1)


@pytest.mark.parametrize("fit", [lambda p, k: least_squares(p, [k]), minimax])
@pytest.mark.parametrize("start", [(0.0, 0.0), (5.0, -3.0), (-2.0, 1.0)])
def test_known_constants_are_recovered(fit, start):
    found = fit(EXPONENTIAL, start)
    assert getattr(found, "k", found) == pytest.approx([2, -1], abs=1e-9)


def test_least_squares_line():
    k = least_squares(PARABOLA, [(0.0, 0.0)])
    assert k == pytest.approx([1, -1 / 6], abs=1e-10)
    assert float(measure(PARABOLA, k).rms) == pytest.approx(180**-0.5, rel=1e-4)


def test_minimax_line_and_its_proof():
    fit = minimax(PARABOLA, (0.0, 0.0))
    order = np.argsort(fit.points[:, 0])
    assert fit.k == pytest.approx([1, -1 / 8], abs=1e-12)
    assert fit.bound == pytest.approx(1 / 8, abs=1e-13)
    assert fit.reached == pytest.approx(1 / 8, abs=1e-12)
    assert fit.points[order, 0] == pytest.approx([0, 0.5, 1], abs=1e-6)
    assert fit.signs[order].tolist() == [-1, 1, -1]
    assert fit.multipliers[order] == pytest.approx([0.25, 0.5, 0.25], abs=1e-6)


def test_minimax_under_a_constraint():
    fit = minimax(BELOW, (0.0, 0.0))
    assert fit.k == pytest.approx([1, -1 / 4], abs=1e-6)
    assert fit.bound == pytest.approx(1 / 4, abs=1e-12)
    assert sorted(fit.signs) == [-1, -1, 0]


def test_least_squares_under_a_constraint():
    # Tangents of x^2 lie below it; that at m has the error (x - m)^2.
    k = least_squares(BELOW, [(0.0, 0.0)])
    assert k == pytest.approx([1, -1 / 4], abs=1e-6)
    assert float(measure(BELOW, k).constraint) < 1e-9


def test_bad_starts_do_not_spoil_good_ones():
    k = least_squares(LOGARITHM, [(-1.0, 0.0), (1.0, 0.0)])
    assert np.isfinite(k).all()


def test_every_reason_is_given():
    with pytest.raises(FitError) as failure:
        least_squares(LOGARITHM, [(-1.0, 0.0), (-2.0, 0.5)])
    reasons = str(failure.value).split("; ")
    assert [r.split(": ")[0] for r in reasons] == [
        "from (-1.0, 0.0)",
        "from (-2.0, 0.5)",
    ]
    assert all("the error is not finite" in reason for reason in reasons)


def test_least_squares_that_runs_out_of_steps_fails():
    with pytest.raises(FitError, match=r"least squares: .*number of steps"):
        least_squares(EXPONENTIAL, [(0.0, 0.0)], max_steps=2)


def test_minimax_that_runs_out_of_steps_fails():
    with pytest.raises(FitError, match=r"minimax: .*number of steps"):
        minimax(EXPONENTIAL, (5.0, -3.0), max_steps=1)


def test_minimax_from_where_the_error_is_not_a_number_fails():
    with pytest.raises(FitError, match="not finite"):
        minimax(LOGARITHM, (-1.0, 0.0))


def test_redundant_constants_have_no_minimax_proof():
    redundant = problem(lambda k, x: (k.slope + k.offset) * x - x**2)
    with pytest.raises(FitError, match="no set of points bounds"):
        minimax(redundant, (0.0, 0.0))


def test_a_constraint_that_nothing_meets_fails():
    impossible = PARABOLA._replace(constraint=lambda k, x: 1 + 0 * x)
    with pytest.raises(FitError, match="constraint is not met"):
        least_squares(impossible, [(0.0, 0.0)])


def test_float32_neighbor_on_the_allowed_side():
    # float32(0.1) is above 0.1.
    limited = problem(
        lambda k, x: k.value - 1 + 0 * x,
        Number,
        constraint=lambda k, x: k.value - 0.1 + 0 * x,
    )
    (k,) = to_float32(limited, [0.1], lambda m: m.max)
    assert k == np.nextafter(np.float32(0.1), np.float32(0))


def test_float32_without_an_allowed_neighbor_fails():
    limited = problem(
        lambda k, x: k.value + 0 * x, Number, constraint=lambda k, x: 1 + 0 * x
    )
    with pytest.raises(FitError, match="no float32 neighbor"):
        to_float32(limited, [0.1], lambda m: m.max)


@pytest.mark.parametrize("fit", [lambda p, k: least_squares(p, [k]), minimax])
def test_float64_is_required(fit):
    with (
        jax.enable_x64(False),
        pytest.raises(ValueError, match="jax_enable_x64 is off"),
    ):
        fit(PARABOLA, (0.0, 0.0))
