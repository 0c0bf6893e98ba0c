"""The README's example runs, and its numbers are those of the scripts."""

import csv
import json
import re
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import reference
from mpmath import mp

import fiberjax as fj

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "figures"))
advice = import_module("shared.advice").advice
TEXT = (ROOT / "README.md").read_text()
cost = fj.realtime.cost


def test_the_example_asserts_its_own_accuracy():
    code = "\n".join(re.findall(r"```python\n(.*?)```", TEXT, re.S))
    assert code.count("assert") >= 2
    exec(compile(code, "README.md", "exec"), {})


def test_the_table_of_rules():
    """It is the one that the script's numbers give."""
    with (ROOT / "figures" / "error_vs_time.csv").open(newline="") as file:
        assert advice(csv.DictReader(file)) in TEXT


def test_the_truth_of_the_example():
    (call,) = re.findall(r"fj\.N\((.*?)\)", TEXT)
    p, phi, theta_d, eta, sigma_a, beta_n = re.findall(r"[\d.]+", call)
    (shown,) = re.findall(r"abs\(N / (\S+) - 1\)", TEXT)
    numbers = [float(x) for x in (phi, theta_d, eta, sigma_a, beta_n)]
    with mp.workdps(50):
        exact: Any = reference.N(int(p), *numbers, detector="normal")
    assert float(shown) == float(exact)


def test_the_errors_against_the_lobes():
    for name, text in [("d_tt", "4.5 % to 172 %"), ("d_trt", "17 % to 283 %")]:
        assert text.replace(" ", "") in re.sub(r"\s", "", TEXT)
        low, high = (float(x.strip(" %")) / 100 for x in text.split("to"))
        entry = json.loads((ROOT / "fits" / "constants" / f"{name}.json").read_text())
        cells = entry["against_reference"]["cells"]
        errors = [cell["error"]["published"]["max"] for cell in cells]
        assert min(errors) == pytest.approx(low, rel=0.03)
        assert max(errors) == pytest.approx(high, rel=0.03)


def test_the_numbers_of_the_rest():
    folder = ROOT / "fits" / "constants"
    entry = json.loads((folder / "tail.json").read_text())
    cost = json.loads((ROOT / "src/fiberjax/data/operations.json").read_text())
    less, more = (cost[f"medium{name}"]["assembly"] for name in ("", "_rest"))
    at_85, one = entry["grazing"]["85 deg"], entry["furnace"]["one width"]
    pole, unseen = entry["grazing"]["90 deg"], entry["unseen"]
    text = " ".join(TEXT.split())
    for shown in (
        f"are {100 * at_85['exact']:.1f} % of the light",
        f"{more['special'] - less['special']} special and "
        f"{more['other'] - less['other']} other operations",
        f"and {100 * at_85['this']:.1f} % there",
        f"at most {100 * one['without']:.1f} % of its light without it",
        f"{100 * one['this']:.1f} % of its light is off",
        f"by {100 * unseen['relative L2']:.1f} % in L2",
        f"(at most {100 * unseen['largest']:.1f} %)",
        f"at most {unseen['albedo']:.3f} to 89 deg",
        f"at 90 deg that is {pole['this'] - pole['exact']:.3f}",
    ):
        assert shown in text, shown


def test_what_is_said_of_the_tiers_first():
    judged = json.loads((ROOT / "fits" / "quality.json").read_text())
    errors = {
        tier: 100 * judged[tier]["path"]["theta_t"]["mean"]["S"]
        for tier in fj.realtime.TIERS
    }
    karis, *ours = errors.values()
    totals = [4 * special + other for special, other in map(cost, fj.realtime.TIERS)]
    times = [total / totals[0] for total in totals[1:]]
    text = " ".join(TEXT.split())
    assert f"off by {min(ours):.1f} % to {max(ours):.1f} % in place of" in text
    assert f"the {karis:.0f} % of what engines use" in text
    assert f"at {min(times):.2f} to {max(times):.2f} times its operations" in text


@pytest.mark.parametrize("name", ["eta_prime", "h_tt", "d_tt", "d_trt"])
def test_the_table_of_constants(name):
    (row,) = (line for line in TEXT.splitlines() if line.startswith(f"| `{name}.py`"))
    *_, published, least_squares, minimax, errors, _ = row.split("|")
    entry = json.loads((ROOT / "fits" / "constants" / f"{name}.json").read_text())
    constants = {"published": entry["published"], **entry["constants"]}
    shown = {"published": published, "least_squares": least_squares, "minimax": minimax}
    for kind, text in shown.items():
        assert text.strip() == ", ".join(f"{x:.6g}" for x in constants[kind].values())
    found = ", ".join(f"{100 * entry['error'][kind]['max']:.2f} %" for kind in shown)
    assert errors.strip() == found


def test_the_range_of_the_furnace():
    with (ROOT / "figures" / "furnace.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["incidence"] == "theta_d"]
    albedo = [float(r["albedo"]) for r in rows]
    assert f"between {min(albedo):.3f} and {max(albedo):.3f}" in TEXT.replace("\n", " ")


def test_the_numbers_of_the_color():
    low, high = fj.absorption.reach(fj.Fiber())
    assert f"from {low:.3f} to {high:.3f} on average" in " ".join(TEXT.split())


def test_every_picture_and_file_named_exists():
    for path in re.findall(r"\]\((figures/[^)]+)\)", TEXT):
        assert (ROOT / path).exists(), path
    named = set(re.findall(r"`(\w+\.py)`", TEXT.split("## Files")[1]))
    files = {path.name for path in (ROOT / "src" / "fiberjax").glob("*.py")}
    assert files - {"__init__.py"} == named
    for target in re.findall(r"`make ([a-z-]+)`", TEXT):
        assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.M), target
