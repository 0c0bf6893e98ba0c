"""What real-time approximations look like, and what they cost.

realtime_front: the error of S of fits/quality.json against operations, for every tier
and for Karis' lobes refitted; bars are the range over the cases. Each approximation is
shown over the path of light in which it is better. RTXCR's far field (d'Eon 2022) is
quoted, not measured here.
swatch, realtime_slides: a lock of hair under one light, shaded in every pixel: by
`evaluate` and by each model. Exposure is set by the reference and the same for all
models; so is what arrives of the light inside the lock. The swatch has one exposure,
the slides one for each row; the number beside a difference is its relative L2.
realtime_furnace: the albedo of a clear fiber over theta_i, on the grid of
fits/quality.py.
"""

import json
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke
from shared import swatch
from shared.fits import FITS, script
from shared.lock import ASPECT
from shared.style import (
    BLACK,
    BLUE,
    GRAY,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Drawing,
    Table,
    degrees,
    figure,
    run_all,
    title,
)

from fiberjax import realtime

KARIS = "karis2016"
REFITTED = "karis2016, refitted"
NAMES = {KARIS: "Karis 2016", REFITTED: "Karis 2016, refitted"}
TINTS = (BLUE, GREEN, PURPLE, SKY, ORANGE)
WEIGHT = 4
"""Of a special operation: a GPU issues one in the time of four others."""


TICKS = (50, 75, 100, 150, 200, 300, 400, 600, 800)


class Range(NamedTuple):
    """From least to most."""

    low: float
    high: float


QUOTED_ERROR, QUOTED_CASES = Range(0.26, 0.30), Range(0.19, 0.55)
QUOTED_COST = Range(WEIGHT * 43 + 245, WEIGHT * 74 + 400)
"""RTXCR: optimized, 43 special and 245 others, to shipped, 74 and 400; fused pairs are
counted once."""


class Point(NamedTuple):
    """A row of the front: error is the mean, low and high are over the cases."""

    name: str
    path: str
    special: int
    other: int
    operations: int
    error: float
    low: float
    high: float


def color_of(name: str) -> str:
    """Karis' is vermilion; our tiers have theirs in their order."""
    ours = [tier for tier in realtime.TIERS if tier != KARIS]
    return TINTS[ours.index(name) % len(TINTS)] if name in ours else VERMILION


def cost_of(name: str) -> realtime.Cost:
    """Operations of an approximation."""
    return realtime.cost(KARIS if name == REFITTED else name)


def points() -> list[Point]:
    """Every tier and the refit, from fits/quality.json."""
    judged = json.loads((FITS / "quality.json").read_text())
    found = []
    for name in (*realtime.TIERS, REFITTED):
        groups = {path: judged[name]["path"][path] for path in ("theta_t", "theta_d")}
        path = min(groups, key=lambda key: groups[key]["mean"]["S"])
        cases = [x for case, x in groups[path]["cases"].items() if case[:3] != "low"]
        special, other = cost_of(name)
        total = WEIGHT * special + other
        mean = groups[path]["mean"]["S"]
        found.append(
            Point(name, path, special, other, total, mean, min(cases), max(cases))
        )
    return found


def draw_quoted(ax):
    """RTXCR as a box, with a bar for its cases."""
    low, high = QUOTED_COST
    ax.fill_between([low, high], *QUOTED_ERROR, color=GRAY, alpha=0.35, lw=0)
    middle = np.sqrt(low * high)
    ax.plot([middle] * 2, QUOTED_CASES, color=GRAY, lw=1)
    text = "RTXCR, optimized to shipped;\nquoted, fused pairs counted once"
    place: Any = {"xytext": (0, -6), "textcoords": "offset points", "size": 8.5}
    ax.annotate(
        text, (middle, QUOTED_CASES.low), ha="center", va="top", color=GRAY, **place
    )


def draw_front():
    """Error against operations."""
    found = points()
    fig = figure(3.9)
    ax = fig.subplots()
    least = min(at.operations for at in found)
    low, high = 0.8 * least, 1.15 * QUOTED_COST.high
    ax.set(xscale="log", yscale="log", xlim=(low, high), ylim=(0.007, 1))
    draw_quoted(ax)
    front = [at for at in found if at.name in realtime.FITTED]
    ax.plot(
        [at.operations for at in front], [at.error for at in front], color=GRAY, lw=1
    )
    for at in found:
        color, refit = color_of(at.name), at.name == REFITTED
        x = at.operations
        ax.plot([x, x], [at.low, at.high], color=color, lw=1.2, alpha=0.7)
        style: Any = {"mfc": "white" if refit else color, "mec": color}
        ax.plot(x, at.error, "o", ms=7, zorder=3, **style)
        # The refit has the cost of what is refitted and lies just below it.
        beside: Any = {"xytext": (9, -6 if refit else 6), "color": color}
        beside |= {"textcoords": "offset points", "va": "center", "weight": "bold"}
        # The bar of the next tier stands behind it.
        beside["path_effects"] = [Stroke(linewidth=3, foreground="white"), Normal()]
        text = f"{NAMES.get(at.name, at.name)}, {at.error:.3f}"
        ax.annotate(text, (x, at.error), **beside)
    ticks = [x for x in TICKS if low <= x <= high]
    ax.minorticks_off()
    ax.set(xticks=ticks, xticklabels=[str(tick) for tick in ticks])
    levels = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1)
    ax.set(yticks=levels, yticklabels=[f"{level:g}" for level in levels])
    ax.set(
        xlabel=f"operations of one RGB color, a special one counted as {WEIGHT} others",
        ylabel="relative L2 error of S, mean and range",
    )
    rows = [[*map(str, at)] for at in found]
    return Drawing(
        fig, "Error of real-time models against cost", Table(Point._fields, rows)
    )


WIDE, DPI = 1350, 150
"""Pixels: 900 of a browser, at one and a half times its resolution."""

LIGHTS = {"front": swatch.direction(-30, 10), "back": swatch.direction(-120, 8)}
"""R and TRT are seen towards the light, TT against it."""

ROWS = (
    ("R", "blond", (0,), "front"),
    ("TT", "blond", (1,), "back"),
    ("TRT", "blond", (2,), "front"),
    *((f"R+TT+TRT\n{color}", color, (0, 1, 2), "back") for color in swatch.COLORS),
)
FULL = 0.25
"""Difference, of white, that has the strongest color."""


def models() -> list[str]:
    """The reference, Karis and our finest tier, if there is one."""
    return list(dict.fromkeys((swatch.REFERENCE, KARIS, realtime.TIERS[-1])))


def label_of(model: str) -> str:
    """Its name above a column."""
    return {swatch.REFERENCE: "reference", KARIS: "Karis"}.get(model, f"ours, {model}")


@cache
def scenes(width: int) -> dict[str, swatch.Scene]:
    """The lock under each light."""
    found = swatch.scenes(width, list(LIGHTS.values()))
    return dict(zip(LIGHTS, found, strict=True))


@cache
def shaded(width: int, light: str, model: str, p: int) -> dict[str, np.ma.MaskedArray]:
    """A lobe in every color."""
    return swatch.radiance(model, p, scenes(width)[light])


def lit(width: int, row, model: str) -> np.ma.MaskedArray:
    """The lobes of a row, added."""
    _, color, lobes, light = row
    return np.ma.stack([shaded(width, light, model, p)[color] for p in lobes]).sum(0)


class Sheet(NamedTuple):
    """Pictures and text placed by pixels from the upper left corner."""

    fig: Figure
    height: int

    def image(self, left: int, top: int, picture: np.ndarray) -> None:
        """A picture, pixel by pixel."""
        rows, levels = len(picture), np.round(255 * picture).astype(np.uint8)
        self.fig.figimage(levels, left, self.height - top - rows, origin="upper")

    def text(self, left: float, top: float, text: str, **style: Any) -> None:
        """Text about a place."""
        style = {"ha": "center", "va": "center", "color": "#E6E6E6", "size": 8} | style
        self.fig.text(left / WIDE, 1 - top / self.height, text, **style)


def sheet(height: int) -> Sheet:
    """An empty one, on the ground of the pictures."""
    fig = Figure(figsize=(WIDE / DPI, height / DPI), dpi=DPI)
    fig.set_facecolor(tuple(np.round(255 * swatch.srgb(swatch.GROUND)) / 255))
    return Sheet(fig, height)


def draw_swatch():
    """Four colors, each by the reference, ours and Karis; lying, roots on the left."""
    order = [m for m in models() if m != KARIS] + [KARIS]
    edge, head, gap = 96, 40, 8
    tall = (WIDE - edge - gap) // len(order) - gap
    width = round(tall / ASPECT)
    tall = round(ASPECT * width)
    page = sheet(head + len(swatch.COLORS) * (width + gap) + gap)
    rows = {color: (color, color, (0, 1, 2), "back") for color in swatch.COLORS}
    exposed = swatch.exposure(lit(width, rows["blond"], swatch.REFERENCE))
    for j, model in enumerate(order):
        left = edge + j * (tall + gap)
        page.text(left + tall / 2, head / 2, label_of(model), size=10, weight="bold")
        for k, (color, row) in enumerate(rows.items()):
            top = head + k * (width + gap)
            if not j:
                page.text(edge / 2, top + width / 2, color, size=10, weight="bold")
            picture = swatch.developed(lit(width, row, model), exposed)
            page.image(left, top, np.rot90(picture))
    return Drawing(page.fig, "Hair by the reference and real-time models", None, True)


def tinted(difference: np.ndarray) -> np.ndarray:
    """Signed difference on the ground: blue is too dark, red too bright."""
    colors = colormaps["berlin"](0.5 + 0.5 * np.clip(difference / FULL, -1, 1))
    weight = np.clip(np.abs(difference) / FULL, 0, 1)[..., None] ** 0.5
    return weight * colors[..., :3] + (1 - weight) * swatch.srgb(swatch.GROUND)


def draw_slides():
    """Rows of lobes and colors; the reference, models, and their differences."""
    shown = models()
    others = shown[1:]
    count = len(shown) + len(others)
    edge, head, gap = 130, 44, 10
    tall = (WIDE - edge - gap) // count - gap
    width = round(tall / ASPECT)
    tall = round(ASPECT * width)
    page = sheet(head + len(ROWS) * (width + gap) + gap)
    names = [label_of(m) for m in shown]
    names += [f"{label_of(m).removeprefix('ours, ')} less reference" for m in others]
    for j, name in enumerate(names):
        page.text(edge + j * (tall + gap) + tall / 2, head / 2, name, weight="bold")
    cells, table = [], []
    for k, row in enumerate(ROWS):
        exact = lit(width, row, swatch.REFERENCE)
        exposed = swatch.exposure(exact)
        found = {m: lit(width, row, m) for m in others}
        cells = [swatch.developed(x, exposed) for x in (exact, *found.values())]
        cells += [tinted(swatch.difference(x, exact, exposed)) for x in found.values()]
        top = head + k * (width + gap)
        page.text(edge / 2, top + width / 2, row[0], weight="bold", linespacing=1.5)
        for j, cell in enumerate(cells):
            # Lying, roots on the left.
            page.image(edge + j * (tall + gap), top, np.rot90(cell))
        for j, (model, x) in enumerate(found.items()):
            error = swatch.off(x, exact)
            left = edge + (len(shown) + j) * (tall + gap) + tall - 4
            page.text(left, top + width - 10, f"{error:.2f}", ha="right", size=7)
            table.append((row[0].replace("\n", " "), row[1], model, f"{error:.4f}"))
    header = "row", "color", "model", "relative_l2"
    drawing = Table(header, table)
    return Drawing(page.fig, "Lobes of real-time models on hair", drawing, True)


TILTS = (0.0, 2.5)
FURNACE_R = ("r 0.3", "r 0.7")


def furnace():
    """Albedo of a clear fiber: rows (roughness, tilt, theta_i, exact, each tier)."""
    quality, cases, sphere = map(script, ("quality", "shared.cases", "shared.sphere"))
    over = sphere.grid(*quality.NODES)
    found = {}
    for width in FURNACE_R:
        for tilt in TILTS:
            fiber = cases.fiber((1.0,), cases.ROUGH[width], np.radians(tilt))
            each: list[Any] = [None]
            for tier in realtime.TIERS:
                model = partial(quality.of_tier, tier)
                sums = sphere.sums(model, fiber, over, "theta_t")
                each[0] = np.ravel(sums.albedo)
                each.append(np.ravel(sums.albedo_of_approximation))
            found[width, tilt] = each
    return np.degrees(over.theta), found


def draw_furnace():
    """Two roughnesses, untilted and tilted."""
    theta, found = furnace()
    fig = figure(5.6)
    axes = fig.subplots(2, 2, sharey=True).ravel()
    table = []
    for ax, letter, (key, each) in zip(axes, "abcd", found.items(), strict=True):
        width, tilt = key
        for name, line in zip((None, *realtime.TIERS), each, strict=True):
            color = color_of(name) if name else BLACK
            ax.plot(theta, line, color=color, lw=1.5 if name else 2.2)
        title(ax, letter, rf"roughness $r$ = {width[2:]}, tilt $\alpha = {tilt:g}$°")
        degrees(ax, "x", -90, 90, 30)
        ax.set(ylim=(0, 1.3), xlabel=r"inclination $\theta_i$", ylabel="albedo")
        columns = zip(theta, *each, strict=True)
        table += [(width, f"{tilt:g}", *(f"{x:.6f}" for x in line)) for line in columns]
    keys = [Line2D([], [], color=BLACK, lw=2.2)]
    keys += [Line2D([], [], color=color_of(tier)) for tier in realtime.TIERS]
    names = ["reference, R + TT + TRT", *(NAMES.get(x, x) for x in realtime.TIERS)]
    fig.legend(keys, names, loc="outside upper center", ncols=len(keys))
    header = "roughness", "alpha_deg", "theta_i_deg", "reference", *realtime.TIERS
    return Drawing(fig, "Albedo of real-time models", Table(header, table))


DRAWINGS = {
    "swatch": draw_swatch,
    "realtime_slides": draw_slides,
    "realtime_front": draw_front,
    "realtime_furnace": draw_furnace,
}


def main(argv=None):
    """Draw the four figures and write their tables."""
    run_all(DRAWINGS, __doc__, argv)


if __name__ == "__main__":
    main()
