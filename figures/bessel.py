"""Error of M as renderers evaluate it, from their log I0 and from rounding.

At the peak, theta_o = theta_cone, against the library's M in float64: over the argument
x = cos theta_cone cos theta_o/v of I0 at one v in float64, where the series of I0 stops
at ten terms in pbrt and at eleven in Mitsuba, and is left for an asymptotic form at x =
12; and the largest over theta_o, over v, in both precisions. The angles are numbers
that float32 holds.
"""

import jax.numpy as jnp
import numpy as np
from shared.style import (
    BLACK,
    BLUE,
    ORANGE,
    VERMILION,
    Drawing,
    Table,
    figure,
    run,
    title,
)

import fiberjax
from fiberjax.compat import MITSUBA, PBRT, M_renderers
from fiberjax.spherical import inclination

RENDERERS = {"pbrt": (PBRT, VERMILION), "mitsuba": (MITSUBA, BLUE)}
X = np.geomspace(0.3, 1000, 1201)
V_OF_X = 1e-3
V = np.geomspace(1e-6, 1, 97)
# Dense near the pole, where x is 12 if v is small.
THETA = (np.pi / 2 - np.geomspace(1e-4, np.pi / 2, 4001)).astype(np.float32)
HEADER = "renderer", "dtype", "over", "v", "x", "error"


def errors(theta, v, terms, dtype):
    """Relative error of M at its peak, theta a cone and v its variance."""
    there = inclination(jnp.asarray(theta, dtype))
    found = M_renderers(there, there, jnp.asarray(v, dtype), terms)
    wide = jnp.asarray(theta, jnp.float64)
    exact = fiberjax.M(wide, wide, jnp.asarray(np.asarray(v, dtype), jnp.float64))
    return np.abs(np.asarray(found, np.float64) / np.asarray(exact) - 1)


def over_x(terms):
    """The error at each x, in float64."""
    return errors(np.arccos(np.sqrt(X * V_OF_X)), V_OF_X, terms, "float64")


def over_v(terms, dtype):
    """The largest error over the cones at each v."""
    each = errors(THETA[:, None], V.astype(np.float32), terms, dtype)
    return each.max(axis=0)


def measure():
    """Rows of (renderer, dtype, over, v, x, error); x is NaN of the largest."""
    rows = []
    for name, (terms, _) in RENDERERS.items():
        along = over_x(terms)
        rows += [
            (name, "float64", "x", V_OF_X, *row) for row in zip(X, along, strict=True)
        ]
        for dtype in ("float64", "float32"):
            worst = over_v(terms, dtype)
            rows += [
                (name, dtype, "v", v, np.nan, e) for v, e in zip(V, worst, strict=True)
            ]
    return rows


def curve(rows, *key):
    """v, x and the error of the rows of a renderer, dtype and variable."""
    return np.array([row[3:] for row in rows if row[:3] == key]).T


def draw():
    """The error over x, and the largest over v."""
    rows = measure()
    fig = figure(3.6)
    left, right = fig.subplots(1, 2, sharey=True)
    for name, (terms, color) in RENDERERS.items():
        _, x, error = curve(rows, name, "float64", "x")
        style = {"color": color, "ls": "-" if terms == PBRT else "--"}
        left.plot(x, error, label=f"{name}, {terms} terms", **style)
    left.axvline(12, color=BLACK, lw=0.8, ls=":")
    left.set(xscale="log", yscale="log", ylim=(1e-8, 1))
    left.set(xlabel=r"$x=\cos\theta_c\,\cos\theta_o/v$", ylabel="relative error of M")
    left.legend(loc="upper right")
    title(left, "a", "float64, v = 0.001")
    for dtype, color in (("float64", VERMILION), ("float32", ORANGE)):
        v, _, error = curve(rows, "pbrt", dtype, "v")
        right.plot(v, error, label=f"pbrt, {dtype}", color=color)
    v, _, error = curve(rows, "mitsuba", "float64", "v")
    right.plot(v, error, label="mitsuba, float64", color=BLUE, ls="--")
    right.set(xscale="log", xlabel=r"variance $v=\beta^2$, rad$^2$")
    right.legend(loc="lower left")
    title(right, "b", "the largest at the peak, over theta")
    cells = [(*r[:3], f"{r[3]:.6g}", f"{r[4]:.6g}", f"{r[5]:.4e}") for r in rows]
    return Drawing(fig, "Error of M in renderers", Table(HEADER, cells))


def main(argv=None):
    """Draw bessel.svg and write bessel.csv."""
    run("bessel", __doc__, draw, argv)


if __name__ == "__main__":
    main()
