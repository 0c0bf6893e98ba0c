"""The fibers by which approximations of the whole model are fitted and judged."""

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
ROUGH = {f"r {r}": (r * r, r * r) for r in (0.3, 0.5, 0.7)}
"""beta_m and beta_n."""

LOW = {"low": (0.09, 0.05)}


def fiber(color: Any, widths: tuple[float, float], alpha: float = 0.0) -> Fiber:
    """The fiber of a color C: sigma_a = -ln(C)/4."""
    return Fiber(ETA, *widths, alpha, -jnp.log(jnp.asarray(color)) / PASS)
