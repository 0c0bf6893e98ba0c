"""The fibers by which approximations of the whole model are fitted and judged."""

from collections.abc import Mapping
from itertools import product
from typing import Any

import jax.numpy as jnp

from fiberjax.fiber import Fiber
from fiberjax.shading import PASS

ETA = 1.55
COLORS = {
    "black": (0.015, 0.012, 0.010),
    "brown": (0.16, 0.07, 0.03),
    "blond": (0.65, 0.45, 0.22),
    "white": (0.95, 0.95, 0.95),
}
CLEAR = (1.0, 1.0, 1.0)


def _rough(*roughness: float) -> dict[str, tuple[float, float]]:
    return {f"r {r}": (r * r, r * r) for r in roughness}


ROUGH = _rough(0.3, 0.5, 0.7)
"""beta_m and beta_n."""

LOW = {"low": (0.09, 0.05)}

UNSEEN_COLORS = {
    "auburn": (0.35, 0.12, 0.04),
    "ash": (0.5, 0.5, 0.45),
    "red": (0.6, 0.2, 0.05),
    "dark": (0.05, 0.03, 0.02),
}
UNSEEN_ROUGH = _rough(0.35, 0.45, 0.55)
MIXED = {"mixed": (0.12, 0.3)}
UNSEEN_ETA = 1.46, 1.52, 1.58, 1.64
"""What nothing is fitted to."""


def fiber(
    color: Any, widths: tuple[float, float], alpha: float = 0.0, eta: float = ETA
) -> Fiber:
    """The fiber of a color C: sigma_a = -ln(C)/4."""
    return Fiber(eta, *widths, alpha, -jnp.log(jnp.asarray(color)) / PASS)


def fibers(
    colors: Mapping[str, Any],
    widths: Mapping[str, tuple[float, float]],
    alpha: float = 0.0,
    eta: float = ETA,
) -> dict[str, Fiber]:
    """Every width with every color, by their names."""
    return {
        f"{width}, {color}": fiber(C, beta, alpha, eta)
        for (width, beta), (color, C) in product(widths.items(), colors.items())
    }
