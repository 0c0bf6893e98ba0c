"""What a compiled program computes once, not at all, or a block at a time."""

from collections.abc import Callable
from functools import partial
from math import prod
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

from fiberjax._types import Floats

_BLOCK = 4032
"""Not a power of two: its columns would share the sets of a cache."""


def computed_if(condition: Array, value: Callable[[], Floats], like: Any) -> Floats:
    """The value, like `like`, if the condition holds; 0, and no work, if not."""
    again = jax.checkpoint(value, prevent_cse=False)
    return jax.lax.cond(condition, again, lambda: jnp.zeros(like.shape, like.dtype))


def stored(value: Callable[[], Any], anything: Floats) -> Any:
    """The value, as a branch that is always taken.

    XLA fuses what is cheap with each of its users and computes it for each anew, for
    every color here; a branch it does not look into. `anything` has numbers that are
    known only when running and lie above -2. Derivatives are those of the value with
    no branch around it: the reverse pass would keep all that is inside.
    """
    converted, inputs = jax.closure_convert(value)
    return _stored(converted, anything.ravel()[0], *inputs)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _stored(value, anything, *inputs):
    like = jax.eval_shape(value, *inputs)

    def never():
        return jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), like)

    return jax.lax.cond(anything < -2, never, lambda: value(*inputs))


@_stored.defjvp
def _stored_jvp(value, primals, tangents):
    return jax.jvp(value, primals[1:], tangents[1:])


def apart(values: Any, anything: Floats) -> Any:
    """The same values, which XLA computes once and not anew for each of their users.

    Barriers to optimization are gone by the time it decides what to fuse. `anything` as
    in `stored`.
    """
    each, tree = jax.tree.flatten(values)
    return tree.unflatten(_stored(lambda *x: x, anything.ravel()[0], *each))


def in_blocks(f: Callable, arrays: Any, vectors: Any = ()) -> Any:
    """f(arrays, vectors), element by element, a block at a time.

    Arrays broadcast with each other and with vectors, but for a last axis of those.
    What is computed on the way stays in a processor's cache, and the reverse pass keeps
    no more of it than a block.
    """
    shapes = [x.shape for x in jax.tree.leaves(arrays)]
    shapes += [x.shape[:-1] for x in jax.tree.leaves(vectors)]
    shape = jnp.broadcast_shapes(*shapes)
    count = prod(shape)
    if count <= _BLOCK:
        return f(arrays, vectors)
    blocks = -(-count // _BLOCK)
    spare = blocks * _BLOCK - count

    def split(x, *axes):
        flat = jnp.broadcast_to(x, (*shape, *axes)).reshape(count, *axes)
        widths = [(0, spare)] + [(0, 0)] * len(axes)
        padded = jnp.pad(flat, widths, mode="edge") if spare else flat
        return padded.reshape(blocks, _BLOCK, *axes)

    def joined(x):
        whole = x.reshape(blocks * _BLOCK, *x.shape[2:])[:count]
        return whole.reshape(*shape, *x.shape[2:])

    each = jax.checkpoint(lambda block: f(*block), prevent_cse=False)
    cut = jax.tree.map(lambda x: split(x, x.shape[-1]), vectors)
    return jax.tree.map(joined, jax.lax.map(each, (jax.tree.map(split, arrays), cut)))
