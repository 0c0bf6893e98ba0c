"""exp(k0 cos phi + k1) as Karis uses it, against the lobes it stands for.

His lobe is N_p ~ A(p, h) D_p(phi) with one offset h for each phi. Here A is exact, at
the exact h and for a clear fiber, so that what is left is the error of D. The reference
is N_p with the normal detector; errors are relative to its peak over phi.
"""

from collections.abc import Callable
from itertools import product
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from shared.report import errors, fit, progress, rounded

import fiberjax
from fiberjax.approximation import Problem, simpson, to_float32
from fiberjax.fitting import least_squares

ETA = 1.55
THETA_D = (0, 15, 30, 45, 60, 75)
BETA_N = (0.1, 0.2, 0.35, 0.5, 0.7)
FIELDS = ("factor", "lobe")
SHOWN = ("published", "target", "minimax")
WITHIN = 0.1
PHI, WEIGHTS, _ = simpson((0, np.pi, 2049))


class Constants(NamedTuple):
    """The constants of the approximation."""

    k0: float
    k1: float


def approx(k, phi):
    """Karis' form of a density in azimuth, even in phi."""
    return jnp.exp(k.k0 * jnp.cos(phi) + k.k1)


def untrimmed_logistic(phi, s):
    """Logistic density of scale s on the whole line, for phi in [-pi, pi].

    The trimmed one holds tanh(pi/(2 s)) of its mass within a turn.
    """
    return fiberjax.trimmed_logistic(phi, s) * np.tanh(np.pi / (2 * s))


def integral(density: Callable) -> float:
    """Integral over a turn of an even density, by the rule that also fits it."""
    return float(2 * np.pi * WEIGHTS @ density(jnp.asarray(PHI[:, 0])))


class Tabulated(eqx.Module):
    """Error at tabulated phi: factor approx(k, phi) - lobe."""

    phi: Any
    factor: Any
    lobe: Any

    def __call__(self, k, i):
        """Error at index i of the table."""
        return self.factor[i] * approx(k, self.phi[i]) - self.lobe[i]


def index(x):
    """A point of the table is its index."""
    return {"i": x[..., 0].astype(int)}


def problem(table: Tabulated) -> Problem:
    """The fit to one table, of one cell or of several in a row."""
    n = len(table.phi)
    weights = np.tile(WEIGHTS, n // len(WEIGHTS)) * len(WEIGHTS) / n
    points = np.arange(n, dtype=float)[:, None]
    return Problem(Constants, table, index, points, weights, np.zeros(1))


def cell(p: int, cos_gamma: Callable, theta_d: float, beta_n: float):
    """Peak of N_p, and the table of A/peak and N_p/peak over phi."""
    phi = jnp.asarray(PHI[:, 0])
    lobe = fiberjax.N(p, phi, theta_d, eta=ETA, sigma_a=None, beta_n=beta_n)
    a = 1 / fiberjax.eta_prime(theta_d, ETA)
    reflected = fiberjax.reflectance(np.cos(theta_d) * cos_gamma(phi, a), ETA)
    factor = fiberjax.A(p, reflected, 1.0) * jnp.ones_like(phi)
    peak = lobe.max()
    return peak, Tabulated(phi, factor / peak, lobe / peak)


def refitted(problem, place, published, constants) -> dict[str, Any]:
    """Constants and errors of published and refitted sets."""
    sets = {"published": published, **constants}
    return {
        "constants": {name: k._asdict() for name, k in constants.items()},
        "error": {name: errors(problem, place, k) for name, k in sets.items()},
    }


def least_of_all(tables: list[Tabulated]) -> float:
    """What no function of phi alone can do better, whatever its form.

    For two cells with errors f x - m and g x - n at one phi, the value
    x = (m + n)/(f + g) makes both as large; any other x makes one larger.
    """
    g, n = (np.stack([getattr(t, name) for t in tables]) for name in FIELDS)
    pairs = zip(g, n, strict=True)
    return max(float(((m * g - n * f) / (f + g)).max()) for f, m in pairs)


def summary(p: int, pooled: dict[str, Any], cells: list[dict[str, Any]]) -> list[str]:
    """The entry as lines for the terminal."""

    def percent(name, entry):
        return f"{entry['error'][name]['max']:.1%}"

    lines = [
        f"  against N_{p} = A(h) D of a clear fiber, largest error in % of its peak:",
        "  published constants / their target / minimax constants of that cell",
        "  theta_d" + "".join(f"{f'beta_n {b}':>23}" for b in BETA_N),
    ]
    for i, degrees in enumerate(THETA_D):
        row = cells[i * len(BETA_N) : (i + 1) * len(BETA_N)]
        texts = (" /".join(f"{percent(name, c):>6}" for name in SHOWN) for c in row)
        lines.append(f"  {degrees:>7}" + "".join(f"{text:>23}" for text in texts))
    k, error = pooled["constants"]["least_squares"], pooled["error"]
    within = sum(c["error"]["published"]["max"] <= WITHIN for c in cells)
    return [
        *lines,
        f"  one pair for all cells: k0 = {np.float32(k['k0'])!s}, "
        f"k1 = {np.float32(k['k1'])!s}, rms error {error['least_squares']['rms']:.6f}, "
        f"published {error['published']['rms']:.6f}",
        f"  no function of phi alone is within {pooled['bound']:.1%} in all cells; "
        f"the published constants are within {WITHIN:.0%} in {within} of {len(cells)}",
    ]


def against_reference(
    p: int, cos_gamma: Callable, published: Constants, target: Callable, max_steps: int
) -> tuple[dict[str, Any], list[str]]:
    """The `against_reference` entry of the file, and its lines in the table.

    Args:
        p: lobe.
        cos_gamma: cosine of the angle at which the ray towards phi enters, of (phi, a),
            a = 1/eta'.
        published: the published constants.
        target: the density they stand for, of phi.
        max_steps: steps allowed to each solver.
    """
    cells, tables = [], []
    for degrees, beta_n in product(THETA_D, BETA_N):
        progress(f"N_{p}, theta_d = {degrees} deg, beta_n = {beta_n}")
        peak, table = cell(p, cos_gamma, np.radians(degrees), beta_n)

        def place(x, phi=table.phi):
            return {"phi": phi[int(x[0])]}

        constants, _ = fit(problem(table), published, max_steps)
        entry = refitted(problem(table), place, published, constants)
        off = table.factor * target(table.phi) - table.lobe
        entry["error"]["target"] = {"max": rounded(jnp.abs(off).max())}
        where = {"theta_d_degrees": degrees, "beta_n": beta_n}
        cells.append({**where, "peak": rounded(peak), **entry})
        tables.append(table)
    progress("")

    def place_of_all(x):
        which, i = divmod(int(x[0]), len(PHI))
        where = {key: cells[which][key] for key in ("theta_d_degrees", "beta_n")}
        return {**where, "phi": PHI[i, 0]}

    pooled = problem(jax.tree.map(lambda *columns: jnp.concatenate(columns), *tables))
    least = least_squares(pooled, [published], max_steps=max_steps)
    best = Constants(*map(float, to_float32(pooled, least, lambda m: m.rms)))
    # The largest error over all cells has no single best pair: two peaks decide it.
    everywhere = {
        **refitted(pooled, place_of_all, published, {"least_squares": best}),
        "bound": rounded(least_of_all(tables)),
    }
    entry = {
        "form": f"A({p}, h) exp(k0 cos phi + k1), A exact and sigma_a = 0",
        "norm": "error relative to the peak of N over phi, mean square over phi",
        "domain": f"phi in [-pi, pi], eta = {ETA}, detector normal",
        "all": everywhere,
        "cells": cells,
    }
    return {"against_reference": entry}, summary(p, everywhere, cells)
