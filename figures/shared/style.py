"""How every figure looks, and what every figure script does with its drawing."""

import argparse
import csv
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from PIL import Image
from PIL.PngImagePlugin import PngInfo

FIGURES = Path(__file__).parents[1]

WIDTH = 8.6
"""Inches: 826 pixels of a browser, so that 9 points are read as 12 pixels."""

# Okabe and Ito's palette, which the color-blind tell apart.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GRAY, PALE, GLASS = "#6B6B6B", "#D9D9D9", "#EAF2F8"

LOBES = ("R", "TT", "TRT")
LOBE_COLORS = (BLUE, VERMILION, GREEN)

RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "mathtext.fontset": "dejavusans",
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titlepad": 7,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E6E6E6",
    "grid.linewidth": 0.7,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "legend.framealpha": 1,
    "legend.edgecolor": "white",
    "legend.fancybox": False,
    "legend.handlelength": 1.6,
    "lines.linewidth": 1.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    # Outlines look the same on every machine; text would need the reader's fonts.
    "svg.fonttype": "path",
}


class Table(NamedTuple):
    """The numbers behind a figure; every cell is text."""

    header: Sequence[str]
    rows: Iterable[Sequence[str]]


class Drawing(NamedTuple):
    """A figure, what it shows in a few words, and its numbers if it measures.

    pixels: its panels are pictures, so it is written as PNG at the figure's own dpi.
    """

    figure: Figure
    title: str
    table: Table | None = None
    pixels: bool = False


def figure(height: float) -> Figure:
    """An empty figure of the common width."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def title(ax: Axes, letter: str, text: str) -> None:
    """Title of a panel, after its letter."""
    ax.set_title(rf"$\bf{{{letter}}}$  {text}")


def degrees(ax: Axes, axis: str, low: float, high: float, step: float) -> None:
    """Limits and ticks of an axis that shows an angle in degrees."""
    ticks = [low + step * k for k in range(round((high - low) / step) + 1)]
    labels = [f"${tick:.0f}$°" for tick in ticks]
    ax.set(**{f"{axis}lim": (low, high)})
    ax.set(**{f"{axis}ticks": ticks, f"{axis}ticklabels": labels})


def progress(text: str) -> None:
    """A line on the terminal that the next one overwrites; nothing in a pipe."""
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


def _settle(figure: Figure) -> None:
    """Lay the panels out once, and round where they are.

    The layout's solver orders its variables by their address in memory: the last bits
    of its result differ from run to run.
    """
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for ax in figure.axes:
        bounds = ax.get_position(original=True).bounds
        ax.set_position(Bbox.from_bounds(*(round(x, 6) for x in bounds)))


def _replace(path: Path, write: Callable[[Path], Any]) -> None:
    """Write the file whole or leave it as it was."""
    unfinished = path.with_suffix(".tmp")
    write(unfinished)
    unfinished.replace(path)


def _write_pixels(path: Path, drawing: Drawing) -> None:
    """A PNG of 128 colors: hair has too much detail for all of them."""
    canvas = FigureCanvasAgg(drawing.figure)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    info = PngInfo()
    info.add_text("Title", drawing.title)
    few = picture.quantize(128, dither=Image.Dither.NONE)
    few.save(path, format="PNG", optimize=True, pnginfo=info)


def save(drawing: Drawing, name: str, output: Path) -> None:
    """Write name.svg or name.png, and name.csv if there is a table.

    A rerun writes the same.
    """
    # Dates and versions would differ between reruns.
    unknown = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    metadata = {"Title": drawing.title, **unknown}

    def write_figure(path):
        with mpl.rc_context({"svg.hashsalt": name}):
            drawing.figure.savefig(path, format="svg", metadata=metadata)

    def write_table(path, table):
        with path.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([table.header, *table.rows])

    output.mkdir(parents=True, exist_ok=True)
    if drawing.pixels:
        _replace(output / f"{name}.png", partial(_write_pixels, drawing=drawing))
    else:
        _settle(drawing.figure)
        _replace(output / f"{name}.svg", write_figure)
    if drawing.table is not None:
        _replace(output / f"{name}.csv", partial(write_table, table=drawing.table))


def run(
    name: str,
    doc: str | None,
    draw: Callable[[], Drawing | None],
    argv: Sequence[str] | None = None,
) -> None:
    """The script: draw in float64 and in the common style, and write the files."""
    run_all({name: draw}, doc, argv)


def run_all(
    draws: Mapping[str, Callable[[], Drawing | None]],
    doc: str | None,
    argv: Sequence[str] | None = None,
) -> None:
    """The script of several figures by name; None leaves what is there alone."""
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=FIGURES,
        metavar="DIR",
        help="where to write; the folder of the script",
    )
    options = parser.parse_args(argv)
    jax.config.update("jax_enable_x64", True)
    for name, draw in draws.items():
        progress(name)
        with mpl.rc_context(RC):
            drawing = draw()
            if drawing is not None:
                save(drawing, name, options.output)
    progress("")
