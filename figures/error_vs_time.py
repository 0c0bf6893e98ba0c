"""N by rule and order: largest error over azimuth against time per value.

A clear fiber of eta 1.55 at four theta_d; errors are relative to the peak of the lobe
over phi. Truth is GaussGamma(500) in float64, which the tests compare with
GaussGamma(400) and with scipy's adaptive quadrature.

Times are those of one machine and differ from run to run, so the files do too; the
rules take turns, so that their ratios mean more than the times do. scipy integrates the
textbook integral over h in plain Python, at its default tolerance and theta_d = 0.
"""

import itertools
import math
import os
import statistics
import time
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.lines import Line2D
from scipy.integrate import quad
from shared.style import (
    BLACK,
    BLUE,
    LOBES,
    VERMILION,
    Drawing,
    Table,
    figure,
    progress,
    run,
)

import fiberjax
from fiberjax import GaussGamma, GaussH

TRUTH = GaussGamma(500)
TEXTBOOK = GaussH(70)
RULES = {
    "float64": (
        *map(GaussH, (10, 20, 35, 70, 140, 280, 1000)),
        *map(GaussGamma, (8, 12, 16, 24, 35, 48, 64, 96, 192)),
    ),
    "float32": (*map(GaussH, (20, 70, 280)), *map(GaussGamma, (8, 12, 24, 48, 96))),
}
ROUNDS = 7
# Numbers that float32 holds, so that one truth serves both precisions.
ETA = float(np.float32(1.55))
BETA_N = (0.1, 0.2, 0.5)
THETA_D = np.radians([0, 30, 60, 75]).astype(np.float32)
PHI = np.linspace(0, np.pi, 801, dtype=np.float32)[:-1]
GRID = np.meshgrid(np.array(BETA_N, np.float32), THETA_D, PHI, indexing="ij")
LOOKS = {
    ("GaussH", "float64"): {"color": VERMILION, "marker": "o", "ms": 3.5},
    ("GaussH", "float32"): {"color": VERMILION, "marker": ".", "ms": 3, "ls": ":"},
    ("GaussGamma", "float64"): {"color": BLUE, "marker": "o", "ms": 3.5},
    ("GaussGamma", "float32"): {"color": BLUE, "marker": ".", "ms": 3, "ls": ":"},
    "textbook": {"marker": "o", "ms": 9, "mfc": "none", "mec": BLACK, "ls": ""},
    ("quad", "float64"): {"marker": "s", "ms": 5, "color": BLACK, "ls": ""},
}
NAMES = (
    "GaussH, 10 to 1000 nodes",
    "GaussH in float32",
    "GaussGamma, 8 to 192 nodes",
    "GaussGamma in float32",
    "GaussH(70)",
    "scipy quad in $h$",
)
PROBES = PHI[20::80]
HEADER = (
    "rule",
    "order",
    "dtype",
    "lobe",
    "beta_n",
    "error",
    "ns_per_value",
    "device",
    "jax",
)


def grid(dtype):
    """beta_n, theta_d and phi of every value, each of shape (beta_n, theta_d, phi)."""
    return [jnp.asarray(x, dtype) for x in GRID]


def by_rule(rule, p, beta_n, theta_d, phi):
    """N_p at every value."""
    return fiberjax.N(p, phi, theta_d, eta=ETA, sigma_a=None, beta_n=beta_n, rule=rule)


def errors(value, truth):
    """Largest error relative to the peak over phi, for each beta_n."""
    off = np.abs(np.asarray(value, float) - truth)
    return (off / truth.max(axis=-1, keepdims=True)).max(axis=(1, 2))


def attenuation(p, mu):
    """A_p of a clear fiber at incident cosine mu."""
    g = math.sqrt(ETA**2 - 1 + mu * mu)
    r_s, r_p = (mu - g) / (mu + g), (ETA**2 * mu - g) / (ETA**2 * mu + g)
    f = (r_s**2 + r_p**2) / 2
    return f if p == 0 else (1 - f) ** 2 * f ** (p - 1)


def integrand(h, p, phi, theta_d, beta_n):
    """A D(phi - Phi)/2 in plain Python."""
    cos_d = math.cos(theta_d)
    eta_p = math.sqrt(ETA**2 - math.sin(theta_d) ** 2) / cos_d
    turned = 2 * p * math.asin(h / eta_p) - 2 * math.asin(h) + p * math.pi
    x = math.remainder(phi - turned, 2 * math.pi)
    images = (x + 2 * math.pi * k for k in (-1, 0, 1))
    density = sum(math.exp(-0.5 * (y / beta_n) ** 2) for y in images)
    density /= beta_n * math.sqrt(2 * math.pi)
    return attenuation(p, cos_d * math.sqrt(1 - h * h)) * density / 2


def by_scipy(p, beta_n, truth):
    """Largest error over the probes at the first theta_d, and seconds per value."""
    theta_d, scale = float(THETA_D[0]), truth.max()
    worst, start = 0.0, time.perf_counter()
    for phi in PROBES:
        arguments = p, float(phi), theta_d, beta_n
        # With full_output it keeps its doubts about the end points to itself.
        value = quad(integrand, -1, 1, args=arguments, full_output=1)[0]
        worst = max(worst, abs(value - truth[phi == PHI][0]) / scale)
    return worst, (time.perf_counter() - start) / len(PROBES)


def seconds(call):
    """Duration of one call."""
    start = time.perf_counter()
    call().block_until_ready()
    return time.perf_counter() - start


def measure():
    """Rows of the table, numbers as numbers."""
    truth, calls, found = {}, {}, {}
    for p, lobe in enumerate(LOBES):
        truth[p] = np.asarray(by_rule(TRUTH, p, *grid("float64")))
        for dtype, rules in RULES.items():
            for rule in rules:
                progress(f"{lobe} by {rule}, {dtype}")
                key = p, rule, dtype
                calls[key] = partial(by_rule, rule, p, *grid(dtype))
                found[key] = errors(calls[key](), truth[p])
    times = {key: [] for key in calls}
    for turn in range(ROUNDS):
        progress(f"round {turn + 1} of {ROUNDS}")
        for key, call in calls.items():
            times[key].append(seconds(call))
    rows = []
    for (p, rule, dtype), error in found.items():
        name = type(rule).__name__
        each = statistics.median(times[p, rule, dtype]) / truth[p].size
        for beta_n, e in zip(BETA_N, error, strict=True):
            rows.append((name, rule.order, dtype, LOBES[p], beta_n, e, each))
    for p, k in itertools.product(truth, range(len(BETA_N))):
        e, each = by_scipy(p, float(np.float32(BETA_N[k])), truth[p][k, 0])
        rows.append(("quad", "", "float64", LOBES[p], BETA_N[k], e, each))
    return rows


def table(rows):
    """The rows as text."""
    where = f"{os.cpu_count()} CPU cores", jax.__version__
    return Table(
        HEADER,
        [
            (*map(str, row[:5]), f"{row[5]:.12e}", f"{1e9 * row[6]:.4g}", *where)
            for row in rows
        ],
    )


def draw_panel(ax, rows):
    """Error against time of one lobe at one roughness."""
    points = {}
    for name, order, dtype, *_, error, each in rows:
        points.setdefault((name, dtype), []).append((1e6 * each, error))
        if (name, order, dtype) == ("GaussH", TEXTBOOK.order, "float64"):
            ax.plot(1e6 * each, error, **LOOKS["textbook"])
    for key, xy in points.items():
        ax.plot(*np.transpose(xy), **LOOKS[key])
    ax.set(xscale="log", yscale="log", xlim=(0.1, 9e3), ylim=(2e-16, 9))
    ax.set(yticks=10.0 ** np.arange(-16, 1, 4), xticks=10.0 ** np.arange(-1, 4))
    ax.minorticks_off()


def draw():
    """A panel for each lobe and roughness."""
    rows = measure()
    fig = figure(7.4)
    axes = fig.subplots(3, 3, sharex=True, sharey=True)
    for line, lobe in zip(axes, LOBES, strict=True):
        for ax, beta_n in zip(line, BETA_N, strict=True):
            draw_panel(ax, [row for row in rows if row[3:5] == (lobe, beta_n)])
            ax.set_title(rf"$\bf{{{lobe}}}$, $\beta_n$ = {beta_n} rad")
        line[0].set(ylabel="largest error / peak")
    for ax in axes[-1]:
        ax.set(xlabel="time per value, µs")
    keys = [Line2D([], [], **look) for look in LOOKS.values()]
    fig.legend(keys, NAMES, loc="outside upper center", ncols=3)
    return Drawing(fig, "Error of N against time per value", table(rows))


def main(argv=None):
    """Draw error_vs_time.svg and write error_vs_time.csv."""
    run("error_vs_time", __doc__, draw, argv)


if __name__ == "__main__":
    main()
