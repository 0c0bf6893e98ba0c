"""What real-time approximations are worth: error of R + TT + TRT over the sphere.

Exact: S cos(theta_o) of fiberjax.evaluate without rest, separable M and N.
Cases: four colors C, sigma_a = -ln(C)/4, times roughness r with beta_m = beta_n = r^2,
and "low", r = .3 with beta_n = .05; eta 1.55. With the path of light, 1/cos theta_t,
and that of Karis, 1/cos theta_d; without tilt, and tilted by 2.5 degrees.
Norm: root of int |error|^2 over int |exact|^2, over both directions in solid angle and
colors; its mean and largest over the cases, for each lobe and in total. Error of the
albedo over theta_i; the albedo of a clear fiber; the largest error over the largest
value at the same theta_i.
"""

import argparse
import json
from collections.abc import Callable
from functools import partial
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from shared.cases import COLORS, LOW, ROUGH, fiber
from shared.report import progress, rounded, save
from shared.sphere import PATHS, Grid, Sums, grid, sums

from fiberjax import karis, realtime
from fiberjax.fiber import Fiber
from fiberjax.shading import of_angles, of_fiber

WIDTHS = ROUGH | LOW
TILTS = {"": 0.0, "tilted": float(np.radians(2.5))}
BANDS = (0, 30, 60, 80, 90)
"""Degrees of |theta_i| between which the error of the albedo is told apart."""

LOBES = ("R", "TT", "TRT", "S")
NODES = 128, 64


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


def relative(found: Sums) -> np.ndarray:
    """The error of each lobe and of the sum, relative to its own norm."""
    return np.sqrt(np.asarray(found.square_of_error / found.square))


def by_band(theta_i: np.ndarray, error: np.ndarray) -> dict[str, Any]:
    """Largest and mean error of the albedo between bounds of |theta_i|.

    At each theta_i that is the largest over cases and colors.
    """
    degrees, found = np.degrees(np.abs(theta_i)), {}
    for low, high in pairwise(BANDS):
        here = error[(degrees > low) & (degrees <= high)]
        found[f"{low} to {high}"] = {
            "max": rounded(here.max(), 4),
            "mean": rounded(here.mean(), 4),
        }
    return found


def group(model: Callable, over: Grid, path: str, alpha: float) -> dict[str, Any]:
    """All cases of one path and tilt."""
    errors, albedo, worst = {}, [], []
    for width, beta in WIDTHS.items():
        for name, color in COLORS.items():
            found = sums(model, fiber(color, beta, alpha), over, path)
            errors[width, name] = relative(found)
            albedo.append(np.abs(found.albedo - found.albedo_of_approximation).max(-1))
            place = np.degrees(found.worst_at)
            worst.append((float(found.worst), f"{width}, {name}", place))
    rough = np.array([e for (width, _), e in errors.items() if width in ROUGH])
    low = np.array([e for (width, _), e in errors.items() if width in LOW])
    error, case, where = max(worst, key=lambda one: one[0])

    def means(values):
        return {k: rounded(v, 4) for k, v in zip(LOBES, values, strict=True)}

    return {
        "mean": means(rough.mean(0)),
        "max": means(rough.max(0)),
        "low": means(low.mean(0)),
        "cases": {f"{w}, {n}": rounded(e[-1], 4) for (w, n), e in errors.items()},
        "albedo": by_band(over.theta, np.max(albedo, 0)),
        "worst": {
            "error over peak": rounded(error, 4),
            "case": case,
            **{
                f"{angle} deg": rounded(x, 4)
                for angle, x in zip(("theta_i", "theta_o", "phi"), where, strict=True)
            },
        },
    }


def furnace(model: Callable, over: Grid) -> dict[str, Any]:
    """Albedo of a clear fiber: the most it has, and its largest distance from exact."""
    found = {}
    for (label, alpha), (width, beta) in (
        (t, w) for t in TILTS.items() for w in WIDTHS.items()
    ):
        clear = sums(model, fiber((1.0,), beta, alpha), over, PATHS[0])
        exact, close = np.ravel(clear.albedo), np.ravel(clear.albedo_of_approximation)
        found[", ".join(filter(None, (width, label)))] = {
            "largest": rounded(close.max(), 4),
            "largest exact": rounded(exact.max(), 4),
            "error": rounded(np.abs(close - exact).max(), 4),
        }
    return found


def judge(name: str, model: Callable, over: Grid) -> dict[str, Any]:
    """Everything about one approximation."""
    found = {}
    for path in PATHS:
        for label, alpha in TILTS.items():
            key = ", ".join(filter(None, (path, label)))
            progress(f"{name}: {key}")
            found[key] = group(model, over, path, alpha)
    progress(f"{name}: furnace")
    return {"path": found, "furnace": furnace(model, over)}


def readme_rows(entry: dict[str, Any]) -> list[str]:
    """The rows of the README's table."""
    rows = []
    for (name, one), path in product(entry.items(), PATHS[::-1]):
        group = one["path"][path]
        numbers = [group["mean"][x] for x in ("S", *LOBES[:3])]
        numbers += [group["max"]["S"], group["low"]["S"], to_80(group)]
        cells = name, f"cos {path}", *(f"{x:.3f}" for x in numbers)
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def to_80(group: dict[str, Any]) -> float:
    """Largest error of the albedo to 80 degrees."""
    bands = [band for band in group["albedo"] if band != "80 to 90"]
    return max(group["albedo"][band]["max"] for band in bands)


def table(entry: dict[str, Any]) -> list[str]:
    """A line for each approximation and path."""
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
    for name, one in entry.items():
        most = max(x["error"] for x in one["furnace"].values())
        lines.append(f"{name}: albedo of a clear fiber off by at most {most:.3f}")
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
    jax.config.update("jax_enable_x64", True)
    over = grid(*options.nodes)
    entry = {name: judge(name, model, over) for name, model in models().items()}
    progress("")
    save(options.output / "quality.json", {"nodes": list(options.nodes), **entry})
    print("\n".join(table(entry)), flush=True)


if __name__ == "__main__":
    main()
