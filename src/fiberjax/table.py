"""A function of angles as a table, its lookup and its files."""

import json
import os
from collections.abc import Callable
from importlib import import_module
from math import prod
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fiberjax._types import Floats, Reals, choice, floats

SUFFIXES = (".npz", ".exr")


def replace(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file whole or leave what was there, also if killed or without power."""
    unfinished = path.with_name(f"unfinished-{path.name}")
    write(unfinished)
    with unfinished.open("rb+") as file:
        os.fsync(file.fileno())
    unfinished.replace(path)


class Table(eqx.Module):
    """Values on a grid of uneven nodes, and what is looked up between them.

    On each axis x lies between two nodes, found by bisection, or is moved to the end it
    is beyond: fold an azimuth into the range first. t is the linear interpolation, axis
    by axis, of the 2^d stored values around; what is looked up is

        scale t                  where floor is None
        scale (exp(t) - floor)   elsewhere

    Fields:
        names: the arguments, one an axis; static.
        axes: increasing nodes of each axis, (n_k,), that float32 holds.
        values: what is stored, (n_1, ..., n_d) or (n_1, ..., n_d, C), float16 or
            float32.
        scale: the peak over all nodes, () or (C,).
        floor: what is added before the logarithm is taken, relative to the peak.
        error: largest error found between nodes, over the peak; static.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    axes: tuple[Array, ...]
    values: Array
    scale: Array
    floor: Array | None
    error: float = eqx.field(static=True)

    def __call__(self, **at: Reals) -> Floats:
        """The value at arguments by name, that broadcast.

        Args:
            at: one for each axis; beyond its range the end is taken.

        Returns:
            Shape broadcast(at), with the color axis of the values, dtype of the
            arguments. Its derivatives are those of the interpolation: slopes of cells.

        Raises:
            ValueError: other names than those of the axes.
        """
        if set(at) != set(self.names):
            raise ValueError(f"arguments {tuple(at)}: must be {self.names}")
        given = jnp.broadcast_arrays(*floats(tuple(at[name] for name in self.names)))
        dtype = given[0].dtype
        flat = self.values.reshape(prod(map(len, self.axes)), *self.scale.shape)
        index, corners = 0, [(jnp.ones((), dtype), 0)]
        for x, axis in zip(given, self.axes, strict=True):
            nodes = axis.astype(dtype)
            cell = jnp.clip(jnp.searchsorted(nodes, x, "right") - 1, 0, len(axis) - 2)
            t = (x - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
            t = jnp.clip(t, 0, 1)
            index = index * len(axis) + cell
            corners = [
                (w * share, step * len(axis) + k)
                for w, step in corners
                for k, share in enumerate((1 - t, t))
            ]
        whole = (..., *[None] * self.scale.ndim)
        t = sum(w[whole] * flat[index + step].astype(dtype) for w, step in corners)
        return self._decode(t)

    def _decode(self, t: Any) -> Floats:
        scale = self.scale.astype(t.dtype)
        if self.floor is None:
            return scale * t
        return scale * (jnp.exp(t) - self.floor.astype(t.dtype))

    def save(self, path: str | Path) -> None:
        """Write the table, whole or not at all; the same table gives the same bytes.

        .npz has the arrays "values", "scale", "floor" (absent where None) and "error",
        and the nodes of each axis under its own name, in the order of "names".
        .exr has the values as half or float, the last axis along x, all others, row
        by row, along y; channels Y, RGB or c0000, ...; and attributes: the nodes of
        each axis as float vector under "axis_" and its name, "names" in order, joined
        by a space, "scale", "floor" and "error" as JSON. It needs the extra [tables].

        Raises:
            ValueError: another suffix.
        """
        path = Path(path)
        choice("suffix of path", path.suffix, SUFFIXES)
        replace(path, self._write_npz if path.suffix == ".npz" else self._write_exr)

    @classmethod
    def load(cls, path: str | Path) -> "Table":
        """The table that `save` wrote.

        Raises:
            ValueError: another suffix.
        """
        path = Path(path)
        choice("suffix of path", path.suffix, SUFFIXES)
        names, axes, values, *rest = (
            _read_npz(path) if path.suffix == ".npz" else _read_exr(path)
        )
        return cls(names, tuple(map(jnp.asarray, axes)), jnp.asarray(values), *rest)

    def _write_npz(self, path: Path) -> None:
        arrays = dict(zip(self.names, self.axes, strict=True))
        arrays |= {"names": np.array(self.names), "values": self.values}
        arrays |= {"scale": self.scale, "error": np.float64(self.error)}
        if self.floor is not None:
            arrays["floor"] = self.floor
        with path.open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)

    def _write_exr(self, path: Path) -> None:
        exr = import_module("OpenEXR")
        image = np.asarray(self.values)
        image = image.reshape(-1, len(self.axes[-1]), *self.scale.shape)
        header = {
            "compression": exr.ZIP_COMPRESSION,
            "type": exr.scanlineimage,
            "names": " ".join(self.names),
            "scale": json.dumps(np.asarray(self.scale, float).tolist()),
            "floor": json.dumps(None if self.floor is None else float(self.floor)),
            "error": json.dumps(self.error),
        }
        for name, axis in zip(self.names, self.axes, strict=True):
            header[f"axis_{name}"] = np.asarray(axis, np.float32)
        pixels = _channels(self.scale.shape)
        exr.File(header, {k: image[at].copy() for k, at in pixels.items()}).write(
            str(path)
        )


def _channels(shape: tuple[int, ...]) -> dict[str, Any]:
    """Names of the channels of an image, and which part of the values each has."""
    if not shape:
        return {"Y": ...}
    names = "RGB" if shape == (3,) else [f"c{k:04}" for k in range(*shape)]
    return {name: (..., k) for k, name in enumerate(names)}


def _number(x: Any) -> Array:
    """What decodes, in the precision that is at hand."""
    return jnp.asarray(x, jnp.result_type(float))


def _read_npz(path: Path) -> tuple[Any, ...]:
    with np.load(path, allow_pickle=False) as file:
        names = tuple(map(str, file["names"]))
        axes = [file[name] for name in names]
        floor = _number(file["floor"]) if "floor" in file else None
        scale, error = _number(file["scale"]), float(file["error"])
        return names, axes, file["values"], scale, floor, error


def _read_exr(path: Path) -> tuple[Any, ...]:
    exr = import_module("OpenEXR")
    with exr.File(str(path), separate_channels=True) as file:
        header = file.header()
        names = tuple(header["names"].split())
        axes = [np.asarray(header[f"axis_{name}"], np.float32) for name in names]
        scale = _number(json.loads(header["scale"]))
        floor, error = (json.loads(header[key]) for key in ("floor", "error"))
        pixels = [file.channels()[k].pixels for k in _channels(scale.shape)]
    values = np.stack(pixels, -1) if scale.ndim else pixels[0]
    values = values.reshape(*map(len, axes), *scale.shape)
    return names, axes, values, scale, None if floor is None else _number(floor), error
