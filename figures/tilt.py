"""The signs: inclination and tilt along the fiber, offset and azimuth around it.

Cones, exits and azimuths are fiberjax's own. The tilt is several times that of hair, so
that it can be seen; the cross section is that of eta' = 1.55.
"""

import numpy as np
from matplotlib.patches import Circle, Ellipse, Polygon
from shared.style import (
    BLACK,
    GLASS,
    GRAY,
    LOBE_COLORS,
    LOBES,
    Drawing,
    degrees,
    figure,
    run,
    title,
)

import fiberjax
from fiberjax.fiber import cone, lobe_shape

ETA = 1.55
THETA_I = 35.0
ALPHA = 8.0
H = 0.6
RADIUS = 0.13
REACH = 1.15
SHIFTS = (r"$+2\alpha$", r"$-\alpha$", r"$-4\alpha$")
PATCH = {"fc": "white", "ec": "none", "pad": 1}
DASHED = {"color": GRAY, "lw": 0.9, "ls": (0, (4, 3)), "zorder": 1}


def arrow(ax, start, end, color, **look):
    """A straight arrow."""
    ends = {"shrinkA": 0, "shrinkB": 0, "mutation_scale": 10, "lw": 1.5}
    look = {"arrowstyle": "-|>", "color": color} | ends | look
    ax.annotate("", end, start, arrowprops=look)


def turn(ax, center, radius, start, end, color=BLACK):
    """The turn from start to end, in degrees of the page, as an arc with an arrow."""
    t = np.radians(np.linspace(start, end, 60))
    x, y = center[0] + radius * np.cos(t), center[1] + radius * np.sin(t)
    ax.plot(x[:-4], y[:-4], color=color, lw=1)
    last = (x[-5], y[-5]), (x[-1], y[-1])
    arrow(ax, *last, color, lw=1, mutation_scale=7)


def label(ax, place, text, color=BLACK, **look):
    """Text centered on a place."""
    ax.text(*place, text, **{"color": color, "ha": "center", "va": "center"} | look)


def direction(theta, far=False):
    """Direction of inclination theta in degrees, up, or down on the far side."""
    t = np.radians(theta)
    return np.array([np.sin(t), -np.cos(t) if far else np.cos(t)])


def specular(theta_i, alpha, p):
    """Inclination of a lobe's cone; all angles in degrees."""
    fiber = fiberjax.Fiber(eta=ETA, alpha=np.radians(alpha), sigma_a=None)
    return float(np.degrees(cone(np.radians(theta_i), lobe_shape(fiber, p))))


def draw_fiber(ax, tilt):
    """The fiber from the side; scales turn the normals of its surface by `tilt`."""
    edges = np.linspace(-1.2, 1.2, 10)
    drop = (edges[1] - edges[0]) * np.tan(np.radians(tilt))
    x = np.repeat(edges, 2)[1:-1]
    y = RADIUS + np.tile([drop / 2, -drop / 2], len(edges) - 1)
    outline = np.concatenate([np.stack([x, y], 1), np.stack([x, -y], 1)[::-1]])
    ax.add_patch(Polygon(outline, fc=GLASS, ec=BLACK, lw=1, zorder=3))
    arrow(ax, (1.2, 0), (1.62, 0), BLACK)
    label(ax, (1.48, -0.19), "tangent")
    ax.plot([0, 0], [-1.3, 1.3], **DASHED)
    ax.set(aspect="equal", xlim=(-1.6, 1.8), ylim=(-1.5, 1.5))
    ax.axis("off")
    ax.set_anchor("N")


def draw_cone(ax, theta, color):
    """All directions of one inclination: a circle, seen almost from its side."""
    x, y = REACH * direction(theta)
    ax.add_patch(Ellipse((x, 0), 0.16, 2 * y, fc="none", ec=color, lw=0.8, zorder=1))


def draw_inclination(ax):
    """theta_i, and the specular cone without tilt."""
    draw_fiber(ax, 0.0)
    theta_o = specular(THETA_I, 0.0, 0)
    draw_cone(ax, theta_o, LOBE_COLORS[0])
    for theta, name, text, color in (
        (THETA_I, r"$\theta_i$", r"$\theta_i > 0$", BLACK),
        (theta_o, r"$\theta_o$", r"$\theta_o = -\theta_i$", LOBE_COLORS[0]),
    ):
        arrow(ax, (0, 0), REACH * direction(theta), color, zorder=2)
        turn(ax, (0, 0), 0.55, 90, 90 - theta, color)
        label(ax, 0.74 * direction(theta / 2), name, color)
        label(ax, REACH * direction(theta) + (0, 0.12), text, color)
    label(ax, (0, -1.38), "normal plane", GRAY)
    label(ax, (0.93, 1.06), "to the light", ha="left")
    label(ax, (-0.66, -1.1), "specular cone", LOBE_COLORS[0])


def draw_tilt(ax):
    """The cones of light at normal incidence on tilted scales."""
    draw_fiber(ax, ALPHA)
    arrow(ax, (0, 1.42), (0, RADIUS), BLACK)
    label(ax, (-0.06, 1.42), r"light, $\theta_i$ = 0", ha="right")
    label(ax, (-1.38, 0), "tip", GRAY)
    label(ax, (1.42, 0.14), "root", GRAY)
    # Both normals at the middle of a scale, where the radius is that of the fiber.
    foot, length = np.array([0.8, RADIUS]), 0.5
    ax.plot(*np.transpose([foot, foot + length * direction(0)]), **DASHED)
    arrow(ax, foot, foot + length * direction(ALPHA), BLACK, lw=1, mutation_scale=7)
    label(ax, foot + (length + 0.11) * direction(ALPHA / 2), r"$\alpha$")
    for p, (name, color, shift) in enumerate(
        zip(LOBES, LOBE_COLORS, SHIFTS, strict=True)
    ):
        # Every other lobe leaves on the far side.
        theta, far = specular(0.0, ALPHA, p), p % 2 == 1
        draw_cone(ax, theta, color)
        arrow(ax, (0, 0), REACH * direction(theta, far), color, zorder=2)
        text = rf"$\bf{{{name}}}$ {shift}"
        label(ax, (REACH + 0.14) * direction(theta, far), text, color, bbox=PATCH)


def page(azimuth):
    """Direction of an azimuth: light from the left, tangent towards the reader."""
    return -np.array([np.cos(azimuth), np.sin(azimuth)])


def draw_offset(ax):
    """The scale of h, at the left of the cross section."""
    ax.plot([-2.1, -2.1], [-1, 1], color=BLACK, lw=1)
    for h, text in ((-1, "$-1$"), (0, "0"), (H, f"{H:g}"), (1, "1")):
        ax.plot([-2.15, -2.1], [h, h], color=BLACK, lw=1)
        label(ax, (-2.22, h), text, ha="right")
    label(ax, (-2.1, 1.25), "offset $h$")


def traced(h):
    """Where the ray of offset h meets the circle, and the azimuths it leaves towards.

    It leaves at gamma_i from the normal of each point, so the point has the azimuth
    Phi + gamma_i.
    """
    eta_p = fiberjax.eta_prime(0.0, ETA)
    exits = [float(fiberjax.Phi(p, h, eta_p)) for p in range(len(LOBES))]
    return [page(phi + float(np.arcsin(h))) for phi in exits], exits


def draw_section(ax):
    """One ray through the cross section."""
    points, exits = traced(H)
    entry = points[0]
    ax.add_patch(Circle((0, 0), 1, fc=GLASS, ec=BLACK, lw=1))
    ax.plot([-2.1, 1.75], [0, 0], **DASHED)
    ax.plot(*np.transpose([0 * entry, 1.6 * entry]), **DASHED)
    arrow(ax, (-2.1, H), entry, BLACK)
    ax.plot(*np.transpose(points), color=BLACK, lw=1.5)
    normal = 180 - np.degrees(np.arcsin(H))
    inside = np.degrees(np.arctan2(*(points[1] - entry)[::-1]))
    for name, radius, start, end in (
        (r"$\gamma_i$", 0.45, 180, normal),
        (r"$\gamma_t$", 0.5, normal - 180, inside),
    ):
        turn(ax, entry, radius, start, end)
        middle = np.radians((start + end) / 2)
        place = np.array([np.cos(middle), np.sin(middle)])
        label(ax, entry + (radius + 0.14) * place, name)
    ax.plot(0, 0, "o", color=BLACK, ms=2.5)
    ax.add_patch(Circle((0, 0), 0.06, fc="none", ec=BLACK, lw=0.9))
    label(ax, (-0.3, -0.18), "tangent")
    turn(ax, (0, 0), 1.3, 180, 203)
    label(ax, (-1.55, -0.27), r"$\varphi > 0$")
    places = ((-1.05, 1.55), (1.55, -0.42), (-1.5, -1.2))
    for name, color, phi, point, place in zip(
        LOBES, LOBE_COLORS, exits, points, places, strict=True
    ):
        arrow(ax, point, point + 0.8 * page(phi), color)
        text = rf"$\bf{{{name}}}$  $\Phi = {np.degrees(phi):.0f}$°"
        label(ax, place, text, color)
    ax.set(aspect="equal", xlim=(-2.5, 2.1), ylim=(-1.4, 1.7))
    ax.axis("off")
    ax.set_anchor("N")


def draw_azimuth(ax):
    """Phi over the offset."""
    h = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 361))
    eta_p = fiberjax.eta_prime(0.0, ETA)
    places = ((-0.62, 95), (-0.62, 228), (-0.62, 357))
    for p, (name, color, place) in enumerate(
        zip(LOBES, LOBE_COLORS, places, strict=True)
    ):
        ax.plot(h, np.degrees(fiberjax.Phi(p, h, eta_p)), color=color)
        ax.plot(H, np.degrees(fiberjax.Phi(p, H, eta_p)), "o", color=color, ms=5)
        label(ax, place, name, color, weight="bold", ha="left", va="bottom")
    ax.axvline(H, **DASHED)
    for phi, text in ((0, "back"), (180, "forward"), (360, "back")):
        label(ax, (1.03, phi), text, GRAY, ha="left")
    degrees(ax, "y", -180, 450, 90)
    ax.set(
        xlim=(-1, 1),
        xticks=np.linspace(-1, 1, 5),
        xlabel="offset $h$",
        ylabel=r"azimuth $\Phi$",
    )


def draw():
    """The four panels."""
    fig = figure(6.9)
    axes = fig.subplots(2, 2, height_ratios=(1, 0.95))
    draw_inclination(axes[0, 0])
    title(axes[0, 0], "a", "inclination: positive towards the tangent")
    draw_tilt(axes[0, 1])
    title(axes[0, 1], "b", r"tilt $\alpha > 0$: normals turned towards the tangent")
    draw_section(axes[1, 0])
    draw_offset(axes[1, 0])
    title(axes[1, 0], "c", f"offset and azimuth: the ray $h = {H:g}$")
    draw_azimuth(axes[1, 1])
    title(axes[1, 1], "d", rf"where every ray leaves, $\eta' = {ETA:g}$")
    return Drawing(fig, "Sign conventions of inclination, tilt, offset and azimuth")


def main(argv=None):
    """Draw tilt.svg."""
    run("tilt", __doc__, draw, argv)


if __name__ == "__main__":
    main()
