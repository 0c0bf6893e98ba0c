"""The lobes of one fiber: N around it, M along it, and their product over the sphere.

A clear fiber of eta 1.55 whose scales are tilted by -3 degrees. N for light at normal
incidence, M and S cos(theta_o) for light at theta_i = 45 degrees.
"""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from shared.style import (
    BLACK,
    GLASS,
    GRAY,
    LOBE_COLORS,
    LOBES,
    PALE,
    Drawing,
    degrees,
    figure,
    run,
    title,
)

import fiberjax
from fiberjax.fiber import cone, lobe_shape

ETA = 1.55
ALPHA = -3.0
BETA_M = 0.15
BETA_N = 0.2
THETA_I = 45.0
STYLES = {0.05: ":", BETA_N: "-", 0.5: (0, (5, 1.5))}
# Resolves the narrowest lobe.
RULE = fiberjax.GaussGamma(400)
PHI = np.linspace(0, 180, 361)
SHIFTS = (r"$-\theta_i + 2\alpha$", r"$-\theta_i - \alpha$", r"$-\theta_i - 4\alpha$")
PLACES = ((4.5, -58), (3.9, -33), (2.0, -22))
RANGE = (-90, 60)
DECADES = range(-4, 1)


def azimuthal(p):
    """N_p at theta_d = 0, one row for each roughness, over PHI."""
    rows = np.array(list(STYLES))[:, None]
    value = fiberjax.N(
        p, np.radians(PHI), 0.0, eta=ETA, sigma_a=None, beta_n=rows, rule=RULE
    )
    return np.asarray(value)


def draw_polar(ax, lobes):
    """N_p around the fiber, light from the left, the tangent towards the reader."""
    phi = np.radians(np.concatenate([-PHI[:0:-1], PHI]))
    out = -np.stack([np.cos(phi), np.sin(phi)])
    for level, name in ((0.1, "0.1"), (0.2, "0.2"), (0.4, "$N_p$ = 0.4")):
        ring = Circle((0, 0), np.sqrt(level), fc="none", ec=PALE, lw=0.7, zorder=0)
        ax.add_patch(ring)
        x, y = np.sqrt(level) * np.array([np.cos(-2.0), np.sin(-2.0)])
        box = {"fc": "white", "ec": "none", "pad": 1}
        ax.text(x, y, name, size=8, color=GRAY, ha="center", va="center", bbox=box)
    for lobe, color in zip(lobes, LOBE_COLORS, strict=True):
        for (beta_n, style), row in zip(STYLES.items(), lobe, strict=True):
            x, y = np.sqrt(np.concatenate([row[:0:-1], row])) * out
            usual = beta_n == BETA_N
            if usual:
                ax.fill(x, y, color=color, alpha=0.18, lw=0)
            ax.plot(x, y, color=color, ls=style, lw=1.5 if usual else 1)
    ax.add_patch(Circle((0, 0), 0.04, fc=GLASS, ec=BLACK, lw=0.9, zorder=5))
    for y in (-0.03, 0, 0.03):
        arrow = {"arrowstyle": "-|>", "color": GRAY, "lw": 0.9}
        ax.annotate("", (-0.36, y), (-0.7, y), arrowprops=arrow)
    ax.text(-0.7, 0.065, r"light, $\varphi$ = 0", size=8.5, color=GRAY)
    for name, color, x, y in zip(
        LOBES, LOBE_COLORS, (-0.09, 0.5, -0.22), (-0.145, 0.0, 0.15), strict=True
    ):
        ax.text(x, y, name, color=color, weight="bold", ha="center", va="center")
    ax.set(aspect="equal", xlim=(-0.72, 0.86), ylim=(-0.68, 0.68))
    ax.axis("off")
    ax.set_anchor("N")


def draw_around(ax, lobes):
    """N_p over phi for each roughness."""
    for lobe, color in zip(lobes, LOBE_COLORS, strict=True):
        for style, row in zip(STYLES.values(), lobe, strict=True):
            ax.plot(PHI, row, color=color, ls=style)
    for name, color, x, y in zip(
        LOBES, LOBE_COLORS, (8, 160, 8), (0.0128, 0.72, 0.115), strict=True
    ):
        ax.text(x, y, name, color=color, weight="bold", ha="center")
    keys = [Line2D([], [], color=BLACK, ls=style) for style in STYLES.values()]
    names = [rf"$\beta_n$ = {beta_n} rad" for beta_n in STYLES]
    ax.legend(keys, names, loc="upper center", bbox_to_anchor=(0.42, 1.0))
    ax.set(
        yscale="log",
        ylim=(1e-3, 1.4),
        xlabel=r"azimuth $\varphi$, 0 towards the light",
        ylabel=r"$N_p$ per radian",
    )
    degrees(ax, "x", 0, 180, 30)


def draw_along(ax, fiber):
    """M_p over theta_o, with the specular cones; theta_o upwards, as in the map."""
    theta_i = np.radians(THETA_I)
    theta_o = np.linspace(*RANGE, 226)
    for p, (name, color, shift, place) in enumerate(
        zip(LOBES, LOBE_COLORS, SHIFTS, PLACES, strict=True)
    ):
        shape = lobe_shape(fiber, p)
        center, v = cone(theta_i, shape), shape.beta_m**2
        value = np.asarray(fiberjax.M(center, np.radians(theta_o), v))
        ax.plot(value, theta_o, color=color)
        ax.fill_betweenx(theta_o, value, color=color, alpha=0.18, lw=0)
        peak, at = float(fiberjax.M(center, center, v)), float(np.degrees(center))
        ax.plot([0, peak], [at, at], color=color, lw=1)
        label = rf"$\bf{{{name}}}$  {shift}"
        ax.text(*place, label, color=color, va="center")
    ax.axhline(-THETA_I, color=BLACK, lw=0.9, ls=(0, (4, 3)))
    ax.text(8.9, -49.5, r"$-\theta_i$", ha="right", va="center")
    given = (
        rf"light at $\theta_i$ = {THETA_I:.0f}°",
        rf"tilt $\alpha = {ALPHA:.0f}$°",
    )
    ax.text(8.7, 42, "\n".join(given), ha="right", va="center", linespacing=1.5)
    degrees(ax, "y", *RANGE, 30)
    ax.set(
        ylabel=r"outgoing inclination $\theta_o$",
        xlabel=r"$M_p$ per unit of $\sin\theta_o$",
        xlim=(0, 9),
    )


def draw_sphere(ax, fiber):
    """S cos(theta_o) over the directions."""
    phi, theta_o = np.linspace(-90, 270, 121), np.linspace(*RANGE, 76)
    # Even in phi: half the azimuths serve.
    half, which = np.unique(np.abs((phi + 180) % 360 - 180), return_inverse=True)
    value = fiberjax.evaluate(
        fiber, np.radians(THETA_I), np.radians(theta_o)[:, None], np.radians(half)
    )
    image = ax.contourf(
        phi,
        theta_o,
        np.asarray(value)[:, which],
        10.0 ** (np.arange(3 * min(DECADES), 3) / 3),
        norm=LogNorm(),
        cmap="magma_r",
        extend="both",
    )
    # Without edges the background shines through where two tints meet.
    image.set(edgecolor="face", linewidth=0.4)
    box = {"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none"}
    for name, color, place in zip(
        LOBES, LOBE_COLORS, ((75, -57), (180, -42), (0, -22)), strict=True
    ):
        ax.text(
            *place,
            name,
            color=color,
            weight="bold",
            ha="center",
            va="center",
            bbox=box,
        )
    ax.grid(False)
    degrees(ax, "x", -90, 270, 90)
    ax.tick_params("y", labelleft=False)
    ax.set(xlabel=r"azimuth $\varphi$, 0 towards the light")
    return image


def draw():
    """The four panels."""
    fiber = fiberjax.Fiber(
        eta=ETA, beta_m=BETA_M, beta_n=BETA_N, alpha=np.radians(ALPHA), sigma_a=None
    )
    lobes = [azimuthal(p) for p in range(len(LOBES))]
    fig = figure(7.0)
    above, below = fig.add_gridspec(2, 1, height_ratios=(1, 0.95))
    polar, around = above.subgridspec(1, 2).subplots(squeeze=False)[0]
    along, sphere = below.subgridspec(1, 2, width_ratios=(1, 1.7)).subplots(
        sharey=True, squeeze=False
    )[0]
    draw_polar(polar, lobes)
    title(polar, "a", r"$N_p$ around the fiber: equal areas, equal energy")
    draw_around(around, lobes)
    title(around, "b", r"$N_p$ over the azimuth, for three roughnesses")
    draw_along(along, fiber)
    title(along, "c", r"$M_p$ along the fiber")
    image = draw_sphere(sphere, fiber)
    title(sphere, "d", r"$S \cos\theta_o = \Sigma\, M_p N_p$ per steradian")
    bar = fig.colorbar(image, ax=sphere, aspect=30, pad=0.02)
    bar.set_ticks([10.0**k for k in DECADES])
    return Drawing(fig, "The lobes R, TT and TRT around and along a fiber")


def main(argv=None):
    """Draw lobes.svg."""
    run("lobes", __doc__, draw, argv)


if __name__ == "__main__":
    main()
