"""What color a single fiber has of a color asked for, by three ways to absorption.

The albedo is the mean over all inclinations, as in surroundings that are bright on all
sides. The solver returns what it is asked for between R's albedo and that of the clear
fiber; Chiang's inversion is for hair that light meets many times, Karis' color is that
of TT.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.lines import Line2D
from shared.style import (
    BLACK,
    BLUE,
    GRAY,
    ORANGE,
    PALE,
    SKY,
    VERMILION,
    Drawing,
    Table,
    figure,
    run,
    title,
)

import fiberjax
from fiberjax import absorption

FIBER = fiberjax.Fiber()
BETA_N = (0.3, 0.7, 1.0)
COLORS = (SKY, BLUE, VERMILION)
ASKED = np.array([*range(1, 12), *range(12, 97, 4), 98, 99]) / 100
HEADER = ("way", "beta_n_perceptual", "color", "sigma_a", "albedo")


@jax.jit
@jax.vmap
def scattered(sigma_a):
    """Mean albedo of the fiber over inclinations, weighted by cos^2."""
    x, w = np.polynomial.legendre.leggauss(48)
    theta_i = np.pi / 2 * x
    fiber = replace(FIBER, sigma_a=sigma_a)
    return (w * np.cos(theta_i) ** 2) @ fiberjax.albedo(fiber, theta_i)


def measure():
    """Absorption and albedo over the colors asked for, by (way, beta_n)."""
    solved = np.asarray(jax.vmap(lambda color: absorption.solve(FIBER, color))(ASKED))
    within = np.isfinite(solved)
    ways: dict[tuple[str, str], Any] = {("solve", ""): (ASKED, solved)}
    for b in BETA_N:
        ways["from_color", f"{b:g}"] = ASKED, absorption.from_color(ASKED, b)
    ways["zeta", ""] = ASKED, absorption.zeta(ASKED)
    result = {
        key: np.stack([color, sigma_a, scattered(jnp.asarray(sigma_a))])
        for key, (color, sigma_a) in ways.items()
    }
    result["solve", ""] = result["solve", ""][:, within]
    return result


def table(result):
    """One row for each color of each way."""
    rows = (
        (*key, f"{color:g}", f"{sigma_a:.9g}", f"{albedo:.9f}")
        for key, columns in result.items()
        for color, sigma_a, albedo in zip(*columns, strict=True)
    )
    return Table(HEADER, rows)


def looks() -> Iterator[tuple[tuple[str, str], dict[str, Any], str]]:
    """Line and name of every way."""
    yield ("solve", ""), {"color": BLACK}, "solve"
    for b, color in zip(BETA_N, COLORS, strict=True):
        name = rf"from_color, perceptual $\beta_n$ = {b:g}"
        yield ("from_color", f"{b:g}"), {"color": color}, name
    yield ("zeta", ""), {"color": ORANGE, "ls": "--"}, "zeta"


def draw():
    """Albedo and absorption over the color asked for."""
    result = measure()
    low, high = map(float, absorption.reach(FIBER))
    fig = figure(4.1)
    left, right = fig.subplots(1, 2)
    left.axhspan(0, low, color=PALE, lw=0)
    left.axhspan(high, 1.05, color=PALE, lw=0)
    left.text(0.98, low / 2, "below R alone", ha="right", va="center", color=GRAY)
    for key, look, _ in looks():
        color, sigma_a, albedo = result[key]
        left.plot(color, albedo, **look)
        right.plot(color, sigma_a, **look)
    left.set(xlim=(0, 1), ylim=(0, 1.05), ylabel="albedo of one fiber, mean")
    title(left, "a", "color of one fiber")
    right.set(xlim=(0, 1), ylim=(1e-5, 10), yscale="log")
    right.set(ylabel=r"$\sigma_a$ per radius")
    title(right, "b", "absorption")
    for ax in (left, right):
        ax.set(xlabel="color asked for, $C$")
    keys = [Line2D([], [], **look) for _, look, _ in looks()]
    right.legend(keys, [name for *_, name in looks()], loc="lower left")
    return Drawing(fig, "Color of one fiber against the color asked for", table(result))


def main(argv=None):
    """Draw absorption.svg and write absorption.csv."""
    run("absorption", __doc__, draw, argv)


if __name__ == "__main__":
    main()
