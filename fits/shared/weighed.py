"""What a fit of a tier makes least: weighted errors of its lobes, and of their sum."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from shared.importance import Samples

from fiberjax import exponential
from fiberjax.shading import LOBES

ALBEDO = 1.0
NOTICED = 0.01
FURNACE = 40.0
TRT = 0.2
RIDGE = 1e-5


def lobes(k: Any, at: Samples, which: tuple[int, ...] = LOBES) -> list[Any]:
    """Each lobe of every fiber."""
    shape = at.exact.shape[2:]

    def one(p):
        own, unravel = ravel_pytree(k[exponential.NAMES[p]])

        def of(own, hair, directions):
            k = {exponential.NAMES[p]: unravel(own)}
            return jnp.broadcast_to(exponential.lobe(p, k, hair, directions), shape)

        return by_columns(jax.vmap(of, (None, 0, 0)), own, (at.hair, at.at))

    return [one(p) for p in which]


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def by_columns(f: Any, x: Any, given: Any) -> Any:
    """f(x, *given) of a vector x, whose tangents are products with its Jacobian.

    A Jacobian with respect to more than x then has no other columns of f. There are
    no derivatives in what is given.
    """
    return f(x, *given)


@by_columns.defjvp
def _(f, primals, tangents):
    x, given = primals
    found, tangent = jax.linearize(lambda x: f(x, *given), x)
    return found, jnp.tensordot(tangents[0], jax.vmap(tangent)(jnp.eye(len(x))), 1)


def _scale(at: Samples, square: Any) -> Any:
    """What turns an error into one relative to the root of a mean square."""
    over = at.weight * at.weight_i[..., None]
    each = square[:, None, None] * square.shape[0] * square.shape[-1]
    return jnp.sqrt(over[..., None] / each)


def of_lobe(k: Any, at: Samples, p: int) -> Any:
    """Error of one lobe, whose sum of squares is the mean of the squared relative L2.

    And the constants themselves, a little: large ones that cancel do not bear rounding.
    """
    (found,) = lobes(k, at, (p,))
    error = (found - at.exact[:, p]) * _scale(at, at.square_lobes[:, p])
    return jnp.append(error, RIDGE * ravel_pytree(k)[0])


def of_all(k: Any, at: Samples) -> Any:
    """Errors of S, of the albedo and of TRT, the excess of clear fibers, the constants.

    An error of the albedo counts more than in proportion from `NOTICED` on: it is the
    largest that matters.
    """
    found = lobes(k, at)
    error = sum(found) - at.exact.sum(1)
    albedo = (error * at.weight[..., None]).sum(2)
    above = jax.nn.relu(albedo[..., 0] - at.room)
    albedo = albedo * jnp.sqrt(1 + (albedo / NOTICED) ** 2)
    trt = (found[2] - at.exact[:, 2]) * _scale(at, at.square_lobes[:, 2])
    parts = [
        error * _scale(at, at.square),
        ALBEDO * albedo / np.sqrt(albedo.size),
        TRT * trt,
        FURNACE * above / np.sqrt(above.size),
        RIDGE * ravel_pytree(k)[0],
    ]
    return jnp.concatenate([part.ravel() for part in parts])


@jax.jit
def relative(k: Any, at: Samples) -> Any:
    """Relative L2 of S of each fiber and color."""
    error = sum(lobes(k, at)) - at.exact.sum(1)
    over = (at.weight * at.weight_i[..., None])[..., None]
    return jnp.sqrt((over * error**2).sum((1, 2)) / at.square)
