"""Points in time and error: their looks and their Pareto front."""

import math
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from shared.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RC, SKY, VERMILION
from shared.timing import Row

FORMS = {
    "GaussH": (VERMILION, "v"),
    "GaussGamma": (BLUE, "o"),
    "Windowed": (GREEN, "D"),
    "Series": (ORANGE, "s"),
    "auto": (PURPLE, "^"),
    "naive": (VERMILION, "v"),
    "log_I0": (ORANGE, "s"),
    "i0e": (GREEN, "D"),
    "ours": (BLUE, "o"),
    "lobe_first": (VERMILION, "v"),
    "lobe_again": (ORANGE, "s"),
    "guided": (BLUE, "o"),
}
DTYPES = ("float64", "float32")
RING: dict[str, Any] = {"marker": "o", "ms": 9, "mfc": "none", "mec": BLACK, "ls": ""}
SQUARE: dict[str, Any] = {"marker": "s", "ms": 5, "color": BLACK, "ls": ""}
CROSS: dict[str, Any] = {"marker": "x", "ms": 5, "mew": 1.5, "ls": ""}
FRONT: dict[str, dict[str, Any]] = {
    "float64": {"color": "#CCCCCC", "lw": 5, "solid_capstyle": "butt"},
    "float32": {"color": SKY, "alpha": 0.45, "lw": 5, "solid_capstyle": "butt"},
}
LIMIT: dict[str, dict[str, Any]] = {
    "float64": {"color": BLACK, "lw": 1},
    "float32": {"color": BLACK, "lw": 1, "ls": ":"},
}
SHADE = "#F2F2F2"


def look(form: str, dtype: str) -> dict[str, Any]:
    """Color and marker by form; float32 is open, and its lines are dotted."""
    color, marker = FORMS[form]
    style: dict[str, Any]
    if dtype == "float64":
        style = {"mfc": color, "mew": 0, "ms": 4.2, "ls": "-"}
    else:
        style = {"mfc": "white", "mew": 0.8, "ms": 3.4, "ls": ":"}
    return {"color": color, "marker": marker, "lw": 0.8, **style}


def front(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points that no other beats in both coordinates, from left to right."""
    best, kept = math.inf, []
    for x, y in sorted(points):
        if y < best:
            best = y
            kept.append((x, y))
    return kept


def point(row: Row) -> tuple[float, float]:
    """Microseconds and error."""
    return 1e6 * row.seconds, row.error


def lines(rows: Iterable[Row]) -> dict[tuple[str, str], list[tuple[float, float]]]:
    """Points by form and dtype, in the order of the rows."""
    found = defaultdict(list)
    for row in rows:
        found[row.form, row.dtype].append(point(row))
    return found


def ruled(ax: Axes) -> None:
    """Grid lines at the ticks, as one path."""
    x, y = [], []
    for at, ends, along, across in (
        (ax.get_xticks(), ax.get_ylim(), x, y),
        (ax.get_yticks(), ax.get_xlim(), y, x),
    ):
        for tick in at:
            along += [tick, tick, np.nan]
            across += [*ends, np.nan]
    ax.plot(x, y, color=RC["grid.color"], lw=RC["grid.linewidth"], zorder=0.5)


def draw_front(ax: Axes, rows: Iterable[Row]) -> None:
    """A wide pale staircase for each precision, of what is less than all wrong."""
    rows = list(rows)
    for dtype, style in FRONT.items():
        right = [row for row in rows if row.dtype == dtype and row.error < 1]
        found = np.transpose(front(map(point, right)))
        ax.plot(*found, drawstyle="steps-post", **style)


def draw_points(ax: Axes, rows: Iterable[Row]) -> None:
    """A line with markers for each form and precision; no numbers lie on the edge."""
    for key, line in lines(rows).items():
        style = look(*key)
        ax.plot(*np.transpose(line), **style)
        for x, y in line:
            if math.isnan(y):
                color = {"color": style["color"], "clip_on": False}
                ax.plot(x, ax.get_ylim()[1], **CROSS, **color)


def keys(forms: Iterable[str]) -> tuple[list[Line2D], list[str]]:
    """Entries of a legend."""
    forms = list(forms)
    names = [form.replace("log_I0", "log $I_0$") for form in forms]
    return [Line2D([], [], **look(form, "float64")) for form in forms], names
