"""M as papers and renderers print it, in JAX."""

from math import factorial

import jax.numpy as jnp
from jax.scipy.special import i0, i0e


def exponents(theta_cone, theta_o, v):
    """cos cos/v and sin sin/v."""
    a = jnp.cos(theta_cone) * jnp.cos(theta_o) / v
    return a, jnp.sin(theta_cone) * jnp.sin(theta_o) / v


def printed_M(theta_cone, theta_o, v):
    """The equation factor by factor: csch and I0 overflow where v is small."""
    a, b = exponents(theta_cone, theta_o, v)
    return jnp.exp(b) * i0(a) / (2 * v * jnp.sinh(1 / v))


def textbook_I0(x):
    """The series of renderers, of ten terms."""
    return sum((x / 2) ** (2 * k) / factorial(k) ** 2 for k in range(10))


def textbook_log_I0(x):
    """The asymptotic form of renderers beyond 12, with 1/(8x) inside the half."""
    far = x + (-jnp.log(2 * jnp.pi) + jnp.log(1 / x) + 1 / (8 * x)) / 2
    return jnp.where(x > 12, far, jnp.log(textbook_I0(x)))


def textbook_M(theta_cone, theta_o, v):
    """M as renderers print it."""
    a, b = exponents(theta_cone, theta_o, v)
    narrow = jnp.exp(textbook_log_I0(a) + b - 1 / v + 0.6931 + jnp.log(1 / (2 * v)))
    broad = jnp.exp(b) * textbook_I0(a) / (jnp.sinh(1 / v) * 2 * v)
    return jnp.where(v <= 0.1, narrow, broad)


def scaled_M(theta_cone, theta_o, v):
    """The equation with jax's i0e: nothing overflows, but the exponent cancels."""
    a, b = exponents(theta_cone, theta_o, v)
    return jnp.exp(b + jnp.abs(a) - 1 / v) * i0e(a) / (v * (1 - jnp.exp(-2 / v)))
