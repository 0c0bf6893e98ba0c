"""Where N, M and their derivatives are right, for our forms and for the textbook's.

Maps of log10 of the error in float64 and in float32: (a) N of TRT over roughness and
theta_d; (b) M over variance and inclination; (c, d) N of TRT over eta - 1 and sigma_a,
at a moderate and at a small roughness. Ours are fiberjax.N with its default rule and
fiberjax.M. The textbook's N has 70 Gauss-Legendre nodes in h, eta', arcsines, F as a
quotient of differences, 1 - F as a difference, D as a sum of images; its M is that of
renderers, with csch and log I0. Derivatives are by automatic differentiation, in every
argument. Truth is extended precision.

An error of N is relative to its peak over phi, that of a derivative to its own peak; in
phi and beta_n, where a derivative that nearly cancels is a difference of terms as large
as N/beta_n, to N's peak over min(beta_n, 1) if that is larger, in the others to N's
peak if that is larger. The worst of three azimuths is shown: one beta_n (at most 1 rad)
past Phi of h = 0.3, of the caustic and of grazing. A rounded Phi alone makes errors of
about 4 pi eps/beta_n. Errors of M, two deviations (at most 75 degrees) off the cone,
are relative to what rounding is in proportion to: 1 + |E|/2 times the modulus, E the
exponent, and for derivatives also M times the sum of the moduli of the terms. Numbers
below 1e-290, in float32 below 1e-30, may be lost. Truth is that of the arguments as the
precision holds them; eta is never below the next number after 1, as float32 has it for
eta - 1 below 1e-7.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator
from shared import precise
from shared.inches import place, write
from shared.naive import textbook_M
from shared.style import (
    GRAY,
    WIDTH,
    Drawing,
    Table,
    figure,
    progress,
    run,
)

import fiberjax

P = 2
NODES, WEIGHTS = np.polynomial.legendre.leggauss(70)
DTYPES = ("float64", "float32")
FORMS = ("ours", "textbook")
COLUMNS = tuple(itertools.product(FORMS, DTYPES))
# What is lost below these is no error.
LOST = {"float64": 1e-290, "float32": 1e-30}
ETA, SIGMA_A, THETA_D = 1.55, 0.25, 0.5
MODERATE, SMALL = 0.3, 0.01
# Below pi/2, as float32(pi/2) is not.
POLE = float(np.nextafter(np.float32(np.pi / 2), np.float32(0)))
INCLINATIONS = np.linspace(0, 90, 19)
FLOOR = -17.0
COLORS, COLORS_MAP = Normalize(-16, 0), "viridis"
HATCHED: Any = {
    "hatch": "//////",
    "facecolor": "white",
    "edgecolor": GRAY,
    "linewidth": 0,
}


def textbook_N(phi, theta_d, eta, sigma_a, beta_n):
    """N_p as the papers print it, at one point."""
    h, weight = jnp.asarray(NODES, phi.dtype), jnp.asarray(WEIGHTS, phi.dtype)
    eta_p = jnp.sqrt(eta**2 - jnp.sin(theta_d) ** 2) / jnp.cos(theta_d)
    gamma_i, gamma_t = jnp.arcsin(h), jnp.arcsin(h / eta_p)
    Phi = 2 * P * gamma_t - 2 * gamma_i + P * jnp.pi
    cos_i = jnp.cos(theta_d) * jnp.cos(gamma_i)
    cos_t = jnp.sqrt(1 - (1 - cos_i**2) / eta**2)
    r_s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    r_p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    F = (r_s**2 + r_p**2) / 2
    theta_t = jnp.arcsin(jnp.sin(theta_d) / eta)
    T = jnp.exp(-2 * sigma_a * jnp.cos(gamma_t) / jnp.cos(theta_t))
    A = (1 - F) ** 2 * F ** (P - 1) * T**P
    turns = 2 * jnp.pi * jnp.arange(-3, 4, dtype=phi.dtype)[:, None]
    images = jnp.exp(-((phi - Phi - turns) ** 2) / (2 * beta_n**2))
    D = images.sum(0) / (jnp.sqrt(2 * jnp.pi) * beta_n)
    return (weight * A * D).sum() / 2


def our_N(phi, theta_d, eta, sigma_a, beta_n):
    """N_p by the default rule."""
    return fiberjax.N(P, phi, theta_d, eta=eta, sigma_a=sigma_a, beta_n=beta_n)


def jet(f, count):
    """Value and derivatives of f at arrays of points, along a new first axis."""

    def at_one(*x):
        value, slopes = jax.value_and_grad(f, tuple(range(count)))(*x)
        return jnp.stack([value, *slopes])

    return jax.jit(jax.vmap(at_one, out_axes=1))


class Equation(NamedTuple):
    """A function, its argument names and their symbols, in two forms.

    `exact` maps arguments to the derivatives and to what errors are relative to.
    """

    symbol: str
    arguments: Mapping[str, str]
    forms: Mapping[str, Callable[..., Any]]
    exact: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

    @property
    def quantities(self) -> tuple[str, ...]:
        """The value and the arguments in which there are derivatives."""
        return ("value", *self.arguments)


def exact_N(x):
    """N and its derivatives, and what their errors are relative to."""
    points = precise.Points(*x.astype(precise.WIDE))
    # The peak does not depend on the azimuth.
    fibers, which = np.unique(x[1:], axis=1, return_inverse=True)
    peaks = precise.N_peaks(P, precise.Points(fibers[0], *fibers))[:, which]
    steep = peaks[0] / np.minimum(points.beta_n, 1)
    terms = [steep if key in ("phi", "beta_n") else peaks[0] for key in N.quantities]
    return precise.N(P, points), np.maximum(peaks, np.stack([peaks[0], *terms[1:]]))


def exact_M(x):
    """M, and what rounding errors are in proportion to."""
    return precise.M(*x), precise.M_scales(*x)


N = Equation(
    "N",
    {
        "phi": r"\varphi",
        "theta_d": r"\theta_d",
        "eta": r"\eta",
        "sigma_a": r"\sigma_a",
        "beta_n": r"\beta_n",
    },
    dict(zip(FORMS, (jet(our_N, 5), jet(textbook_N, 5)), strict=True)),
    exact_N,
)
M = Equation(
    "M",
    {"theta_cone": r"\theta_{\mathrm{cone}}", "theta_o": r"\theta_o", "v": "v"},
    dict(zip(FORMS, (jet(fiberjax.M, 3), jet(textbook_M, 3)), strict=True)),
    exact_M,
)


class Axis(NamedTuple):
    """What a map is drawn over, in the units of the figure and of the table."""

    label: str
    values: np.ndarray
    ticks: Sequence[float]
    unit: str = ""


class Map(NamedTuple):
    """An equation over two axes.

    `points` turns places of pixels and a dtype into arguments that it holds, of shape
    (arguments, azimuths, pixels) and as float64.
    """

    name: str
    title: str
    equation: Equation
    x: Axis
    y: Axis
    points: Callable[[np.ndarray, np.ndarray, str], np.ndarray]


def single(x):
    """The float32 numbers next to x, as float64."""
    return np.asarray(x, np.float32).astype(float)


def azimuths(theta_d, eta, sigma_a, beta_n):
    """Arguments of N at the three azimuths of each fiber."""
    theta_d, eta, sigma_a, beta_n = np.broadcast_arrays(theta_d, eta, sigma_a, beta_n)
    marks = precise.landmarks(P, theta_d, eta, 0.3) + P * np.pi
    phi = single(precise.wrap(marks + np.minimum(beta_n, 1)))
    fibers = (np.broadcast_to(x, phi.shape) for x in (theta_d, eta, sigma_a, beta_n))
    return np.stack([phi, *fibers])


def inclination(degrees):
    """In radians, rounded to float32, short of the pole."""
    return np.minimum(single(np.radians(degrees)), POLE)


def by_roughness(log_beta, degrees, _):
    """Arguments of N over roughness and theta_d."""
    beta_n = single(10.0**log_beta)
    return azimuths(inclination(degrees), single(ETA), single(SIGMA_A), beta_n)


def by_variance(log_v, degrees, _):
    """Arguments of M over variance and the inclination of the cone."""
    v, theta = single(10.0**log_v), inclination(degrees)
    theta_o = single(theta - np.minimum(2 * np.sqrt(v), np.radians(75)))
    return np.stack([theta, theta_o, v])[:, None]


def by_index(beta_n):
    """Arguments of N over eta - 1 and sigma_a."""

    def points(log_index, log_sigma, dtype):
        eta = (1 + 10.0**log_index).astype(dtype)
        eta = np.maximum(eta, 1 + np.finfo(dtype).eps).astype(float)
        return azimuths(single(THETA_D), eta, single(10.0**log_sigma), single(beta_n))

    return points


TRT = r"$N_{\mathrm{TRT}}$"
DEGREES = Axis(r"$\theta_d$", INCLINATIONS, (30, 60), "°")
INDEX = Axis(r"$\log_{10}(\eta - 1)$", np.linspace(-12, np.log10(2), 25), (-10, -6, -2))
ABSORPTION = Axis(r"$\log_{10}\sigma_a$ per radius", np.linspace(-6, 3, 19), (-4, 0))
MAPS = (
    Map(
        "roughness",
        rf"{TRT} over roughness, $\eta$ = {ETA}, $\sigma_a$ = {SIGMA_A} per radius",
        N,
        Axis(r"$\log_{10}\beta_n$, rad", np.linspace(-6, 2, 25), (-5, -3, -1, 1)),
        DEGREES,
        by_roughness,
    ),
    Map(
        "variance",
        r"$M$ over variance, two deviations off the cone",
        M,
        Axis(r"$\log_{10} v$, rad²", np.linspace(-8, 4, 25), (-6, -2, 2)),
        DEGREES._replace(label=r"$\theta_{\mathrm{cone}}$"),
        by_variance,
    ),
    *(
        Map(
            name,
            rf"{TRT} over index and absorption, $\beta_n$ = {beta_n} rad, "
            rf"$\theta_d$ = {THETA_D} rad",
            N,
            INDEX,
            ABSORPTION,
            by_index(beta_n),
        )
        for name, beta_n in (("index", MODERATE), ("index_narrow", SMALL))
    ),
)


def errors(plan, x, y, columns=COLUMNS):
    """log10 of the error by form and dtype, shape (quantities, pixels); NaN if none.

    x and y are the places of the pixels, in the units of the axes.
    """
    given = {dtype: plan.points(x, y, dtype) for dtype in DTYPES}
    lined = [z.reshape(len(z), -1) for z in given.values()]
    unique, which = np.unique(np.hstack(lined), axis=1, return_inverse=True)
    exact, scale = plan.equation.exact(unique)
    parts = dict(zip(DTYPES, np.split(which.ravel(), len(DTYPES)), strict=True))
    found = {}
    for form, dtype in columns:
        at, shape = parts[dtype], given[dtype].shape[1:]
        arguments = jnp.asarray(unique[:, at], dtype)
        value = np.asarray(plan.equation.forms[form](*arguments), precise.WIDE)
        lost = LOST[dtype] / np.finfo(dtype).eps
        off = np.abs(value - exact[:, at]) / np.maximum(scale[:, at], lost)
        found[form, dtype] = logarithm(off.reshape(-1, *shape).max(axis=1))
    return found


def logarithm(error):
    """log10, to one decimal and not below the floor; NaN where there is no number."""
    error = np.where(np.isfinite(error), np.maximum(error, 10**FLOOR), np.nan)
    return np.round(np.log10(error).astype(float), 1)


def pixels(plan):
    """Places of every pixel, row by row."""
    x, y = np.meshgrid(plan.x.values, plan.y.values)
    return x.ravel(), y.ravel()


def measure():
    """The errors of every map, by its name."""
    precise.require_wide()
    result = {}
    for plan in MAPS:
        progress(f"errors over {plan.name}")
        result[plan.name] = errors(plan, *pixels(plan))
    return result


def table(result):
    """One row for each pixel and quantity; the columns are forms and dtypes."""
    header = ("map", "quantity", "x", "y", *("_".join(column) for column in COLUMNS))
    rows = []
    for plan in MAPS:
        found = np.stack([result[plan.name][column] for column in COLUMNS], axis=-1)
        for quantity, line in zip(plan.equation.quantities, found, strict=True):
            for x, y, cell in zip(*pixels(plan), line, strict=True):
                place = f"{x:.4g}", f"{y:.4g}"
                rows.append((plan.name, quantity, *place, *(f"{e:.1f}" for e in cell)))
    return Table(header, rows)


# Inches.
LEFT, ACROSS, DOWN, GAP = 1.22, 1.18, 0.56, 0.05
ABOVE, BELOW = 0.5, 0.56
BLOCK = ABOVE + 4 * (DOWN + GAP) + BELOW
EDGE = 0.05


def draw_panel(ax, plan, values):
    """The errors of one quantity; what is not finite shows the hatched ground."""
    x, y = plan.x.values, plan.y.values
    half_x, half_y = (x[1] - x[0]) / 2, (y[1] - y[0]) / 2
    ax.imshow(
        values.reshape(len(y), len(x)),
        origin="lower",
        aspect="auto",
        extent=(x[0] - half_x, x[-1] + half_x, y[0] - half_y, y[-1] + half_y),
        norm=COLORS,
        cmap=COLORS_MAP,
        interpolation="none",
    )
    if np.isnan(values).any():
        ax.patch.set(**HATCHED)
    ax.grid(False)
    ax.spines[:].set_visible(False)


def ticks(axis, plan, shown):
    """Ticks and their labels on the outer panels, none on the others."""
    axis.set_major_locator(FixedLocator(plan.ticks if shown else ()))
    axis.set_major_formatter(f"${{x:.0f}}${plan.unit}")
    axis.set_tick_params(length=2, pad=2)


def symbol(equation, quantity):
    """The heading of a column."""
    if quantity == "value":
        return rf"${equation.symbol}$"
    name = equation.arguments[quantity]
    return rf"$\partial {equation.symbol}/\partial {name}$"


def draw_map(fig, top, letter, plan, found):
    """Forms and dtypes below each other, quantities side by side."""
    rows, columns = list(itertools.product(DTYPES, FORMS)), plan.equation.quantities
    first = top + ABOVE
    for (row, key), column in itertools.product(enumerate(rows), range(len(columns))):
        left, down = LEFT + column * (ACROSS + GAP), first + row * (DOWN + GAP)
        ax = place(fig, left, down, ACROSS, DOWN)
        draw_panel(ax, plan, found[key[::-1]][column])
        ticks(ax.xaxis, plan.x, shown=row == len(rows) - 1)
        ticks(ax.yaxis, plan.y, shown=column == 0)
    title = rf"$\bf{{{letter}}}$  {plan.title}"
    write(fig, EDGE, top + 0.15, title, size=9.5)
    for column, quantity in enumerate(columns):
        middle = LEFT + column * (ACROSS + GAP) + ACROSS / 2
        write(fig, middle, first - 0.07, symbol(plan.equation, quantity), ha="center")
    for row, (dtype, form) in enumerate(rows):
        middle = first + row * (DOWN + GAP) + DOWN / 2
        name = f"{form}\n{dtype}"
        write(fig, EDGE, middle, name, va="center", size=8.5, linespacing=1.3)
    width, height = len(columns) * (ACROSS + GAP) - GAP, 4 * (DOWN + GAP) - GAP
    below = first + height + 0.35
    write(fig, LEFT + width / 2, below, plan.x.label, ha="center")
    style = {"rotation": 90, "ha": "center", "va": "center"}
    write(fig, LEFT - 0.37, first + height / 2, plan.y.label, **style)


def draw_key(fig, top):
    """The colors, in the space that M leaves."""
    left, width = LEFT + 4 * (ACROSS + GAP) + 0.35, 1.8
    ax = place(fig, left, top + 0.9, width, 0.14)
    colors = ScalarMappable(COLORS, COLORS_MAP)
    bar = fig.colorbar(colors, cax=ax, orientation="horizontal", extend="max")
    bar.set_ticks([-16, -12, -8, -4, 0])
    label = (
        r"$\log_{10}$ of the error, relative to",
        r"the peak over $\varphi$ ($N$)",
        r"the terms of the sum ($M$)",
    )
    bar.set_label("\n".join(label), labelpad=3, linespacing=1.4)
    fig.legend(
        [Patch(**HATCHED)],
        ["NaN or infinite"],
        loc="upper left",
        bbox_to_anchor=(left / WIDTH, 1 - (top + 1.95) / fig.get_figheight()),
        borderaxespad=0,
        borderpad=0,
    )


def draw():
    """A block of panels for each map."""
    result = measure()
    fig = figure(len(MAPS) * BLOCK + EDGE)
    # Every panel has its place.
    fig.set_layout_engine("none")
    for k, plan in enumerate(MAPS):
        draw_map(fig, EDGE + k * BLOCK, "abcd"[k], plan, result[plan.name])
    draw_key(fig, EDGE + BLOCK)
    return Drawing(fig, "Errors of N, M and their derivatives", table(result))


def main(argv=None):
    """Draw stability.svg and write stability.csv."""
    run("stability", __doc__, draw, argv)


if __name__ == "__main__":
    main()
