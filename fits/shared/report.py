"""What every fit script does with its study: fit, check, print, write."""

import argparse
import itertools
import json
import re
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from shared import independent

from fiberjax.approximation import FitError, Problem, measure, to_float32
from fiberjax.fitting import STEPS, Minimax, least_squares, minimax

CONSTANTS = Path(__file__).parents[1] / "constants"
AGREEMENT = 1e-4
KINDS = {1: "error = +bound", -1: "error = -bound", 0: "constraint active"}


class Claim(NamedTuple):
    """What a source says, what is measured, and whether it holds."""

    claim: str
    measured: str
    holds: bool


class Study(NamedTuple):
    """One set of constants and everything there is to say about it.

    Args:
        name: stem of the file of constants.
        form: the approximation, in words.
        norm: what its error means.
        domain: where.
        published: the published constants.
        problem: error and constraint.
        place: from a point x to the variables a reader wants to see.
        check: scipy's name and least largest error, one of `shared.independent`.
        also: further quantities, each a function of the constants.
        claims: what the sources say, given the finished entry.
        further: more entries for the file, and lines for the table.
    """

    name: str
    form: str
    norm: str
    domain: str
    published: Any
    problem: Problem
    place: Callable[[Any], dict[str, Any]]
    check: Callable[[Problem, Sequence[float]], tuple[str, float]]
    also: dict[str, Callable[[Any], Any]]
    claims: Callable[[dict[str, Any]], list[Claim]] = lambda entry: []
    further: Callable[[int], tuple[dict[str, Any], list[str]]] = lambda steps: ({}, [])


def rounded(x: Any, digits: int = 6) -> float:
    """Few enough digits that a rerun on another machine gives the same."""
    return float(f"{float(x):.{digits}g}")


def placed(place: dict[str, Any]) -> dict[str, float]:
    """Coordinates as written: a flat peak has no more digits. No -0."""
    return {name: round(float(x), 4) + 0.0 for name, x in place.items()}


def fit(problem: Problem, start: Any, max_steps: int) -> tuple[dict[str, Any], Minimax]:
    """Both sets of constants as float32 holds them, and the minimax evidence."""
    least = least_squares(problem, [start], max_steps=max_steps)
    best = minimax(problem, least, max_steps=max_steps)
    constants = {
        "least_squares": to_float32(problem, least, lambda m: m.rms),
        "minimax": to_float32(problem, best.k, lambda m: m.max),
    }
    named = {s: problem.constants(*map(float, k)) for s, k in constants.items()}
    return named, best


def errors(problem: Problem, place: Callable, k: Sequence[float]) -> dict[str, Any]:
    """Largest error, root mean square and where, of constants k."""
    at = measure(problem, np.asarray(k, float)).at
    return {**summary(problem, k), "max_at": placed(place(at))}


def summary(problem: Problem, k: Any) -> dict[str, float]:
    """Largest error and root mean square of constants k."""
    m = measure(problem, np.asarray(k, float))
    if not np.isfinite([m.max, m.rms]).all():
        raise FitError(f"the error of constants {tuple(k)} is not finite")
    return {"max": rounded(m.max), "rms": rounded(m.rms)}


def certificate(study: Study, best: Minimax) -> dict[str, Any]:
    """The lower bound of the largest error and the points that prove it."""
    points = [
        {
            "at": placed(study.place(x)),
            "kind": KINDS[int(sign)],
            "multiplier": rounded(multiplier, 4),
        }
        for x, sign, multiplier in zip(
            best.points, best.signs, best.multipliers, strict=True
        )
    ]
    points.sort(key=lambda point: tuple(point["at"].values()))
    if len(points[0]["at"]) == 1:
        kinds = [point["kind"] for point in points]
        if any(a == b for a, b in itertools.pairwise(kinds)):
            raise FitError(f"minimax: the signs of the error do not alternate, {kinds}")
    return {"bound": rounded(best.bound), "points": points}


def check(study: Study, entry: dict[str, Any]) -> dict[str, Any]:
    """What scipy reaches from the published constants; FitError where it differs."""
    found = {}
    for name, method, quantity in (
        ("least_squares", independent.least_squares, "rms"),
        ("minimax", study.check, "max"),
    ):
        by, theirs = method(study.problem, study.published)
        ours = entry["error"][name][quantity]
        if not abs(ours - theirs) <= AGREEMENT * theirs:
            raise FitError(f"{name}: {quantity} error {ours}, scipy {by} {theirs:.6g}")
        found[name] = {"method": f"scipy {by}", quantity: rounded(theirs, 4)}
    return found


def measured(study: Study, max_steps: int) -> tuple[dict[str, Any], list[str]]:
    """The whole entry of the file, and further lines for the table."""
    constants, best = fit(study.problem, study.published, max_steps)
    sets = {"published": study.published, **constants}
    more, lines = study.further(max_steps)
    entry = {
        "form": study.form,
        "constants": {name: k._asdict() for name, k in constants.items()},
        "published": study.published._asdict(),
        "error": {
            name: errors(study.problem, study.place, k) for name, k in sets.items()
        },
        "in half": {
            name: summary(study.problem, np.asarray(k, np.float16))
            for name, k in sets.items()
        },
        "norm": study.norm,
        "domain": study.domain,
        "also": {
            what: {name: rounded(f(k)) for name, k in sets.items()}
            for what, f in study.also.items()
        },
        "certificate": certificate(study, best),
    }
    entry["check"] = check(study, entry)
    entry["claims"] = [claim._asdict() for claim in study.claims(entry)]
    packages = ("fiberjax", "jax", "numpy", "optimistix", "scipy")
    entry |= more | {"versions": {package: version(package) for package in packages}}
    return entry, lines


def table(study: Study, entry: dict[str, Any]) -> list[str]:
    """Published beside refitted, and what follows from the numbers."""
    sets = {"published": entry["published"], **entry["constants"]}
    error = entry["error"]
    rows = [["", *(name.replace("_", " ") for name in sets)]]
    rows += [
        [n, *(str(np.float32(k[n])) for k in sets.values())]
        for n in study.published._fields
    ]
    rows += [
        [f"{q} error", *(f"{error[s][q]:.6f}" for s in sets)] for q in ("max", "rms")
    ]
    rows += [
        [f"worst at {variable}", *(f"{error[s]['max_at'][variable]:.4f}" for s in sets)]
        for variable in error["published"]["max_at"]
    ]
    rows += [[q, *(f"{v[s]:.6f}" for s in sets)] for q, v in entry["also"].items()]
    lines = [f"{study.name}: {study.form}", f"  {study.norm}, {study.domain}"]
    width = max(len(row[0]) for row in rows)
    for first, *cells in rows:
        lines.append(f"  {first:{width}}" + "".join(f"{cell:>15}" for cell in cells))
    proof = entry["certificate"]
    lines.append(f"  no constants do better than {proof['bound']:.6f}, proved by")
    for point in proof["points"]:
        at = ", ".join(f"{name} = {x:.4f}" for name, x in point["at"].items())
        lines.append(f"    {point['kind']} at {at}, multiplier {point['multiplier']}")
    for name, quantity in (("least_squares", "rms"), ("minimax", "max")):
        found = entry["check"][name]
        lines.append(f"  {found['method']}: {quantity} error {found[quantity]:.4g}")
        if not error[name][quantity] < error["published"][quantity]:
            lines.append(f"  {name}: no better than the published constants")
    for claim in entry["claims"]:
        verdict = "holds" if claim["holds"] else "does NOT hold"
        lines.append(f"  claim {claim['claim']}: {verdict}; {claim['measured']}")
    return lines


def save(path: Path, entry: dict[str, Any]) -> None:
    """Write the file whole or leave it as it was."""
    text = json.dumps(entry, indent=2, allow_nan=False) + "\n"
    # One line for each group of plain numbers.
    text = re.sub(r"\{[^{}]*\}", lambda group: " ".join(group[0].split()), text)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_suffix(".tmp")
    unfinished.write_text(text)
    unfinished.replace(path)


def progress(text: str) -> None:
    """A line on the terminal that the next one overwrites; nothing in a pipe."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def run(study: Study, doc: str | None, argv: Sequence[str] | None = None) -> None:
    """The script: fit, print the table, write the file. SystemExit if the fit fails."""
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for option, kind, default, metavar, text in (
        ("--output", Path, CONSTANTS, "DIR", "where to write; fits/constants"),
        ("--max-steps", int, STEPS, "N", f"steps allowed to each solver; {STEPS}"),
    ):
        parser.add_argument(
            option, type=kind, default=default, metavar=metavar, help=text
        )
    options = parser.parse_args(argv)
    jax.config.update("jax_enable_x64", True)
    try:
        entry, lines = measured(study, options.max_steps)
    except FitError as error:
        raise SystemExit(f"{study.name}: {error}; nothing written") from error
    save(options.output / f"{study.name}.json", entry)
    print("\n".join(table(study, entry) + lines), flush=True)
