"""Many queries at once: by blocks, on all devices of a mesh."""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from fiberjax._types import lobe_number

BLOCK = 1 << 16


def rows(queries: tuple[Any, ...]) -> int:
    """The common length of the first axes; ValueError unless there is one."""
    lengths = {np.shape(x)[0] for x in queries if np.ndim(x)}
    if len(lengths) != 1 or 0 in lengths:
        shapes = ", ".join(str(np.shape(x)) for x in queries)
        raise ValueError(
            f"queries have shapes {shapes}: all but numbers must have the same first "
            "axis, of length >= 1"
        )
    return lengths.pop()


def _checked(result: Any, size: int) -> Any:
    for x in jax.tree.leaves(result):
        if jnp.shape(x)[:1] != (size,):
            raise ValueError(
                f"function returns shape {jnp.shape(x)} for {size} queries: the first "
                f"axis must be {size}"
            )
    return result


def in_blocks(
    function: Callable[..., Any], *, mesh: Mesh | None = None, block: int = BLOCK
) -> Callable[..., Any]:
    """The same function of any number of queries, block by block on every device.

    function(parameters, *queries), as `evaluate`, `pdf`, `sample` and `albedo` are with
    a fiber for parameters. The queries are cut into blocks; a device works through its
    blocks one after the other, and reverse mode computes each block again: beside
    arguments, results and the cotangents of results, memory is that of one block. A sum
    over queries that a function draws by itself, from seeds and block=1, needs no more.
    On a mesh the blocks are spread over the devices of all its axes and the parameters
    are copied to each. Values need no communication, the gradient in the parameters one
    sum over devices. What is in a block does not depend on the mesh: neither do
    results, but for their last bits.

    Args:
        function: returns arrays, or a PyTree of them, whose first axis is that of the
            queries. `functools.partial` sets static choices.
        mesh: devices, also those of other processes; None for the default device.
        block: static, queries that a device works on at a time, >= 1. More than there
            are means all of them.

    Returns:
        Jitted function of (parameters, *queries). Queries are arrays (n, ...) with one
        n, sharded along it or not, or numbers, which go with each of them. Results
        (n, ...) are sharded over the mesh if n is a multiple of block times devices.
        Else the last query is repeated up to that, and results are whole on each
        device.

    Raises:
        ValueError: block < 1; queries of different length; a result without their axis.
    """
    block = lobe_number("block", block, lowest=1)
    devices = 1 if mesh is None else mesh.size

    def local(size, parameters, arrays, numbers):
        @partial(jax.checkpoint, prevent_cse=False)
        def one(some):
            both = zip(some, numbers, strict=True)
            queries = [n if x is None else x for x, n in both]
            return _checked(function(parameters, *queries), size)

        blocks = jax.tree.map(lambda x: x.reshape(-1, size, *x.shape[1:]), arrays)
        result = jax.lax.map(one, blocks)
        return jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:]), result)

    @jax.jit
    def bulk(parameters, *queries):
        n = rows(queries)
        size = min(block, n)
        spare = -n % (size * devices)

        def padded(x):
            widths = [(0, spare)] + [(0, 0)] * (x.ndim - 1)
            return jnp.pad(x, widths, mode="edge") if spare else x

        # None, where the other has an entry, is an empty PyTree.
        arrays = [padded(jnp.asarray(x)) if jnp.ndim(x) else None for x in queries]
        numbers = [None if jnp.ndim(x) else x for x in queries]
        if mesh is None:
            result = local(size, parameters, arrays, numbers)
            return jax.tree.map(lambda x: x[:n], result) if spare else result
        along = PartitionSpec(mesh.axis_names)
        here, everywhere = (NamedSharding(mesh, x) for x in (along, PartitionSpec()))
        run = jax.shard_map(
            partial(local, size),
            mesh=mesh,
            in_specs=(everywhere.spec, along, everywhere.spec),
            out_specs=along,
            # Scans inside start from zeros that the check would take for the same
            # on every device.
            check_vma=False,
        )
        parameters, numbers = jax.device_put((parameters, numbers), everywhere)
        result = run(parameters, jax.device_put(arrays, here), numbers)
        if not spare:
            return result
        return jax.tree.map(lambda x: x[:n], jax.device_put(result, everywhere))

    return bulk
