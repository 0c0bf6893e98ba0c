"""Evaluators of three scenes as one would write them by hand, without the library.

As plans do, they make a table of N of each lobe within the call: Chebyshev polynomials
in cos theta_d times cosines of phi, entries by Gauss-Legendre in gamma with as many
nodes as the tolerance takes, one image of the detector. A value is a product of two
vectors with that matrix, written out; so is M, with I0 by jax.
"""

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

NODES = {"R only": 16, "black hair": 16, "clear fiber": 20}
# Polynomials and cosines by the lobe; 3 is all others, which do not know phi.
SIZES = {
    "R only": {0: (11, 22)},
    "black hair": {0: (12, 24), 1: (12, 17), 2: (12, 21)},
    "clear fiber": {0: (11, 20), 1: (14, 18), 2: (16, 24), 3: (12, 1)},
}


def _M(sin_c, cos_c, sin_o, cos_o, v):
    versine = ((sin_o - sin_c) ** 2 + (cos_o - cos_c) ** 2) / 2
    a = cos_c * cos_o / v
    bessel = jax.scipy.special.i0e(a)
    return jnp.exp(-versine / v + jnp.abs(a) - a) * bessel / (-v * jnp.expm1(-2 / v))


def _wrapped(x):
    return x - 2 * jnp.pi * jnp.round(x / (2 * jnp.pi))


def _entries(fiber, p, count, c, phi):
    """N of a lobe (theta_d, phi, color); R has none."""
    x, w = np.polynomial.legendre.leggauss(count)
    gamma, share = np.pi / 4 * (1 + x), np.pi / 8 * w * np.cos(np.pi / 4 * (1 + x))
    k, e = fiber.eta**2 - 1, fiber.eta**2
    mu = c[:, None] * np.cos(gamma)
    g = jnp.sqrt(k + mu * mu)
    F = (((mu - g) / (mu + g)) ** 2 + ((e * mu - g) / (e * mu + g)) ** 2) / 2
    gamma_t = jnp.atan2(c[:, None] * np.sin(gamma), g)
    A = [F, (1 - F) ** 2, (1 - F) ** 2 * F, (1 - F) * F**2][p][..., None]
    if p and fiber.sigma_a is not None:
        length = 2 * fiber.eta * g / (k + c[:, None] ** 2)
        A = A * jnp.exp(-p * length[..., None] * fiber.sigma_a)
    if p == 3:
        D = jnp.full((*gamma_t.shape, len(phi)), 1 / math.pi)
    else:
        turn = (2 * p * gamma_t - 2 * gamma + p * math.pi)[..., None]
        over = 1 / (math.sqrt(2) * fiber.beta_n)
        D = sum(jnp.exp(-((over * _wrapped(phi - s * turn)) ** 2)) for s in (-1, 1))
        D = D / (math.sqrt(2 * math.pi) * fiber.beta_n)
    return jnp.einsum("h, thc, thp -> tpc", share, A, D)


def _of_theta(p, c):
    """What polynomials are of: all other lobes change fast at grazing angles."""
    return c if p < 3 else jnp.sqrt(c)


def _table(fiber, p, count, polynomials, cosines):
    """Coefficients (polynomial, cosine, color, 1)."""
    at = (np.arange(polynomials) + 0.5) / polynomials * np.pi
    turns = (np.arange(cosines) + 0.5) / cosines * np.pi
    x = (1 + np.cos(at)) / 2
    N = _entries(fiber, p, count, jnp.asarray(x if p < 3 else x * x), turns)
    over_theta, over_phi = (
        np.cos(np.arange(len(y))[:, None] * y) * 2 / len(y) for y in (at, turns)
    )
    over_theta[0] /= 2
    over_phi[0] /= 2
    return jnp.einsum("jt, kp, tpc -> jkc", over_theta, over_phi, N)[..., None]


def _chebyshev(x, count):
    """Chebyshev polynomials of x, which are cosines of multiples of acos(x)."""
    found = [1.0, x]
    while len(found) < count:
        found.append(2 * x * found[-1] - found[-2])
    return found[:count]


def _product(matrix, left, right):
    """Written out, so that nothing is stored between: XLA makes one loop of it."""
    rows = (sum(x * y for x, y in zip(row, right, strict=True)) for row in matrix)
    return sum(x * y for x, y in zip(left, rows, strict=True))


def _along(fiber, p, sin_i, cos_i, sin_o, cos_o):
    """M of a lobe."""
    tilt = 0.0 if p == 3 else fiber.tilts[p] * fiber.alpha
    sin_t, cos_t = jnp.sin(tilt), jnp.cos(tilt)
    sin_c = -sin_i * cos_t + cos_i * sin_t
    cos_c = cos_i * cos_t + sin_i * sin_t
    v = (fiber.widths_m[min(p, 2)] * fiber.beta_m) ** 2
    return _M(sin_c, cos_c, sin_o, cos_o, v)


@partial(jax.jit, static_argnums=0)
def evaluate(name, fiber, theta_i, theta_o, phi):
    """S of the lobes that the scene needs, at directions (n,)."""
    along = jnp.sin(theta_i), jnp.cos(theta_i), jnp.sin(theta_o), jnp.cos(theta_o)
    c, cos_phi = jnp.cos((theta_o - theta_i) / 2), jnp.cos(phi)
    total = jnp.zeros((1, len(phi)), phi.dtype)
    for p, (polynomials, cosines) in SIZES[name].items():
        table = _table(fiber, p, NODES[name], polynomials, cosines)
        at_theta = _chebyshev(2 * _of_theta(p, c) - 1, polynomials)
        at_phi = _chebyshev(cos_phi, cosines)
        total = total + _along(fiber, p, *along) * _product(table, at_theta, at_phi)
    if fiber.sigma_a is None or np.ndim(fiber.sigma_a) == 0:
        return total[0]
    return jnp.broadcast_to(total, (len(fiber.sigma_a), len(phi))).T
