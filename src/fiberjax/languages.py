"""How HLSL, GLSL and WGSL write what a shader computes."""

import re
from typing import NamedTuple

import numpy as np

from fiberjax.expression import Node


class Language(NamedTuple):
    """The spelling of one language.

    Fields:
        number, color: types.
        splat: a color of one number.
        spelled: functions under other names than in HLSL.
        select: a choice by a condition, or None for the operator ?:.
        typed: whether a type follows its name, after a colon.
        constants: an empty `HairConstants`.
    """

    number: str
    color: str
    splat: str
    spelled: dict[str, str]
    select: str | None
    typed: bool
    constants: str


LANGUAGES = {
    "hlsl": Language(
        "float", "float3", "(float3){}", {}, None, False, "HairConstants hair;"
    ),
    "glsl": Language(
        "float",
        "vec3",
        "vec3({})",
        {"rsqrt": "inversesqrt"},
        None,
        False,
        "HairConstants hair;",
    ),
    "wgsl": Language(
        "f32",
        "vec3f",
        "vec3f({})",
        {"rsqrt": "inverseSqrt"},
        "select({2}, {1}, {0})",
        True,
        "var hair: HairConstants;",
    ),
}
"""Each language by the ending of its files."""

RESERVED = frozenset(
    re.findall(
        r"\w+",
        """
        abs abstract active alias alignas alignof as asm asm_fragment async
        atomic_uint attribute auto await become bool break buffer case cast catch
        cbuffer centerpass centroid clamp class coherent column_major common compile
        compile_fragment concept const const_assert consteval constexpr constinit
        continue continuing cos crate debugger decltype default delete demote
        diagnostic discard do dot double dword else enable enum exp exp2 explicit
        export extends extern external fallthrough false filter final finally fixed
        flat float fn for friend from fxgroup get goto groupshared hair half highp if
        impl implements import in inline inout input instanceof int interface
        invariant inverseSqrt inversesqrt L layout let line linear log long loop lowp
        macro main match material matrix max mediump meta min mod module move mut
        mutable namespace new nil noexcept noinline nointerpolation noise noncoherent
        noperspective NULL null nullptr of operator out output override package packed
        packoffset partition pass patch pixelfragment point pow precise precision priv
        private protected pub public readonly ref regardless register require requires
        resource restrict return row_major rsqrt sample sampler select Self self set
        shared short sign sin sizeof smooth snorm sqrt stateblock static static_assert
        std string struct subroutine super superp switch T tanh target tbuffer
        technique template texture this throw trait triangle true try type typedef
        typeid typename typeof uniform union unless unorm unsafe unsigned unsized use
        using V var varying vector vertexfragment virtual void volatile wgsl where
        while with writeonly yield
        """,
    )
)
"""What no value may be named: functions, and words that mean something somewhere."""

_INFIX = {
    "or": ("||", 2),
    "and": ("&&", 2),
    "eq": ("==", 3),
    "ne": ("!=", 3),
    "gt": (">", 4),
    "ge": (">=", 4),
    "lt": ("<", 4),
    "le": ("<=", 4),
    "add": ("+", 5),
    "sub": ("-", 5),
    "mul": ("*", 6),
    "div": ("/", 6),
}
_PREFIX = {"neg": "-", "not": "!"}
_UNARY, _ATOM = 7, 8
_ALIKE = ("max", "min", "pow", "clamp", "select")
"""Functions whose arguments have one type."""


class Text(NamedTuple):
    """An expression and how strongly its outermost operator binds."""

    text: str
    binds: int = _ATOM

    def within(self, least: int) -> str:
        """The text, in parentheses if it binds less."""
        return self.text if self.binds >= least else f"({self.text})"


def literal(language: Language, value: np.ndarray) -> Text:
    """A constant as float32 holds it, in as few digits as it takes."""
    with np.errstate(over="ignore"):
        numbers = np.atleast_1d(value).astype(np.float32)
    if not np.isfinite(numbers).all():
        raise ValueError(f"a constant is {value}: must be finite in float32")
    texts = [str(x) for x in numbers]
    if len(texts) == 3:
        return Text(f"{language.color}({', '.join(texts)})")
    return Text(texts[0], _UNARY if numbers[0] < 0 else _ATOM)


def splat(language: Language, x: Text) -> str:
    """A color of one number."""
    cast = language.splat.startswith("(")
    return language.splat.format(x.within(_ATOM) if cast else x.text)


def operation(language: Language, node: Node, args: list[Text]) -> Text:
    """An operation on expressions."""
    if node.op in _PREFIX:
        # Not two signs in a row: that would be another operator.
        return Text(_PREFIX[node.op] + args[0].within(_ATOM), _UNARY)
    if node.op in _INFIX:
        return _infix(*_INFIX[node.op], *args)
    if node.op in _ALIKE and node.color:
        args = [
            x if y.color or y.true_or_false else Text(splat(language, x))
            for x, y in zip(args, node.args, strict=True)
        ]
    if node.op == "select" and language.select is None:
        condition, taken, otherwise = (x.within(1) for x in args)
        return Text(f"{condition} ? {taken} : {otherwise}", 0)
    texts = [x.text for x in args]
    if node.op == "select":
        return Text(str(language.select).format(*texts))
    return Text(f"{language.spelled.get(node.op, node.op)}({', '.join(texts)})")


def _infix(sign: str, binds: int, left: Text, right: Text) -> Text:
    if sign in "+-" and right.text.startswith("-") and right.binds > binds:
        sign, right = "+-"[sign == "+"], right._replace(text=right.text[1:])
    # WGSL wants parentheses wherever conditions are joined.
    least = _INFIX["eq"][1] if binds < _INFIX["eq"][1] else binds
    return Text(f"{left.within(least)} {sign} {right.within(binds + 1)}", binds)


def declared(language: Language, color: bool, name: str) -> str:
    """A parameter or a field."""
    kind = language.color if color else language.number
    return f"{name}: {kind}" if language.typed else f"{kind} {name}"


def variable(language: Language, node: Node, name: str, value: str) -> str:
    """A statement that names a value."""
    if language.typed:
        return f"let {name} = {value};"
    kind = "bool" if node.true_or_false else declared(language, node.color, "").strip()
    return f"{kind} {name} = {value};"


def function(
    language: Language, result: str, name: str, parameters: list[str], body: list[str]
) -> list[str]:
    """The lines of a function."""
    inside = ", ".join(parameters)
    if language.typed:
        head = f"fn {name}({inside}) -> {result} {{"
    else:
        head = f"{result} {name}({inside}) {{"
    return [head, *(f"    {line}" for line in body), "}"]


def structure(
    language: Language, name: str, fields: list[tuple[str, str]]
) -> list[str]:
    """The lines of a struct: each field as declared, and what it means."""
    end = "," if language.typed else ";"
    close = "}" if language.typed else "};"
    lines = [f"    {field}{end}" + f"  // {why}" * bool(why) for field, why in fields]
    return [f"struct {name} {{", *lines, close]
