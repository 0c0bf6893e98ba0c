"""Shader source of the real-time approximations, and the operations it takes.

Exact: `fiberjax.realtime.evaluate` and `fiberjax.artist.shade`, the JAX functions.
Written: each of `fiberjax.shader.SHADERS` in HLSL, GLSL and WGSL; the operations of
each for `fiberjax.realtime.cost`, in the machine code of a GPU where the packages of
`pip install '.[assembly]'` are, in optimized SPIR-V where glslangValidator, spirv-opt
and spirv-dis are. What cannot be counted stays as it was. The heads of the files say
what quality.json and constants/tail.json do, which fits/quality.py and fits/tail.py
write.
"""

import argparse
import json
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

from shared.assembly import ARCHITECTURE
from shared.counting import counted
from shared.report import CONSTANTS, save

from fiberjax import realtime, shader
from fiberjax.languages import LANGUAGES

SHADERS = Path(__file__).parent / "shaders"
QUALITY = Path(__file__).parent / "quality.json"
TAIL = CONSTANTS / "tail.json"


def operations(cost: dict[str, dict[str, int]]) -> list[str]:
    """Lines for the head of a file: what it takes."""
    gpu, general = cost["assembly"], cost["spirv"]
    return [
        f"hair_bsdf_hoisted takes {gpu['special']} special operations "
        f"(exp, rsqrt, ...) and {gpu['other']}",
        f"others in the code of a GPU, {ARCHITECTURE}, a fused "
        f"multiply-add as one; {general['special']} and",
        f"{general['other']} in SPIR-V, nothing fused.",
    ]


def errors(worth: dict[str, Any]) -> list[str]:
    """What quality.json says of R + TT + TRT."""
    usual, unseen, clear = worth["path"]["theta_t"], worth["unseen"], worth["furnace"]
    return [
        f"R + TT + TRT is off by {usual['mean']['S']} of S, relative L2 over both "
        "directions, mean over",
        f"four colors and beta = .09, .25, .49, at most {usual['max']['S']}; "
        f"{unseen['rough']['mean']['S']} on fibers that",
        f"nothing was fitted to, at most {unseen['rough']['max']['S']}. Furnace, the "
        "same beta and beta_n .05,",
        "eta 1.55, tilts to 2.5 degrees: albedo off by at most "
        f"{clear['error']['0 to 90']['max']}, {abs(clear['above'])}",
        f"{'above' if clear['above'] > 0 else 'below'} max(1, exact) at the most.",
    ]


def errors_of_rest(unseen: dict[str, float]) -> list[str]:
    """What tail.json says of the rest by itself."""
    return [
        f"The rest itself is off by {unseen['relative L2']} in L2, mean over fibers "
        "that nothing was",
        f"fitted to, at most {unseen['largest']}; its albedo by at most "
        f"{unseen['albedo']} to 89 degrees.",
    ]


def files(costs: dict[str, Any]) -> dict[str, str]:
    """The text of every shader by the name of its file."""
    texts, quality = {}, json.loads(QUALITY.read_text())
    rest = errors_of_rest(json.loads(TAIL.read_text())["unseen"])
    for tier, language in product(shader.SHADERS, LANGUAGES):
        # The lobes of the artist's are those of the tier without a suffix.
        lines = errors(quality[tier.split("_")[0]])
        lines += [*(rest if tier.endswith("_rest") else ()), *operations(costs[tier])]
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
    print(f"{'special + other':20}{ARCHITECTURE:>12}{'SPIR-V':>12}")
    for tier, cost in costs.items():
        cells = (f"{x['special']} + {x['other']}" for x in cost.values())
        print(f"{tier:20}" + "".join(f"{cell:>12}" for cell in cells))


if __name__ == "__main__":
    main()
