"""The error maps: their truth, the committed numbers and where those come from."""

import csv
import json
import sys
from collections import defaultdict
from importlib import import_module
from pathlib import Path

import jax
import numpy as np
import pytest

TESTS = Path(__file__).parent
FIGURES = TESTS.parent / "figures"
sys.path.insert(0, str(FIGURES))

stability = import_module("stability")
precise = import_module("shared.precise")

COLUMNS = stability.COLUMNS
MAPS = {plan.name: plan for plan in stability.MAPS}
# Closer to eta = 1 the textbook's errors are rounding, on which machines differ.
FIRST = {"roughness": 0, "variance": 0, "index": 20, "index_narrow": 20}
WIDTHS = {
    "variance": 1.0,
    "index": stability.MODERATE,
    "index_narrow": stability.SMALL,
}
needs_truth = pytest.mark.skipif(
    np.finfo(precise.WIDE).eps > 1e-18, reason="longdouble is no wider than double"
)


def points(name):
    return json.loads((TESTS / "tables" / f"{name}.json").read_text())["points"]


def exact(point, names):
    texts = [point["value"], *(point["grad"].get(name, "nan") for name in names)]
    return [precise.WIDE(text) for text in texts]


def read(folder):
    """Errors by map, shape (quantities, pixels, forms and dtypes)."""
    lines = defaultdict(list)
    with (folder / "stability.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            lines[row["map"]].append([float(row["_".join(key)]) for key in COLUMNS])
    shapes = {name: len(plan.equation.quantities) for name, plan in MAPS.items()}
    return {
        name: np.reshape(found, (shapes[name], -1, len(COLUMNS)))
        for name, found in lines.items()
    }


@pytest.fixture(scope="module")
def committed():
    return read(FIGURES)


def sample(name):
    """Numbers of a few pixels of a map, and their places."""
    x, y = stability.pixels(MAPS[name])
    column = np.arange(len(x)) % len(MAPS[name].x.values)
    some = np.flatnonzero(column >= FIRST[name])
    some = some[:: len(some) // 6]
    return some, x[some], y[some]


def check(name, x, new, old, dtype, steep=2):
    """Equal to half a decade, or both no more than rounding at random.

    For derivatives rounding grows as the inverse square of the roughness: steep = 2.
    """
    np.testing.assert_array_equal(np.isnan(new), np.isnan(old))
    beta_n = np.minimum(10.0**x, 1) if name == "roughness" else WIDTHS[name]
    noise = np.log10(200 * np.finfo(dtype).eps / beta_n**steep)
    near = (np.abs(new - old) <= 0.5) | np.isnan(old)
    assert (near | (np.maximum(new, old) < noise)).all()


@needs_truth
@pytest.mark.parametrize("p", [0, 1, 2, 4])
def test_truth_of_N(p):
    names = precise.Points._fields
    table = [q for q in points("N") if q["in"]["p"] == p]
    given = np.array([[float(q["in"][name]) for name in names] for q in table]).T
    found = precise.N(p, precise.Points(*given.astype(precise.WIDE)))
    truth = np.array([exact(q, names) for q in table]).T
    keys = ("value", *names)
    peaks = [[precise.WIDE(q["peak"].get(k, 0)) for q in table] for k in keys]
    size = np.maximum(peaks, peaks[0])
    known = ~np.isnan(truth)
    assert known.sum() > 50
    wrong = np.abs(found - truth)[known]
    assert (wrong <= 2e-17 * np.maximum(size[known], 1e-290)).all()
    sought = precise.N_peaks(p, precise.Points(*given))
    sought, there = np.maximum(sought, sought[0]), size > 1e-30
    np.testing.assert_allclose(sought[there], size[there].astype(float), rtol=0.05)


@needs_truth
def test_truth_of_M():
    names = tuple(stability.M.arguments)
    table = points("M")
    given = np.array([[float(q["in"][name]) for name in names] for q in table]).T
    truth = np.array([exact(q, names) for q in table]).T
    scale = precise.M_scales(*given)
    wrong = np.abs(precise.M(*given) - truth) / np.maximum(scale, 1e-290)
    assert wrong.max() < 1e-18


def test_truth_needs_more_than_double(monkeypatch):
    monkeypatch.setattr(precise, "WIDE", np.float64)
    with pytest.raises(RuntimeError, match="longdouble"):
        precise.require_wide()


def test_the_table_is_whole(committed):
    assert set(committed) == set(MAPS)
    for name, plan in MAPS.items():
        assert committed[name].shape[1] == len(plan.x.values) * len(plan.y.values)


def test_every_number_of_ours_is_finite(committed):
    ours = [key[0] == "ours" for key in COLUMNS]
    for name in MAPS:
        assert np.isfinite(committed[name][..., ours]).all()
        assert committed[name][..., ours].min() >= stability.FLOOR
    # And the table can tell.
    assert np.isnan(committed["variance"][..., ~np.array(ours)]).any()


def test_M_is_right_everywhere(committed):
    for k, (form, dtype) in enumerate(COLUMNS):
        if form == "ours":
            worst = committed["variance"][..., k].max()
            assert worst <= np.log10(5 * np.finfo(dtype).eps)


@needs_truth
@pytest.mark.parametrize("name", MAPS)
def test_recomputed_pixels(committed, name):
    some, x, y = sample(name)
    # The derivatives of our N take long to compile.
    columns = COLUMNS if name == "variance" else COLUMNS[2:]
    found = stability.errors(MAPS[name], x, y, columns)
    for key in columns:
        old = committed[name][:, some, COLUMNS.index(key)]
        check(name, x, found[key], old, key[1])


@needs_truth
def test_recomputed_values_of_ours(committed):
    some, x, y = sample("roughness")
    given = stability.by_roughness(x, y, "float64")
    arguments = given.reshape(len(given), -1)
    exact, scale = stability.exact_N(arguments)
    value = np.asarray(jax.jit(jax.vmap(stability.our_N))(*arguments))
    worst = (np.abs(value - exact[0]) / scale[0]).reshape(given.shape[1:]).max(axis=0)
    old = committed["roughness"][0, some, 0]
    check("roughness", x, stability.logarithm(worst), old, "float64", steep=1)


@needs_truth
@pytest.mark.slow
def test_a_rerun_writes_the_same(committed, tmp_path):
    for folder in ("once", "again"):
        stability.main(["--output", str(tmp_path / folder)])
    for name in ("stability.csv", "stability.svg"):
        once, again = (tmp_path / folder / name for folder in ("once", "again"))
        assert once.read_bytes() == again.read_bytes()
    rerun = read(tmp_path / "once")
    for name, plan in MAPS.items():
        x = stability.pixels(plan)[0]
        for k, (_, dtype) in enumerate(COLUMNS[:2]):
            new, old = rerun[name][..., k], committed[name][..., k]
            check(name, x, new, old, dtype)
