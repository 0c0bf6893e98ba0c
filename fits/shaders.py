"""Shader source of the real-time approximations, and the operations it takes.

Exact: `fiberjax.realtime.evaluate` and `fiberjax.artist.shade`, the JAX functions.
Written: each of `fiberjax.shader.SHADERS` in HLSL, GLSL and WGSL; the operations of
each for `fiberjax.realtime.cost`, in the machine code of a GPU where the packages of
`pip install '.[assembly]'` are, in optimized SPIR-V where glslangValidator, spirv-opt
and spirv-dis are. What cannot be counted stays as it was.
"""

import argparse
import json
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

from shared import assembly, spirv
from shared.report import progress, save

from fiberjax import realtime, shader
from fiberjax.emission import emitted
from fiberjax.languages import LANGUAGES

SHADERS = Path(__file__).parent / "shaders"
COUNTERS: dict[str, Any] = {"assembly": assembly, "spirv": spirv}


def counted(before: dict[str, Any]) -> dict[str, Any]:
    """The operations of every shader by every counter, as before where it is missing.

    SystemExit if there is nothing to keep.
    """
    found: dict[str, Any] = {tier: {} for tier in shader.SHADERS}
    for name, counter in COUNTERS.items():
        absent = ", ".join(counter.missing())
        if absent:
            print(f"{absent}: not found; operations in {name} are not counted again")
        for tier, costs in found.items():
            if not absent:
                progress(f"operations of {tier} in {name}")
                text = emitted(shader.program(tier), counter.LANGUAGE)
                costs[name] = counter.operations(text)._asdict()
            elif name in before.get(tier, {}):
                costs[name] = before[tier][name]
            else:
                raise SystemExit(f"{tier}: its operations in {name} were never counted")
    progress("")
    return found


def files(costs: dict[str, Any]) -> dict[str, str]:
    """The text of every shader by the name of its file."""
    texts = {}
    for tier, language in product(shader.SHADERS, LANGUAGES):
        gpu, general = costs[tier]["assembly"], costs[tier]["spirv"]
        lines = [
            f"hair_bsdf_hoisted takes {gpu['special']} special operations "
            f"(exp, rsqrt, ...) and {gpu['other']}",
            f"others in the code of a GPU, {assembly.ARCHITECTURE}, a fused "
            f"multiply-add as one; {general['special']} and",
            f"{general['other']} in SPIR-V, nothing fused.",
        ]
        texts[f"{tier}.{language}"] = shader.source(tier, language, lines)
    return texts


def main(argv: Sequence[str] | None = None) -> None:
    """Count, write the files, print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for option, default, text in (
        ("--output", SHADERS, "where to write; fits/shaders"),
        ("--costs", realtime.COSTS, "file of operations; that of the package"),
    ):
        parser.add_argument(
            option, type=Path, default=default, metavar="PATH", help=text
        )
    options = parser.parse_args(argv)
    costs = counted(json.loads(realtime.COSTS.read_text()))
    save(options.costs, costs)
    options.output.mkdir(parents=True, exist_ok=True)
    for name, text in files(costs).items():
        (options.output / name).write_text(text)
    print(f"{'special + other':20}{assembly.ARCHITECTURE:>12}{'SPIR-V':>12}")
    for tier, cost in costs.items():
        cells = (f"{x['special']} + {x['other']}" for x in cost.values())
        print(f"{tier:20}" + "".join(f"{cell:>12}" for cell in cells))


if __name__ == "__main__":
    main()
