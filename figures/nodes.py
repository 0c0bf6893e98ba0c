"""How many nodes in gamma a lobe needs, and how many `auto` takes.

Fibers are drawn over the domain (p 0 to 5, beta_n 0.1 to 10, eta 1 to 3, sigma_a to
1e3), the same in every run. For each, and for several tolerances, the smallest order of
the graded rule is searched whose error, relative to the peak over phi, is below the
tolerance at every |theta_d| up to a limit. Beside it is what `auto` takes for these
inclinations. The constants of that formula come from a fit to these orders that is
seldom below them; those of a fit to the present draws are a row of the table.

"rest" is all lobes from TRRT on: its average over h, whose nodes are graded towards
what little absorption changes at grazing. Its orders are those that give it and its
derivative in sigma_a, relative to the largest at any theta_d, for even steps of log
sigma_a; the last row has the nodes for each e-fold of error and of the grading that
serve all of them.
"""

import itertools
import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize
from shared.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    VERMILION,
    Drawing,
    Table,
    figure,
    progress,
    run,
    title,
)

from fiberjax import wrapped_normal
from fiberjax.detectors import DETECTORS
from fiberjax.graded import graded_offsets, grading, layer
from fiberjax.orders import FEWEST, FIT, REST, Fit, averaged, needed, turning
from fiberjax.quadrature import gauss_legendre_unit
from fiberjax.section import deflection, ray, section

COUNT = 160
MOST = 400
"""The order of the exact rule, to which the others are padded."""
PHI = np.linspace(0, math.pi, 24)
THETA_D = np.radians([*np.linspace(0, 80, 9), 85, 88, 89.5, 89.99])
LIMITS = {0: "0", 6: "60", 12: "89.99"}
"""By number of inclinations, how far they go, in degrees."""
TOLERANCES = {1e-4: BLUE, 1e-6: GREEN, 1e-9: ORANGE, 1e-12: VERMILION}
ETAS = (1.01, 1.05, 1.3, 1.55, 1.8, 2.5, 3.0)
SIGMAS = (0.0, *np.logspace(-6, 3, 10))
Place = tuple[float, float, float]
"""Scales and digits, as `orders.averaged` has them."""

HEADER = ("p", "eta", "sigma_a", "beta_n", "tolerance", "theta_d", "needed", "taken")


@partial(jax.jit, static_argnums=0)
def lobe(p, eta, sigma_a, beta_n, at, weight):
    """N_p of shape (theta_d, phi) by the nodes."""
    theta_d, phi = jnp.asarray(THETA_D)[:, None, None], jnp.asarray(PHI)[:, None]
    here = section(theta_d, eta, sigma_a)
    offset, slope = graded_offsets(grading(here, p))(at)
    (light,) = ray(offset, here).A(p).times(slope * weight)
    x, turn = phi - p % 2 * math.pi, deflection(p, offset, here)
    both = wrapped_normal(x - turn, beta_n) + wrapped_normal(x + turn, beta_n)
    return (light * both / 2).sum(-1)


def padded(order):
    """The nodes and weights of an order, as many as of the exact rule."""
    at, weight, _ = gauss_legendre_unit(order)
    spare = 0, MOST - order
    return np.pad(at, spare, mode="edge"), np.pad(weight, spare)


def by_order(p, fiber, order):
    """The same by an order."""
    return np.asarray(lobe(p, *fiber, *padded(order)))


def needed_by(p, fiber):
    """The smallest orders, by tolerance, for every limit of theta_d."""
    exact = by_order(p, fiber, MOST)
    peak = exact.max(1)
    found = {}
    order = 3
    while len(found) < len(TOLERANCES) * len(LIMITS) and order < MOST // 2:
        order = max(order + 1, int(1.04 * order))
        # Of what is all but absorbed nothing is asked.
        off = np.abs(by_order(p, fiber, order) - exact).max(1) / (peak + 1e-250)
        for tolerance, last in itertools.product(TOLERANCES, LIMITS):
            if off[: last + 1].max() < tolerance:
                found.setdefault((tolerance, last), order)
    return found


@jax.jit
def rest(eta, sigma_a, tolerance, at, weight):
    """The average of the rest by theta_d, and its derivative in sigma_a."""

    def value(sigma_a):
        here = section(jnp.asarray(THETA_D)[:, None], eta, sigma_a)
        offset, slope = graded_offsets(layer(here, tolerance))(at)
        (light,) = ray(offset, here).A_rest(REST).times(slope * weight)
        return light.sum(-1)

    return jnp.stack(jax.jvp(value, (sigma_a,), (jnp.ones_like(sigma_a),)))


def needed_by_rest(eta: float, sigma_a: float, tolerance: float) -> int:
    """The smallest order for the average of the rest and its derivative."""
    fiber = jnp.asarray(eta), jnp.asarray(sigma_a)
    exact = rest(*fiber, min(TOLERANCES), *padded(MOST))
    largest = jnp.abs(exact).max(1)
    order = 3
    while order < MOST // 2:
        order = max(order + 1, int(1.04 * order))
        off = jnp.abs(rest(*fiber, tolerance, *padded(order)) - exact).max(1)
        if jnp.all(off < tolerance * largest + 1e-250):
            break
    return order


def searched_rest() -> list[tuple[tuple[float, float, float], Place, int]]:
    """(eta, sigma_a, tolerance), the place and the smallest order."""
    found = []
    for key in itertools.product(ETAS, SIGMAS, TOLERANCES):
        progress("rest: eta {:g}, sigma_a {:g}, {:g}".format(*key))
        eta, sigma_a, tolerance = key
        here = section(jnp.zeros(()), *map(jnp.asarray, (eta, sigma_a)))
        delta, near = float(grading(here, REST)), float(layer(here, tolerance))
        at = delta, near, math.log(1 / tolerance)
        found.append((key, at, needed_by_rest(*key)))
    return found


def for_layer(at: Place, order: int) -> float:
    """The constant LAYER that gives an order, where the layer decides; else 0."""
    delta, near, digits = at
    if order <= needed(0.0, delta, REST, digits, np):
        return 0.0
    return (order - FEWEST) / (np.arcsinh(math.pi / 2 / near) * digits)


def draws():
    """p, and eta, sigma_a and beta_n, of each fiber."""
    rng = np.random.default_rng(1)
    for _ in range(COUNT):
        p = int(rng.choice([0, 1, 2, 2, 3, 5]))
        near = 1 + 10 ** rng.uniform(-6, 0.3)
        eta = rng.choice([rng.uniform(1.3, 1.8), near])
        sigma_a = rng.choice([0.0, 10 ** rng.uniform(-2, 0.3), 10 ** rng.uniform(0, 3)])
        yield p, (float(eta), float(sigma_a), float(10 ** rng.uniform(-1, 1)))


def place(p, fiber, last, tolerance):
    """What `orders.needed` is a function of: turns, delta, p and digits."""
    eta, sigma_a, beta_n = fiber
    here = section(jnp.zeros(()), *map(jnp.asarray, (eta, sigma_a)))
    delta = np.asarray(grading(here, p))
    band = DETECTORS["normal"].bandwidth(tolerance) / beta_n
    cos = math.cos(THETA_D[last])
    turns = band * turning(p, cos, np.float64(eta), delta, np)
    return float(turns), float(delta), p, math.log(1 / tolerance)


def searched():
    """(p, fiber, last inclination, tolerance), the place and the smallest order."""
    found = []
    for k, (p, fiber) in enumerate(draws()):
        progress(f"fiber {k + 1} of {COUNT}")
        for (tolerance, last), order in needed_by(p, fiber).items():
            key = p, fiber, last, tolerance
            found.append((key, place(*key), order))
    return found


def refitted(rows):
    """Constants that are seldom below the orders, and else close to them."""
    turns, delta, p, digits = np.array([place for _, place, _ in rows]).T
    orders = np.array([order for *_, order in rows])

    def loss(constants):
        model = needed(turns, delta, p, digits, np, Fit(*constants))
        off = np.log(model / orders)
        return off.mean() + 3000 * np.mean(np.minimum(off, 0) ** 2)

    options = {"maxiter": 3000, "maxfev": 3000, "adaptive": True}
    return Fit(*minimize(loss, FIT, method="Nelder-Mead", options=options).x)


def taken(row):
    """What the model says for a row."""
    turns, delta, p, digits = row[1]
    return float(needed(turns, delta, p, digits, np))


def averaged_of(at: Place) -> float:
    """What the model says for the rest."""
    delta, near, digits = at
    return float(averaged(delta, near, digits, np))


def table(rows, rests, fit):
    """One row a search; the constants at the end."""
    lines = []
    for row in rows:
        (p, fiber, last, tolerance), _, order = row
        numbers = f"{p}", *(f"{x:.12g}" for x in fiber), f"{tolerance:g}"
        lines.append((*numbers, LIMITS[last], f"{order}", f"{taken(row):.2f}"))
    constants = " ".join(f"{name} {x:.3f}" for name, x in fit._asdict().items())
    for (eta, sigma_a, tolerance), at, order in rests:
        numbers = f"{eta:g}", f"{sigma_a:g}", "", f"{tolerance:g}"
        lines.append(("rest", *numbers, "", f"{order}", f"{averaged_of(at):.2f}"))
    serves = max(for_layer(at, order) for _, at, order in rests)
    lines.append(("fit", "", "", "", "", "", "", constants))
    lines.append(("layer", "", "", "", "", "", "", f"{serves:.4f}"))
    return Table(HEADER, lines)


def draw():
    """Taken over needed: against the order, and how it is distributed."""
    rows, rests = searched(), searched_rest()
    fig = figure(3.6)
    left, right = fig.subplots(1, 2, width_ratios=(3, 2))
    for tolerance, color in TOLERANCES.items():
        some = [row for row in rows if row[0][3] == tolerance]
        orders = np.array([row[2] for row in some])
        ratios = np.array([taken(row) for row in some]) / orders
        left.plot(orders, ratios, ".", ms=2.5, color=color, label=f"{tolerance:g}")
        same = [(at, order) for key, at, order in rests if key[2] == tolerance]
        of_rest = [order for _, order in same]
        more = [averaged_of(at) / order for at, order in same]
        left.plot(of_rest, more, "+", ms=4, mew=0.8, color=color)
        share = np.arange(1, len(ratios) + 1) / len(ratios)
        right.plot(np.sort(ratios), share, color=color)
    for ax, line in ((left, left.axhline), (right, right.axvline)):
        line(1, color=BLACK, lw=0.8)
        ax.minorticks_off()
    ratio = "nodes taken / nodes needed"
    left.set(xscale="log", xlabel="nodes needed", ylabel=ratio, ylim=(0, 4))
    left.set(xticks=(5, 10, 20, 50, 100), xticklabels=(5, 10, 20, 50, 100))
    left.legend(title="tolerance", markerscale=4)
    right.set(xlim=(0.5, 4), ylim=(0, 1), xlabel=ratio, ylabel="share of the searches")
    title(left, "a", "every search; +: averages of the rest")
    title(right, "b", "how many take how much")
    return Drawing(fig, "Nodes that auto takes", table(rows, rests, refitted(rows)))


def main(argv=None):
    """Draw nodes.svg and write nodes.csv."""
    run("nodes", __doc__, draw, argv)


if __name__ == "__main__":
    main()
