"""The scripts and the constants of the fits."""

import json
import sys
from importlib import import_module
from types import ModuleType
from typing import Any, NamedTuple

from shared.style import BLUE, FIGURES, GREEN, VERMILION

FITS = FIGURES.parent / "fits"


class Look(NamedTuple):
    """Color and name of a set of constants."""

    color: str
    name: str


LOOKS = {
    "published": Look(VERMILION, "published"),
    "least_squares": Look(GREEN, "least squares"),
    "minimax": Look(BLUE, "minimax"),
}


def script(name: str) -> ModuleType:
    """A module of fits/: the definition of the form, what it stands for, its error."""
    if str(FITS) not in sys.path:
        sys.path.append(str(FITS))
    return import_module(name)


def entry(name: str) -> dict[str, Any]:
    """What the script wrote to fits/constants."""
    return json.loads((FITS / "constants" / f"{name}.json").read_text())


def constants(name: str) -> dict[str, Any]:
    """The sets of constants of a fit."""
    read, kind = entry(name), script(name).Constants
    sets = {"published": read["published"], **read["constants"]}
    return {which: kind(**sets[which]) for which in LOOKS}
