"""The figure scripts, what they draw and the numbers they write."""

import csv
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

import fiberjax

FIGURES = Path(__file__).parents[1] / "figures"
sys.path.insert(0, str(FIGURES))
NAMES = (
    "error_vs_time",
    "fits",
    "fits_against_lobes",
    "furnace",
    "lobes",
    "stability",
    "tilt",
    "variance",
)
TABLES = ("error_vs_time", "furnace", "stability", "variance")
# Times differ from run to run, and one takes minutes and has tests of its own.
REPRODUCIBLE = tuple(
    name for name in NAMES if name not in ("error_vs_time", "stability", "variance")
)
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
# Names that hash what they name, down to its last bit.
HASH = re.compile(r'(?<=["#])[a-z][0-9a-f]{10}(?=[")])')


def script(name):
    return import_module(name)


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_script_is_tested():
    assert {path.stem for path in FIGURES.glob("*.py")} == set(NAMES)
    drawn = {path.name for path in FIGURES.iterdir() if path.suffix in (".svg", ".csv")}
    assert drawn == {f"{n}.svg" for n in NAMES} | {f"{n}.csv" for n in TABLES}


@pytest.mark.parametrize("name", NAMES)
def test_help(name, capsys):
    with pytest.raises(SystemExit) as stop:
        script(name).main(["--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    assert "--output DIR" in text
    doc = script(name).__doc__
    assert doc
    assert doc.strip() in text


@pytest.mark.parametrize("name", NAMES)
def test_committed_svg(name):
    text = (FIGURES / f"{name}.svg").read_text()
    assert len(text) < 400_000
    assert "<title>" in text
    assert "dc:date" not in text
    # Names of formats aside, it refers to nothing outside itself.
    hosts = set(re.findall(r"https?://([^/\"]*)", text))
    assert hosts == {"www.w3.org", "purl.org", "creativecommons.org"}


@pytest.mark.parametrize("name", REPRODUCIBLE)
def test_a_rerun_writes_the_same(name, tmp_path):
    for folder in ("once", "again"):
        script(name).main(["--output", str(tmp_path / folder)])
    written = sorted(path.name for path in (tmp_path / "once").iterdir())
    assert written == [f"{name}.csv"] * (name in TABLES) + [f"{name}.svg"]
    for file in written:
        once, again = (tmp_path / folder / file for folder in ("once", "again"))
        assert once.read_bytes() == again.read_bytes()
    new, old = (
        HASH.sub("", (folder / f"{name}.svg").read_text())
        for folder in (tmp_path / "once", FIGURES)
    )
    assert NUMBER.sub("", new) == NUMBER.sub("", old)
    drawn, committed = (np.array(NUMBER.findall(text), float) for text in (new, old))
    np.testing.assert_allclose(drawn, committed, rtol=0, atol=0.01)


def test_a_script_is_silent_in_a_pipe(tmp_path):
    ran = subprocess.run(
        [sys.executable, FIGURES / "tilt.py", "--output", tmp_path],
        cwd=tmp_path,
        capture_output=True,
        check=True,
    )
    assert ran.stdout == ran.stderr == b""
    assert [path.name for path in tmp_path.iterdir()] == ["tilt.svg"]


def clear(**values):
    return fiberjax.Fiber(eta=1.55, sigma_a=None, **values)


def test_furnace_table():
    table = rows(FIGURES / "furnace.csv")
    columns = {
        k: np.array([float(row[k]) for row in table]) for k in list(table[0])[1:]
    }
    incidence = np.array([row["incidence"] for row in table])
    groups = {"theta_d": incidence == "theta_d", "theta_i": incidence == "theta_i"}
    assert np.abs(columns["albedo"][groups["theta_i"]] - 1).max() < 1e-12
    spread = columns["albedo"][groups["theta_d"]]
    assert 0.72 < spread.min() < 0.725
    assert 1.13 < spread.max() < 1.135
    assert columns["theta_i_deg"].min() == -89.9
    assert columns["theta_i_deg"].max() == 89.9
    for name, group in groups.items():
        for beta_m in np.unique(columns["beta_m"]):
            for alpha in np.unique(columns["alpha_deg"]):
                here = group & (columns["beta_m"] == beta_m)
                here &= columns["alpha_deg"] == alpha
                # Another rule and other sums than the script's.
                fiber = clear(beta_m=beta_m, alpha=np.radians(alpha))
                theta_i = np.radians(columns["theta_i_deg"][here])
                choices = {"incidence": name, "rule": fiberjax.GaussGamma(80)}
                whole = fiberjax.albedo(fiber, theta_i, **choices)
                lobes = fiberjax.albedo(fiber, theta_i, rest=False, **choices)
                for key, value in (("albedo", whole), ("rest", whole - lobes)):
                    np.testing.assert_allclose(columns[key][here], value, atol=1e-9)


def error_columns(**wanted):
    table = rows(FIGURES / "error_vs_time.csv")
    return [row for row in table if all(row[k] == v for k, v in wanted.items())]


def by_gamma(gamma, p, phi, beta_n):
    """A cos(gamma) (D(phi - Phi) + D(phi + Phi))/2 at theta_d = 30 degrees."""
    eta, cos_d = (
        np.float64(np.float32(1.55)),
        np.cos(np.float32(np.pi / 6), dtype=float),
    )
    mu = cos_d * np.cos(gamma)
    nu = np.sqrt(1 - (1 - mu**2) / eta**2)
    r_s, r_p = (mu - eta * nu) / (mu + eta * nu), (eta * mu - nu) / (eta * mu + nu)
    f = (r_s**2 + r_p**2) / 2
    a = f if p == 0 else (1 - f) ** 2 * f ** (p - 1)
    eta_p = np.sqrt(eta**2 - 1 + cos_d**2) / cos_d
    turned = 2 * p * np.arcsin(np.sin(gamma) / eta_p) - 2 * gamma
    turns = 2 * np.pi * np.arange(-4, 5)
    x = np.concatenate([phi - p * np.pi + s * turned + turns for s in (-1, 1)])
    density = np.exp(-((x / beta_n) ** 2) / 2).sum() / (beta_n * np.sqrt(2 * np.pi))
    return a * density * np.cos(gamma) / 2


@pytest.mark.parametrize("p", [0, 1, 2])
def test_errors_of_the_rules(p):
    figure = script("error_vs_time")
    grid = figure.grid("float64")
    truth = np.asarray(figure.by_rule(figure.TRUTH, p, *grid))
    closer = np.asarray(figure.by_rule(fiberjax.GaussGamma(400), p, *grid))
    assert figure.errors(closer, truth).max() < 2e-14
    for k, beta_n in enumerate(figure.BETA_N):
        # In gamma, where quad needs few intervals.
        for phi in figure.PROBES[::4]:
            place = p, float(phi), float(np.float32(beta_n))
            exact = quad(by_gamma, 0, np.pi / 2, place, epsabs=1e-14, epsrel=1e-13)[0]
            ours = truth[k, 1][phi == figure.PHI][0]
            assert abs(exact - ours) < 1e-13 * truth[k, 1].max()
    for rule in (figure.TEXTBOOK, fiberjax.GaussGamma(24)):
        measured = figure.errors(figure.by_rule(rule, p, *grid), truth)
        written = error_columns(
            rule=type(rule).__name__,
            order=str(rule.order),
            dtype="float64",
            lobe=("R", "TT", "TRT")[p],
        )
        assert [float(row["beta_n"]) for row in written] == list(figure.BETA_N)
        errors = [float(row["error"]) for row in written]
        np.testing.assert_allclose(errors, measured, rtol=0, atol=1e-9)


def test_the_error_table_is_whole():
    figure = script("error_vs_time")
    for lobe in ("R", "TT", "TRT"):
        for beta_n in figure.BETA_N:
            written = error_columns(lobe=lobe, beta_n=str(beta_n))
            keys = {(row["rule"], row["order"], row["dtype"]) for row in written}
            expected = {
                (type(rule).__name__, str(rule.order), dtype)
                for dtype, rules in figure.RULES.items()
                for rule in rules
            }
            assert keys == expected | {("quad", "", "float64")}
            assert all(float(row["ns_per_value"]) > 0 for row in written)


@pytest.mark.slow
def test_error_vs_time_runs(tmp_path):
    script("error_vs_time").main(["--output", str(tmp_path)])
    new, old = (rows(folder / "error_vs_time.csv") for folder in (tmp_path, FIGURES))
    assert (tmp_path / "error_vs_time.svg").exists()
    for row, before in zip(new, old, strict=True):
        for key in ("rule", "order", "dtype", "lobe", "beta_n"):
            assert row[key] == before[key]
        # Rounding in float32 may differ between machines.
        tolerance = 1e-9 if row["dtype"] == "float64" else 3e-6
        assert abs(float(row["error"]) - float(before["error"])) < tolerance


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def test_traced_ray_obeys_snell():
    tilt = script("tilt")
    for h in (-0.95, -0.3, 0.0, tilt.H):
        points, exits = tilt.traced(h)
        leaving = [tilt.page(phi) for phi in exits]
        # Light comes from the left, and h counts upwards.
        arriving, entry = np.array([1.0, 0.0]), points[0]
        assert entry == pytest.approx([-np.sqrt(1 - h * h), h])
        mirrored = arriving - 2 * (arriving @ entry) * entry
        assert leaving[0] == pytest.approx(mirrored)
        before = cross(entry, arriving)
        for start, end, out in zip(points, points[1:], leaving[1:], strict=False):
            chord = (end - start) / np.linalg.norm(end - start)
            # The part along the surface is eta times as large outside.
            assert tilt.ETA * cross(start, chord) == pytest.approx(before)
            assert tilt.ETA * cross(end, chord) == pytest.approx(cross(end, out))
            assert out @ end > 0
            before = cross(end, out)


def test_drawn_cones_are_those_of_tilted_mirrors():
    tilt = script("tilt")
    alpha = tilt.ALPHA
    down, normal = np.array([0.0, -1.0]), tilt.direction(alpha)
    mirrored = down - 2 * (down @ normal) * normal
    assert tilt.direction(tilt.specular(0.0, alpha, 0)) == pytest.approx(mirrored)
    assert tilt.specular(0.0, alpha, 1) == pytest.approx(-alpha)
    assert tilt.specular(0.0, alpha, 2) == pytest.approx(-4 * alpha)
    assert tilt.specular(tilt.THETA_I, 0.0, 0) == pytest.approx(-tilt.THETA_I)
