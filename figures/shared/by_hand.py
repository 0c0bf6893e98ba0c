"""Evaluators of three scenes as one would write them by hand, without the library.

Gauss-Legendre in gamma with as many nodes as the tolerance takes, one loop for all
lobes that are needed, one image of the detector, I0 by jax.
"""

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

NODES = {"R only": 16, "black hair": 16, "clear fiber": 20}
LOBES = {"R only": (0,), "black hair": (0, 1, 2), "clear fiber": (0, 1, 2)}
REST = ("clear fiber",)


def _M(sin_c, cos_c, sin_o, cos_o, v):
    versine = ((sin_o - sin_c) ** 2 + (cos_o - cos_c) ** 2) / 2
    a = cos_c * cos_o / v
    bessel = jax.scipy.special.i0e(a)
    return jnp.exp(-versine / v + jnp.abs(a) - a) * bessel / (-v * jnp.expm1(-2 / v))


def _wrapped(x):
    return x - 2 * jnp.pi * jnp.round(x / (2 * jnp.pi))


@partial(jax.jit, static_argnums=0)
def evaluate(name, fiber, theta_i, theta_o, phi):
    """S of the lobes that the scene needs."""
    lobes, rest = LOBES[name], name in REST
    clear = fiber.sigma_a is None
    sigma_a = () if clear else jnp.atleast_1d(fiber.sigma_a)
    x, w = np.polynomial.legendre.leggauss(NODES[name])
    gammas, shares = np.pi / 4 * (1 + x), np.pi / 4 * w
    c = jnp.cos((theta_o - theta_i) / 2)
    k = fiber.eta**2 - 1
    r = jnp.sqrt(k + c * c)
    colors = 1 if clear else len(sigma_a)
    sums = [[0.0] * colors for _ in (*lobes, *[3] * rest)]
    over = 1 / (math.sqrt(2) * fiber.beta_n)
    for gamma, share in zip(gammas, shares, strict=True):
        mu = c * math.cos(gamma)
        g = jnp.sqrt(k + mu * mu)
        s = ((mu - g) / (mu + g)) ** 2
        e = fiber.eta**2
        F = (s + ((e * mu - g) / (e * mu + g)) ** 2) / 2
        # Of R there is none.
        gamma_t = jnp.atan2(c * math.sin(gamma), g) if max(lobes) else 0.0
        length = 2 * fiber.eta * g / (r * r)
        T = [1.0] if clear else [jnp.exp(-q * length) for q in sigma_a]
        for j, p in enumerate((*lobes, *[3] * rest)):
            if p == 3:
                D = 1 / math.pi
            else:
                turn = 2 * p * gamma_t - 2 * gamma + p * math.pi
                D = jnp.exp(-((over * _wrapped(phi - turn)) ** 2))
                D = D + jnp.exp(-((over * _wrapped(phi + turn)) ** 2))
            A = F if p == 0 else (1 - F) ** 2 * F ** (p - 1)
            A = (1 - F) * F**2 if p == 3 else A
            common = D * A * (share * math.cos(gamma) / 2)
            for q in range(colors):
                sums[j][q] = sums[j][q] + common * T[q] ** p
    peak = 1 / (math.sqrt(2 * math.pi) * fiber.beta_n)
    sin_i, cos_i = jnp.sin(theta_i), jnp.cos(theta_i)
    sin_o, cos_o = jnp.sin(theta_o), jnp.cos(theta_o)
    total = [0.0] * colors
    for j, p in enumerate((*lobes, *[3] * rest)):
        tilt = 0.0 if p == 3 else fiber.tilts[p] * fiber.alpha
        sin_t, cos_t = jnp.sin(tilt), jnp.cos(tilt)
        sin_c = -sin_i * cos_t + cos_i * sin_t
        cos_c = cos_i * cos_t + sin_i * sin_t
        v = (fiber.widths_m[min(p, 2)] * fiber.beta_m) ** 2
        along = _M(sin_c, cos_c, sin_o, cos_o, v) * (1.0 if p == 3 else peak)
        for q in range(colors):
            total[q] = total[q] + along * sums[j][q]
    return total[0] if clear else jnp.moveaxis(jnp.stack(total), 0, -1)
