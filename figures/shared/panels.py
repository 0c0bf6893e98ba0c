"""Error against time, drawn: blocks of panels below each other."""

from collections import defaultdict
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from shared import m_forms, n_rules, strategies
from shared.inches import place, write
from shared.points import (
    DTYPES,
    FRONT,
    LIMIT,
    RING,
    SHADE,
    SQUARE,
    draw_front,
    draw_points,
    keys,
    look,
    point,
    ruled,
)
from shared.style import GRAY, LOBES, PALE, WIDTH, figure

RULES = ("GaussH", "GaussGamma", "Windowed", "Series", "auto")
TIMES = (0.08, 0.8)
"""Microseconds: what the axes of the samples show."""

# Inches.
LEFT, RIGHT, GAP, HEIGHT = 0.92, 0.2, 0.14, 1.28
DOWN, TALL, BETWEEN = 0.1, 1.7, 1.05
FIRST = 1.2
SECOND = FIRST + 5 * (HEIGHT + DOWN) + BETWEEN
THIRD = SECOND + HEIGHT + BETWEEN
FOURTH = THIRD + HEIGHT + BETWEEN
END = FOURTH + TALL + 0.55


def row_of(fig, top, count, height=HEIGHT, gap=GAP):
    """Axes side by side over the whole width; the first has the labels of all."""
    width = (WIDTH - LEFT - RIGHT + gap) / count - gap
    axes = [
        place(fig, LEFT + k * (width + gap), top, width, height) for k in range(count)
    ]
    for ax in axes:
        ax.set(xscale="log", yscale="log")
        ax.minorticks_off()
        # Of matplotlib's grid every line is several elements of the file.
        ax.grid(False)
        ax.tick_params(left=False, bottom=False, labelleft=ax is axes[0])
    return axes


def decades(ax, low, high):
    """Ticks of a time axis in microseconds."""
    ticks = 10.0 ** np.arange(low, high + 1)
    ax.set(xticks=ticks, xticklabels=[f"{tick:g}" for tick in ticks])


def below(fig, end, text):
    """The label of the time axes of a row that ends there."""
    write(fig, (LEFT + WIDTH - RIGHT) / 2, end + 0.42, text, ha="center")


def heading(fig, top, letter, text):
    """What a block shows."""
    write(fig, 0.08, top - 0.36, rf"$\bf{{{letter}}}$  {text}", size=9.5)


def legend(fig, top, entries, ncols):
    """A legend that ends at the right edge of the panels."""
    fig.legend(
        *entries,
        loc="upper right",
        ncols=ncols,
        bbox_to_anchor=(1 - RIGHT / WIDTH, 1 - top / fig.get_figheight()),
        borderpad=0,
        borderaxespad=0,
        columnspacing=1.6,
    )


def draw_key(fig):
    """Forms of N, precisions and marks."""
    lines, names = keys(RULES)
    for dtype in DTYPES:
        style: Any = look("GaussH", dtype) | {"color": GRAY}
        if dtype == "float64":
            style["mfc"] = GRAY
        lines.append(Line2D([], [], **style))
        names.append(dtype)
    lines += [Line2D([], [], **style) for style in (RING, SQUARE)]
    names += [f"GaussH({n_rules.TEXTBOOK.order})", "scipy quad"]
    for name, styles in (("Pareto front", FRONT), ("exp limit", LIMIT)):
        lines += [Line2D([], [], **styles[dtype]) for dtype in DTYPES]
        names += [f"{name}, {dtype}" for dtype in DTYPES]
    legend(fig, 0.08, (lines, names), 5)


def draw_exp_limit(ax, rows, exp_seconds):
    """The error of GaussGamma at the time that its exponentials alone take."""
    for dtype, style in LIMIT.items():
        each = 1e6 * exp_seconds[dtype] * n_rules.exps_per_node(rows[0].case)
        line = [
            (each * int(row.setting), row.error)
            for row in rows
            if (row.form, row.dtype) == ("GaussGamma", dtype)
        ]
        ax.plot(*np.transpose(line), **style)


def draw_marks(ax, rows):
    """A ring around the textbook rule; scipy on the right edge, with its time."""
    for row in rows:
        if (row.form, row.setting) == ("GaussH", str(n_rules.TEXTBOOK.order)):
            ax.plot(*point(row), **RING)
        elif row.form == "quad":
            at = ax.get_xlim()[1], row.error
            ax.plot(*at, clip_on=False, **SQUARE)
            beside: Any = {"xytext": (-6, 0), "textcoords": "offset points", "size": 8}
            time = f"{1e3 * row.seconds:.1f} ms"
            ax.annotate(time, at, ha="right", va="center", **beside)


def draw_N(ax, rows):
    """All rules for one lobe and roughness."""
    ax.set(ylim=(1e-16, 200), yticks=10.0 ** np.arange(-16, 1, 4))
    floor = n_rules.rounding(LOBES.index(rows[0].case), rows[0].width)
    ax.axhspan(1e-16, floor, color=SHADE, lw=0, zorder=0)
    ruled(ax)
    rules = [row for row in rows if row.form != "quad"]
    draw_front(ax, rules)
    draw_points(ax, rules)
    draw_marks(ax, rows)


def draw_queries(fig, top, by, exp_seconds):
    """Roughness downwards, lobes side by side."""
    text = r"$N$, each value with a $\varphi$ and a $\theta_d$ of its own"
    heading(fig, top, "a", text)
    for k, beta_n in enumerate(n_rules.BETA_N):
        axes = row_of(fig, top + k * (HEIGHT + DOWN), 3)
        for ax, lobe in zip(axes, LOBES, strict=True):
            ax.set(xlim=(0.01, 60))
            decades(ax, -2, 1)
            ax.tick_params(labelbottom=beta_n == n_rules.BETA_N[-1])
            draw_N(ax, by["N", lobe, beta_n])
            draw_exp_limit(ax, by["N", lobe, beta_n], exp_seconds)
            if k == 0:
                ax.set_title(lobe, loc="center", pad=3)
        axes[0].set(ylabel=rf"$\beta_n$ = {beta_n:g} rad" + "\nerror / peak")
        if k == 0:
            axes[0].text(0.012, 1e-14, "rounding of float64", va="center", size=8)
    end = top + 5 * HEIGHT + 4 * DOWN
    below(fig, end, "time per value of three channels, µs")


def draw_grid(fig, top, by):
    """TRT by roughness."""
    heading(fig, top, "b", r"$N$ of TRT where many $\varphi$ share each $\theta_d$")
    axes = row_of(fig, top, 3)
    for ax, beta_n in zip(axes, (0.03, 0.1, 0.3), strict=True):
        ax.set(xlim=(0.01, 60))
        decades(ax, -2, 1)
        draw_N(ax, by["N_grid", "TRT", beta_n])
        ax.set_title(rf"$\beta_n$ = {beta_n:g} rad", loc="center", pad=5, size=9)
    axes[0].set(ylabel="error / peak")
    below(fig, top + HEIGHT, "time per value of three channels, µs")


def draw_M(fig, top, by):
    """Four forms by variance."""
    heading(fig, top, "c", r"$M$, all values with one $v$")
    axes = row_of(fig, top, 4)
    for ax, v in zip(axes, m_forms.V, strict=True):
        ax.set(xlim=(0.002, 0.05), ylim=(1e-17, 10))
        ax.set(yticks=10.0 ** np.arange(-16, 1, 4))
        ax.set(xticks=(0.003, 0.01, 0.03), xticklabels=("3", "10", "30"))
        ruled(ax)
        rows = by["M", "", v]
        draw_front(ax, rows)
        draw_points(ax, rows)
        ax.set_title(rf"$v$ = {v:g} rad²", loc="center", pad=5, size=9)
    axes[0].set(ylabel="error / peak")
    below(fig, top + HEIGHT, "time per value, ns")
    legend(fig, top - 0.47, keys(m_forms.FORMS), 4)


def draw_strategies(ax, groups):
    """The strategies at each roughness, joined by lines with a name."""
    for rows in groups:
        for dtype in DTYPES:
            line = [point(row) for row in rows if row.dtype == dtype]
            style = look("guided", dtype) | {"color": GRAY, "marker": ""}
            ax.plot(*np.transpose(line), **style)
        draw_points(ax, rows)
    y = 0.0
    starts = [(*min(map(point, rows)), rows[0].width) for rows in groups]
    for x, variance, beta in sorted(starts, key=lambda start: start[1]):
        # The names must not overlap.
        y = max(variance, 1.55 * y)
        ax.text(0.93 * x, y, rf"$\beta$ = {beta:g}", ha="right", va="center", size=8)


def draw_samples(fig, top, by):
    """Variance against time, for two bands of theta_i."""
    text = r"samples; variance $\times$ time is constant along the slanted lines"
    heading(fig, top, "d", text)
    axes = row_of(fig, top, 2, TALL, 0.6)
    limits = (5e-5, 5e-2), (2e-3, 2)
    for ax, band, limit in zip(axes, strategies.BANDS, limits, strict=True):
        ax.set(xlim=TIMES, ylim=limit)
        ax.set(xticks=(0.1, 0.2, 0.5), xticklabels=("0.1", "0.2", "0.5"))
        ax.tick_params(labelleft=True)
        for product in 10.0 ** np.arange(-6, 1):
            ends = [product / time for time in TIMES]
            ax.plot(TIMES, ends, color=PALE, lw=0.7)
        draw_strategies(ax, [by["sample", band, beta] for beta in strategies.BETAS])
        text = band.replace("theta_i", r"$\theta_i$") + "°"
        ax.set_title(text, loc="center", pad=5, size=9)
    axes[0].set(ylabel="variance of the weight")
    below(fig, top + TALL, "time per sample, µs")
    legend(fig, top - 0.47, keys(strategies.STRATEGIES), 3)


def blocks(rows):
    """The figure of the rows."""
    by = defaultdict(list)
    for row in rows:
        by[row.quantity, row.case, row.width].append(row)
    exp_seconds = {row.dtype: row.seconds for row in rows if row.quantity == "exp"}
    fig = figure(END)
    # Every panel has its place.
    fig.set_layout_engine("none")
    draw_key(fig)
    draw_queries(fig, FIRST, by, exp_seconds)
    draw_grid(fig, SECOND, by)
    draw_M(fig, THIRD, by)
    draw_samples(fig, FOURTH, by)
    return fig
