"""Operations of a shader, counted in the machine code of a GPU.

The shader, emitted as HLSL with a head that gives CUDA the vectors of HLSL, is
compiled by NVRTC and disassembled by nvdisasm. They come with
`pip install '.[assembly]'` and need no GPU.
"""

import ctypes
import re
import subprocess
import tempfile
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

from fiberjax.languages import LANGUAGES
from fiberjax.realtime import Cost

# Of two structs ?: would choose an address before they are loaded.
LANGUAGE = LANGUAGES["hlsl"]._replace(select="select({0}, {1}, {2})")
ARCHITECTURE = "sm_86"
PACKAGES = {
    "nvidia-cuda-nvrtc": r"libnvrtc\.so\.\d+",
    "nvidia-cuda-nvdisasm": "nvdisasm",
}
"""The file of each package that is used."""

# Functions of single numbers are CUDA's own.
HEAD = """
struct Float3 {
    float x, y, z;
    Float3() {}
    Float3(float a) : x(a), y(a), z(a) {}
    Float3(float x, float y, float z) : x(x), y(y), z(z) {}
};
#define float3 Float3
#define OPERATOR(sign) float3 operator sign(float3 a, float3 b) { \\
    return float3(a.x sign b.x, a.y sign b.y, a.z sign b.z); }
OPERATOR(+) OPERATOR(-) OPERATOR(*) OPERATOR(/)
float3 operator-(float3 a) { return float3(-a.x, -a.y, -a.z); }
float dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float clamp(float x, float low, float high) { return min(max(x, low), high); }
float sign(float x) { return x == 0.0f ? 0.0f : copysign(1.0f, x); }
float select(bool condition, float a, float b) { return condition ? a : b; }
#define OF_ONE(f) float3 f(float3 a) { return float3(f(a.x), f(a.y), f(a.z)); }
OF_ONE(abs) OF_ONE(sign) OF_ONE(sqrt) OF_ONE(rsqrt) OF_ONE(exp) OF_ONE(exp2)
OF_ONE(log) OF_ONE(sin) OF_ONE(cos) OF_ONE(tanh)
#define OF_TWO(f) float3 f(float3 a, float3 b) { \\
    return float3(f(a.x, b.x), f(a.y, b.y), f(a.z, b.z)); }
OF_TWO(min) OF_TWO(max) OF_TWO(pow)
float3 clamp(float3 x, float3 low, float3 high) { return min(max(x, low), high); }
float3 select(bool condition, float3 a, float3 b) {
    return float3(
        condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z);
}
"""

# Without an index of the thread there is no arithmetic but that of the shader; across
# the barrier no load moves to where a condition needs it, in place of a selection.
MAIN = """
extern "C" __global__ void shade(
    const HairConstants *constants, const float3 *directions, float3 *result) {
    HairConstants hair = *constants;
    float3 L = directions[0], V = directions[1], T = directions[2];
    __syncthreads();
    *result = hair_bsdf_hoisted(hair, L, V, T);
}
"""

_OTHER = "FADD FMUL FFMA FMNMX FSEL FSET FSETP SEL LOP3 PLOP3"
_FREE = "MOV IMAD.MOV UMOV LDG STG LDC ULDC BAR BRA BSSY BSYNC EXIT NOP"
PRICES = {
    "MUFU": (1, 0),
    **dict.fromkeys(_OTHER.split(), (0, 1)),
    **dict.fromkeys(_FREE.split(), (0, 0)),
}
"""Special-function and other operations of an instruction."""


def _file(package: str) -> Path | None:
    """The file of the package that is used."""
    try:
        found = files(package) or ()
    except PackageNotFoundError:
        return None
    named = (x for x in found if re.fullmatch(PACKAGES[package], x.name))
    return next((Path(str(x.locate())) for x in named), None)


def missing() -> list[str]:
    """The packages that are not there."""
    return [package for package in PACKAGES if not _file(package)]


def cuda(source: str) -> str:
    """HLSL as CUDA, in which a constant is of double precision unless it says so."""
    code = re.sub("//.*", "", source)
    number = r"\b\d+(\.\d+(e[-+]?\d+)?|e[-+]?\d+)"
    return HEAD + re.sub(number, r"\g<0>f", code) + MAIN


def compiled(text: str) -> bytes:
    """Machine code of CUDA; RuntimeError with what NVRTC says, if it fails."""
    nvrtc = ctypes.CDLL(str(_file("nvidia-cuda-nvrtc")))
    program = ctypes.c_void_p()

    def call(name: str, *args) -> int:
        return getattr(nvrtc, f"nvrtc{name}")(*args)

    def got(name: str) -> bytes:
        size = ctypes.c_size_t()
        call(f"Get{name}Size", program, ctypes.byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        call(f"Get{name}", program, buffer)
        return buffer.raw

    options = [
        f"--gpu-architecture={ARCHITECTURE}",
        # As shaders are compiled: fused, without denormal numbers, and with what the
        # special-function unit has for division, roots, exp and log.
        "--use_fast_math",
        "--device-as-default-execution-space",
    ]
    given = (ctypes.c_char_p * len(options))(*map(str.encode, options))
    begin = ctypes.byref(program), text.encode(), b"hair.cu", 0, None, None
    if call("CreateProgram", *begin):
        raise RuntimeError("NVRTC: no program can be created")
    try:
        if call("CompileProgram", program, len(options), given):
            raise RuntimeError(f"NVRTC: {got('ProgramLog').decode()}")
        return got("CUBIN")
    finally:
        call("DestroyProgram", ctypes.byref(program))


def disassembled(code: bytes) -> str:
    """The instructions of machine code; RuntimeError with what nvdisasm says."""
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory, "hair.cubin")
        file.write_bytes(code)
        command = [str(_file("nvidia-cuda-nvdisasm")), "-c", file]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"nvdisasm: {done.stdout}{done.stderr}")
    return done.stdout


def instructions(text: str) -> Iterator[str]:
    """Name of each, with the first of its modifiers if the two have a price."""
    line = r"/\*[0-9a-f]{4,}\*/\s+(?:@!?U?P\w+\s+)?([A-Z]\w*)(\.\w+)?"
    for name, modifier in re.findall(line, text):
        yield name + modifier if name + modifier in PRICES else name


def operations(source: str) -> Cost:
    """Those of one color from constants of the material and three directions.

    Counted in the instructions of one thread of NVIDIA's sm_86, which has none that
    many threads share; both sides of a branch. Special: MUFU, that is reciprocal, sqrt,
    rsqrt, exp2, log2, sine, cosine and tanh. Other: additions, multiplications, fused
    multiply-adds, min, max, comparisons, selections and logic, each as one. Signs,
    absolute values and clamps to [0, 1] within an instruction are free, and so are
    moves, loads and stores. exp and log have the multiplication that turns them into
    exp2 and log2.

    Args:
        source: what `LANGUAGE` makes of `hair_bsdf_hoisted`.

    Raises:
        RuntimeError: a package is missing, a tool fails, or an instruction has no
            price.
    """
    if missing():
        raise RuntimeError(f"{', '.join(missing())}: not found")
    special = other = 0
    for name in instructions(disassembled(compiled(cuda(source)))):
        if name not in PRICES:
            raise RuntimeError(f"{name}: an instruction without a price")
        special += PRICES[name][0]
        other += PRICES[name][1]
    return Cost(special, other)
