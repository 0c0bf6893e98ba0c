"""The sampler by strategy: variance of its weights, and what a sample costs."""

import itertools
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from shared.style import progress
from shared.timing import Row, medians

import fiberjax

STRATEGIES = ("lobe_first", "lobe_again", "guided")
BETAS = (0.05, 0.2, 0.5, 0.9)
SIGMAS = (0.0, 0.3, 2.0)
THETA_I = (0, 15, 30, 45, 60, 75, 78, 80, 82, 85, 87, 89)
ORDINARY = 75
ETA, ALPHA = 1.55, np.radians(-2.0)
COUNT, ROUNDS = 100_000, 9


def draw_samples(strategy, fiber, theta_i, u):
    """Samples of one strategy, jitted as a whole."""
    return fiberjax.sample(fiber, theta_i, u, strategy=strategy)


drawn = jax.jit(draw_samples, static_argnums=0)


def variances(strategy, beta, sigma_a, theta_i, u):
    """Variance of the weight, and of the weight times 1 + cos phi cos theta_o."""
    fiber = fiberjax.Fiber(ETA, beta, beta, ALPHA, sigma_a)
    s = drawn(strategy, fiber, jnp.radians(theta_i), u)
    seen = s.weight * (1 + jnp.cos(s.phi) * jnp.cos(s.theta_o))
    return float(s.weight.var()), float(seen.var())


def measure():
    """Both variances; keys are (strategy, beta, sigma_a, theta_i)."""
    u = jax.random.uniform(jax.random.key(1), (COUNT, 5))
    result = {}
    for key in itertools.product(STRATEGIES, BETAS, SIGMAS, map(float, THETA_I)):
        progress("variance: {}, beta {}, sigma_a {}".format(*key))
        result[key] = variances(*key, u)
    return result


def costs(dtype="float32"):
    """Nanoseconds a sample by strategy, each with a theta_i of its own."""
    u = jax.random.uniform(jax.random.key(2), (COUNT, 5), dtype)
    theta_i = jnp.linspace(-1.5, 1.5, COUNT, dtype=dtype)
    fiber = fiberjax.Fiber(ETA, 0.3, 0.3, ALPHA, 0.3)
    calls = {s: partial(drawn, s, fiber, theta_i, u) for s in STRATEGIES}
    for call in calls.values():
        jax.block_until_ready(call())
    return {s: 1e9 * t / COUNT for s, t in medians(calls, ROUNDS).items()}


def mean(values):
    """The geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


BANDS = {f"theta_i to {ORDINARY}": False, f"theta_i beyond {ORDINARY}": True}


def rows():
    """Mean variance of the weight at each roughness, for theta_i in two bands."""
    result = measure()
    found = []
    for dtype in ("float64", "float32"):
        cost = costs(dtype)
        for (band, beyond), strategy, beta in itertools.product(
            BANDS.items(), STRATEGIES, BETAS
        ):
            variance = mean(
                [
                    each
                    for key, (each, _) in result.items()
                    if key[:2] == (strategy, beta) and (key[3] > ORDINARY) == beyond
                ]
            )
            what = "sample", strategy, "", dtype, band, beta
            found.append(Row(*what, variance, cost[strategy] / 1e9))
    return found
