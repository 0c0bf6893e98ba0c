"""A function on grids, chunk by chunk, that goes on where it was stopped."""

import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from math import prod
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax.experimental import multihost_utils
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from fiberjax.bulk import in_blocks
from fiberjax.table import replace

_PROBES = 64


class Chunks:
    """Values of a function on tensor grids, a chunk of points at a time.

    With a folder every chunk is a file there, named by a hash of its points, which is
    written whole or not at all: what has been computed is read. `spec.json` says what
    the folder is of, down to values of the function at a few points.

    Args:
        function: of arrays (n,) by name, returning (n,) or (n, C).
        ranges: (low, high) of each argument, by name.
        size: points of a chunk.
        mesh: devices that share it, or None.
        folder: where to keep chunks, or None.
        spec: what else must be the same for a folder to be used again, as JSON.
        dtype: of the arguments.

    Raises:
        ValueError: the folder is of something else; a value that is not finite.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        ranges: dict[str, tuple[float, float]],
        size: int,
        mesh: Mesh | None,
        folder: Path | None,
        spec: dict[str, Any],
        dtype: np.dtype,
    ):
        def by_position(_, *columns):
            return function(**dict(zip(ranges, columns, strict=True)))

        devices = 1 if mesh is None else mesh.size
        block = -(-size // devices)
        self.names, self.size = tuple(ranges), size
        self.folder = None
        self._bulk = in_blocks(by_position, mesh=mesh, block=block)
        self._dtype = dtype
        whole = None if mesh is None else NamedSharding(mesh, PartitionSpec())
        self._everywhere = jax.jit(lambda x: x, out_shardings=whole)
        columns = [jax.ShapeDtypeStruct((size,), self._dtype)] * len(ranges)
        shape = jax.eval_shape(self._bulk, None, *columns)
        if not hasattr(shape, "shape") or len(shape.shape) > 2:
            raise ValueError(
                f"function returns {shape}: must be one array (n,), (n, C)"
            )
        self.color = shape.shape[1:]
        self._result = shape
        if folder is not None:
            self._open(
                folder, {"axes": {k: list(v) for k, v in ranges.items()}, **spec}
            )

    def __call__(self, axes: Sequence[np.ndarray], what: str) -> np.ndarray:
        """Values at all combinations, (n_1, ..., n_d) or (n_1, ..., n_d, C)."""
        shape = tuple(map(len, axes))
        count = prod(shape)
        values = np.empty((count, *self.color), self._result.dtype)
        for k, start in enumerate(range(0, count, self.size)):
            _show(f"{what}: chunk {k + 1} of {-(-count // self.size)}")
            some = np.arange(start, min(start + self.size, count))
            at = np.unravel_index(some, shape)
            columns = [axis[i] for axis, i in zip(axes, at, strict=True)]
            values[some] = self._chunk(np.stack(columns).astype(self._dtype))
        _show("")
        return values.reshape(*shape, *self.color)

    def _open(self, folder: Path, spec: dict[str, Any]) -> None:
        """Begin a folder, or see that it is of the same."""
        low, high = np.array(list(spec["axes"].values()), float).T[..., None]
        # Roberts' sequence: even in any number of dimensions.
        root = np.roots([1, *[0] * (len(low) - 1), -1, -1]).real.max()
        steps = np.arange(1, _PROBES + 1) / root ** np.arange(1, len(low) + 1)[:, None]
        probes = (low + (high - low) * (steps % 1)).astype(self._dtype)
        pieces = range(0, _PROBES, self.size)
        found = [self._evaluate(probes[:, k : k + self.size]) for k in pieces]
        found = np.concatenate(found)
        if jax.process_index() == 0:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / "spec.json"
            if path.exists():
                _compare(folder, json.loads(path.read_text()), spec, found)
            else:
                text = json.dumps({**spec, "values": found.tolist()}, indent=1)
                replace(path, lambda new: new.write_text(text))
        self.folder = folder

    def _chunk(self, points: np.ndarray) -> np.ndarray:
        """Values at points (d, n), read if they were written."""
        if self.folder is None:
            return self._evaluate(points)
        digest = hashlib.sha256(points.tobytes()).hexdigest()
        path = self.folder / f"{digest[:32]}.npy"
        # All processes do as the first finds: each of them might see another folder.
        there = bool(_agreed(np.array(jax.process_index() == 0 and path.exists())))
        if there:
            shape = (points.shape[1], *self.color)
            first = jax.process_index() == 0
            empty = np.empty(shape, self._result.dtype)
            return _agreed(np.load(path) if first else empty)
        values = self._evaluate(points)
        if jax.process_index() == 0:

            def write(new):
                with new.open("wb") as file:
                    np.save(file, values)

            replace(path, write)
        return values

    def _evaluate(self, points: np.ndarray) -> np.ndarray:
        n = points.shape[1]
        full = np.pad(points, ((0, 0), (0, self.size - n)), mode="edge")
        values = np.asarray(self._everywhere(self._bulk(None, *full)))[:n]
        finite = np.isfinite(values)
        if not finite.all():
            k = np.argwhere(~finite)[0][0]
            at = ", ".join(
                f"{name} = {x:g}"
                for name, x in zip(self.names, points[:, k], strict=True)
            )
            raise ValueError(f"function is {values[k]} at {at}: must be finite")
        return values


def _agreed(x: np.ndarray) -> np.ndarray:
    """What the first process has."""
    if jax.process_count() == 1:
        return x
    return np.asarray(multihost_utils.broadcast_one_to_all(x))


def _compare(folder: Path, old: dict[str, Any], spec: dict[str, Any], found) -> None:
    """ValueError if a folder was begun with something else."""
    for key, value in spec.items():
        if old.get(key) != value:
            raise ValueError(
                f"folder = {str(folder)!r} was begun with {key} = {old.get(key)}, not "
                f"{value}: must be another folder, or be deleted"
            )
    was = np.asarray(old["values"])
    near = 64 * np.finfo(found.dtype).eps * np.abs(was).max(initial=0)
    if was.shape != found.shape or np.abs(was - found).max() > near:
        raise ValueError(
            f"folder = {str(folder)!r} was begun with another function, by its values: "
            "must be another folder, or be deleted"
        )


def _show(text: str) -> None:
    """A line on the terminal that the next one overwrites; nothing in a pipe."""
    if sys.stderr.isatty() and jax.process_index() == 0:
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
