"""Albedo of a clear fiber in a uniformly bright room, where nothing may get lost.

With attenuations at theta_i the albedo is 1 for any widths and tilts. With attenuations
at theta_d, as d'Eon et al. publish it, lobes of unequal widths or tilted cones weight
theta_d differently, and it is not. Below, what is lost without the higher lobes.
"""

import numpy as np
from matplotlib.lines import Line2D
from shared.style import (
    BLACK,
    BLUE,
    ORANGE,
    SKY,
    VERMILION,
    Drawing,
    Table,
    degrees,
    figure,
    run,
    title,
)

import fiberjax

ETA = 1.55
BETA_M = (0.05, 0.2, 0.6, 0.9)
COLORS = (SKY, BLUE, ORANGE, VERMILION)
ALPHA = (-2.5, 0.0, 2.5)
INCIDENCE = ("theta_d", "theta_i")
EDGE = 89.9
# Closer together towards the poles, where the curves bend.
HALF = (*range(0, 70, 2), *np.arange(70, 89.5, 0.5), 89.7, EDGE)
THETA_I = np.array([*(-x for x in HALF[:0:-1]), *HALF], float)
HEADER = ("incidence", "beta_m", "alpha_deg", "theta_i_deg", "albedo", "rest")


def measure():
    """Albedo and the share of the lobes beyond TRT.

    Keys are (incidence, beta_m, alpha); values have two rows, over THETA_I.
    """
    result = {}
    for incidence in INCIDENCE:
        for beta_m in BETA_M:
            for alpha in ALPHA:
                fiber = fiberjax.Fiber(
                    eta=ETA, beta_m=beta_m, alpha=np.radians(alpha), sigma_a=None
                )
                parts = fiberjax.albedo(
                    fiber, np.radians(THETA_I), per_lobe=True, incidence=incidence
                )
                parts = np.asarray(parts)
                result[incidence, beta_m, alpha] = parts.sum(axis=0), parts[-1]
    return result


def table(result):
    """One row for each albedo, in 12 decimals: more would be rounding."""
    rows = (
        (*map(str, key), f"{theta_i:g}", f"{albedo:.12f}", f"{rest:.12f}")
        for key, columns in result.items()
        for theta_i, albedo, rest in zip(THETA_I, *columns, strict=True)
    )
    return Table(HEADER, rows)


def draw_albedo(ax, result, alpha):
    """The albedo over theta_i at one tilt."""
    for beta_m, color in zip(BETA_M, COLORS, strict=True):
        ax.plot(THETA_I, result["theta_i", beta_m, alpha][0], color=BLACK)
        ax.plot(THETA_I, result["theta_d", beta_m, alpha][0], color=color)
    ax.set(ylim=(0.7, 1.15), ylabel="albedo")


def draw_rest(ax, result):
    """The share of the lobes beyond TRT; it is untilted."""
    ax.plot(THETA_I, result["theta_i", BETA_M[0], 0.0][1], color=BLACK)
    for beta_m, color in zip(BETA_M, COLORS, strict=True):
        ax.plot(THETA_I, result["theta_d", beta_m, 0.0][1], color=color)
    ax.set(ylim=(0, 0.15), ylabel="share of the light")


def draw():
    """The furnace for three tilts, and the share of the lobes beyond TRT."""
    result = measure()
    fig = figure(6.0)
    axes = fig.subplots(2, 2).ravel()
    for ax, letter, alpha in zip(axes, "abc", ALPHA, strict=False):
        draw_albedo(ax, result, alpha)
        title(ax, letter, rf"albedo, tilt $\alpha = {alpha:g}$°")
    draw_rest(axes[3], result)
    title(axes[3], "d", "lost if the sum stops at TRT")
    for ax in axes:
        degrees(ax, "x", -90, 90, 30)
        ax.set(xlabel=r"inclination $\theta_i$")
    keys = [Line2D([], [], color=color) for color in (*COLORS, BLACK)]
    names = [rf"at $\theta_d$, $\beta_m$ = {beta_m} rad" for beta_m in BETA_M]
    axes[1].legend(
        keys,
        [*names, r"at $\theta_i$, every $\beta_m$"],
        loc="lower center",
        title="attenuations taken",
    )
    return Drawing(fig, "Albedo of a clear fiber over the inclination", table(result))


def main(argv=None):
    """Draw furnace.svg and write furnace.csv."""
    run("furnace", __doc__, draw, argv)


if __name__ == "__main__":
    main()
