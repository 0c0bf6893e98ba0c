"""Draws over the whole domain, its ends included: every value and gradient is finite.

The rule is the default. The slow run makes LARGE, more than 1e6 draws, the fast one
SMALL of them; both add those of M.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj


class Failure(NamedTuple):
    """Points that are known to fail: "case dtype", and which groups of its points."""

    case: str
    where: Callable[[dict[str, Any]], np.ndarray]


KNOWN_FAILURES: dict[str, Failure] = {}
"""By what is wrong with them."""

POLE = np.pi / 2
PAST_POLE = float(np.float32(POLE))


class Draw:
    """Seeded draws of each quantity, of a shape."""

    def __init__(self, *seed: int):
        self.rng = np.random.default_rng(seed)

    def mixed(self, shape, *parts):
        """From the parts: each a share, and an array or a choice of numbers."""
        share = [part[0] for part in parts]
        arrays = [
            np.broadcast_to(
                x if isinstance(x, np.ndarray) else self.rng.choice(x, shape), shape
            )
            for _, x in parts
        ]
        return np.choose(self.rng.choice(len(parts), shape, p=share), arrays)

    def decades(self, low, high, shape):
        return 10 ** self.rng.uniform(low, high, shape)

    def inclination(self, shape):
        near = POLE - self.decades(-16, -1, shape)
        return self.mixed(
            shape,
            (0.6, self.rng.uniform(-POLE, POLE, shape)),
            (0.1, self.rng.choice([-1, 1], shape) * near),
            (0.15, (-POLE, POLE, -PAST_POLE, PAST_POLE)),
            (0.15, (0.0, 1e-9, -1e-9)),
        )

    def azimuth(self, shape):
        axis = np.pi * self.rng.integers(-1, 2, shape)
        return self.mixed(
            shape,
            (0.6, self.rng.uniform(-np.pi, np.pi, shape)),
            (0.2, (0.0, np.pi, -np.pi, 2 * np.pi)),
            (0.1, axis + self.decades(-16, -1, shape)),
            (0.1, self.rng.normal(0, 1, shape) * self.decades(0, 6, shape)),
        )

    def eta(self, shape):
        return self.mixed(
            shape,
            (0.4, self.rng.uniform(1, 3, shape)),
            (0.2, 1 + self.decades(-12, 0.3, shape)),
            (0.2, 1 + 2.0 ** -self.rng.integers(1, 53, shape)),
            (0.2, (1.0, 1.0, 1.0, 3.0)),
        )

    def roughness(self, lowest, shape):
        some = self.decades(np.log10(lowest), 2, shape)
        return self.mixed(shape, (0.9, some), (0.1, (lowest, 100.0)))

    def sigma_a(self, shape):
        some = self.decades(-6, 3, shape)
        return self.mixed(shape, (0.75, some), (0.25, (0.0, 0.0, 0.0, 1e3)))

    def tilt(self, shape):
        return self.mixed(
            shape,
            (0.5, self.rng.normal(0, 0.05, shape)),
            (0.3, self.rng.uniform(-1.5, 1.5, shape)),
            (0.2, (0.0,)),
        )

    def around(self, cone, beta_m):
        """Inclinations, a third of them near the cone."""
        near = cone + beta_m * self.rng.normal(0, 3, cone.shape)
        near = np.clip(near, -POLE, POLE)
        shape = cone.shape
        return self.mixed(shape, (0.33, near), (0.67, self.inclination(shape)))


def points_of_M(draw, groups, width):
    shape = (groups, width)
    cone = draw.inclination(shape) + draw.tilt(shape)
    beta_m = draw.roughness(1e-4, shape)
    theta_o = draw.around(cone, beta_m)
    return {"theta_cone": cone, "theta_o": theta_o, "v": beta_m**2}


def points_of_N(draw, groups, width):
    """A group shares its absorption."""
    shape = (groups, width)
    beta_n = draw.roughness(1e-6, shape).ravel()
    # Neighbors alike ask for few rules, as fibers do; a tenth of the groups for all.
    alike = groups * 9 // 10 * width
    beta_n[:alike] = np.sort(beta_n[:alike])
    return {
        "phi": draw.azimuth(shape),
        "theta_d": draw.inclination(shape),
        "eta": draw.eta(shape),
        "sigma_a": draw.sigma_a(groups),
        "beta_n": beta_n.reshape(shape),
    }


def points_of_fibers(draw, groups, width):
    """A group shares a fiber."""
    usual = fj.Fiber()
    fiber = fj.Fiber(
        draw.eta(groups),
        draw.roughness(1e-4, groups),
        draw.roughness(1e-6, groups),
        draw.tilt(groups),
        draw.sigma_a(groups),
        np.tile(usual.widths_m, (groups, 1)),
        np.tile(usual.widths_n, (groups, 1)),
        np.tile(usual.tilts, (groups, 1)),
    )
    theta_i = draw.inclination((groups, width))
    theta_o = draw.around(-theta_i, np.asarray(fiber.beta_m)[:, None])
    phi = draw.azimuth((groups, width))
    return {"fiber": fiber, "theta_i": theta_i, "theta_o": theta_o, "phi": phi}


def points_of_grids(draw, groups, width):
    """A group shares a fiber, and all of its inclinations share azimuths."""
    points = points_of_fibers(draw, groups, 4)
    points["theta_i"] = points["theta_i"][..., None]
    points["theta_o"] = points["theta_o"][..., None]
    return {**points, "phi": draw.azimuth((groups, 1, width // 4))}


class Case(NamedTuple):
    """A function, its points, how many share a group, and the lowest right value."""

    f: Callable
    points: Callable
    width: int
    lowest: float = 0.0


ALL = {"lobes": (0, 1, 2, 3)}
CASES = {
    "M": Case(fj.M, points_of_M, 1000),
    **{f"N{p}": Case(partial(fj.N, p), points_of_N, 256) for p in range(4)},
    "evaluate": Case(partial(fj.evaluate, **ALL), points_of_fibers, 64),
    # A cosine series is right to a share of its peak, and below 0 by that at most.
    "evaluate on grids": Case(
        partial(fj.evaluate, **ALL), points_of_grids, 64, -np.inf
    ),
    "evaluate at theta_i": Case(
        partial(fj.evaluate, incidence="theta_i", **ALL), points_of_fibers, 64
    ),
    "pdf": Case(fj.pdf, points_of_fibers, 64),
}
DTYPES = ("float32", "float64")
EASY = [("M", dtype, 200_000) for dtype in DTYPES]
SMALL = [
    ("N1", "float32", 50_000),
    ("N2", "float64", 30_000),
    ("evaluate", "float32", 20_000),
]
LARGE = [
    (name, dtype, 60_000 if name.startswith("N") else 75_000)
    for name in CASES
    if name != "M"
    for dtype in DTYPES
]


def slopes(f):
    """Values and gradients in everything, group by group."""

    def group(point):
        def total(point):
            value = f(**point)
            return value.sum(), value

        gradient, value = jax.grad(total, has_aux=True)(point)
        return value, gradient

    return jax.jit(lambda points: jax.lax.map(group, points))


def failing(case, points) -> np.ndarray:
    """Which groups have a value or gradient that is wrong."""
    value, gradient = slopes(case.f)(points)
    value = np.asarray(value).reshape(len(value), -1)
    bad = ~(value >= case.lowest).all(1)
    for array in (value, *jax.tree.leaves(gradient)):
        bad |= ~np.isfinite(array).reshape(len(array), -1).all(1)
    return bad


def unknown(name, points, bad) -> np.ndarray:
    """Which of the failing groups are in no entry of the table."""
    for what, known in KNOWN_FAILURES.items():
        if known.case == name:
            here = known.where(points)
            assert (bad & here).any(), f"{what}: fails no more"
            bad = bad & ~here
    return bad


def first(points, bad):
    """The numbers of the first failing group, by name."""
    leaves = jax.tree_util.tree_leaves_with_path(points)
    return {jax.tree_util.keystr(k): x[bad.argmax()].tolist() for k, x in leaves}


@pytest.mark.parametrize(
    ("name", "dtype", "count"),
    [*EASY, *SMALL, *(pytest.param(*case, marks=pytest.mark.slow) for case in LARGE)],
)
def test_values_and_gradients_are_finite(name, dtype, count):
    case = CASES[name]
    groups = -(-count // case.width)
    points = case.points(Draw(*name.encode(), count), groups, case.width)
    points = jax.tree.map(lambda x: jnp.asarray(x, dtype), points)
    bad = unknown(f"{name} {dtype}", points, failing(case, points))
    assert not bad.any(), (
        f"{bad.sum()} of {groups} groups fail, as {first(points, bad)}"
    )


def test_there_are_no_known_failures_of_other_cases():
    cases = {f"{name} {dtype}" for name, dtype, _ in LARGE + EASY}
    assert {known.case for known in KNOWN_FAILURES.values()} <= cases


def test_what_is_not_finite_is_seen(monkeypatch):
    """In a value, in a gradient, and in an entry of the table that is out of date."""
    x = jnp.asarray([[1.0, 4.0], [0.0, 1.0], [-1.0, 1.0], [2.0, 3.0]])
    bad = failing(Case(lambda x: jnp.sqrt(x), points_of_M, 2), {"x": x})
    np.testing.assert_array_equal(bad, [False, True, True, False])
    assert failing(Case(lambda x: x - 2, points_of_M, 2), {"x": x[:1]}).all()
    table = {"at 0": Failure("sqrt", lambda points: (points["x"] == 0).any(1))}
    monkeypatch.setitem(globals(), "KNOWN_FAILURES", table)
    found = unknown("sqrt", {"x": x}, bad)
    np.testing.assert_array_equal(found, [False, False, True, False])
    with pytest.raises(AssertionError, match="at 0: fails no more"):
        unknown("sqrt", {"x": x[2:]}, bad[2:])
