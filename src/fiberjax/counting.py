"""Operations of a JAX function, by kind, read from its program."""

from collections import Counter
from collections.abc import Callable
from math import log2, prod
from typing import Any

import jax
import numpy as np

KINDS = {
    "exp": ("exp", "exp2", "expm1", "logistic", "tanh", "sinh", "cosh", "asinh"),
    "log": ("log", "log1p", "atanh", "acosh"),
    "trigonometric": ("sin", "cos", "tan", "asin", "acos", "atan", "atan2"),
    "root": ("sqrt", "rsqrt", "cbrt", "div", "rem", "pow"),
    "erf": ("erf", "erf_inv", "erfc"),
    "bessel": ("bessel_i0e", "bessel_i1e", "lgamma"),
}
"""What takes many times as long as an addition; everything else is a flop."""

_KIND_OF = {name: kind for kind, names in KINDS.items() for name in names}

WEIGHT = {
    "flop": 1,
    "root": 4,
    "exp": 16,
    "log": 16,
    "trigonometric": 16,
    "erf": 24,
    "bessel": 48,
}
"""Operations as flops, by a convention near what CPUs take."""

_FREE = {
    "broadcast_in_dim", "reshape", "squeeze", "transpose", "convert_element_type",
    "concatenate", "slice", "dynamic_slice", "pad", "iota", "copy", "stop_gradient",
    "optimization_barrier", "gather", "scatter", "dynamic_update_slice", "split",
    "expand_dims", "device_put", "bitcast_convert_type",
}  # fmt: skip
"""Moves only."""


def _inner(equation: Any) -> list[tuple[Any, int]]:
    """The programs inside an equation, and how often each is run."""
    name, given = equation.primitive.name, equation.params
    if name == "scan":
        return [(given["jaxpr"].jaxpr, given["length"])]
    if name == "while":
        return [(given["body_jaxpr"].jaxpr, 1)]
    found = []
    for value in given.values():
        for x in value if isinstance(value, tuple | list) else (value,):
            x = getattr(x, "jaxpr", x)
            if hasattr(x, "eqns"):
                found.append((x, 1))
    return found


def _leaf(equation: Any) -> Counter:
    """One equation without a program inside."""
    name = equation.primitive.name
    size = max((prod(x.aval.shape) for x in equation.outvars), default=0)
    if name in _FREE:
        return Counter()
    if name == "dot_general":
        (over, _), _ = equation.params["dimension_numbers"]
        shape = equation.invars[0].aval.shape
        return Counter(flop=2 * size * prod(shape[k] for k in over))
    if name.startswith(("reduce", "cum")):
        return Counter(flop=max(prod(x.aval.shape) for x in equation.invars))
    if name == "integer_pow":
        return Counter(flop=size * round(1 + log2(abs(equation.params["y"]) or 1)))
    return Counter({_KIND_OF.get(name, "flop"): size})


def _count(program: Any, wanted: list[bool]) -> Counter:
    """Operations that the wanted results need; of branches, those of the longest."""
    needed = {
        x for x, w in zip(program.outvars, wanted, strict=True) if w and _is_variable(x)
    }
    total: Counter = Counter()
    for equation in reversed(program.eqns):
        asked = [x in needed for x in equation.outvars]
        if not any(asked):
            continue
        needed |= set(filter(_is_variable, equation.invars))
        inner = _inner(equation)
        counts = []
        for each, times in inner:
            # What a loop hands on is needed as a whole.
            part = (
                asked if len(each.outvars) == len(asked) else [True] * len(each.outvars)
            )
            if equation.primitive.name in ("scan", "while"):
                part = [True] * len(each.outvars)
            counts.append(
                Counter({k: n * times for k, n in _count(each, part).items()})
            )
        if not inner:
            total += _leaf(equation)
        elif equation.primitive.name == "cond":
            total += max(counts, key=flops)
        else:
            for count in counts[:1]:
                total += count
    return total


def _is_variable(x: Any) -> bool:
    return not hasattr(x, "val")


def flops(count: Counter) -> float:
    """All operations as flops."""
    return float(sum(WEIGHT[kind] * n for kind, n in count.items()))


def operations(
    function: Callable[..., Any], *args: Any, per: int = 1
) -> dict[str, float]:
    """Operations of a call, by kind: exp, log, trigonometric, root, erf, bessel, flop.

    Counted in the program that JAX traces, loops as often as they run; where a branch
    is taken when running, the longest counts. What no result needs is not counted.

    Args:
        function: of arrays.
        *args: arrays, or PyTrees of them.
        per: what all are divided by, the number of values of the call.
    """
    program = jax.make_jaxpr(function)(*args).jaxpr
    count = _count(program, [True] * len(program.outvars))
    return {kind: count.get(kind, 0) / per for kind in WEIGHT}


def cost(count: dict[str, float]) -> float:
    """Operations as flops, by `WEIGHT`."""
    return float(np.sum([WEIGHT[kind] * n for kind, n in count.items()]))
