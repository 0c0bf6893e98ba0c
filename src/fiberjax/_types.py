"""Array aliases, the one place that decides dtypes, and checks of static choices."""

import operator
from typing import Any, TypeAlias

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Num

Reals: TypeAlias = Num[ArrayLike, "..."]
"""What every public function takes: Python numbers or arrays of any shape."""

Floats: TypeAlias = Float[Array, "..."]
"""What every public function returns."""


def _is_weak(x: Any) -> bool:
    return type(x) in (bool, int, float) or getattr(x, "weak_type", False)


def floats(leading: tuple[Any, ...], others: tuple[Any, ...] = ()) -> list[Floats]:
    """Arrays of one floating dtype, that of the leading arguments.

    The others follow, so that a float64 constant does not promote float32 angles. They
    decide only where every leading argument is a plain Python number.
    """
    strong = [x for x in leading if not _is_weak(x)]
    dtype = jnp.result_type(float, *(strong or others))
    return [jnp.asarray(x, dtype) for x in (*leading, *others)]


def lobe_number(name: str, p: Any, lowest: int = 0) -> int:
    """`p` as an int; ValueError unless it is a static integer >= `lowest`."""
    try:
        number = operator.index(p)
    except Exception as error:  # a tracer fails in ways of its own
        raise ValueError(f"{name} = {p!r}: must be a static integer") from error
    if number < lowest:
        raise ValueError(f"{name} = {number}: must be >= {lowest}")
    return number


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> None:
    """ValueError unless `value` is one of `allowed`."""
    if value not in allowed:
        raise ValueError(f"{name} = {value!r}: must be one of {allowed}")
