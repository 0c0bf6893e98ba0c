"""Shader source of the real-time approximations, and the operations it takes.

Exact: `fiberjax.realtime.evaluate` and `fiberjax.artist.shade`, the JAX functions.
Written: each of `fiberjax.shader.SHADERS` in HLSL, GLSL and WGSL; the operations of
each for `fiberjax.realtime.cost`, in the machine code of a GPU where the packages of
`pip install '.[assembly]'` are, in optimized SPIR-V where glslangValidator, spirv-opt
and spirv-dis are. What cannot be counted stays as it was. The heads of the files say
what quality.json does, which fits/quality.py writes.
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
QUALITY = Path(__file__).parent / "quality.json"
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


def measured(
    cost: dict[str, dict[str, int]], worth: dict[str, Any] | None
) -> list[str]:
    """Lines for the head of a file: its operations, and what quality.json says."""
    gpu, general = cost["assembly"], cost["spirv"]
    lines = [
        f"hair_bsdf_hoisted takes {gpu['special']} special operations "
        f"(exp, rsqrt, ...) and {gpu['other']}",
        f"others in the code of a GPU, {assembly.ARCHITECTURE}, a fused "
        f"multiply-add as one; {general['special']} and",
        f"{general['other']} in SPIR-V, nothing fused.",
    ]
    if worth is None:
        return lines
    usual, unseen, clear = worth["path"]["theta_t"], worth["unseen"], worth["furnace"]
    return [
        f"R + TT + TRT is off by {usual['mean']['S']} of S, relative L2 over both "
        "directions, mean over",
        f"four colors and beta = .09, .25, .49, at most {usual['max']['S']}; "
        f"{unseen['rough']['mean']['S']} on other fibers, at",
        f"most {unseen['rough']['max']['S']}. Furnace, the same beta and beta_n .05, "
        "eta 1.55, tilts to",
        f"2.5 degrees: albedo off by at most {clear['error']['0 to 90']['max']}, "
        f"{abs(clear['above'])} {'above' if clear['above'] > 0 else 'below'} "
        "max(1, exact) at the most.",
        *lines,
    ]


def files(costs: dict[str, Any]) -> dict[str, str]:
    """The text of every shader by the name of its file."""
    texts, quality = {}, json.loads(QUALITY.read_text())
    for tier, language in product(shader.SHADERS, LANGUAGES):
        lines = measured(costs[tier], quality.get(tier.removesuffix("_rest")))
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
