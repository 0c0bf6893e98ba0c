"""Ranges of numbers: what a scene says of each argument."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

Interval: TypeAlias = tuple[float, float]
"""Lowest and highest value, both of them included."""

Range: TypeAlias = float | Sequence[float]
"""A number, or (low, high)."""


def interval(name: str, given: Any, allowed: Interval, touch: bool = True) -> Interval:
    """(low, high) of a number or an interval.

    Args:
        name: of the argument, for the error.
        given: a number or a sequence of two.
        allowed: bounds of what may be asked for; the upper one may be infinite.
        touch: whether the lower bound itself may be.

    Raises:
        ValueError: neither a number nor two, not finite, empty, or beyond the bounds.
    """
    said = f"{name} = {given!r}: must be a number or (low, high)"
    try:
        ends = np.asarray(given)
    except ValueError as error:
        raise ValueError(said) from error
    if ends.dtype.kind not in "fiu" or ends.shape not in ((), (2,)):
        raise ValueError(said)
    low, high = (float(x) for x in np.broadcast_to(ends, 2))
    if low > high:
        raise ValueError(f"{name} = {given!r}: must be (low, high) with low <= high")
    above = allowed[0] <= low if touch else allowed[0] < low
    if not (above and high <= allowed[1] and np.isfinite((low, high)).all()):
        left = "[" if touch else "("
        raise ValueError(
            f"{name} = {given!r}: must be finite and lie in "
            f"{left}{allowed[0]:g}, {allowed[1]:g}]"
        )
    return low, high


def covers(outer: Interval, values: Any) -> bool:
    """Whether all values lie in the interval, but for the rounding of float32."""
    values = np.asarray(values, float)
    low, high = outer[0] - 1e-6 * abs(outer[0]), outer[1] + 1e-6 * abs(outer[1])
    return bool(((values >= low) & (values <= high)).all())
