"""Values a second of the near field on one core, and of Mitsuba's LLVM back end.

float32, RGB, 2^20 directions that share one fiber: `eval`, `pdf` and `sample`, by
vectors and by angles, and the reverse-mode gradient of the sum of all values in the
parameters of the fiber. By processor time: others may use the machine. Mitsuba takes
turns with the library, which needs
pip install '.[oracle]' and an LLVM that works, libLLVM 16 or later at
DRJIT_LIBLLVM_PATH; without it the script says so and leaves figure and table alone.
"""

import os
import sys
import time
from functools import partial
from importlib.metadata import version

import jax
import jax.numpy as jnp
import numpy as np
from shared import mitsuba_hair
from shared.style import BLUE, ORANGE, SKY, Drawing, Table, figure, progress, run, title
from shared.timing import medians

import fiberjax
from fiberjax import directions, nearfield

COUNT, BLOCK = 1 << 20, 1 << 13
ROUNDS = 5
WORKS = ("eval", "pdf", "sample", "gradient")
FORMS = {"vectors": BLUE, "angles": SKY, "Mitsuba": ORANGE}
ETA, SIGMA_A = 1.55, (0.2, 0.4, 0.8)
MISSING = (
    "Mitsuba's LLVM back end does not run here (pip install '.[oracle]', libLLVM 16 or "
    "later at DRJIT_LIBLLVM_PATH): nearfield_speed is left as it was"
)
HEADER = "work", "form", "M_per_s", "ratio_to_mitsuba", "jax", "mitsuba"


def places():
    """theta_i, theta_o, phi and h, and four uniform numbers, of every direction."""
    rng = np.random.default_rng(0)
    theta = rng.uniform(-1.5, 1.5, (2, COUNT))
    phi, h = rng.uniform(-np.pi, np.pi, COUNT), rng.uniform(-1, 1, COUNT)
    u = rng.uniform(size=(COUNT, 4))
    return [x.astype(np.float32) for x in (*theta, phi, h, u)]


def vectors(theta, x, y):
    """Unit vectors, the tangent first."""
    return np.stack([np.sin(theta), np.cos(theta) * x, np.cos(theta) * y], -1)


def hair():
    """The fiber, in float32."""
    betas = mitsuba_hair.deviations(mitsuba_hair.ROUGHNESS)
    tilt = np.radians(mitsuba_hair.TILT)
    of = fiberjax.Fiber(ETA, *betas, tilt, SIGMA_A)
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), of)


@partial(jax.jit, static_argnums=0)
def gradient(f, of, *at):
    """Derivatives of the sum of all values in the fiber's numbers.

    Each block's are taken by themselves: a sum needs no memory of the others.
    """
    each = jax.grad(lambda of, x: f(of, *x).sum())
    zero = jax.tree.map(jnp.zeros_like, of)

    def step(total, x):
        return jax.tree.map(jnp.add, total, each(of, x)), None

    return jax.lax.scan(step, zero, at)[0]


def ours(by_angles, by_vectors):
    """Calls of the library by (work, form)."""
    found, of = {}, hair()
    for form, module, (given, out, u) in (
        ("vectors", directions, by_vectors),
        ("angles", nearfield, by_angles),
    ):
        *at, h, numbers = (jnp.asarray(x) for x in (*given, *out, u))
        for work, f in (("eval", module.evaluate), ("pdf", module.pdf)):
            found[work, form] = partial(f, of, *at, h)
        found["sample", form] = partial(module.sample, of, at[0], h, numbers)
        cut = [x.reshape(-1, BLOCK, *x.shape[1:]) for x in (*at, h)]
        found["gradient", form] = partial(gradient, module.evaluate, of, *cut)
    return found


def calls():
    """All calls by (work, form), after a first run."""
    theta_i, theta_o, phi, h, u = places()
    given = vectors(theta_i, -h, np.sqrt(1 - h * h))
    azimuth = np.arctan2(given[:, 2], given[:, 1]) + phi
    out = vectors(theta_o, np.cos(azimuth), np.sin(azimuth))
    found = ours(((theta_i,), (theta_o, phi, h), u), ((given,), (out, h), u))
    theirs = mitsuba_hair.calls(given, out, u, ETA, SIGMA_A)
    found |= {(work, "Mitsuba"): call for work, call in theirs.items()}
    for key, call in found.items():
        progress(", ".join(key))
        jax.block_until_ready(call())
    return found


def one_core():
    """Everything that starts from here on shares a core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def draw():
    """Bars of values a second by work; None where Mitsuba does not run."""
    if not mitsuba_hair.runs():
        print(MISSING, file=sys.stderr)
        return None
    one_core()
    times = medians(calls(), ROUNDS, clock=time.process_time)
    rates = {key: COUNT / taken / 1e6 for key, taken in times.items()}
    fig = figure(3.2)
    ax = fig.subplots()
    for k, form in enumerate(FORMS):
        at = np.arange(len(WORKS)) + (k - 1) * 0.27
        height = [rates[work, form] for work in WORKS]
        bars = ax.bar(at, height, 0.25, color=FORMS[form], label=form)
        ax.bar_label(bars, fmt="%.3g", fontsize=8)
    ax.set(xticks=range(len(WORKS)), yscale="log", ylabel="million a second")
    ax.set_xticklabels(WORKS)
    ax.legend(loc="upper right")
    title(ax, "a", "near field, float32, RGB, one core")
    rows, versions = [], (jax.__version__, version("mitsuba"))
    for (work, form), rate in rates.items():
        ratio = rate / rates[work, "Mitsuba"]
        rows.append((work, form, f"{rate:.4g}", f"{ratio:.4g}", *versions))
    return Drawing(fig, "Speed of the near field", Table(HEADER, rows))


def main(argv=None):
    """Draw nearfield_speed.svg and write nearfield_speed.csv, if Mitsuba runs."""
    run("nearfield_speed", __doc__, draw, argv)


if __name__ == "__main__":
    main()
