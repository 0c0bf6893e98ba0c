"""Operations of every shader, by every counter there is."""

from typing import Any

from shared import assembly, spirv
from shared.report import progress

from fiberjax import shader
from fiberjax.emission import emitted

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
