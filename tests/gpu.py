"""Shaders run on whatever Vulkan device there is, one invocation for each direction."""

import os
import shutil
import subprocess
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

SIZE = 64
DOTS = 3
REQUIRED = bool(os.environ.get("SHADERS_REQUIRED"))
"""Whether what is missing to run shaders is a failure: where it has been installed."""


def absent(reason: str) -> NoReturn:
    """Skips the test with the reason, or fails it."""
    if REQUIRED:
        pytest.fail(reason)
    pytest.skip(reason)


GLSL = """#version 450
{source}
layout(local_size_x = {size}) in;
layout(std430, binding = 0) readonly buffer Given {{ float given[]; }};
layout(std430, binding = 1) buffer Found {{ float found[]; }};

void main() {{
    uint k = gl_GlobalInvocationID.x * {stride}u;
    HairMaterial material;
{material}
    vec3 L = vec3({L}), V = vec3({V}), T = vec3({T});
    vec3 S = hair_bsdf(material, L, V, T);
{results}
}}
"""
HLSL = """{source}
[[vk::binding(0, 0)]] StructuredBuffer<float> given;
[[vk::binding(1, 0)]] RWStructuredBuffer<float> found;

[numthreads({size}, 1, 1)]
void main(uint3 id : SV_DispatchThreadID) {{
    uint k = id.x * {stride}u;
    HairMaterial material;
{material}
    float3 L = float3({L}), V = float3({V}), T = float3({T});
    float3 S = hair_bsdf(material, L, V, T);
{results}
}}
"""
WGSL = """{source}
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> found: array<f32>;

@compute @workgroup_size({size})
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let k = id.x * {stride}u;
    var material: HairMaterial;
{material}
    let L = vec3f({L});
    let V = vec3f({V});
    let T = vec3f({T});
    let S = hair_bsdf(material, L, V, T);
{results}
}}
"""
MAIN = {"glsl": GLSL, "hlsl": HLSL, "wgsl": WGSL}
COLOR = {"glsl": "vec3", "hlsl": "float3", "wgsl": "vec3f"}


def harness(language: str, source: str, sizes: dict[str, int]) -> str:
    """The source with an entry that calls it.

    Given are the fields of the material, of so many components, L, V and T; found are
    the color and the three dot products that the shader has made.
    """
    at, texts = 0, {}
    for name, size in (*sizes.items(), ("L", 3), ("V", 3), ("T", 3)):
        texts[name] = ", ".join(f"given[k + {at + i}u]" for i in range(size))
        at += size
    material = [
        f"    material.{name} = "
        + (f"{COLOR[language]}({texts[name]})" if size == 3 else texts[name])
        + ";"
        for name, size in sizes.items()
    ]
    values = ["S.x", "S.y", "S.z", "dot(T, L)", "dot(T, V)", "dot(L, V)"]
    place = {"wgsl": "id.x", "hlsl": "id.x", "glsl": "gl_GlobalInvocationID.x"}
    results = [
        f"    found[{place[language]} * 6u + {i}u] = {value};"
        for i, value in enumerate(values)
    ]
    return MAIN[language].format(
        source=source,
        size=SIZE,
        stride=at,
        material="\n".join(material),
        results="\n".join(results),
        **{name: texts[name] for name in "LVT"},
    )


def spirv(language: str, text: str, directory: Path) -> bytes:
    """What glslangValidator makes of HLSL or GLSL; fails the test if nothing."""
    shader, code = directory / f"hair.{language}", directory / "hair.spv"
    shader.write_text(text)
    options = ["-D"] if language == "hlsl" else []
    command = ["glslangValidator", *options, "-V", "-S", "comp", "-e", "main"]
    done = subprocess.run(
        [*command, "--target-env", "vulkan1.1", shader, "-o", code],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return code.read_bytes()


def device() -> Any:
    """A Vulkan device; skips the test with the reason if there is none."""
    try:
        wgpu: Any = import_module("wgpu")
    except ImportError:
        absent("no wgpu: pip install '.[shader]'")
    os.environ.setdefault("XDG_RUNTIME_DIR", "/tmp")
    found = wgpu.gpu.enumerate_adapters_sync()
    vulkan = [x for x in found if x.info["backend_type"] == "Vulkan"]
    if not vulkan:
        absent("no Vulkan device: `make shader-deps` installs one")
    return vulkan[0].request_device_sync()


def need_glslang() -> None:
    """Skips the test with the reason if HLSL and GLSL cannot be compiled."""
    if not shutil.which("glslangValidator"):
        absent("no glslangValidator: `make shader-deps` installs it")


def run(device: Any, code: str | bytes, given: np.ndarray) -> np.ndarray:
    """What the shader finds for each row of what is given."""
    count = -(-len(given) // SIZE) * SIZE
    rows = np.concatenate([given, np.repeat(given[-1:], count - len(given), 0)])
    rows = np.ascontiguousarray(rows, np.float32)
    usage = {"STORAGE": 0x80, "COPY_SRC": 0x4}
    source = device.create_buffer_with_data(data=rows, usage=usage["STORAGE"])
    size = count * 6 * 4
    target = device.create_buffer(size=size, usage=sum(usage.values()))
    module = device.create_shader_module(code=code)
    pipeline = device.create_compute_pipeline(
        layout="auto", compute={"module": module, "entry_point": "main"}
    )
    group = device.create_bind_group(
        layout=pipeline.get_bind_group_layout(0),
        entries=[
            {"binding": k, "resource": {"buffer": buffer}}
            for k, buffer in enumerate((source, target))
        ],
    )
    encoder = device.create_command_encoder()
    step = encoder.begin_compute_pass()
    step.set_pipeline(pipeline)
    step.set_bind_group(0, group)
    step.dispatch_workgroups(count // SIZE)
    step.end()
    device.queue.submit([encoder.finish()])
    found = np.frombuffer(device.queue.read_buffer(target), np.float32)
    return found.reshape(count, 6)[: len(given)]
