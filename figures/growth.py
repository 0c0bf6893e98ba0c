"""How time and memory grow with queries, colors, lobes and tolerance.

fiberjax.in_blocks over the full model and over a plan (hair of sigma_a .2 to 4, beta
.15 to .4, tolerance 1e-3), in float64, on one device, every point in a process of its
own. Queries are made from their numbers within each block, and only a sum is kept:
memory is what a block takes, however many there are. (a) Time and (b) peak memory of
the process, JAX and compiler included, against the number of queries, in three colors;
(c) time of a value against colors, (d) against lobes that are kept, without the rest,
and (e) against the tolerance of `auto` and of plans.

Times and memory are those of one machine and differ from run to run.
"""

import argparse
import json
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from shared.style import (
    BLUE,
    GRAY,
    Drawing,
    Table,
    figure,
    progress,
    run,
    title,
)
from shared.timing import machine

import fiberjax as fj
from fiberjax.scene import Plan, Scene, plan

BLOCK = 1 << 14
QUERIES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
COLORS = (1, 3, 8, 32)
LOBES = (1, 2, 3, 5)
TOLERANCES = (1e-2, 1e-4, 1e-6)
PROMISED = 1e-3
USUAL = 100_000
HEADER = (
    "against",
    "value",
    "form",
    "queries",
    "ns_per_value",
    "peak_MB",
    "device",
    "jax",
)


def scene(tolerance):
    """The scene of the plans."""
    ends = (0.15, 0.4)
    return Scene(
        eta=1.55,
        beta_m=ends,
        beta_n=ends,
        alpha=-0.035,
        sigma_a=(0.2, 4.0),
        tolerance=tolerance,
    )


def evaluator(against, value, form, path):
    """A function of a fiber and angles; a plan comes from its file."""
    if form == "planned":
        return Plan.load(path).evaluate
    if against == "tolerance":
        return partial(fj.evaluate, rule=fj.auto(value))
    if against == "lobes":
        return partial(fj.evaluate, lobes=tuple(range(value)), rest=False)
    return fj.evaluate


def work(against, value, form, queries, path):
    """A function of nothing that sums over the queries, made in the blocks."""
    colors = value if against == "colors" else 3
    fiber = fj.Fiber(1.55, 0.25, 0.3, -0.035, np.linspace(0.2, 4.0, colors))
    evaluate = evaluator(against, value, form, path)
    block = min(BLOCK, queries)

    def one(fiber, number):
        """The sum over one block, by additive sequences of the query's number."""
        n = number[:, None] * block + jnp.arange(block)
        u = [jnp.mod(n * x, 1.0) for x in (0.8191725, 0.6710436, 0.5497005)]
        theta_i, theta_o, phi = u[0] * 3 - 1.5, u[1] * 3 - 1.5, u[2] * 6.28 - 3.14
        return evaluate(fiber, theta_i, theta_o, phi).sum(1)

    many = fj.in_blocks(one, block=1)
    numbers = jnp.arange(-(-queries // block), dtype=float)
    return lambda: many(fiber, numbers).sum(0)


def peak_of_memory():
    """Of this process in MB: getrusage has that of the parent in it."""
    status = Path("/proc/self/status").read_text()
    line = next(x for x in status.splitlines() if x.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def child(against, value, form, queries, path):
    """Measure one point: the best of some runs, and the peak of memory."""
    jax.config.update("jax_enable_x64", True)
    call = work(against, value, form, queries, path)
    jax.block_until_ready(call())
    times = []
    for _ in range(3 if queries < QUERIES[-1] else 1):
        start = time.perf_counter()
        jax.block_until_ready(call())
        times.append(time.perf_counter() - start)
    where = [machine(), jax.__version__]
    # Whole blocks are run.
    block = min(BLOCK, queries)
    done = -(-queries // block) * block
    print(json.dumps([1e9 * min(times) / done, peak_of_memory(), *where]))


def points():
    """Every point: what varies, its value, the form, and the number of queries."""
    both = "full", "planned"
    found = [("queries", n, form, n) for n in QUERIES for form in both]
    found += [("colors", c, form, USUAL) for c in COLORS for form in both]
    found += [("lobes", p, "full", USUAL) for p in LOBES]
    return found + [("tolerance", t, f, USUAL) for t in TOLERANCES for f in both]


def measure(folder):
    """Rows of the table, one process after the other; plans are kept in a folder."""
    rows, every, command = [], points(), [sys.executable, __file__, "--child"]
    for tolerance in {PROMISED, *TOLERANCES}:
        progress(f"plan for {tolerance:g}")
        plan(scene(tolerance)).save(folder / f"{tolerance:g}.json")
    for k, point in enumerate(every):
        progress(f"point {k + 1} of {len(every)}: {point}")
        tolerance = point[1] if point[0] == "tolerance" else PROMISED
        given = json.dumps([*point, str(folder / f"{tolerance:g}.json")])
        pipes: Any = {"capture_output": True, "text": True}
        ran = subprocess.run([*command, given], check=True, **pipes)
        nanoseconds, peak, *where = json.loads(ran.stdout)
        against, value, form, queries = point
        rows.append((against, value, form, queries, nanoseconds, peak, *where))
    return rows


def lines(ax, rows, against, column, scale=1.0):
    """One line for each form."""
    for form, color in (("full", GRAY), ("planned", BLUE)):
        here = [row for row in rows if row[0] == against and row[2] == form]
        if here:
            at = [row[1] for row in here]
            ax.loglog(
                at, [row[column] * scale for row in here], "o-", color=color, label=form
            )


def draw():
    """Measure, and draw what came out."""
    with TemporaryDirectory() as folder:
        rows = measure(Path(folder))
    fig = figure(5.2)
    panels = fig.subplot_mosaic("aabb\nccde")
    of_queries = [row for row in rows if row[0] == "queries"]
    seconds = [(*row[:4], row[4] * row[3] / 1e9, *row[5:]) for row in of_queries]
    lines(panels["a"], seconds, "queries", 4)
    panels["a"].set(xlabel="queries", ylabel="seconds")
    panels["a"].legend()
    title(panels["a"], "a", "time")
    for form, color in (("full", GRAY), ("planned", BLUE)):
        here = [row for row in of_queries if row[2] == form]
        at, peaks = [row[1] for row in here], [row[5] for row in here]
        panels["b"].semilogx(at, peaks, "o-", color=color)
    panels["b"].set(xlabel="queries", ylabel="MB", ylim=0)
    title(panels["b"], "b", "peak memory")
    for letter, against, name in (
        ("c", "colors", "colors"),
        ("d", "lobes", "lobes"),
        ("e", "tolerance", "tolerance"),
    ):
        lines(panels[letter], rows, against, 4)
        panels[letter].set(xlabel=name)
        title(panels[letter], letter, f"by {name}")
    panels["c"].set_ylabel("ns of a value")
    panels["d"].set_xticks(LOBES, [str(p) for p in LOBES])
    panels["d"].xaxis.minorticks_off()
    for letter in "de":
        panels[letter].sharey(panels["c"])
        panels[letter].tick_params(labelleft=False)
    table = [
        (*map(str, row[:4]), f"{row[4]:.4g}", f"{row[5]:.4g}", *row[6:]) for row in rows
    ]
    return Drawing(fig, "Growth of time and memory", Table(HEADER, table))


def main(argv=None):
    """Draw growth.svg and write growth.csv."""
    arguments = sys.argv[1:] if argv is None else argv
    if arguments[:1] == ["--child"]:
        parser = argparse.ArgumentParser()
        parser.add_argument("--child", type=json.loads)
        child(*parser.parse_args(arguments).child)
        return
    run("growth", __doc__, draw, argv)


if __name__ == "__main__":
    main()
