"""How many nodes in gamma a lobe needs, and how many `auto` takes.

Fibers are drawn over the domain (p 0 to 5, beta_n 0.1 to 10, eta 1 to 3, sigma_a to
1e3), the same in every run. For each, and for several tolerances, the smallest order of
the graded rule is searched whose error, relative to the peak over phi, is below the
tolerance at every |theta_d| up to a limit. Beside it is what `auto` takes for these
inclinations. The constants of that formula come from a fit to these orders that is
seldom below them; those of a fit to the present draws are the last row of the table.
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
from fiberjax.graded import graded_offsets, grading
from fiberjax.orders import FIT, Fit, needed, turning
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


def by_order(p, fiber, order):
    """The same by an order."""
    at, weight, _ = gauss_legendre_unit(order)
    spare = 0, MOST - order
    padded = np.pad(at, spare, mode="edge"), np.pad(weight, spare)
    return np.asarray(lobe(p, *fiber, *padded))


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


def table(rows, fit):
    """One row a search; the constants at the end."""
    lines = []
    for row in rows:
        (p, fiber, last, tolerance), _, order = row
        numbers = f"{p}", *(f"{x:.12g}" for x in fiber), f"{tolerance:g}"
        lines.append((*numbers, LIMITS[last], f"{order}", f"{taken(row):.2f}"))
    constants = " ".join(f"{name} {x:.3f}" for name, x in fit._asdict().items())
    lines.append(("fit", "", "", "", "", "", "", constants))
    return Table(HEADER, lines)


def draw():
    """Taken over needed: against the order, and how it is distributed."""
    rows = searched()
    fig = figure(3.6)
    left, right = fig.subplots(1, 2, width_ratios=(3, 2))
    for tolerance, color in TOLERANCES.items():
        some = [row for row in rows if row[0][3] == tolerance]
        orders = np.array([row[2] for row in some])
        ratios = np.array([taken(row) for row in some]) / orders
        left.plot(orders, ratios, ".", ms=2.5, color=color, label=f"{tolerance:g}")
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
    title(left, "a", "every search")
    title(right, "b", "how many take how much")
    return Drawing(fig, "Nodes that auto takes", table(rows, refitted(rows)))


def main(argv=None):
    """Draw nodes.svg and write nodes.csv."""
    run("nodes", __doc__, draw, argv)


if __name__ == "__main__":
    main()
