"""From a scene to its evaluator, step by step; read it from top to bottom.

describe      black to brown hair, seen from everywhere, for a film: an error of 1e-3
plan          what is left out, with the bound of each omission and what it saves
evaluate      as fiberjax.evaluate, and against it, by the rule for that roughness
differentiate how S changes with absorption and roughness, by reverse mode
bake          the plan as a table for a renderer that looks up
compare       all of them, and what each is off by

The plan is printed. (a) S of one fiber in three channels over phi, full and planned;
(b) its derivatives in sigma_a and beta_n; (c) errors over the peak of plan and table,
and what they were promised to be below.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from shared.style import (
    BLACK,
    BLUE,
    ORANGE,
    SKY,
    VERMILION,
    Drawing,
    degrees,
    figure,
    progress,
    run,
    title,
)

import fiberjax as fj
from fiberjax.scene import Scene, plan

THETA_I, THETA_O = 0.3, -0.35
BAKED = 4e-3
SIGMA_A = 0.5, 0.9, 1.8


def describe():
    """A scene: numbers are ranges, and what is absent stays None."""
    return Scene(
        eta=1.55,
        beta_m=(0.15, 0.35),
        beta_n=(0.2, 0.4),
        alpha=(-0.06, -0.02),
        sigma_a=(0.4, 3.0),
        tolerance=1e-3,
    )


def hair():
    """A fiber of the scene, in three channels."""
    return fj.Fiber(1.55, 0.25, 0.3, -0.035, SIGMA_A)


def slopes(evaluate, fiber, phi):
    """Derivatives of the channel mean of S in sigma_a, for all channels, and beta_n."""

    def mean(fiber, phi):
        return evaluate(fiber, THETA_I, THETA_O, phi).mean()

    each = jax.vmap(jax.grad(mean), (None, 0))(fiber, phi)
    return each.sigma_a.sum(-1), each.beta_n


def bake(planned, fiber):
    """A table over theta_o and phi, for the theta_i at hand."""
    axes = {"theta_o": (-np.pi / 2, np.pi / 2), "phi": (0, np.pi)}
    function = partial(planned.evaluate, fiber, THETA_I)
    return fj.tabulate(function, axes, tolerance=BAKED, entries=1 << 18)


def draw():
    """All steps, and a figure of what comes of them."""
    fiber, phi = hair(), jnp.linspace(0, np.pi, 361)

    scene = describe()
    scene.check(fiber, theta_i=THETA_I, theta_o=THETA_O, phi=phi)

    progress("plan")
    planned = plan(scene)
    progress("")
    print(planned)

    progress("evaluate")
    full = partial(fj.evaluate, rule=fj.auto(1e-12, *scene.ends("beta_n")))
    exact = full(fiber, THETA_I, THETA_O, phi)
    found = planned.evaluate(fiber, THETA_I, THETA_O, phi)

    progress("differentiate")
    by_absorption, by_width = slopes(planned.evaluate, fiber, phi)
    exactly = slopes(full, fiber, phi)

    progress("bake")
    table = bake(planned, fiber)
    looked_up = table(theta_o=THETA_O, phi=phi)

    fig = figure(2.9)
    values, derivatives, errors = fig.subplots(1, 3)
    degree = np.degrees(phi)
    for k, color in enumerate((VERMILION, ORANGE, BLUE)):
        values.plot(degree, exact[:, k], color=color, lw=3, alpha=0.35)
        label = rf"$\sigma_a$ = {SIGMA_A[k]}"
        values.plot(degree, found[:, k], color=color, lw=1, label=label)
    values.set(ylabel="S cos θ$_o$ per steradian", ylim=0)
    values.legend()
    title(values, "a", "full (wide) and planned")
    for exact_slope, slope, color, label in (
        (exactly[0], by_absorption, BLUE, r"in $\sigma_a$"),
        (exactly[1], by_width, VERMILION, r"in $\beta_n$"),
    ):
        derivatives.plot(degree, exact_slope, color=color, lw=3, alpha=0.35)
        derivatives.plot(degree, slope, color=color, lw=1, label=label)
    derivatives.set_ylabel("derivative of the mean")
    derivatives.legend()
    title(derivatives, "b", "derivatives")
    peak = float(full(fiber, THETA_I, jnp.linspace(-1, 1, 99), 0.0).max())
    scale = jnp.maximum(exact.max(0), peak)
    for value, promised, color, label in (
        (found, scene.tolerance, BLUE, "plan"),
        (looked_up, scene.tolerance + BAKED, SKY, "table"),
    ):
        off = np.abs((value - exact) / scale).max(1)
        errors.semilogy(degree, np.maximum(off, 1e-9), color=color, label=label)
        errors.axhline(promised, color=color, ls="--", lw=1)
    errors.plot([], [], color=BLACK, ls="--", lw=1, label="promised")
    errors.set(ylabel="error over the peak", ylim=(1e-8, None))
    errors.legend(loc="lower right")
    title(errors, "c", "what was promised")
    for ax in (values, derivatives, errors):
        degrees(ax, "x", 0, 180, 60)
        ax.set_xlabel("φ")
    return Drawing(fig, "A scene, its plan and its table")


def main(argv=None):
    """Print the plan and draw tutorial.svg."""
    run("tutorial", __doc__, draw, argv)


if __name__ == "__main__":
    main()
