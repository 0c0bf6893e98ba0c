"""Array aliases, the one place that decides dtypes, and checks of static choices."""

import operator
from typing import Any, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Num

Reals: TypeAlias = Num[ArrayLike, "..."]
"""What every public function takes: Python numbers or arrays of any shape."""

Floats: TypeAlias = Float[Array, "..."]
"""What every public function returns."""


def _decides(x: Any) -> bool:
    """Whether x has a floating dtype of its own; plain numbers and integers do not."""
    if type(x) in (bool, int, float) or getattr(x, "weak_type", False):
        return False
    return bool(jnp.issubdtype(jnp.result_type(x), jnp.floating))


def floats(leading: tuple[Any, ...], others: tuple[Any, ...] = ()) -> list[Floats]:
    """Arrays of one floating dtype, that of the leading arguments.

    The others follow, so that a float64 constant does not promote float32 angles. They
    decide only where no leading argument does.
    """
    leading, others = (
        tuple(np.asarray(x) if isinstance(x, list | tuple) else x for x in group)
        for group in (leading, others)
    )
    decisive = list(filter(_decides, leading)) or list(filter(_decides, others))
    dtype = jnp.result_type(float, *decisive)
    return [jnp.asarray(x, dtype) for x in (*leading, *others)]


def lobe_number(name: str, p: Any, lowest: int = 0) -> int:
    """`p` as an int; ValueError unless it is a static integer >= `lowest`."""
    try:
        number = int(operator.index(p))
    except TypeError as error:  # tracers raise it too
        raise ValueError(f"{name} = {p!r}: must be a static integer") from error
    if number < lowest:
        raise ValueError(f"{name} = {number}: must be >= {lowest}")
    return number


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> None:
    """ValueError unless `value` is one of `allowed`."""
    if value not in allowed:
        raise ValueError(f"{name} = {value!r}: must be one of {allowed}")


def flag(name: str, value: Any) -> bool:
    """`value` as a bool; ValueError unless it is one."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} = {value!r}: must be True or False")
    return bool(value)


def broadcastable(**shapes: tuple[int, ...]) -> None:
    """ValueError unless the shapes broadcast."""
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError as error:
        listed = ", ".join(f"{name} has shape {x}" for name, x in shapes.items())
        raise ValueError(f"{listed}: must broadcast") from error


def last_axis(size: int, **named: Any) -> None:
    """ValueError unless the last axis of every array has this size."""
    for name, x in named.items():
        if np.shape(x)[-1:] != (size,):
            raise ValueError(f"{name} has shape {np.shape(x)}: must end in {size}")
