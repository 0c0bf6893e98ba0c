"""Shader source of a graph: structs, a function for constants, one for each section."""

import re
import textwrap
from typing import NamedTuple

from fiberjax.expression import DIRECTIONS, MATERIAL, Node
from fiberjax.languages import (
    Language,
    Text,
    declared,
    function,
    splat,
    structure,
    variable,
)
from fiberjax.regrouping import uses
from fiberjax.statements import Body, below, field_names

WIDTH = 88
DOTS = {"sin_i": "dot(T, L)", "sin_o": "dot(T, V)", "cos_io": "dot(L, V)"}
"""What the directions are given as."""


class Program(NamedTuple):
    """What is written.

    Fields:
        result: the node of the BSDF; its inputs are named as in `DOTS` or are fields of
            the material.
        material: the fields of the material, inputs; and what each means.
        sections: what to say above the function of each section.
        header: the lines of the first comment.
    """

    result: Node
    material: dict[Node, str]
    sections: dict[str, str]
    header: list[str]


class _Source:
    """A program in one language."""

    def __init__(self, program: Program, language: Language):
        self._program, self._language = program, language
        nodes = below(program.result)
        self._directions = [
            x for name in DOTS for x in nodes if x.op == "input" and x.name == name
        ]
        fields: dict[Node, set[str]] = {}
        for node in nodes:
            for x in node.args if node.level == DIRECTIONS else ():
                if x.level == MATERIAL:
                    fields.setdefault(x, set()).add(node.section)
        self._count = uses([program.result, *fields])
        self._fields = field_names(fields)
        self._calls: dict[Node, list[Node]] = {}
        self._sections = [self._section(x) for x in nodes if x.op == "call"]

    def _hair(self) -> dict[Node, str]:
        return {node: f"hair.{name}" for node, name in self._fields.items()}

    def _color(self, node: Node, text: Text) -> str:
        return text.text if node.color else splat(self._language, text)

    def _section(self, call: Node) -> list[str]:
        """The function of a section."""
        body = Body(self._language, self._count, self._hair(), call.name)
        (root,), language = call.args, self._language
        result = body.result(root).text
        given = sorted(body.parameters, key=lambda pair: pair[0].order)
        self._calls[call] = [node for node, _ in given]
        given = [declared(language, x.color, name) for x, name in given]
        lines = [*body.lines, f"return {result};"]
        kind = language.color if root.color else language.number
        name = f"hair_{call.name}"
        parameters = [self._struct("HairConstants", "hair"), *given]
        comment = textwrap.wrap(self._program.sections.get(call.name, ""), WIDTH - 3)
        return [
            *(f"// {line}" for line in comment),
            *function(language, kind, name, parameters, lines),
        ]

    def _struct(self, kind: str, name: str) -> str:
        """A parameter that is a struct."""
        return f"{name}: {kind}" if self._language.typed else f"{kind} {name}"

    def _constants(self) -> list[str]:
        """The function from the material to what depends on it alone."""
        known = {node: f"material.{node.name}" for node in self._program.material}
        inputs = {x: name for x, name in self._hair().items() if x.op == "input"}
        fields = {x: name for x, name in self._hair().items() if x.op != "input"}
        body = Body(self._language, self._count, known, None, fields=fields)
        for node in fields:
            body.text(node)
        copied = [f"{name} = {known[x]};" for x, name in inputs.items()]
        lines = [self._language.constants, *copied, *body.lines, "return hair;"]
        parameters = [self._struct("HairMaterial", "material")]
        return function(
            self._language, "HairConstants", "hair_constants", parameters, lines
        )

    def _bsdf(self) -> list[str]:
        """The function from constants and directions to the result."""
        root, language = self._program.result, self._language
        body = Body(
            language,
            self._count,
            {**self._hair(), **{x: x.name for x in self._directions}},
            calls=self._calls,
        )
        result = self._color(root, body.result(root))
        dots = [variable(language, x, x.name, DOTS[x.name]) for x in self._directions]
        lines = [*dots, *body.lines, f"return {result};"]
        return self._entry("hair_bsdf_hoisted", "HairConstants", "hair", lines)

    def _entry(self, name: str, kind: str, first: str, lines: list[str]) -> list[str]:
        vectors = [declared(self._language, True, x) for x in "LVT"]
        parameters = [self._struct(kind, first), *vectors]
        return function(self._language, self._language.color, name, parameters, lines)

    def text(self) -> str:
        """The whole file."""
        material = [
            (declared(self._language, x.color, x.name), why)
            for x, why in self._program.material.items()
        ]
        fields = [
            (declared(self._language, x.color, name), "")
            for x, name in self._fields.items()
        ]
        at_once = "return hair_bsdf_hoisted(hair_constants(material), L, V, T);"
        parts = [
            [f"// {line}".rstrip() for line in self._program.header],
            structure(self._language, "HairMaterial", material),
            [
                "// What depends on the material alone.",
                *structure(self._language, "HairConstants", fields),
            ],
            self._constants(),
            *self._sections,
            ["// With constants that have been made before.", *self._bsdf()],
            [
                "// L towards the light, V towards the eye, T along the fiber: unit.",
                *self._entry("hair_bsdf", "HairMaterial", "material", [at_once]),
            ],
        ]
        lines = [y for part in parts for x in [*part, ""] for y in _wrapped(x)]
        return "\n".join(lines)


_BREAKS = re.compile(r", | [-+?:*/] ")


def _place(line: str) -> int:
    """Where to break a line: as far outside of parentheses and as late as can be."""
    indent, places = len(line) - len(line.lstrip()), []
    for found in _BREAKS.finditer(line, indent + 8, WIDTH):
        before = line[: found.start()]
        depth = before.count("(") - before.count(")")
        comma = found[0] == ", "
        # An operator begins the next line; a comma ends this one.
        place = found.end() if comma else found.start() + 1
        places.append((depth, found[0] in (" * ", " / "), -place))
    return -min(places)[2] if places else len(line)


def _wrapped(line: str) -> list[str]:
    """The line in parts that are not too long."""
    parts, lead = [], " " * (len(line) - len(line.lstrip()) + 4)
    while len(line) > WIDTH and not line.lstrip().startswith("//"):
        place = _place(line)
        parts.append(line[:place].rstrip())
        line = lead + line[place:].lstrip()
    return [*parts, line] if line.strip() or not parts else parts


def emitted(program: Program, language: Language) -> str:
    """The source of a program, which defines `hair_bsdf`.

    Args:
        program: what is written.
        language: how, one of `fiberjax.languages.LANGUAGES`.

    Returns:
        A file without an entry point: HairMaterial, HairConstants, hair_constants,
        a function for each section, hair_bsdf_hoisted, hair_bsdf.

    Raises:
        ValueError: the result does not depend on directions; a constant is not finite.
    """
    if program.result.level < DIRECTIONS:
        raise ValueError("the result depends on no direction: must be a BSDF")
    return _Source(program, language).text()
