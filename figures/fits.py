"""The four fits, published and refitted, each above its error.

The forms, what they stand for and how the error is measured are those of fits/*.py; the
constants are those of fits/constants.
"""

from typing import Any

import numpy as np
from shared.fits import LOOKS, constants, entry, script
from shared.style import BLACK, GRAY, Drawing, degrees, figure, run, title

SMALL_A = 0.35


def draw_fit(axes, name, x, exact, approx, error, style: Any = "-"):
    """The exact curve and the fits, and below them the errors times 100.

    `approx` and `error` are functions of the constants.
    """
    above, below = axes
    above.plot(x, exact, color=BLACK, alpha=0.3, lw=4)
    for which, k in constants(name).items():
        color = LOOKS[which].color
        above.plot(x, approx(k), color=color, lw=1, ls=style)
        below.plot(x, 100 * np.asarray(error(k)), color=color, ls=style)


def largest(axes, name, unit):
    """The largest errors, above their panel; the colors of these words are the key."""
    _, below = axes
    errors = entry(name)["error"]
    below.axhline(0, color=BLACK, lw=0.8)
    for which, x, ha in zip(
        LOOKS, (0, 0.525, 1), ("left", "center", "right"), strict=True
    ):
        color, word = LOOKS[which]
        text = f"{word} {100 * errors[which]['max']:.2f}{unit}"
        below.text(x, 1.03, text, color=color, ha=ha, size=8, transform=below.transAxes)


def draw_eta_prime(axes):
    """eta' cos theta_d over cos theta_d."""
    fit = script("eta_prime")
    c = np.linspace(0.002, 1, 500)
    theta_d = np.arccos(c)
    draw_fit(
        axes,
        "eta_prime",
        c,
        c * fit.exact(theta_d),
        lambda k: c * fit.approx(k, c),
        lambda k: fit.error(k, c, theta_d),
    )
    largest(axes, "eta_prime", " %")
    axes[0].text(0.66, 1.41, "exact", color=GRAY, ha="right")
    axes[0].set(ylabel=r"$\eta' \cos\theta_d$", xlim=(0, 1))
    axes[1].set(
        ylabel="relative error, %", xlabel=r"$\cos\theta_d$", ylim=(-0.85, 0.85)
    )


def draw_h_tt(axes):
    """h over phi, at two a."""
    fit = script("h_tt")
    for a, style in ((SMALL_A, (0, (4, 1.5))), (fit.LARGEST_A, "-")):
        x = np.linspace(2 * np.arcsin(a), np.pi, 361)
        draw_fit(
            axes,
            "h_tt",
            np.degrees(x),
            fit.exact(a, x),
            lambda k, a=a, x=x: fit.approx(k, a, x),
            lambda k, a=a, x=x: fit.error(k, a, x),
            style,
        )
    largest(axes, "h_tt", " %")
    axes[0].text(40, 0.72, rf"$a = 1/\eta' = {SMALL_A}$")
    axes[0].text(133, 0.97, "$a = 1/1.55$")
    degrees(axes[0], "x", 30, 180, 30)
    axes[0].set(ylabel="$h$", ylim=(0, 1.08))
    axes[1].set(
        ylabel="error, % of the radius", xlabel=r"azimuth $\varphi$", ylim=(-17, 5)
    )


def draw_density(axes, name, low, high, step):
    """A density over phi."""
    fit = script(name)
    phi = np.linspace(low, high, 541)
    x = np.radians(phi)
    draw_fit(
        axes,
        name,
        phi,
        fit.exact(x),
        lambda k: fit.approx(k, x),
        lambda k: fit.error(k, x),
    )
    largest(axes, name, " %")
    degrees(axes[0], "x", low, high, step)
    axes[0].set(ylabel="$D$ per radian", ylim=(0, None))
    axes[1].set(ylabel="error, % of the peak", xlabel=r"azimuth $\varphi$")


def draw():
    """Four pairs of panels."""
    fig = figure(8.8)
    grid = fig.add_gridspec(2, 2)
    pairs = [
        grid[i, j]
        .subgridspec(2, 1, height_ratios=(1.2, 1))
        .subplots(sharex=True, squeeze=False)[:, 0]
        for i in range(2)
        for j in range(2)
    ]
    draw_eta_prime(pairs[0])
    title(
        pairs[0][0], "a", r"eta_prime: $\eta' \approx a/c + b\,c,\;\; c = \cos\theta_d$"
    )
    draw_h_tt(pairs[1])
    title(
        pairs[1][0],
        "b",
        r"h_tt: $h \approx (1 + a\,(k_0 + k_1 \cos\varphi))\,\cos\varphi/2$",
    )
    draw_density(pairs[2], "d_tt", 0, 180, 30)
    title(pairs[2][0], "c", r"d_tt: $D \approx \exp(k_0 \cos\varphi + k_1)$")
    draw_density(pairs[3], "d_trt", 0, 90, 15)
    title(pairs[3][0], "d", r"d_trt: $D \approx \exp(k_0 \cos\varphi + k_1)$")
    return Drawing(fig, "Published and refitted constants, and their errors")


def main(argv=None):
    """Draw fits.svg."""
    run("fits", __doc__, draw, argv)


if __name__ == "__main__":
    main()
