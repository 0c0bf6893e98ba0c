"""Tables with no more nodes than an error asks for."""

from collections.abc import Callable, Mapping
from math import prod
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh

from fiberjax._types import lobe_number
from fiberjax.chunks import Chunks
from fiberjax.table import Table

_FIRST = 1 << 18
"""Entries of the first grid, which finds where nodes are needed; 1025 on an axis."""

_EVEN = 0.05
"""Share of the nodes that is spread evenly, should the first grid have missed some."""

_ENOUGH = 0.75
"""An error above this part of the tolerance is not worth a smaller table."""

_ROUNDS = 8


def _encode(values: np.ndarray, scale: np.ndarray, floor: float | None) -> np.ndarray:
    part = values / scale
    return part if floor is None else np.log(part + floor)


def _decode(t: np.ndarray, floor: float | None) -> np.ndarray:
    """The value over the peak."""
    return t if floor is None else np.exp(t) - floor


def _midpoints(axis: np.ndarray, at: Any = 0.5) -> np.ndarray:
    return axis[:-1] + at * np.diff(axis)


def _each(array: np.ndarray, axis: int) -> np.ndarray:
    """The largest over all other axes."""
    return array.max(tuple(k for k in range(array.ndim) if k != axis))


def _interpolated(t: np.ndarray, at: list[Any]) -> np.ndarray:
    """Between the nodes of each axis, at a fraction of every interval; None at them."""
    for k, share in enumerate(at):
        if share is not None:
            first = np.moveaxis(t, k, -1)
            first = first[..., :-1] + share * np.diff(first)
            t = np.moveaxis(first, -1, k)
    return t


def _place(axis: np.ndarray, errors: np.ndarray, count: int) -> np.ndarray:
    """Nodes that share the error: as dense as the root of the errors of intervals."""
    need = np.sqrt(errors)
    need = need + (_EVEN * need.sum() + 1e-300) * np.diff(axis) / np.ptp(axis)
    total = np.concatenate([[0], np.cumsum(need)])
    nodes = np.interp(np.linspace(0, total[-1], count), total, axis)
    nodes = np.unique(nodes.astype(np.float32)).astype(float)
    return np.concatenate([axis[:1], nodes[1:-1], axis[-1:]])


def _counts(needs: list[float], allowed: float) -> list[int]:
    """Nodes of each axis: the smallest product that leaves the error."""
    each = np.sqrt(len(needs) / allowed)
    return [2 + int(need * (1 + _EVEN) * each) for need in needs]


def _ranges(axes: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    if not axes:
        raise ValueError("axes = {}: must name at least one argument")
    found = {}
    for name, ends in axes.items():
        low, high = (float(np.float32(x)) for x in ends)
        if not -np.inf < low < high < np.inf:
            raise ValueError(
                f"axes[{name!r}] = {ends}: must be (low, high), low < high"
            )
        found[name] = low, high
    return found


def tabulate(
    function: Callable[..., Any],
    axes: Mapping[str, tuple[float, float]],
    *,
    tolerance: float,
    dtype: Any = np.float32,
    given: Any = None,
    entries: int = 1 << 22,
    mesh: Mesh | None = None,
    folder: str | Path | None = None,
    chunk: int = 1 << 16,
) -> Table:
    """A table of a function, to an error between its nodes.

    On a first grid the error of interpolation is measured in the middle of every
    interval; nodes are then as dense along each axis as its root, and so many that the
    error is met, measured on the stored table in the middle of all cells and at another
    place in each. The values or the logarithm of value + floor are stored, whichever
    needs fewer. What is narrower than two intervals of the first grid can be missed: it
    has 1025 nodes on one axis, 512 on each of two, 64 of three, 22 of four.

    Args:
        function: of arrays (n,) by keyword, one for each axis, returning (n,) or
            (n, C), as `partial(fiberjax.evaluate, fiber, 0.6)` of theta_o and phi.
        axes: (low, high) by the name of the argument, in the order they are stored.
        tolerance: largest error over the peak of each color, in (0, 1).
        dtype: float16 or float32, of what is stored.
        given: float32 or float64, of the arrays that the function is given, as those of
            a plan in float32; None for that of JAX.
        entries: the largest number of values of each color.
        mesh: devices that share the points, also those of other processes, which must
            call this alike; None for the default device.
        folder: where to keep what is computed. A call that was stopped goes on from
            there; the first process writes.
        chunk: points that are computed, and written, at a time.

    Returns:
        `Table`. The same arguments give the same table.

    Raises:
        ValueError: an empty range, values that are not finite, a tolerance that the
            dtype or so many entries do not reach, a folder begun with other arguments
            or another function.
    """
    ranges, kind = _ranges(axes), np.dtype(dtype)
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance = {tolerance}: must lie in (0, 1)")
    if kind not in (np.float16, np.float32):
        raise ValueError(f"dtype = {kind}: must be float16 or float32")
    points = np.dtype(jnp.result_type(float) if given is None else given)
    allowed = sorted({"float32", jnp.result_type(float).name})
    if points.name not in allowed:
        raise ValueError(f"given = {points}: must be {' or '.join(allowed)}")
    chunk = lobe_number("chunk", chunk, lowest=1)
    each = min(1025, round(min(_FIRST, entries) ** (1 / len(ranges))))
    spec = {"tolerance": float(tolerance), "dtype": kind.name, "given": points.name}
    spec["entries"] = entries
    size = min(chunk, 1 << (each ** len(ranges) - 1).bit_length())
    place = None if folder is None else Path(folder)
    spec["chunk"] = size
    values_on = Chunks(function, ranges, size, mesh, place, spec, points)
    nodes = [np.linspace(*ends, each) for ends in ranges.values()]
    found, counts, floors, allowed = None, [], (None, tolerance), tolerance
    for k in range(_ROUNDS):
        what = f"grid {k + 1}"
        grid = values_on(nodes, what).astype(float)
        peak = np.abs(grid).max(tuple(range(len(nodes))))
        scale = np.where(peak > 0, peak, 1)
        if k == 0 and grid.min() < 0:
            floors = (None,)
        if k:
            table, rounding = _stored(
                values_on, nodes, grid, scale, floors[0], kind, what
            )
            if rounding > tolerance / 2:
                raise ValueError(
                    f"tolerance = {tolerance}: must be >= {2 * rounding:.2g}, twice "
                    f"what {kind} rounds by"
                )
            met = table.error <= tolerance
            if met and (found is None or table.values.size < found.values.size):
                found = table
            if found is not None and table.error >= _ENOUGH * tolerance:
                break
            between = max(table.error - rounding, 1e-300)
            allowed *= (0.9 * tolerance - rounding) / between
        needs = _monitor(values_on, nodes, grid, scale, floors, what)
        sizes = [prod(_counts(need, allowed)) for need, _ in needs]
        best = int(np.argmin(sizes))
        floors, (need, errors) = (floors[best],), needs[best]
        counts = _counts(need, allowed)
        if prod(counts) > entries or counts == list(map(len, nodes)):
            break
        nodes = [_place(*x) for x in zip(nodes, errors, counts, strict=True)]
    if found is None:
        raise ValueError(
            f"tolerance = {tolerance}: about {prod(counts)} entries are needed, "
            f"entries = {entries} are allowed"
        )
    return found


def _monitor(values_on, nodes, grid, scale, floors, name):
    """For each floor, needs of the axes, and errors of their intervals."""
    middle = []
    for k in range(len(nodes)):
        points = [_midpoints(x) if k == i else x for i, x in enumerate(nodes)]
        middle.append(values_on(points, f"{name}, axis {k + 1}") / scale)
    found = []
    for floor in floors:
        t, errors = _encode(grid, scale, floor), []
        for k, exact in enumerate(middle):
            share = [0.5 if k == i else None for i in range(len(nodes))]
            error = np.abs(_decode(_interpolated(t, share), floor) - exact)
            errors.append(_each(error, k))
        found.append(([np.sqrt(e).sum() for e in errors], errors))
    return found


def _stored(values_on, nodes, grid, scale, floor, kind, name):
    """The table in its dtype, and its largest error."""
    t = _encode(grid, scale, floor).astype(kind)
    rounding = np.abs(_decode(t.astype(float), floor) - grid / scale).max()
    error, rng = 0.0, np.random.default_rng(0)
    for places in ("middle", "elsewhere"):
        shares = [
            0.5 if places == "middle" else rng.uniform(size=len(x) - 1) for x in nodes
        ]
        points = [_midpoints(x, share) for x, share in zip(nodes, shares, strict=True)]
        exact = values_on(points, f"{name}, {places} of cells") / scale
        near = _decode(_interpolated(t.astype(float), shares), floor)
        error = max(error, float(np.abs(near - exact).max()))
    real = jnp.result_type(float)
    table = Table(
        values_on.names,
        tuple(jnp.asarray(x, jnp.float32) for x in nodes),
        jnp.asarray(t),
        jnp.asarray(scale, real),
        None if floor is None else jnp.asarray(floor, real),
        error,
    )
    return table, float(rounding)
