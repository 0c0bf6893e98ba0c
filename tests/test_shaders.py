"""Shaders: what is emitted, what is committed, and what they compute when run."""

import ctypes
import json
import re
import shutil
import subprocess
import sys
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import gpu
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.ad_checkpoint import checkpoint_name

from fiberjax import artist, numerics, realtime, shader
from fiberjax.emission import DOTS, Program, emitted
from fiberjax.expression import DIRECTIONS, MATERIAL, Graph
from fiberjax.fiber import Fiber
from fiberjax.languages import LANGUAGES, Text, operation
from fiberjax.regrouping import regrouped
from fiberjax.shading import LEAST, of_angles, of_dots
from fiberjax.tracing import EmissionError, section, traced

FITS = Path(__file__).parents[1] / "fits"
sys.path.insert(0, str(FITS))
spirv: Any = import_module("shared.spirv")
assembly: Any = import_module("shared.assembly")
counting: Any = import_module("shared.counting")
script: Any = import_module("shaders")

COSTS = json.loads(realtime.COSTS.read_text())
CASES = list(product(shader.SHADERS, LANGUAGES))
every = pytest.mark.parametrize(("tier", "language"), CASES)


def need(counter):
    absent = ", ".join(counter.missing())
    skipped = bool(absent) and not gpu.REQUIRED
    return pytest.mark.skipif(skipped, reason=f"{absent}: not found")


needs_spirv, needs_assembly = need(spirv), need(assembly)


def committed(name):
    return (FITS / "shaders" / name).read_text()


def test_files_are_what_the_emitter_writes():
    files = script.files(COSTS)
    found = {path.name for path in (FITS / "shaders").iterdir()}
    assert found == set(files) | {"MIGRATION.md"}
    for name, text in files.items():
        assert text == committed(name), f"{name} differs: make shaders"


def test_every_tier_has_a_shader_and_a_cost():
    assert set(realtime.TIERS) <= set(shader.SHADERS) == set(COSTS)
    for tier in realtime.TIERS:
        for name, found in COSTS[tier].items():
            assert realtime.cost(tier, name) == tuple(found.values())
        assert realtime.cost(tier) == realtime.cost(tier, "assembly")


@needs_spirv
@pytest.mark.parametrize("tier", shader.SHADERS)
def test_a_recount_in_spirv_agrees(tier):
    text = emitted(shader.program(tier), spirv.LANGUAGE)
    assert spirv.operations(text)._asdict() == COSTS[tier]["spirv"]


@needs_assembly
@pytest.mark.parametrize("tier", shader.SHADERS)
def test_a_recount_in_assembly_agrees(tier):
    text = emitted(shader.program(tier), assembly.LANGUAGE)
    assert assembly.operations(text)._asdict() == COSTS[tier]["assembly"]


@needs_spirv
def test_prices_of_operations_in_spirv():
    source = """
struct HairConstants { float a; float b; vec3 c; };
vec3 hair_bsdf_hoisted(HairConstants hair, vec3 L, vec3 V, vec3 T) { return %s; }
"""
    for expression, price in {
        "exp(hair.a) * L": (1, 3),
        "exp(L)": (3, 0),
        "L / hair.a": (3, 3),
        "pow(L, V)": (6, 3),
        "tanh(L)": (6, 12),
        "vec3(dot(L, V))": (0, 5),
        "hair.c * hair.c": (0, 3),
        "-abs(L) * V": (0, 3),
        "max(L, V) + V": (0, 6),
        "clamp(L, hair.a, hair.b)": (0, 6),
        "L * V + T": (0, 6),
        "L.x > 0.5 ? V : T": (0, 4),
        "inversesqrt(L) * log2(V) + sqrt(T)": (9, 6),
    }.items():
        assert spirv.operations(source % expression) == price, expression
    with pytest.raises(RuntimeError, match="Atan: an instruction without a price"):
        spirv.operations(source % "atan(L)")
    with pytest.raises(RuntimeError, match=r"(?s)glslangValidator: .*syntax"):
        spirv.operations(source % "L +")


# What every function of the head comes to, in the code of a GPU.
IN_ASSEMBLY = {
    "L": (0, 0),
    "hair.c": (0, 0),
    "exp2(hair.a) * L": (1, 3),
    "exp(hair.a) * L": (1, 4),
    "exp(L)": (3, 3),
    "log(L)": (3, 3),
    "1.0 / L.x * V": (1, 3),
    "L / V": (3, 3),
    "pow(L, V)": (6, 3),
    "tanh(L)": (3, 0),
    "sin(L) + cos(L)": (6, 6),
    "(float3)dot(L, V)": (0, 3),
    "-abs(L) * V": (0, 3),
    "min(L, V) + V": (0, 6),
    "clamp(L, hair.a, hair.b)": (0, 6),
    "clamp(L * V, 0.0, 1.0)": (0, 3),
    "(float3)clamp(L.x, -1.0, 1e-3)": (0, 2),
    "L * V + T": (0, 3),
    "L * V - 2.5 * T": (0, 6),
    "select(L.x > 0.5, V, T)": (0, 4),
    "select(L.x > 0.5 && V.x < 0.2, L.x, T.x) * V": (0, 7),
    "select(L.x > 0.5, exp2(V) * T, T * L)": (3, 4),
    "sign(L)": (0, 9),
    "rsqrt(L) * sqrt(T)": (6, 3),
}
IN_HLSL = """
struct HairConstants { float a; float b; float3 c; };  // 1.0
float3 hair_bsdf_hoisted(HairConstants hair, float3 L, float3 V, float3 T) {
    return %s;
}
"""


@needs_assembly
@pytest.mark.parametrize("expression", IN_ASSEMBLY)
def test_prices_of_operations_in_assembly(expression):
    assert assembly.operations(IN_HLSL % expression) == IN_ASSEMBLY[expression]


@needs_assembly
def test_what_cannot_be_counted_in_assembly():
    with pytest.raises(RuntimeError, match="F2I: an instruction without a price"):
        assembly.operations(IN_HLSL % "float3(int(L.x))")
    with pytest.raises(RuntimeError, match=r"(?s)NVRTC: .*expected an expression"):
        assembly.operations(IN_HLSL % "L +")
    with pytest.raises(RuntimeError, match=r"nvdisasm: .*fatal"):
        assembly.disassembled(b"nothing")


@needs_assembly
def test_a_constant_is_of_single_precision():
    """In double precision it would be another kind of instruction."""
    text = assembly.cuda("float f(float x2) { return 1e-12 * x2 + 0.5 - 1.5e+10; }")
    assert "1e-12f * x2 + 0.5f - 1.5e+10f;" in text


@pytest.mark.parametrize("counter", ["spirv", "assembly"])
def test_without_a_tool_counts_stay(counter, monkeypatch, capsys):
    other = ({"spirv", "assembly"} - {counter}).pop()
    for name in (counter, other):
        monkeypatch.setattr(counting.COUNTERS[name], "missing", lambda: ["some tool"])
    assert counting.counted(COSTS) == COSTS
    assert f"some tool: not found; operations in {counter}" in capsys.readouterr().out
    without = {tier: {other: found[other]} for tier, found in COSTS.items()}
    with pytest.raises(SystemExit, match=f"in {counter} were never counted"):
        counting.counted(without)
    with pytest.raises(RuntimeError, match="some tool: not found"):
        counting.COUNTERS[counter].operations("")


def test_a_rerun_writes_the_same_bytes(tmp_path):
    """Without float64 too, as the script runs."""
    costs = tmp_path / "operations.json"
    run = [sys.executable, FITS / "shaders.py", "--output", tmp_path, "--costs", costs]
    ran = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True)
    for tier, language in CASES:
        name = f"{tier}.{language}"
        assert (tmp_path / name).read_text() == committed(name)
    assert costs.read_bytes() == realtime.COSTS.read_bytes()
    for tier, found in COSTS.items():
        cells = (f"{x['special']} \\+ {x['other']}" for x in found.values())
        assert re.search(rf"(?m)^{tier} +{' +'.join(cells)}$", ran.stdout)
    assert ran.stderr == ""


# What the emitter does.


class Material(NamedTuple):
    """A material of a number and a color."""

    a: Any
    c: Any


def program(f, sections=()):
    graph = Graph()
    material = graph.input("a", MATERIAL), graph.input("c", MATERIAL, True)
    dots = [graph.input(name, DIRECTIONS) for name in DOTS]
    one, color = (jax.ShapeDtypeStruct(s, jnp.float32) for s in ((), (3,)))
    like = Material(one, color), one, one, one
    root = traced(graph, f, like, [*material, *dots], sections)
    return Program(regrouped(root), dict.fromkeys(material, "some"), {}, ["Head."])


def written(f, language="glsl", sections=()):
    return emitted(program(f, sections), LANGUAGES[language])


def returned(f, language="glsl"):
    """What the function of directions returns, and of constants assigns."""
    text = written(f, language)
    found = re.findall(r"hair\.(\w+) = (.*);", text)
    last = re.findall(r"return (.*);", text.split("hair_bsdf_hoisted(")[1])[0]
    return re.sub(r"^vec3\((.*)\)$", r"\1", last), dict(found)


EXPRESSIONS = {
    "(x + y) * (z - x)": "(sin_i + sin_o) * (cos_io - sin_i)",
    "x - (y + z)": "sin_i - sin_o - cos_io",
    "x / (y / z)": "sin_i * cos_io / sin_o",
    "x / y / z": "sin_i / (sin_o * cos_io)",
    "x * y / 4": "0.25 * sin_i * sin_o",
    "-(x * -y) - z * 2": "sin_i * sin_o - 2.0 * cos_io",
    "-x + y": "sin_o - sin_i",
    "-x - y": "-(sin_i + sin_o)",
    "x + 1 + y + 2": "sin_i + 3.0 + sin_o",
    "(x + 1 + y) - 1": "sin_i + sin_o",
    "jnp.exp(3 * x) * y * jnp.exp(-z)": (
        "sin_o * exp2(4.328085 * sin_i - 1.442695 * cos_io)"
    ),
    "x * (-y - z)": "-(sin_i * (sin_o + cos_io))",
    "jnp.exp(x) * jnp.exp(m.c) * y * 2": "sin_o * exp2(1.442695 * sin_i) * hair.c",
    "x / jnp.exp(y)": "sin_i * exp2(-1.442695 * sin_o)",
    "jnp.clip(x, -1, 0.5)": "clamp(sin_i, -1.0, 0.5)",
    "jnp.sqrt(x)": "sqrt(max(sin_i, 0.0))",
    "numerics.sqrt(x)": "sqrt(max(sin_i, 0.0))",
    "jnp.sqrt(x * x)": "sqrt(sin_i * sin_i)",
    "numerics.quotient(x, y, 1.0)": "sin_o != 0.0 ? sin_i / sin_o : 1.0",
    "x**2.5": "pow(max(sin_i, 0.0), 2.5)",
    "jnp.abs(x) ** 0.5": "sqrt(abs(sin_i))",
    "x**2 * y**-1": "sin_i * sin_i / sin_o",
    "jnp.where(x > y, x, z) + 1": "(sin_i > sin_o ? sin_i : cos_io) + 1.0",
    "(x, jnp.exp(y))[0] * 1": "sin_i",
    "x - (y - z * -2)": "sin_i - sin_o - 2.0 * cos_io",
    "-(x + y) * z": "-((sin_i + sin_o) * cos_io)",
    "jnp.exp2(x) * jnp.exp2(z)": "exp2(sin_i + cos_io)",
    "jnp.exp(2 * x - y * m.a)": "exp2(2.88539 * sin_i - hair.a * sin_o)",
}


def test_values_used_twice_are_computed_once():
    text = written(
        lambda m, x, y, z: jnp.sin(x * y) * (x * y) + jnp.exp(z) * y / (x * y)
    )
    assert "    float t = sin_i * sin_o;\n" in text
    assert "return vec3(sin_o * exp2(1.442695 * cos_io) / t + sin(t) * t);" in text
    text = written(lambda m, x, y, z: jnp.exp(x) * y + jnp.exp(x) * jnp.exp(z))
    assert "    float t = exp2(1.442695 * sin_i);\n" in text
    assert "return vec3(t * sin_o + t * exp2(1.442695 * cos_io));" in text


def test_signs_before_a_sum_in_parentheses():
    graph, language = Graph(), LANGUAGES["glsl"]
    x, y = (graph.input(name, DIRECTIONS) for name in "xy")
    for op, shown in (("add", "x + (-y + x)"), ("sub", "x - (-y + x)")):
        args = [Text("x"), Text("-y + x", 5)]
        assert operation(language, graph.make(op, x, y), args).text == shown
        args = [Text("x"), Text("-y", 7)]
        sign = "-" if op == "add" else "+"
        assert operation(language, graph.make(op, x, y), args).text == f"x {sign} y"


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_expressions(text):
    f = eval(f"lambda m, x, y, z: {text}", {"jnp": jnp, "numerics": numerics})
    assert returned(f)[0] == EXPRESSIONS[text]


def test_what_depends_on_the_material_is_computed_once():
    def f(m, x, y, z):
        width = checkpoint_name(1 / (m.a * 2), "width")
        return x / m.a * 3 * jnp.exp(m.c * 4 * y * width) - (y + m.a + 1)

    last, fields = returned(f)
    assert fields == {
        "width": "5.77078 * width * material.c",
        "a": "3.0 / material.a",
        "a_2": "-(material.a + 1.0)",
    }
    assert last == "hair.a_2 - sin_o + hair.a * sin_i * exp2(sin_o * hair.width)"


def test_sections_are_functions_of_what_they_need():
    def lobe(a, x, y):
        return jnp.exp(a * checkpoint_name(x + y, "off"))

    def f(m, x, y, z):
        shared = checkpoint_name(x * z, "both")
        one = section("One", lobe)(m.a, shared, y)
        return one * m.c + section("Two", lobe)(m.a, shared, shared)

    text = written(f, sections=("One", "Two"))
    assert "float hair_One(HairConstants hair, float both, float sin_o) {" in text
    assert "float hair_Two(HairConstants hair, float both) {" in text
    assert "    float off = both + sin_o;\n" in text
    sum_of_both = "hair_Two(hair, both) + hair_One(hair, both, sin_o) * hair.c"
    assert f"return {sum_of_both};" in text
    with pytest.raises(EmissionError, match="section One: must have one result"):
        written(
            lambda m, x, y, z: section("One", lambda x: (x, x + 1))(x)[0],
            "glsl",
            ("One",),
        )


def test_a_function_of_the_material_alone_is_none():
    with pytest.raises(ValueError, match="depends on no direction"):
        written(lambda m, x, y, z: m.c * m.a)


def test_names_are_kept_and_no_word_of_a_language():
    def f(m, x, y, z):
        half = checkpoint_name(x + y, "half")
        return checkpoint_name(half * half, "sin") * checkpoint_name(half + z, "half")

    text = written(f)
    assert "float half_2 = sin_i + sin_o;" in text
    assert "float sin_2 = half_2 * half_2;" in text
    assert "float half_3 = half_2 + cos_io;" in text


@pytest.mark.parametrize(
    ("f", "message"),
    [
        (lambda m, x, y, z: jnp.arctan(x) * y, "primitive 'atan'"),
        (lambda m, x, y, z: jnp.stack([x, y]).sum() * y, r"\(2,\)|primitive"),
        (lambda m, x, y, z: m.c[:2].sum() * x, "slice makes the shape|primitive"),
        (lambda m, x, y, z: jnp.where(m.c > x, x, y), "gt of colors: a condition"),
        (lambda m, x, y, z: x.astype(int).astype(jnp.float32), "a conversion to int"),
        (lambda m, x, y, z: checkpoint_name(x, "cos phi"), "name 'cos phi': must be"),
        (lambda m, x, y, z: x * 1e-30 * 1e30 * jnp.inf, "must be finite in float32"),
    ],
)
def test_what_a_shader_has_nothing_for(f, message):
    with pytest.raises(ValueError, match=message):
        written(f)


def test_colors_and_numbers_in_each_language():
    def f(m, x, y, z):
        return jnp.maximum(m.c * x, y) ** (y + 2) * jnp.where(x > 0, m.c * y, 1.0)

    for language, choice, color in (
        ("glsl", "sin_i > 0.0 ? sin_o * hair.c : vec3(1.0)", "vec3(sin_o)"),
        ("hlsl", "sin_i > 0.0 ? sin_o * hair.c : (float3)1.0", "(float3)sin_o"),
        ("wgsl", "select(vec3f(1.0), sin_o * hair.c, sin_i > 0.0)", "vec3f(sin_o)"),
    ):
        text = written(f, language)
        assert choice in text
        assert f"max(sin_i * hair.c, {color})" in text


def test_unknown_tiers_and_languages():
    with pytest.raises(
        ValueError, match=r"tier = 'karis': must be one of \('karis2016"
    ):
        shader.source("karis", "hlsl")
    with pytest.raises(ValueError, match="language = 'metal': must be one of"):
        shader.source("karis2016", "metal")
    with pytest.raises(ValueError, match="tier = 'karis2016_artist'"):
        realtime.cost("karis2016_artist")
    with pytest.raises(ValueError, match=r"counted = 'hlsl': must be one of \('ass"):
        realtime.cost("karis2016", "hlsl")


@every
def test_files_can_be_read(tier, language):
    text = shader.source(tier, language, ["Error .41."])
    assert "\n// Error .41.\n" in text
    assert max(map(len, text.splitlines())) <= 88
    assert not re.search(r"pow\(-|[^\w]nan|[^\w]inf[^\w]", text)
    for root in re.findall(r"(?i)sqrt\((.*)", re.sub("//.*", "", text)):
        assert root.startswith(("max(", "color", "square"))


# What they compute.


def numbers(node, given, found):
    """The value of a node of a graph."""
    if node not in found:
        args = [numbers(x, given, found) for x in node.args]
        if any(x.color for x in node.args) and node.op != "dot":
            args = [x if np.ndim(x) == 2 else np.asarray(x)[..., None] for x in args]
        found[node] = operated(node, given, args)
    return found[node]


def operated(node, given, args):
    if node.op in ("const", "input"):
        return node.value if node.op == "const" else given[node.name]
    special = {
        "named": lambda x: x,
        "call": lambda x: x,
        "clamp": lambda x, low, high: np.clip(x, low, high),
        "dot": lambda x, y: np.sum(x * y, -1),
        "rsqrt": lambda x: 1 / np.sqrt(x),
        "select": np.where,
        "gt": np.greater,
        "ne": np.not_equal,
    }
    plain = {"sub": "subtract", "mul": "multiply", "div": "divide", "neg": "negative"}
    plain |= {"max": "maximum", "min": "minimum", "pow": "power"}
    if node.op in special:
        return special[node.op](*args)
    return getattr(np, str(plain.get(node.op, node.op)))(*args)


def units(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def directions(n, rng):
    """L, V and T; three in ten anywhere, the others next to poles and to each other."""
    T, L, V = (units(rng.normal(size=(n, 3))) for _ in range(3))
    kind, near = np.arange(n) % 10, 10 ** rng.uniform(-8, -0.5, (n, 1))
    side, other = rng.choice([-1, 1], (2, n, 1))
    for vector, away, kinds in (
        (L, side * T + near * L, (1, 2)),  # grazing
        (V, other * T + near * V, (2, 3)),
        (V, side * L, (4,)),
        (V, side * L + near * V, (5,)),
        (V, other * T, (6, 7)),  # a pole, with L anywhere or there too
        (L, side * T, (7,)),
    ):
        rows = np.isin(kind, kinds)
        vector[rows] = units(away)[rows]
    return L, V, T


COLORS = [(0, 0, 0), (1, 1, 1), (0.015, 0.012, 0.01), (0.65, 0.45, 0.22), (1, 0, 0.5)]
MATERIALS = {
    shader.Material: {
        "eta": (1, 1.3, 1.55, 1.8),
        "sigma_a": [-np.log(np.maximum(c, 1e-9)) / 4 + 0.0 for c in COLORS],
        "beta_m": (0.01, 0.05, 0.3, 1),
        "beta_n": (0.05, 0.5),
        "alpha": (-0.05, 0, 0.03),
    },
    shader.ArtistMaterial: {
        "base_color": COLORS,
        "specular": (0, 0.5, 1),
        "roughness": (0.1, 0.3, 0.7, 1),
        "scatter": (0, 1),
        "shift": (-0.1, 0, 0.035),
        "shadow": (0, 0.5, 1),
    },
}


EXTREMES = {
    shader.Material: {
        "eta": (0.5, 1, 1.0001, 3, 10),
        "sigma_a": [(0, 0, 0), (1e4, 1, 0), (1e-6, 30, 1e30)],
        "beta_m": (1e-3, 1e-2, 3, 100),
        "beta_n": (0, 1e-3, 10),
        "alpha": (-1.5, -1, 0.5, 1, 3),
    },
    shader.ArtistMaterial: {
        "base_color": [(0, 0, 0), (1, 1, 1), (1, 1e-20, 0.5)],
        "specular": (0, 10),
        "roughness": (0.01, 5),
        "scatter": (0, 10),
        "shift": (-1, 1),
        "shadow": (0, 1),
    },
}


def given(tier, n, materials=MATERIALS):
    """Materials and directions in float32, by name."""
    rng = np.random.default_rng(4)
    columns = {}
    for name, values in materials[shader.SHADERS[tier].material].items():
        chosen = np.asarray(values)[rng.integers(len(values), size=n)]
        columns[name] = chosen.reshape(n, -1).astype(np.float32)
    vectors = dict(zip("LVT", directions(n, rng), strict=True))
    return columns | {name: x.astype(np.float32) for name, x in vectors.items()}


def exact(tier):
    """The JAX function of materials and dot products, in float64.

    And of what rounding adds to cos theta_i cos theta_o cos phi, a difference of them.
    """
    made = shader.SHADERS[tier]

    def f(columns, dots, added):
        at = of_dots(*dots)
        cos_phi = jnp.clip(at.cos_phi + added / (at.cos_i * at.cos_o), -1, 1)
        half = jnp.maximum(jnp.sqrt(0.5 + 0.5 * cos_phi), LEAST)
        at = at._replace(cos_phi=cos_phi, cos_half_phi=half, over_half_phi=1 / half)
        return made.bsdf(made.material(*columns), at)

    mapped = jax.jit(jax.vmap(f))
    return lambda columns, dots, added=None: np.asarray(
        mapped(columns, dots, np.zeros_like(dots[0]) if added is None else added)
    )


def columns_of(tier, rows):
    fields = shader.SHADERS[tier].material.__annotations__
    arrays = [np.asarray(rows[name], np.float64) for name in fields]
    return [x if x.shape[1] == 3 else x[:, 0] for x in arrays]


def worst(tier, rows, found):
    """The largest error over 1e-4 relative + 1e-6, and which were looked at again.

    Where directions are nearly opposite or along the fiber, the dot products of unit
    vectors as float32 holds them do not determine the result: there it must be one that
    the function takes within an ulp or two of them and of cos phi's numerator.
    """
    f, columns = exact(tier), columns_of(tier, rows)
    color, dots = found[:, :3], found[:, 3:].astype(np.float64)
    truth = f(columns, list(dots.T))
    assert np.isfinite(truth).all()
    tolerance = 1e-4 * np.abs(truth) + 1e-6
    error = np.abs(color - truth) / tolerance
    again = np.flatnonzero(error.max(1) > 1)
    sides, ulps, fine = (2.0**-23 * np.linspace(-2, 2, n) for n in (3, 5, 17))
    steps = np.array(list(product(sides, sides, ulps, fine)))
    some = [np.repeat(x[again], len(steps), 0) for x in columns]
    moved = (dots[again, None] + steps[:, :3]).reshape(-1, 3)
    near = f(some, list(moved.T), np.tile(steps[:, 3], len(again)))
    near = near.reshape(len(again), len(steps), 3)
    outside = np.maximum(near.min(1) - color[again], color[again] - near.max(1))
    error[again] = np.maximum(outside, 0) / tolerance[again]
    return error.max(), again


@pytest.mark.parametrize("tier", shader.SHADERS)
def test_the_graph_computes_the_function(tier):
    """In float64, where regrouping changes nothing but rounding."""
    rows = given(tier, 5000)
    L, V, T = (np.asarray(rows[name], np.float64) for name in "LVT")
    pairs = ((T, L), (T, V), (L, V))
    dots = [np.clip(np.sum(x * y, -1), -1, 1) for x, y in pairs]
    columns = columns_of(tier, rows)
    names = dict(
        zip(
            (*shader.SHADERS[tier].material.__annotations__, *DOTS),
            [*columns, *dots],
            strict=True,
        )
    )
    found = numbers(shader.program(tier).result, names, {})
    expected = exact(tier)(columns, dots)
    # Constants of the graph have been rounded to float32: exponents feel it.
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-7)


@pytest.fixture(scope="module")
def device():
    return gpu.device()


def shown(device, tier, language, text, rows, directory):
    names = (*shader.SHADERS[tier].material.__annotations__, *"LVT")
    sizes = {name: rows[name].shape[1] for name in names[:-3]}
    text = gpu.harness(language, text, sizes)
    code = text if language == "wgsl" else gpu.spirv(language, text, directory)
    return gpu.run(device, code, np.concatenate([rows[name] for name in names], 1))


@every
def test_shaders_run_and_agree_with_jax(device, tier, language, tmp_path):
    if language != "wgsl":
        gpu.need_glslang()
    rows, text = given(tier, 100_000), committed(f"{tier}.{language}")
    found = shown(device, tier, language, text, rows, tmp_path)
    assert np.isfinite(found).all()
    error, again = worst(tier, rows, found)
    assert error <= 1
    # A second look is rare, the more so away from poles and from opposite directions.
    assert len(again) <= 0.014 * len(found)
    assert np.isin(again % 10, (0, 8, 9)).sum() <= 4


@every
def test_shaders_of_extreme_materials_are_finite(device, tier, language, tmp_path):
    if language != "wgsl":
        gpu.need_glslang()
    rows, text = given(tier, 20_000, EXTREMES), committed(f"{tier}.{language}")
    found = shown(device, tier, language, text, rows, tmp_path)
    assert np.isfinite(found).all()
    assert (found[:, :3] >= 0).all()


# On a processor, for the values: all that a GPU has and C++ has not.
HOST = """
#include <algorithm>
#include <cmath>
using namespace std;
#define __global__
#define __syncthreads()
float rsqrt(float x) { return 1 / sqrt(x); }
"""
EACH = """
extern "C" void each(
    int n, const HairMaterial *material, const float3 *directions, float3 *result) {
    for (int k = 0; k < n; ++k) {
        HairConstants hair = hair_constants(material[k]);
        shade(&hair, directions + 3 * k, result + k);
    }
}
"""


@pytest.mark.skipif(not shutil.which("g++"), reason="g++: not found")
@pytest.mark.parametrize("tier", shader.SHADERS)
def test_what_is_counted_in_assembly_computes_the_function(tier, tmp_path):
    text = assembly.cuda(emitted(shader.program(tier), assembly.LANGUAGE))
    (tmp_path / "hair.cpp").write_text(HOST + text + EACH)
    options = "-O1", "-ffp-contract=off", "-shared", "-fPIC", "-o", "hair.so"
    subprocess.run(["g++", *options, "hair.cpp"], cwd=tmp_path, check=True)
    rows = given(tier, 20_000)
    names = shader.SHADERS[tier].material.__annotations__
    material, vectors = (
        np.concatenate([rows[x] for x in some], 1) for some in (names, "LVT")
    )
    color = np.empty((len(vectors), 3), np.float32)
    arrays = (x.ctypes.data_as(ctypes.c_void_p) for x in (material, vectors, color))
    ctypes.CDLL(str(tmp_path / "hair.so")).each(len(color), *arrays)
    pairs = ("TL", "TV", "LV")
    dots = [(rows[x] * rows[y]).sum(1, keepdims=True) for x, y in pairs]
    error, again = worst(tier, rows, np.concatenate([color, *dots], 1))
    assert error <= 1
    assert np.isin(again % 10, (0, 8, 9)).sum() <= 5


@pytest.mark.parametrize("tier", shader.SHADERS)
def test_a_wrong_shader_is_seen(device, tier, tmp_path):
    """A thousandth more of what is exponentiated, and the text of another tier."""
    rows, text = given(tier, 2000), committed(f"{tier}.wgsl")
    broken = [re.sub(r"exp2\(", "exp2(1.001 * ", text, count=1)]
    if shader.SHADERS[tier].material is shader.Material:
        others = [x for x in realtime.TIERS if x != tier.removesuffix("_rest")]
        broken += [committed(f"{other}.wgsl") for other in others]
    for other in broken:
        found = shown(device, tier, "wgsl", other, rows, tmp_path)
        assert worst(tier, rows, found)[0] > 1


def test_dots_are_those_of_the_angles():
    at = seen_at(5)[0]
    for x, y in zip(of_dots(at.sin_i, at.sin_o, at.cos_io), at, strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-9)


def seen_at(seed):
    """A thousand directions: what a model is given, their angles and dot products."""
    rng = np.random.default_rng(seed)
    theta_i, theta_o = rng.uniform(-1.5, 1.5, (2, 1000))
    angles = theta_i, theta_o, rng.uniform(-3, 3, 1000)
    at = of_angles(*map(jnp.asarray, angles))
    return at, angles, [np.asarray(x) for x in (at.sin_i, at.sin_o, at.cos_io)]


def of_all(values):
    return [np.broadcast_to(x, (1000, *np.shape(x))) for x in values]


@pytest.mark.parametrize("tier", realtime.TIERS)
@pytest.mark.parametrize("rest", [False, True])
def test_a_shader_is_what_its_tier_evaluates(tier, rest):
    _, angles, dots = seen_at(6)
    fiber = Fiber(1.5, 0.2, 0.3, -0.03, (0.1, 0.2, 0.4))
    expected = realtime.evaluate(tier, fiber, *angles, rest=rest)
    values = of_all(getattr(fiber, x) for x in shader.Material.__annotations__)
    found = exact(f"{tier}_rest" if rest else tier)(values, dots)
    # Constants of a shader are those of single precision.
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-9)


def test_the_artists_shader_is_what_shade_evaluates():
    _, angles, dots = seen_at(7)
    chosen = artist.Artist(jnp.asarray((0.6, 0.4, 0.2)), 0.5, 0.4, 0.7, 0.05)
    expected = artist.shade(chosen, *angles, shadow=0.3)
    found = exact("karis2016_artist")(of_all((*chosen, 0.3)), dots)
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_the_counts_of_the_readme():
    text = (FITS.parent / "README.md").read_text()
    for tier, cost in COSTS.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| `{tier}`"))
        cells = (f"{x['special']} + {x['other']}" for x in cost.values())
        assert row.endswith(f"| {' | '.join(cells)} |")
