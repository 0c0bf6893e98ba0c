"""What leaving out saves: full and planned evaluators of nine scenes.

One fiber of each scene, in three colors where there is absorption, at 2^15 directions
drawn from its ranges; for "one theta_i" a grid of 64 theta_o by 512 phi. "full" is
fiberjax.evaluate as it comes, "planned" what fiberjax.scene.plan makes of the scene,
"by hand" a short program for that scene alone (shared/by_hand.py), each as one compiled
program. (a) Time of a value, and how many times less it takes when planned. (b)
Operations of a value in one color, as flops: a root or quotient counts as 4, an
exponential, logarithm or trigonometric function as 16, erf as 24, I0 as 48; for "full"
with the nodes or windows of the fiber in the scene that takes most. (c) The largest
error over the peak, on three other fibers, and what was promised.

Times are medians on one machine and differ from run to run; the calls take turns. The
table also has what planning takes, one scene after the other in one process, and what
it takes again, once all is compiled.
"""

import time
from dataclasses import replace
from functools import partial

import jax
import numpy as np
from shared import by_hand, scene_cases
from shared.style import (
    BLUE,
    GRAY,
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

from fiberjax.counting import cost, operations
from fiberjax.expenses import baseline
from fiberjax.farfield import evaluate_model
from fiberjax.scene import plan

COUNT, SEEN, FIBERS, ROUNDS = 1 << 15, 128, 3, 5
GRID = 64, 512
FORMS = {"full": GRAY, "planned": BLUE, "by hand": ORANGE}
HEADER = (
    "scene",
    "form",
    "ns_per_value",
    "flops",
    "promised",
    "achieved",
    "planning_s",
    "again_s",
    "device",
    "jax",
)


def places(name, scene):
    """A fiber and its directions."""
    fiber, angles = scene_cases.inside(scene, COUNT, 0)
    if name == "one theta_i":
        theta_i, theta_o, phi = angles
        angles = [theta_i[0], theta_o[: GRID[0], None], phi[: GRID[1]]]
    return fiber, angles


def flops(f, scene):
    """Operations of one value in one color."""
    fiber, angles = scene_cases.inside(scene, COUNT, 0)
    if fiber.sigma_a is not None:
        fiber = replace(fiber, sigma_a=fiber.sigma_a[0])
    return cost(operations(lambda *x: f(fiber, *x), *angles, per=COUNT))


def forms(name, scene, found):
    """The evaluators of a scene."""
    every = {"full": scene_cases.full(scene), "planned": found.evaluate}
    if name in by_hand.NODES:
        every["by hand"] = lambda *x: by_hand.evaluate(name, *x)
    return every


def off(f, scene):
    """The largest error over the peak, on fibers that the plan has not seen."""
    errors = []
    for seed in range(1, FIBERS + 1):
        fiber, angles = scene_cases.inside(scene, SEEN, seed)
        errors.append(scene_cases.achieved(f, scene, fiber, angles))
    return max(errors)


def timed(scene):
    """A plan, and what it takes."""
    start = time.perf_counter()
    return plan(scene), time.perf_counter() - start


def measure():
    """Rows of the table."""
    rows, calls = [], {}
    for name, scene in scene_cases.SCENES.items():
        progress(f"plan: {name}")
        found, first = timed(scene)
        _, again = timed(scene)
        fiber, angles = places(name, scene)
        for form, f in forms(name, scene, found).items():
            progress(f"{name}, {form}")
            whole = jax.jit(f)
            calls[name, form] = partial(whole, fiber, *angles)
            jax.block_until_ready(calls[name, form]())
            # What `auto` decides when running cannot be counted.
            static = partial(evaluate_model, baseline(scene)) if form == "full" else f
            count = flops(static, scene)
            took = [f"{x:.2f}" if form == "planned" else "" for x in (first, again)]
            rows.append((name, form, count, scene.tolerance, off(f, scene), *took))
    times = medians(calls, ROUNDS, at_least=0.05)
    return [(*row, 1e9 * times[row[:2]] / COUNT) for row in rows]


def ratio(x):
    """Two digits, and no exponent."""
    return f"{float(f'{x:.2g}'):g}"


def bars(ax, rows, value):
    """One bar for each form of each scene."""
    names = list(scene_cases.SCENES)
    full = {row[0]: value(row) for row in rows if row[1] == "full"}
    for k, (form, color) in enumerate(FORMS.items()):
        here = [row for row in rows if row[1] == form]
        at = [names.index(row[0]) + (k - 1) * 0.27 for row in here]
        drawn = ax.bar(at, [value(row) for row in here], 0.25, color=color, label=form)
        if form == "planned":
            saved = [ratio(full[row[0]] / value(row)) for row in here]
            ax.bar_label(drawn, saved, fontsize=8, padding=2, color=color)
    ax.set(yscale="log", xticks=range(len(names)), ylim=(None, 8 * max(full.values())))
    ax.set_xticklabels([])
    ax.grid(axis="x", visible=False)


def draw():
    """Measure, and draw what came out."""
    rows = measure()
    fig = figure(7.4)
    times, counts, errors = fig.subplots(3, 1)
    bars(times, rows, lambda row: row[-1])
    title(times, "a", "time of a value")
    times.set_ylabel("ns")
    times.legend(ncols=3, loc="upper left")
    bars(counts, rows, lambda row: row[2])
    title(counts, "b", "operations of a value, one color")
    counts.set_ylabel("flops")
    names = list(scene_cases.SCENES)
    planned = [row for row in rows if row[1] == "planned"]
    at = np.arange(len(names))
    errors.plot(
        at, [r[3] for r in planned], "_", ms=22, color=VERMILION, label="promised"
    )
    errors.plot(at, [r[4] for r in planned], "o", color=BLUE, label="achieved")
    errors.set(yscale="log", ylabel="error over the peak", xticks=at)
    errors.set_xticklabels(names, rotation=20, ha="right")
    errors.set_xlim(times.get_xlim())
    errors.legend(ncols=2, loc="lower left")
    title(errors, "c", "the promise of a plan")
    where = machine(), jax.__version__
    formats = "{}", "{}", "{:.5g}", "{:g}", "{:.3g}", "{}", "{}", "{:.4g}"
    cells = [[f.format(x) for f, x in zip(formats, row, strict=True)] for row in rows]
    table = [(*row[:2], row[-1], *row[2:-1], *where) for row in cells]
    return Drawing(fig, "Full and planned evaluators", Table(HEADER, table))


def main(argv=None):
    """Draw scenes.svg and write scenes.csv."""
    run("scenes", __doc__, draw, argv)


if __name__ == "__main__":
    main()
