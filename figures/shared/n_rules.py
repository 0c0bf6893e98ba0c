"""N by every rule, and by scipy: workloads, truth and errors.

A value is one N, in three channels, at one phi and theta_d. Values of the workload "N"
have both to themselves, as the hits of a path tracer do; in "N_grid" many phi share
each theta_d, as in a table.
"""

import math
from dataclasses import astuple
from functools import cache, partial
from time import perf_counter
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import quad
from shared.style import LOBES, progress
from shared.timing import Row

import fiberjax
from fiberjax import GaussGamma, GaussH, Series, Windowed, auto

# Numbers that float32 holds, so that one truth serves both precisions.
ETA = float(np.float32(1.55))
SIGMA_A = tuple(map(float, np.array([0.15, 0.3, 0.6], np.float32)))
THETA_D = np.radians([0, 30, 60, 75, 85]).astype(np.float32)
PHI = np.linspace(0, np.pi, 2049, dtype=np.float32)[:-1]
COUNT = len(THETA_D) * len(PHI)
BETA_N = (0.003, 0.03, 0.1, 0.3, 1.0)

TRUTH_ORDERS = dict(zip(BETA_N, (6000, 1000, 500, 300, 300), strict=True))
"""Of GaussGamma: at least twice what these roughnesses ask for."""


def windowed(order):
    """The tolerance that `auto` gives to windows of this order."""
    return Windowed(order, float(f"{math.exp(-order / 1.5):.0e}"))


TEXTBOOK = GaussH(70)
SERIES = {"float64": (16, 24, 32, 48, 96, 192), "float32": (12, 24, 48, 96)}
TOLERANCES = {
    "float64": (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
    "float32": (1e-2, 1e-4, 1e-6),
}
RULES: dict[tuple[str, str], tuple[Any, ...]] = {
    ("N", "float64"): (
        *map(GaussH, (10, 20, 70, 140, 280, 1000)),
        *map(GaussGamma, (8, 12, 16, 24, 32, 48, 96, 192)),
        *map(windowed, (8, 12, 16, 24, 32, 48)),
        *map(auto, TOLERANCES["float64"]),
    ),
    ("N", "float32"): (
        *map(GaussH, (10, 20, 70, 280)),
        *map(GaussGamma, (8, 12, 16, 24, 48, 96)),
        *map(windowed, (8, 12, 16, 24)),
        *map(auto, TOLERANCES["float32"]),
    ),
    **{
        ("N_grid", dtype): (
            *(Series(order, math.ceil(order / 0.89)) for order in orders),
            *map(GaussGamma, (12, 24, 48)),
            *map(auto, TOLERANCES[dtype]),
        )
        for dtype, orders in SERIES.items()
    },
}
PROBES = PHI[100::400]


def family(rule):
    """The name of a rule without its numbers."""
    return type(rule).__name__.replace("Auto", "auto")


def setting(rule):
    """The numbers of a rule: nodes, then terms or tolerance."""
    numbers = astuple(rule)[:1] if family(rule) == "auto" else astuple(rule)
    return " ".join(str(x) for x in numbers if x is not None)


def places(quantity, dtype):
    """phi and theta_d, flat or as the axes of the grid."""
    phi, theta_d = PHI, THETA_D[:, None]
    if quantity == "N":
        phi, theta_d = (x.ravel() for x in np.broadcast_arrays(phi, theta_d))
    return jnp.asarray(phi, dtype), jnp.asarray(theta_d, dtype)


@partial(jax.jit, static_argnums=(0, 1))
def by_rule(rule, p, phi, theta_d, beta_n):
    """N_p at every value."""
    sigma_a = jnp.asarray(SIGMA_A, phi.dtype)
    return fiberjax.N(
        p, phi, theta_d, eta=ETA, sigma_a=sigma_a, beta_n=beta_n, rule=rule
    )


def width(beta_n):
    """The float32 number next to a roughness."""
    return float(np.float32(beta_n))


@cache
def truth(p, beta_n):
    """N_p by many nodes, shape (theta_d, phi, channels)."""
    rule = GaussGamma(TRUTH_ORDERS[beta_n])
    return np.asarray(by_rule(rule, p, *places("N_grid", "float64"), width(beta_n)))


def error(value, exact):
    """Largest error relative to the peak over phi, at each theta_d and channel."""
    off = np.abs(np.asarray(value, float).reshape(exact.shape) - exact)
    return float((off / exact.max(axis=1, keepdims=True)).max())


def rounding(p, beta_n, dtype="float64"):
    """The error that the rounding of Phi, and of the exponent of T, alone makes."""
    size = 4 * math.pi / min(beta_n, 1) + 4 * p * max(SIGMA_A)
    return float(jnp.finfo(dtype).eps) * size


def calls():
    """What is to be timed, after a first run; keys are (quantity, dtype, rule, p, s).

    One compilation serves all roughnesses: which of its rules `auto` runs is decided
    there.
    """
    found = {}
    for (quantity, dtype), rules in RULES.items():
        at = places(quantity, dtype)
        for p, lobe in enumerate(LOBES):
            for rule in rules:
                progress(f"{quantity} of {lobe} by {rule}, {dtype}")
                for beta_n in BETA_N:
                    s = jnp.asarray(width(beta_n), dtype)
                    call = partial(by_rule, rule, p, *at, s)
                    found[quantity, dtype, rule, p, beta_n] = call
                    if beta_n == BETA_N[0]:
                        jax.block_until_ready(call())
    return found


def row(key, call, seconds):
    """The row of a call that took so many seconds."""
    quantity, dtype, rule, p, beta_n = key
    wrong = error(call(), truth(p, beta_n))
    what = quantity, family(rule), setting(rule), dtype, LOBES[p], beta_n
    return Row(*what, wrong, seconds / COUNT)


def attenuation(p, mu, path):
    """A_p in each channel at incident cosine mu, from the length of a segment."""
    g = math.sqrt(ETA**2 - 1 + mu * mu)
    r_s, r_p = (mu - g) / (mu + g), (ETA**2 * mu - g) / (ETA**2 * mu + g)
    f = (r_s**2 + r_p**2) / 2
    a = f if p == 0 else (1 - f) ** 2 * f ** (p - 1)
    return [a * math.exp(-p * sigma_a * path) for sigma_a in SIGMA_A]


def integrand(h, channel, p, phi, theta_d, beta_n):
    """A D(phi - Phi)/2 in plain Python."""
    sin_d, cos_d = math.sin(theta_d), math.cos(theta_d)
    eta_p = math.sqrt(ETA**2 - sin_d**2) / cos_d
    path = 2 * math.sqrt(1 - (h / eta_p) ** 2) / math.sqrt(1 - (sin_d / ETA) ** 2)
    turned = 2 * p * math.asin(h / eta_p) - 2 * math.asin(h) + p * math.pi
    x = math.remainder(phi - turned, 2 * math.pi)
    images = (x + 2 * math.pi * k for k in (-1, 0, 1))
    density = sum(math.exp(-0.5 * (y / beta_n) ** 2) for y in images)
    density /= beta_n * math.sqrt(2 * math.pi)
    mu = cos_d * math.sqrt(1 - h * h)
    return attenuation(p, mu, path)[channel] * density / 2


def by_scipy(p, beta_n):
    """The row of scipy's adaptive quadrature in h, channel by channel."""
    worst, start = 0.0, perf_counter()
    for theta_d, exact in zip(THETA_D, truth(p, beta_n), strict=True):
        for phi in PROBES:
            at = p, float(phi), float(theta_d), width(beta_n)
            # With full_output it keeps its doubts about the end points to itself.
            value = [
                quad(integrand, -1, 1, args=(channel, *at), full_output=1)[0]
                for channel in range(len(SIGMA_A))
            ]
            off = np.abs(value - exact[phi == PHI][0]) / exact.max(axis=0)
            worst = max(worst, float(off.max()))
    each = (perf_counter() - start) / len(PROBES) / len(THETA_D)
    return Row("N", "quad", "", "float64", LOBES[p], beta_n, worst, each)


def scipy_rows():
    """Every lobe and roughness by scipy."""
    progress("N by scipy")
    return [by_scipy(p, beta_n) for p in range(len(LOBES)) for beta_n in BETA_N]


EXPS = 64
"""Exponentials in the sum that is timed."""


@jax.jit
def exponentials(x):
    """A sum of exponentials of each number, in one loop."""
    total = jnp.zeros_like(x)
    for k in range(EXPS):
        total = total + jnp.exp(x * (k + 1))
    return total


def exp_calls():
    """Sums of exponentials to be timed, after a first run; keys are dtypes."""
    found = {}
    for dtype in SERIES:
        x = jnp.linspace(-0.5, 0, COUNT, dtype=dtype)
        found[dtype] = partial(exponentials, x)
        jax.block_until_ready(found[dtype]())
    return found


def exp_row(dtype, seconds):
    """The row of one exponential."""
    each = seconds / (EXPS * COUNT)
    return Row("exp", "exp", "", dtype, "", math.nan, math.nan, each)


def exps_per_node(lobe):
    """Of GaussGamma: two of the detector, and where there is absorption each T."""
    return 2 + (len(SIGMA_A) if lobe != "R" else 0)
