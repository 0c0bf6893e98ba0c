"""What real-time approximations are worth: error of R + TT + TRT over the sphere.

Exact: S cos(theta_o) of fiberjax.evaluate without rest, separable M and N.
Cases: four colors C, sigma_a = -ln(C)/4, times roughness r with beta_m = beta_n = r^2,
and "low", r = .3 with beta_n = .05; eta 1.55. With the path of light, 1/cos theta_t,
and that of Karis, 1/cos theta_d; without tilt, and tilted by 2.5 degrees: the other
sign of it is the mirror image.
With the path of light also what nothing is fitted to: four other colors times three
other r, or "mixed", beta_m .12 with beta_n .3; the first cases at other eta.
Norm: root of int |error|^2 over int |exact|^2, over both directions in solid angle and
colors; its mean and largest over the cases, for each lobe and in total. Error of the
albedo over theta_i; the albedo of a clear fiber, tilted by 0, 1.25 and 2.5 degrees;
the largest error over the largest value at the same theta_i.
Cost: operations of the shader, as fits/shaders.py counts them.
"""

import argparse
import json
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from shared import cases
from shared.counting import counted
from shared.judgment import LOBES, by_band, by_lobe, clear, judged, of_cases, summary
from shared.judgment import worst as worst_of
from shared.report import progress, save
from shared.sphere import PATHS, Grid, grid

from fiberjax import karis, realtime
from fiberjax.fiber import Fiber
from fiberjax.shading import of_angles, of_fiber

TILTS = {"": 0.0, "tilted": float(np.radians(2.5))}
TILTS_OF_CLEAR = 0.0, 1.25, 2.5
"""Degrees."""

NODES = 128, 64
LEAST_THETA = 10
"""Points of theta with which each band of the albedo has one."""


def of_tier(tier: str, fiber: Fiber, p: int, *angles: Any) -> Any:
    """A lobe of a tier."""
    return realtime.lobe(tier, fiber, p, *angles)


def separable(fiber: Fiber, p: int, *angles: Any) -> Any:
    """Karis' lobes, with the M of the others for R."""
    if p:
        return realtime.lobe("karis2016", fiber, p, *angles)
    at = of_angles(*jnp.broadcast_arrays(*angles))
    return karis.R_separable(karis.PUBLISHED, of_fiber(fiber), at)


def refitted() -> Callable:
    """Karis' lobes with the constants of constants/karis.json."""
    text = (Path(__file__).parent / "constants" / "karis.json").read_text()
    found = json.loads(text)["constants"]["refitted"]
    constants = karis.Constants(**{name: _numbers(x) for name, x in found.items()})

    def lobe(fiber, p, *angles):
        return realtime.lobe("karis2016", fiber, p, *angles, constants=constants)

    return lobe


def _numbers(x: Any) -> Any:
    return tuple(x) if isinstance(x, list) else x


def models() -> dict[str, Callable]:
    """What is judged, by name: lobe(fiber, p, *angles)."""
    tiers = {tier: partial(of_tier, tier) for tier in realtime.TIERS}
    also = {"karis2016, separable R": separable, "karis2016, refitted": refitted()}
    return tiers | also


def group(model: Callable, over: Grid, path: str, alpha: float) -> dict[str, Any]:
    """All cases of one path and tilt."""
    rough, low = (
        judged(model, over, path, cases.fibers(cases.COLORS, widths, alpha))
        for widths in (cases.ROUGH, cases.LOW)
    )
    found = summary(over.theta, rough)
    return {
        **found,
        "low": by_lobe(np.mean([one.error for one in low.values()], 0)),
        "cases": found["cases"] | of_cases(low),
        "albedo": by_band(over.theta, (rough | low).values()),
        "worst": worst_of(rough | low),
    }


def unseen(model: Callable, over: Grid) -> dict[str, Any]:
    """Fibers that nothing is fitted to: other colors and widths, other eta."""
    others = {
        "rough": cases.fibers(cases.UNSEEN_COLORS, cases.UNSEEN_ROUGH),
        "mixed": cases.fibers(cases.UNSEEN_COLORS, cases.MIXED),
    }
    for eta in cases.UNSEEN_ETA:
        others[f"eta {eta}"] = cases.fibers(cases.COLORS, cases.ROUGH, eta=eta)
    return {
        name: summary(over.theta, judged(model, over, PATHS[0], fibers))
        for name, fibers in others.items()
    }


def furnace(model: Callable, over: Grid) -> dict[str, Any]:
    """Albedo of a clear fiber by width and tilt, and the worst of them."""
    widths = (cases.ROUGH | cases.LOW).items()
    fibers = {
        f"{width}, {degrees} deg": cases.fiber(
            cases.CLEAR, beta, float(np.radians(degrees))
        )
        for degrees, (width, beta) in product(TILTS_OF_CLEAR, widths)
    }
    found = judged(model, over, PATHS[0], fibers)
    entries = {name: clear(over.theta, one) for name, one in found.items()}
    return {
        "above": max(one["above"] for one in entries.values()),
        "error": by_band(over.theta, found.values()),
        "cases": entries,
    }


def judge(name: str, model: Callable, over: Grid) -> dict[str, Any]:
    """Everything about one approximation."""
    found = {}
    for path in PATHS:
        for label, alpha in TILTS.items():
            key = ", ".join(filter(None, (path, label)))
            progress(f"{name}: {key}")
            found[key] = group(model, over, path, alpha)
    progress(f"{name}: unseen")
    rest = {"unseen": unseen(model, over)}
    progress(f"{name}: furnace")
    return {"path": found, **rest, "furnace": furnace(model, over)}


def operations() -> dict[str, dict[str, Any]]:
    """The operations of every tier's shader, by counter."""
    costs = counted(json.loads(realtime.COSTS.read_text()))
    return {tier: costs[tier] for tier in realtime.TIERS}


def readme_rows(entry: dict[str, Any]) -> list[str]:
    """The rows of the README's table."""
    rows = []
    for (name, one), path in product(entry.items(), PATHS[::-1]):
        group = one["path"][path]
        numbers = [group["mean"][x] for x in ("S", *LOBES[:3])]
        numbers += [group["max"]["S"], group["low"]["S"], to_80(group)]
        rows.append(row(name, f"cos {path}", *numbers))
    return rows


def row(*cells: str | float) -> str:
    """A row of a table, numbers in three decimals."""
    texts = (x if isinstance(x, str) else f"{x:.3f}" for x in cells)
    return f"| {' | '.join(texts)} |"


def beyond(one: dict[str, Any]) -> list[float]:
    """What the README tells of the fibers nothing is fitted to, and of clear ones."""
    others, furnace = one["unseen"], one["furnace"]
    of_eta = [others[f"eta {eta}"] for eta in cases.UNSEEN_ETA]
    return [
        others["rough"]["mean"]["S"],
        others["rough"]["max"]["S"],
        others["mixed"]["mean"]["S"],
        *(group["mean"]["S"] for group in of_eta),
        max(group["max"]["S"] for group in of_eta),
        one["path"]["theta_t"]["albedo"]["0 to 90"]["max"],
        furnace["error"]["0 to 80"]["max"],
        furnace["error"]["0 to 90"]["max"],
        furnace["above"],
    ]


def readme_beyond(entry: dict[str, Any]) -> list[str]:
    """The rows of the README's second table."""
    return [row(name, *beyond(one)) for name, one in entry.items()]


def to_80(group: dict[str, Any]) -> float:
    """Largest error of the albedo to 80 degrees."""
    return group["albedo"]["0 to 80"]["max"]


def table(entry: dict[str, Any]) -> list[str]:
    """A line for each approximation and path, and one for what lies beyond."""
    lines = [
        f"{'relative L2':28}{'path':20}"
        + "".join(f"{x:>7}" for x in LOBES)
        + f"{'worst':>8}{'low':>8}{'albedo to 80 deg':>18}"
    ]
    for name, one in entry.items():
        for path, group in one["path"].items():
            cells = "".join(f"{group['mean'][x]:7.3f}" for x in LOBES)
            rest = (
                f"{group['max']['S']:8.3f}{group['low']['S']:8.3f}{to_80(group):18.3f}"
            )
            lines.append(f"{name:28}{path:20}{cells}{rest}")
    heads = ["unseen", "worst", "mixed", *map(str, cases.UNSEEN_ETA), "worst"]
    heads += ["albedo", "clear 80", "clear 90", "above"]
    lines.append(f"{'':28}" + "".join(f"{x:>9}" for x in heads))
    for name, one in entry.items():
        lines.append(f"{name:28}" + "".join(f"{x:9.3f}" for x in beyond(one)))
    for name, cost in ((name, one.get("operations")) for name, one in entry.items()):
        for counter, found in (cost or {}).items():
            total = f"{found['special']} special + {found['other']} other"
            lines.append(f"{name:28}{counter:20}{total}")
    return lines


def main(argv=None):
    """Judge every approximation, print the table, write quality.json."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path(__file__).parent,
        metavar="DIR",
        help="where to write; fits",
    )
    parser.add_argument(
        "--nodes",
        type=int,
        nargs=2,
        default=NODES,
        metavar=("THETA", "PHI"),
        help=f"points of the grid; {NODES[0]} {NODES[1]}",
    )
    options = parser.parse_args(argv)
    if options.nodes[0] < LEAST_THETA or options.nodes[1] < 1:
        parser.error(f"--nodes {options.nodes}: must be at least {LEAST_THETA} 1")
    jax.config.update("jax_enable_x64", True)
    over = grid(*options.nodes)
    entry = {name: judge(name, model, over) for name, model in models().items()}
    progress("")
    for tier, cost in operations().items():
        entry[tier]["operations"] = cost
    save(options.output / "quality.json", {"nodes": list(options.nodes), **entry})
    print("\n".join(table(entry)), flush=True)


if __name__ == "__main__":
    main()
