"""What a shader computes: a graph of operations on numbers and colors."""

from dataclasses import dataclass
from typing import Any

import numpy as np

CONSTANT, MATERIAL, DIRECTIONS = range(3)
"""What the value of a node depends on, at most."""

_FOLDED = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "abs": np.abs,
    "sign": np.sign,
    "max": np.maximum,
    "min": np.minimum,
    "pow": np.power,
    "sqrt": np.sqrt,
    "rsqrt": lambda x: 1 / np.sqrt(x),
    "exp": np.exp,
    "exp2": np.exp2,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
}
_COMPARED = ("gt", "ge", "lt", "le", "eq", "ne")
_TRUE_OR_FALSE = (*_COMPARED, "and", "or", "not")
_OF_COLORS = ("dot",)

OPERATIONS = (*_FOLDED, *_TRUE_OR_FALSE, *_OF_COLORS, "select", "clamp")
"""What a node may do to other nodes."""


@dataclass(frozen=True, eq=False)
class Node:
    """A value: an operation on other values, equal only to itself.

    Fields:
        op: one of `OPERATIONS`; "const"; "input"; "named", a value that keeps its name;
            "call", the result of a section.
        args: what the operation acts on.
        value: of a constant, shape () or (3,).
        name: of an input, of a named value, of the section called.
        section: the function that computes it, "" for the one that calls the others.
        level: `CONSTANT`, `MATERIAL` or `DIRECTIONS`.
        color: whether it has three components.
        order: how many nodes the graph had before it.
    """

    op: str
    args: tuple["Node", ...] = ()
    value: Any = None
    name: str = ""
    section: str = ""
    level: int = CONSTANT
    color: bool = False
    order: int = 0

    @property
    def true_or_false(self) -> bool:
        """Whether the value is a condition."""
        return self.op in _TRUE_OR_FALSE


def nonnegative(x: Node) -> bool:
    """Whether the form of x shows that it is >= 0, whatever rounding does."""
    if x.op == "const":
        return bool(np.all(x.value >= 0))
    if x.op in ("sqrt", "rsqrt", "exp", "exp2", "abs", "pow"):
        return True
    if x.op in ("named", "call", "clamp"):
        return nonnegative(x.args[0 if x.op != "clamp" else 1])
    if x.op == "max":
        return any(map(nonnegative, x.args))
    if x.op == "select":
        return all(map(nonnegative, x.args[1:]))
    if x.op == "mul" and x.args[0] is x.args[1]:
        return True
    return x.op in ("add", "mul", "div", "min", "dot") and all(map(nonnegative, x.args))


class Graph:
    """Makes nodes, each once, simplified; those made belong to the current section."""

    def __init__(self):
        self.section = ""
        self._known: dict[Any, Node] = {}

    def constant(self, value: Any) -> Node:
        """A constant; one number if all its components are equal."""
        value = np.asarray(value)
        if value.dtype != bool:
            value = value.astype(np.float64)
        if value.shape not in ((), (1,), (3,)):
            raise ValueError(f"a constant has shape {value.shape}: must be () or (3,)")
        if (value == value.flat[0]).all():
            value = value.flat[0]
        return self._once("const", (), value=value, color=np.ndim(value) == 1)

    def input(self, name: str, level: int, color: bool = False) -> Node:
        """What a caller of the shader sets."""
        return self._once("input", (), name=name, level=level, color=color)

    def named(self, name: str, x: Node) -> Node:
        """The value under its name; a constant needs none."""
        return x if x.op == "const" else self._node("named", x, name=name)

    def call(self, section: str, x: Node) -> Node:
        """The result of a section, which need not be called for a known value."""
        return x if x.level < DIRECTIONS else self._node("call", x, name=section)

    def power(self, x: Node, n: int) -> Node:
        """x^n by repeated multiplication."""
        if n < 0:
            return self.make("div", self.constant(1.0), self.power(x, -n))
        if n < 2:
            return x if n else self.constant(1.0)
        half = self.power(x, n // 2)
        square = self.make("mul", half, half)
        return self.make("mul", square, x) if n % 2 else square

    def make(self, op: str, *args: Node) -> Node:
        """An operation, simplified; square roots and powers only of what is >= 0."""
        if op not in OPERATIONS:
            raise ValueError(f"operation {op!r}: must be one of {OPERATIONS}")
        if op in _FOLDED and all(x.op == "const" for x in args):
            with np.errstate(all="ignore"):
                return self.constant(_FOLDED[op](*(x.value for x in args)))
        simpler = getattr(self, f"_{op}", None)
        found = simpler(*args) if simpler else None
        return self._node(op, *args) if found is None else found

    def _node(self, op: str, *args: Node, name: str = "") -> Node:
        level = max(x.level for x in args)
        color = op not in _OF_COLORS and any(x.color for x in args)
        if color and (op in _TRUE_OR_FALSE or (op == "select" and args[0].color)):
            raise ValueError(f"{op} of colors: a condition must be one number's")
        return self._once(op, args, name=name, level=level, color=color)

    def _once(self, op: str, args: tuple[Node, ...], **of: Any) -> Node:
        value = of.get("value")
        home = self.section if of.get("level") == DIRECTIONS and op != "input" else ""
        literal = None if value is None else (value.tobytes(), value.dtype.str)
        key = (op, *map(id, args), literal, of.get("name"), home)
        if key not in self._known:
            home, order = self.section, len(self._known)
            self._known[key] = Node(op, args, section=home, order=order, **of)
        return self._known[key]

    def _is(self, x: Node, value: float) -> bool:
        return x.op == "const" and bool(np.all(x.value == value))

    def _add(self, x, y):
        return y if self._is(x, 0) else x if self._is(y, 0) else None

    def _sub(self, x, y):
        return x if self._is(y, 0) else None

    def _mul(self, x, y):
        return y if self._is(x, 1) else x if self._is(y, 1) else None

    def _div(self, x, y):
        if y.op == "const":
            return self.make("mul", x, self.constant(1 / y.value))
        return None

    def _neg(self, x):
        return x.args[0] if x.op == "neg" else None

    def _at_least_zero(self, x):
        return x if nonnegative(x) else self.make("max", x, self.constant(0.0))

    def _sqrt(self, x):
        return self._node("sqrt", self._at_least_zero(x))

    def _pow(self, x, y):
        if y.op == "const" and not y.color:
            if y.value == int(y.value) and abs(y.value) <= 16:
                return self.power(x, int(y.value))
            if y.value == 0.5:
                return self.make("sqrt", x)
        return self._node("pow", self._at_least_zero(x), y)

    def _min(self, x, y):
        """A clamp, if it is a maximum of constants that is bounded."""
        high, x = (x, y) if x.op == "const" else (y, x)
        if high.op != "const" or x.op != "max":
            return None
        for low, inner in (x.args, x.args[::-1]):
            if low.op == "const":
                return self._node("clamp", inner, low, high)
        return None

    def _select(self, condition, taken, otherwise):
        if condition.op == "const":
            return taken if condition.value else otherwise
        taken = self._assuming(condition, taken)
        if condition.op == "gt" and taken.op == "sqrt" and self._is(otherwise, 0):
            x, zero = condition.args
            if self._is(zero, 0) and taken.args[0] in (x, self._at_least_zero(x)):
                return taken
        return self._node("select", condition, taken, otherwise)

    def _assuming(self, condition, x):
        """X without the guards for derivatives where the condition fails."""
        if x.op == "select" and x.args[0] is condition:
            return self._assuming(condition, x.args[1])
        if x.op not in OPERATIONS:
            return x
        args = tuple(self._assuming(condition, y) for y in x.args)
        return x if args == x.args else self.make(x.op, *args)
