"""The graph of a JAX function of numbers and colors."""

import re
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Literal

from fiberjax.expression import Graph, Node

_CALLS = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "checkpoint": "jaxpr",
    "closed_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
    "custom_vjp_call": "call_jaxpr",
}
_SAME = (
    "broadcast_in_dim",
    "copy",
    "optimization_barrier",
    "reshape",
    "squeeze",
    "stop_gradient",
)
_PLAIN = {
    "add_any": "add",
    **{name: name for name in ("add", "sub", "mul", "div", "neg", "abs", "sign")},
    **{name: name for name in ("max", "min", "pow", "sqrt", "rsqrt", "exp", "exp2")},
    **{name: name for name in ("log", "sin", "cos", "tanh", "and", "or", "not")},
    **{name: name for name in ("gt", "ge", "lt", "le", "eq", "ne")},
}


class EmissionError(ValueError):
    """A function that is not one of numbers and colors, as a shader has them."""


def section(name: str, f: Callable[..., Any]) -> Callable[..., Any]:
    """A function that stays one, of this name, in a shader."""

    def called(*args):
        return f(*args)

    called.__name__ = name
    return jax.jit(called)


class _Trace:
    """Reads a jaxpr. Values are arrays where they are known, and nodes elsewhere."""

    def __init__(self, graph: Graph, sections: Sequence[str]):
        self._graph = graph
        self._sections = sections

    def node(self, value: Any) -> Node:
        """The value as a node."""
        return value if isinstance(value, Node) else self._graph.constant(value)

    def run(self, jaxpr: Any, constants: Sequence[Any], args: Sequence[Any]) -> list:
        """The results for these arguments."""
        values = dict(zip(jaxpr.constvars, constants, strict=True))
        values |= dict(zip(jaxpr.invars, args, strict=True))

        def read(x):
            return x.val if isinstance(x, Literal) else values[x]

        for eqn in jaxpr.eqns:
            results = self._results(eqn, [read(x) for x in eqn.invars])
            values |= dict(zip(eqn.outvars, results, strict=True))
        return [read(x) for x in jaxpr.outvars]

    def _results(self, eqn: Any, args: list[Any]) -> list[Any]:
        name = eqn.primitive.name
        if name in _CALLS:
            return self._called(eqn.params.get("name"), eqn.params[_CALLS[name]], args)
        if not any(isinstance(x, Node) for x in args):
            found = eqn.primitive.bind(*args, **eqn.params)
            return list(found) if eqn.primitive.multiple_results else [found]
        for out in eqn.outvars:
            if out.aval.shape not in ((), (1,), (3,)):
                raise EmissionError(
                    f"{name} makes the shape {out.aval.shape}: must be () or (3,)"
                )
        if name in _SAME:
            return args[: len(eqn.outvars)]
        return [self._result(name, eqn.params, args)]

    def _called(self, name: Any, called: Any, args: list[Any]) -> list[Any]:
        # Some primitives hold their constants beside the jaxpr, some have none.
        jaxpr, constants = (
            getattr(called, "jaxpr", called),
            getattr(called, "consts", ()),
        )
        if name not in self._sections:
            return self.run(jaxpr, constants, args)
        if self._graph.section or len(jaxpr.outvars) != 1:
            raise EmissionError(f"section {name}: must have one result and no sections")
        self._graph.section = name
        (result,) = self.run(jaxpr, constants, args)
        self._graph.section = ""
        return [self._graph.call(name, self.node(result))]

    def _result(self, name: str, params: dict[str, Any], args: list[Any]) -> Node:
        graph, nodes = self._graph, [self.node(x) for x in args]
        if name in _PLAIN:
            return graph.make(_PLAIN[name], *nodes)
        if name == "name":
            return self._named(params["name"], *nodes)
        if name in ("integer_pow", "square"):
            return graph.power(nodes[0], params.get("y", 2))
        if name == "clamp":
            low, x, high = nodes
            return graph.make("min", graph.make("max", x, low), high)
        if name == "select_n" and len(nodes) == 3:
            condition, otherwise, taken = nodes
            return graph.make("select", condition, taken, otherwise)
        if name == "convert_element_type":
            return self._converted(nodes[0], params["new_dtype"])
        if name == "dot_general" and all(x.color for x in nodes):
            return graph.make("dot", *nodes)
        raise EmissionError(f"primitive {name!r}: a shader has nothing for it")

    def _named(self, name: str, x: Node) -> Node:
        if not re.fullmatch("[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*", name):
            raise EmissionError(f"name {name!r}: must be one in every language")
        return self._graph.named(name, x)

    def _converted(self, x: Node, dtype: Any) -> Node:
        if not jnp.issubdtype(dtype, jnp.floating):
            raise EmissionError(f"a conversion to {np.dtype(dtype)}: must be to floats")
        if not x.true_or_false:
            return x
        one, zero = self._graph.constant(1.0), self._graph.constant(0.0)
        return self._graph.make("select", x, one, zero)


def traced(
    graph: Graph,
    f: Callable[..., Any],
    like: Sequence[Any],
    inputs: Sequence[Node],
    sections: Sequence[str] = (),
) -> Node:
    """The result of f as a node of the graph.

    Args:
        graph: what makes the nodes.
        f: a JAX function of numbers and colors, on a last axis of 3. Calls of jitted
            functions named in `sections` stay calls.
        like: arguments of f, PyTrees of `jax.ShapeDtypeStruct`.
        inputs: the node of each leaf of `like`.
        sections: names of functions, see `section`.

    Returns:
        The node.

    Raises:
        EmissionError: a primitive or a shape that a shader has nothing for; it is
            named.
    """
    closed = jax.make_jaxpr(f)(*like)
    trace = _Trace(graph, sections)
    (result,) = trace.run(closed.jaxpr, closed.consts, list(inputs))
    return trace.node(result)
