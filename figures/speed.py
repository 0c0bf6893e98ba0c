"""Times of the library over those of plain JAX on the same work, in one run.

The work is TT and TRT in three channels, 2^17 directions that share nothing: `evaluate`
by `auto`, M included, against the textbook rule of 70 nodes in h as a (directions, 70)
array, channel by channel and without M. Beside it: a grid of 512 phi and 64 theta_d,
the reverse-mode gradient in five scalars over 2^20 directions in blocks of 2^16, M
against a version by jax's i0e, the time of the exponentials of GaussGamma alone, and
that of compiling the default rule, in the table only. Calls take turns, short ones
several times in a row, and every ratio is one of medians; times are those of one
machine, and the files differ from run to run.
"""

from functools import partial
from itertools import pairwise
from time import perf_counter

import jax
import jax.numpy as jnp
import numpy as np
from shared import m_forms
from shared.n_rules import ETA, SIGMA_A, exp_calls, exp_row
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
from shared.timing import machine, medians

import fiberjax
from fiberjax import GaussGamma, auto

COUNT = 1 << 17
BLOCK = 1 << 16
NODES = 70
BETA_N = (1e-4, 1e-3, 0.01, 0.03, 0.05, 0.1, 0.25, 0.3, 0.5, 1.0)
TIERS = {
    ("float32", 1e-6): BLUE,
    ("float64", 1e-6): GREEN,
    ("float64", 1e-9): ORANGE,
    ("float64", 1e-10): VERMILION,
}
GRID = 512, 64
GRID_BETA_N = (0.1, 0.3, 1.0)
GRADIENT_BETA_N = (0.01, 0.3)
ORDERS = (16, 24)
ROUNDS = 5
AT_LEAST = 0.05
"""Seconds: a call of a millisecond after a long one finds the caches cold."""
WORKS = {
    "grid": "grid: 70 nodes / ours",
    "gradient": "value / its gradient",
    "exp limit": "exponentials / GaussGamma",
    "M": "M: by i0e / ours",
}
HEADER = (
    "work",
    "dtype",
    "setting",
    "width",
    "ns",
    "ns_plain",
    "ratio",
    "device",
    "jax",
)


def directions(dtype, count=COUNT):
    """phi and theta_d, to 69 degrees, with nothing in common."""
    rng = np.random.default_rng(0)
    phi, theta_d = rng.uniform(-np.pi, np.pi, count), rng.uniform(-1.2, 1.2, count)
    return jnp.asarray(phi, dtype), jnp.asarray(theta_d, dtype)


@jax.jit
def plain(phi, theta_d, beta_n):
    """TT + TRT by the textbook rule, as a paper has it."""
    h, w = (jnp.asarray(x, phi.dtype) for x in np.polynomial.legendre.leggauss(NODES))
    cos_d, sin_d = jnp.cos(theta_d)[:, None], jnp.sin(theta_d)[:, None]
    eta_p = jnp.sqrt(ETA**2 - sin_d**2) / cos_d
    gamma_i, gamma_t = jnp.arcsin(h), jnp.arcsin(h / eta_p)
    mu = cos_d * jnp.cos(gamma_i)
    g = jnp.sqrt(ETA**2 - 1 + mu * mu)
    r_s, r_p = (mu - g) / (mu + g), (ETA**2 * mu - g) / (ETA**2 * mu + g)
    f = (r_s**2 + r_p**2) / 2
    path = 2 * jnp.cos(gamma_t) / jnp.sqrt(1 - (sin_d / ETA) ** 2)
    seen = []
    for p in (1, 2):
        away = phi[:, None] - (2 * p * gamma_t - 2 * gamma_i + p * np.pi)
        away = away - 2 * np.pi * jnp.round(away / (2 * np.pi))
        density = jnp.exp(-((away / beta_n) ** 2) / 2) / (beta_n * np.sqrt(2 * np.pi))
        seen.append(density * w / 2 * (1 - f) ** 2 * f ** (p - 1))
    channels = []
    for sigma_a in SIGMA_A:
        T = jnp.exp(-sigma_a * path)
        channels.append((T * (seen[0] + T * seen[1])).sum(1))
    return jnp.stack(channels, -1)


def five(beta_n, dtype):
    """eta, beta_m, beta_n, alpha and a factor of sigma_a, as a gradient takes them."""
    return tuple(jnp.asarray(x, dtype) for x in (ETA, 0.3, beta_n, -0.03, 1.0))


def made_of(eta, beta_m, beta_n, alpha, darkness):
    """The fiber of five scalars."""
    sigma_a = darkness * jnp.asarray(SIGMA_A, darkness.dtype)
    return fiberjax.Fiber(eta, beta_m, beta_n, alpha, sigma_a)


def fiber(beta_n, dtype):
    """The fiber of every row, its numbers arrays."""
    return jax.tree.map(lambda x: jnp.asarray(x, dtype), made_of(*five(beta_n, dtype)))


@partial(jax.jit, static_argnums=0)
def ours(rule, hair, phi, theta_d):
    """TT + TRT by a rule, with M, of angles that broadcast."""
    choices = {"lobes": (1, 2), "rest": False, "rule": rule}
    return fiberjax.evaluate(hair, -0.9 * theta_d, 1.1 * theta_d, phi, **choices)


@partial(jax.jit, static_argnums=0)
def total(rule, scalars, phi, theta_d):
    """The sum of all values, which has gradients in five scalars.

    By blocks of directions, along a first axis, which stay in the caches.
    """

    @jax.checkpoint
    def block(at):
        return ours(rule, made_of(*scalars), *at).sum()

    return jax.lax.map(block, (phi, theta_d)).sum()


gradient = jax.jit(jax.grad(total, argnums=1), static_argnums=0)


def calls():
    """What is timed; keys are (work, dtype, setting, width); "plain" is plain JAX."""
    found = {}
    for dtype in ("float32", "float64"):
        at = directions(dtype)
        width = partial(jnp.asarray, dtype=dtype)
        for beta_n in BETA_N:
            key = "directions", dtype, "plain", beta_n
            found[key] = partial(plain, *at, width(beta_n))
        for (kind, tolerance), beta_n in (
            (tier, b) for tier in TIERS for b in BETA_N if tier[0] == dtype
        ):
            hair = fiber(beta_n, dtype)
            found["directions", kind, f"auto({tolerance:g})", beta_n] = partial(
                ours, auto(tolerance), hair, *at
            )
        axes = [
            jnp.linspace(-low, low, n, dtype=dtype)
            for low, n in zip((3.1, 1.2), GRID, strict=True)
        ]
        flat = [x.ravel() for x in jnp.broadcast_arrays(axes[0], axes[1][:, None])]
        for beta_n in GRID_BETA_N:
            found["grid", dtype, "plain", beta_n] = partial(plain, *flat, width(beta_n))
            found["grid", dtype, "auto(1e-06)", beta_n] = partial(
                ours, auto(1e-6), fiber(beta_n, dtype), axes[0], axes[1][:, None]
            )
        for beta_n in GRADIENT_BETA_N:
            blocks = [x.reshape(-1, BLOCK) for x in directions(dtype, 8 * COUNT)]
            many = five(beta_n, dtype), *blocks
            found["gradient", dtype, "plain", beta_n] = partial(
                total, auto(1e-6), *many
            )
            found["gradient", dtype, "auto(1e-06)", beta_n] = partial(
                gradient, auto(1e-6), *many
            )
        for order in ORDERS:
            hair, name = fiber(0.3, dtype), f"GaussGamma({order})"
            found["exp limit", dtype, name, 0.3] = partial(
                ours, GaussGamma(order), hair, *at
            )
    for v in m_forms.V:
        at = m_forms.places(v, "float32")
        found["M", "float32", "plain", v] = partial(m_forms.FORMS["i0e"], *at)
        found["M", "float32", "ours", v] = partial(m_forms.FORMS["ours"], *at)
    return found


def nodes(setting):
    """The number of nodes, where the setting is one."""
    name, _, order = setting.removesuffix(")").partition("(")
    return f"{order} nodes" if name == "GaussGamma" else ""


def compiling(f, *arguments):
    """Seconds until a function that was never called is ready to run."""
    start = perf_counter()
    jax.jit(f).lower(*arguments).compile()
    return perf_counter() - start


def compile_rows():
    """The default rule: N of TRT, and `evaluate`; the plain rule has both lobes."""
    rows = []
    for dtype in ("float32", "float64"):
        at = directions(dtype, 1000)
        hair = fiber(0.3, dtype)

        def N(phi, theta_d, hair):
            optics = {"eta": hair.eta, "sigma_a": hair.sigma_a, "beta_n": hair.beta_n}
            return fiberjax.N(2, phi, theta_d, **optics)

        def evaluate(phi, theta_d, hair):
            return fiberjax.evaluate(hair, -0.9 * theta_d, 1.1 * theta_d, phi)

        first = compiling(plain, *at, hair.beta_n)
        for f in (N, evaluate):
            key = "compile", dtype, f.__name__, 0.3
            rows.append((key, compiling(f, *at, hair), first))
    return rows


def measure():
    """(work, dtype, setting, width), seconds, and those of plain JAX."""
    progress("compile")
    rows = compile_rows()
    timed = calls()
    for key, call in timed.items():
        progress(", ".join(map(str, key)))
        jax.block_until_ready(call())
    exps = {("exp", dtype): call for dtype, call in exp_calls().items()}
    times = medians(timed | exps, ROUNDS, AT_LEAST)
    each = {dtype: exp_row(dtype, times["exp", dtype]).seconds for _, dtype in exps}
    for key in timed:
        work, dtype, setting, width = key
        if work == "exp limit":
            # Two of each lobe's detector, and three of the absorption.
            order = int(nodes(setting).removesuffix(" nodes"))
            rows.append((key, times[key], 7 * order * COUNT * each[dtype]))
        elif setting != "plain":
            rows.append((key, times[key], times[work, dtype, "plain", width]))
    return rows


def counted(work):
    """Values in one call; compiling is one."""
    grid = GRID[0] * GRID[1]
    cones = len(m_forms.CONES) * len(m_forms.THETA_O)
    others = {"grid": grid, "gradient": 8 * COUNT, "M": cones, "compile": 1}
    return others.get(work, COUNT)


def table(rows):
    """The rows as text; ratios are how much quicker than plain JAX."""
    where = machine(), jax.__version__
    lines = []
    for (work, dtype, setting, width), seconds, other in rows:
        ns = [f"{1e9 * x / counted(work):.4g}" for x in (seconds, other)]
        ratio = f"{other / seconds:.4g}"
        lines.append((work, dtype, setting, f"{width:g}", *ns, ratio, *where))
    return Table(HEADER, lines)


def draw_directions(ax, rows):
    """How much quicker, over roughness."""
    for (dtype, tolerance), color in TIERS.items():
        name = f"auto({tolerance:g})"
        line = [
            (key[3], other / seconds)
            for key, seconds, other in rows
            if key[:3] == ("directions", dtype, name)
        ]
        style = {"ls": ":" if dtype == "float32" else "-", "marker": "o", "ms": 3}
        ax.plot(*np.transpose(line), color=color, label=f"{dtype}, {name}", **style)
    ax.axhline(1, color=BLACK, lw=0.8)
    ax.set(xscale="log", yscale="log", ylim=(0.5, 30), yticks=(0.5, 1, 2, 5, 10, 20))
    ax.set(xlabel=r"roughness $\beta_n$, rad", ylabel="times quicker than 70 nodes")
    ax.set_yticklabels(["0.5", "1", "2", "5", "10", "20"])
    ax.minorticks_off()
    ax.legend(loc="upper left")


def draw_others(ax, rows):
    """Each of the other works, both dtypes, as bars."""
    bars = [
        (WORKS[work], f"{dtype}, {nodes(setting) or f'{width:g}'}", other / seconds)
        for (work, dtype, setting, width), seconds, other in rows
        if work in WORKS
    ]
    bars.sort(key=lambda bar: list(WORKS.values()).index(bar[0]))
    works, names, ratios = zip(*reversed(bars), strict=True)
    places = np.arange(len(bars))
    ax.barh(places, ratios, color=BLUE, height=0.7)
    for place, ratio in zip(places, ratios, strict=True):
        ax.text(ratio * 1.1, place, f"{ratio:.3g}", va="center", fontsize=8)
    for k, (one, other) in enumerate(pairwise(works)):
        if one != other:
            ax.axhline(k + 0.5, color=BLACK, lw=0.4)
        if one != other or k == 0:
            last = len(works) - 1 - works[::-1].index(works[k + (k > 0)])
            ax.text(18000, last, works[last], va="center", ha="right", fontsize=8)
    ax.axvline(1, color=BLACK, lw=0.8)
    ax.set(xscale="log", yticks=places, xlim=(0.05, 20000), xlabel="ratio of times")
    ax.set_yticklabels(names)
    ax.grid(visible=False, axis="y")
    ax.minorticks_off()


def draw():
    """Ratios over roughness, and the other works."""
    rows = measure()
    fig = figure(4.6)
    left, right = fig.subplots(1, 2)
    draw_directions(left, rows)
    title(left, "a", "TT + TRT, three channels, nothing shared")
    draw_others(right, rows)
    title(right, "b", r"other work, by dtype and $\beta_n$, nodes or v")
    return Drawing(fig, "Speed against plain JAX", table(rows))


def main(argv=None):
    """Draw speed.svg and write speed.csv."""
    run("speed", __doc__, draw, argv)


if __name__ == "__main__":
    main()
