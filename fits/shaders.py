"""Shader source of the real-time approximations, and the operations it takes.

Exact: `fiberjax.realtime.evaluate` and `fiberjax.artist.shade`, the JAX functions.
Written: each of `fiberjax.shader.SHADERS` in HLSL, GLSL and WGSL; the operations of
each in optimized SPIR-V, for `fiberjax.realtime.cost`, where glslangValidator,
spirv-opt and spirv-dis are installed.
"""

import argparse
import json
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from shared.operations import missing, operations
from shared.report import progress, save

from fiberjax import realtime, shader
from fiberjax.languages import LANGUAGES

SHADERS = Path(__file__).parent / "shaders"


def counted() -> dict[str, dict[str, int]]:
    """The operations of every shader."""
    found = {}
    for tier in shader.SHADERS:
        progress(f"operations of {tier}")
        found[tier] = operations(shader.source(tier, "glsl"))._asdict()
    progress("")
    return found


def files(costs: dict[str, dict[str, int]]) -> dict[str, str]:
    """The text of every shader by the name of its file."""
    texts = {}
    for tier, language in product(shader.SHADERS, LANGUAGES):
        measured = [
            "hair_bsdf_hoisted takes {special} operations of a special-function unit",
            "(exp, rsqrt, ...) and {other} others, counted in SPIR-V, nothing fused.",
        ]
        lines = [line.format(**costs[tier]) for line in measured]
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
    absent = missing()
    costs = json.loads(realtime.COSTS.read_text()) if absent else counted()
    if absent:
        print(f"{', '.join(absent)}: not found; operations are not counted again")
    else:
        save(options.costs, costs)
    options.output.mkdir(parents=True, exist_ok=True)
    for name, text in files(costs).items():
        (options.output / name).write_text(text)
    for tier, cost in costs.items():
        print(f"{tier}: {cost['special']} special, {cost['other']} other operations")


if __name__ == "__main__":
    main()
