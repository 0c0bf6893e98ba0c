"""The densities of TT and TRT in their place, against the lobes they stand for.

N_p is approximated by A(p, h) D(phi) with one offset h for each azimuth, A exact, for a
clear fiber. The published D has no roughness to set; the refit is the minimax D of that
lobe, inclination and roughness.
"""

import numpy as np
from matplotlib.lines import Line2D
from shared.fits import LOOKS, entry, script
from shared.style import (
    BLACK,
    BLUE,
    LOBES,
    SKY,
    Drawing,
    degrees,
    figure,
    run,
    title,
)

FITS = {1: "d_tt", 2: "d_trt"}
REFIT = (0, (3, 2))
THETA_D = (0, 30, 60)
BETA_N = {0.1: BLACK, 0.35: BLUE, 0.7: SKY}


def refit(name, theta_d, beta_n):
    """The minimax constants of one inclination and roughness."""
    for cell in entry(name)["against_reference"]["cells"]:
        if (cell["theta_d_degrees"], cell["beta_n"]) == (theta_d, beta_n):
            return script(name).Constants(**cell["constants"]["minimax"])
    raise LookupError(f"{name}: no fit at theta_d = {theta_d}, beta_n = {beta_n}")


def draw_lobe(ax, p, theta_d):
    """N_p, the published A D and the refitted ones, over phi."""
    name = FITS[p]
    fit, lobes = script(name), script("shared.lobes")
    angle = np.radians(theta_d)
    cells = {b: lobes.cell(p, fit.cos_gamma, angle, b) for b in BETA_N}
    for beta_n, (peak, table) in cells.items():
        phi, factor, color = np.degrees(table.phi), peak * table.factor, BETA_N[beta_n]
        ax.plot(phi, peak * table.lobe, color=color)
        k = refit(name, theta_d, beta_n)
        ax.plot(phi, factor * fit.approx(k, table.phi), color=color, ls=REFIT, lw=1.1)
    # A and D are the same in every cell.
    peak, table = cells[min(cells)]
    value = peak * table.factor * fit.approx(fit.PUBLISHED, table.phi)
    ax.plot(np.degrees(table.phi), value, color=LOOKS["published"].color, lw=2)
    ax.set(ylim=(0, None))


def draw():
    """TT above, TRT below, at three inclinations."""
    fig = figure(5.8)
    axes = fig.subplots(2, 3)
    letters = iter("abcdef")
    for row, p in zip(axes, FITS, strict=True):
        for ax, theta_d in zip(row, THETA_D, strict=True):
            draw_lobe(ax, p, theta_d)
            title(ax, next(letters), rf"{LOBES[p]}, $\theta_d$ = {theta_d}°")
            degrees(ax, "x", 0, 180, 60)
            ax.set(xlabel=r"azimuth $\varphi$")
        row[0].set(ylabel=rf"$N_{{{LOBES[p]}}}$ per radian")
    keys = [Line2D([], [], color=color) for color in BETA_N.values()]
    keys.append(Line2D([], [], color=BLACK, ls=REFIT, lw=1.1))
    keys.append(Line2D([], [], color=LOOKS["published"].color, lw=2))
    names = [rf"$N$, $\beta_n$ = {beta_n} rad" for beta_n in BETA_N]
    names += ["$A D$, refitted to each", "$A D$, published"]
    fig.legend(keys, names, loc="outside upper center", ncols=5, columnspacing=1.3)
    return Drawing(fig, "Published densities of TT and TRT against the lobes")


def main(argv=None):
    """Draw fits_against_lobes.svg."""
    run("fits_against_lobes", __doc__, draw, argv)


if __name__ == "__main__":
    main()
