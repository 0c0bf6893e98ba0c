"""Variance of the weights of `sample` by strategy, and what a sample costs.

The variance of the weight is that of an estimate of the albedo; beside it that of an
estimate of int evaluate (1 + cos phi cos theta_o) d omega_o, which directions scatter
too. Both are relative to those of lobe_first, over roughness, absorption and theta_i,
and are the same in every run. Times are those of one machine, each sample with a
theta_i of its own; they differ from run to run, and so do the files.
"""

import itertools

import numpy as np
from matplotlib.lines import Line2D
from shared.strategies import (
    BETAS,
    ORDINARY,
    SIGMAS,
    STRATEGIES,
    THETA_I,
    costs,
    mean,
    measure,
)
from shared.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    VERMILION,
    Drawing,
    Table,
    degrees,
    figure,
    run,
    title,
)

COLORS = (BLUE, GREEN, ORANGE, VERMILION)
LINES = {"lobe_again": ":", "guided": "-"}
HEADER = (
    "strategy",
    "beta",
    "sigma_a",
    "theta_i_deg",
    "variance",
    "variance_of_integrand",
    "ns_per_sample",
)


def ratios(result, strategy, column, beyond):
    """Those to lobe_first at ordinary angles, or beyond them."""
    return [
        result[key][column] / result["lobe_first", *key[1:]][column]
        for key in result
        if key[0] == strategy and (key[3] > ORDINARY) == beyond
    ]


def table(result, cost):
    """One row a place, and the geometric means over ordinary angles and beyond."""
    rows = [
        (key[0], *(f"{x:g}" for x in key[1:]), *(f"{v:.6e}" for v in values), "")
        for key, values in result.items()
    ]
    for strategy, beyond in itertools.product(STRATEGIES, (False, True)):
        found = [mean(ratios(result, strategy, k, beyond)) for k in range(2)]
        label = f"ratio {'beyond' if beyond else 'to'} {ORDINARY}"
        share = [f"{x:.6f}" for x in found]
        rows.append((strategy, "all", "all", label, *share, f"{cost[strategy]:.0f}"))
    return Table(HEADER, rows)


def draw_ratios(ax, result, sigma_a):
    """The variance of the weight over theta_i, against lobe_first."""
    for beta, color in zip(BETAS, COLORS, strict=True):
        first = np.array([result["lobe_first", beta, sigma_a, t][0] for t in THETA_I])
        for strategy, line in LINES.items():
            here = [result[strategy, beta, sigma_a, t][0] for t in THETA_I]
            ax.plot(THETA_I, here / first, color=color, ls=line)
    ax.axhline(1, color=BLACK, lw=0.8)
    ax.set(yscale="log", ylim=(1e-3, 20), ylabel="variance / that of lobe_first")
    ax.set_xlabel(r"inclination $\theta_i$")
    degrees(ax, "x", 0, 90, 15)


def draw_means(ax, result, cost):
    """Geometric means at equal count (open) and equal time (filled)."""
    for k, (strategy, beyond) in enumerate(itertools.product(LINES, (False, True))):
        count = mean(ratios(result, strategy, 0, beyond))
        paid = count * cost[strategy] / cost["lobe_first"]
        ax.plot([count, paid], [k, k], color=BLACK, lw=0.8)
        ax.plot(count, k, "o", mfc="white", mec=BLACK)
        ax.plot(paid, k, "o", color=BLACK)
    names = [f"{s}\n{w} {ORDINARY}°" for s in LINES for w in ("to", "beyond")]
    ax.set(xscale="log", xlim=(0.05, 1), yticks=range(4), yticklabels=names)
    ax.set(xlabel="variance (open), variance x time (filled)", ylim=(3.5, -0.5))


def draw():
    """Ratios for three absorptions, and their means at equal count and time."""
    result, cost = measure(), costs()
    fig = figure(6.0)
    axes = fig.subplots(2, 2).ravel()
    for ax, letter, sigma_a in zip(axes, "abc", SIGMAS, strict=False):
        draw_ratios(ax, result, sigma_a)
        title(ax, letter, rf"weight of a sample, $\sigma_a$ = {sigma_a:g} per radius")
    draw_means(axes[3], result, cost)
    title(axes[3], "d", "geometric means")
    keys = [Line2D([], [], color=color) for color in COLORS]
    keys += [Line2D([], [], color=BLACK, ls=line) for line in LINES.values()]
    names = [*(rf"$\beta$ = {b} rad" for b in BETAS), *LINES]
    axes[0].legend(keys, names, loc="lower left", ncols=2)
    return Drawing(fig, "Variance of the weights by strategy", table(result, cost))


def main(argv=None):
    """Draw variance.svg and write variance.csv."""
    run("variance", __doc__, draw, argv)


if __name__ == "__main__":
    main()
