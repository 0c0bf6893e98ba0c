"""Statements of one function of a shader, and what its values are called."""

from collections import Counter
from collections.abc import Mapping, Sequence

from fiberjax.expression import DIRECTIONS, Node
from fiberjax.languages import (
    RESERVED,
    Language,
    Text,
    literal,
    operation,
    variable,
)
from fiberjax.regrouping import uses


def below(root: Node) -> list[Node]:
    """The root and all that it depends on, in the order in which they were made."""
    return sorted(uses([root]), key=lambda node: node.order)


def _unique(name: str, taken: set[str], section: str = "") -> str:
    """The name; if it is taken, with that of the section behind it, or a number."""
    tries = [name, f"{name}_{section.lower()}"] if section else [name]
    numbered = [f"{tries[-1]}_{k}" for k in range(2, 3 + len(taken) + len(RESERVED))]
    found = next(x for x in tries + numbered if x not in taken and x not in RESERVED)
    taken.add(found)
    return found


def _base(node: Node, op: str) -> str:
    """The name of a value, or of the first of such nodes that it is made from."""
    if node.op == op:
        return node.name
    return next(filter(None, (_base(x, op) for x in node.args)), "")


def _field(node: Node) -> str:
    """What to call a value of the material: for what is named in it, or its input."""
    return _base(node, "named") or _base(node, "input") or "constant"


def _local(node: Node) -> str:
    """What to call a value: by its name, x2 if it is the square of x, or t."""
    if node.name:
        return node.name
    x = node.args[0]
    return f"{x.name}2" if node.op == "mul" and x.name and node.args[1] is x else "t"


def field_names(fields: Mapping[Node, set[str]]) -> dict[Node, str]:
    """A name for each value of the material, which these sections take.

    Behind a name that several would have is that of the section, if it is only one's.
    """
    often = Counter(map(_field, fields))
    taken: set[str] = set()
    names = {}
    for node, sections in fields.items():
        name, section = _field(node), "".join(sections)
        if often[name] > 1 and section and len(sections) == 1:
            name += f"_{section.lower()}"
        names[node] = _unique(name, taken)
    return names


class Body:
    """The statements of one function.

    Args:
        language: the language.
        count: how often each node is used.
        known: what the function is given, as it writes it.
        section: whose values it computes, those of others are parameters; None: all.
        calls: what the functions of sections take, by the nodes of their calls.
        fields: values to be kept in fields, as it writes them.
    """

    def __init__(
        self,
        language: Language,
        count: Counter[Node],
        known: Mapping[Node, str],
        section: str | None = "",
        calls: Mapping[Node, Sequence[Node]] | None = None,
        fields: Mapping[Node, str] | None = None,
    ):
        self._language, self._count, self._section = language, count, section
        self._calls, self._fields = calls or {}, fields or {}
        self._texts = {node: Text(text) for node, text in known.items()}
        self._taken = {text for text in known.values() if text.isidentifier()}
        self.lines: list[str] = []
        self.parameters: list[tuple[Node, str]] = []

    def text(self, node: Node) -> Text:
        """The node as an expression; what it needs is put in lines before."""
        if node not in self._texts:
            if node.op == "const":
                return literal(self._language, node.value)
            elsewhere = self._kept(node) and self._section not in (None, node.section)
            if node.op == "input" or elsewhere:
                return self._parameter(node)
            found = self._expression(node)
            if not self._kept(node):
                return found
            self._keep(node, found)
        return self._texts[node]

    def result(self, root: Node) -> Text:
        """The root as an expression, after all that is kept, in its order."""
        for node in below(root):
            here = node.level == DIRECTIONS and node.section == self._section
            if here and self._kept(node) and node.op != "input":
                self.text(node)
        return self.text(root)

    def _kept(self, node: Node) -> bool:
        return node.op == "named" or self._count[node] > 1 or node in self._fields

    def _expression(self, node: Node) -> Text:
        if node.op == "call":
            args = [self.text(x).text for x in self._calls[node]]
            return Text(f"hair_{node.name}({', '.join(['hair', *args])})")
        args = [self.text(x) for x in node.args]
        return args[0] if node.op == "named" else operation(self._language, node, args)

    def _keep(self, node: Node, value: Text) -> None:
        if node in self._fields:
            name = self._fields[node]
            self.lines.append(f"{name} = {value.text};")
        else:
            section = "" if self._section else node.section
            name = _unique(_local(node), self._taken, section)
            self.lines.append(variable(self._language, node, name, value.text))
        self._texts[node] = Text(name)

    def _parameter(self, node: Node) -> Text:
        name = _unique(node.name or _local(node), self._taken)
        self.parameters.append((node, name))
        self._texts[node] = Text(name)
        return self._texts[node]
