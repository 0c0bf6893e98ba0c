"""Operations of a shader, counted in optimized SPIR-V."""

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fiberjax.languages import LANGUAGES
from fiberjax.realtime import Cost

LANGUAGE = LANGUAGES["glsl"]
TOOLS = ("glslangValidator", "spirv-opt", "spirv-dis")

# One vec3 in, nothing of the constants known: all that follows directions is left.
MAIN = """
layout(location = 0) in vec3 L;
layout(location = 1) in vec3 V;
layout(location = 2) in vec3 T;
layout(binding = 0) uniform Block { HairConstants hair; };
layout(location = 0) out vec3 result;

void main() { result = hair_bsdf_hoisted(hair, L, V, T); }
"""

_ONE_SPECIAL = "Exp Exp2 Log Log2 Sqrt InverseSqrt Sin Cos"
_ONE_OTHER = """
FAdd FSub FMul VectorTimesScalar FMin FMax NMin NMax FSign Select LogicalAnd LogicalOr
LogicalNot FOrdEqual FOrdNotEqual FUnordNotEqual FOrdLessThan FOrdGreaterThan
FOrdLessThanEqual FOrdGreaterThanEqual
"""
_FREE = (
    "FAbs FNegate CompositeConstruct CompositeExtract VectorShuffle Load AccessChain"
)
PRICES = {
    **dict.fromkeys(_ONE_SPECIAL.split(), (1, 0)),
    **dict.fromkeys(_ONE_OTHER.split(), (0, 1)),
    **dict.fromkeys(_FREE.split(), (0, 0)),
    **dict.fromkeys(("FClamp", "NClamp", "Fma"), (0, 2)),
    "FDiv": (1, 1),
    "Pow": (2, 1),
    "Tanh": (2, 4),
}
"""Special-function and other operations of an instruction, for each component."""


def missing() -> list[str]:
    """The tools that are not there."""
    return [tool for tool in TOOLS if not shutil.which(tool)]


def run(*command: str | Path) -> str:
    """What the command prints; RuntimeError with that, if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[0]}: {done.stdout}{done.stderr}")
    return done.stdout


def disassembled(source: str) -> str:
    """Optimized SPIR-V of `hair_bsdf_hoisted` in GLSL, disassembled."""
    with tempfile.TemporaryDirectory() as directory:
        shader, code = Path(directory, "hair.frag"), Path(directory, "hair.spv")
        shader.write_text("#version 450\n" + source + MAIN)
        run("glslangValidator", "-V", shader, "-o", code)
        run("spirv-opt", "-O", code, "-o", code)
        return run("spirv-dis", "--no-color", code)


def instructions(text: str) -> Iterator[tuple[str, int]]:
    """Name and components of each that makes a value within a function."""
    sizes = {
        name: int(size)
        for name, size in re.findall(r"(%\S+) = OpTypeVector %\S+ (\d)", text)
    }
    _, body = text.split("OpFunction ", 1)
    found = re.findall(r"= Op(\w+) (%\S+)(?: %\S+ ([A-Z]\w+))?", body)
    for name, kind, extended in found:
        yield (extended if name == "ExtInst" else name), sizes.get(kind, 1)


def operations(source: str) -> Cost:
    """Those of one color from constants of the material and three directions.

    Counted in optimized SPIR-V, per component. Special: exp, exp2, log, log2, sqrt,
    rsqrt, sin, cos, and the reciprocal of a division; a power is two, and so is tanh,
    an exp and a division. Other: additions, multiplications, min, max, comparisons and
    selections are one; a clamp is two, a dot product of three components five, and a
    division has its multiplication here, as has a power. What a GPU may fuse is not.
    Signs, absolute values and moves are free.

    Args:
        source: GLSL that defines `hair_bsdf_hoisted`.

    Raises:
        RuntimeError: a tool is missing or fails, or an instruction has no price.
    """
    if missing():
        raise RuntimeError(f"{', '.join(missing())}: not found")
    special = other = 0
    for name, size in instructions(disassembled(source)):
        if name == "Dot":
            other += 5
        elif name in PRICES:
            special += PRICES[name][0] * size
            other += PRICES[name][1] * size
        elif name != "Label":
            raise RuntimeError(f"{name}: an instruction without a price")
    return Cost(special, other)
