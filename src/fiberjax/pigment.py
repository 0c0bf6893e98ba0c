"""Absorption from what artists set: melanin, or the color of hair that is lit all over.

Both are per fiber radius, as `Fiber.sigma_a` is.
"""

import jax.numpy as jnp

from fiberjax._types import Floats, Reals, choice, floats
from fiberjax.numerics import power_series, sqrt

TABLES: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "pbrt": ((0.419, 0.697, 1.37), (0.187, 0.4, 1.05)),
    "cycles": ((0.506, 0.841, 1.653), (0.343, 0.733, 1.924)),
}
"""Absorption of a unit of eumelanin and of pheomelanin in red, green and blue."""

_FIT = (5.969, -0.215, 2.532, -10.73, 5.574, 0.245)
"""Powers of the azimuthal roughness, Chiang et al. 2016, eq. 9."""

_LEAST_CLEAR = 1e-4
"""What Cycles leaves of 1 - melanin at least."""


def melanin(eumelanin: Reals, pheomelanin: Reals, *, table: str = "pbrt") -> Floats:
    """Absorption of a fiber with two pigments: sigma_a = c_e s_e + c_p s_p.

    | table | s_e | s_p | source |
    |---|---|---|---|
    | pbrt | 0.419, 0.697, 1.37 | 0.187, 0.4, 1.05 | pbrt-v4, after d'Eon et al. 2011 |
    | cycles | 0.506, 0.841, 1.653 | 0.343, 0.733, 1.924 | Blender's hair node |

    Args:
        eumelanin: concentration c_e >= 0 of the brown pigment; 0.3 is blond, 1.3 brown,
            8 black.
        pheomelanin: concentration c_p >= 0 of the red pigment.
        table: "pbrt" (the default) or "cycles".

    Returns:
        sigma_a per radius in red, green and blue, shape broadcast(concentrations) +
        (3,).

    Raises:
        ValueError: no such table.
    """
    choice("table", table, tuple(TABLES))
    brown, red = floats((eumelanin, pheomelanin))
    of_brown, of_red = (jnp.asarray(s, brown.dtype) for s in TABLES[table])
    return brown[..., None] * of_brown + red[..., None] * of_red


def concentrations(melanin: Reals, redness: Reals) -> tuple[Floats, Floats]:
    """Concentrations of both pigments from Cycles' two sliders.

    q = -log(max(1 - melanin, 1e-4)), c_e = q (1 - redness), c_p = q redness; the
    logarithm is log1p, so that little melanin keeps its digits. Above 0.9999 more
    melanin changes nothing and its derivative is 0.

    Args:
        melanin: amount in [0, 1].
        redness: share of pheomelanin in [0, 1].

    Returns:
        (c_e, c_p), for `melanin` with table "cycles".

    Reference: Cycles, Principled Hair BSDF.
    """
    amount, share = floats((melanin, redness))
    full = amount > 1 - _LEAST_CLEAR
    quantity = -jnp.log1p(-jnp.where(full, 1 - _LEAST_CLEAR, amount))
    return quantity * (1 - share), quantity * share


def _slope(b: Floats) -> Floats:
    return power_series(_FIT, b)


def chiang_sigma_a(color: Reals, b: Reals) -> Floats:
    """Absorption of hair that looks of this color: sigma_a = (log C/d(b))^2.

    d = 5.969 - 0.215 b + 2.532 b^2 - 10.73 b^3 + 5.574 b^4 + 0.245 b^5, a fit to the
    multiple scattering albedo of white-lit hair.

    Args:
        color: albedo C in (0, 1] of each channel; black, 0, is infinite absorption.
        b: azimuthal roughness, perceptual, in [0, 1]. Broadcasts with the color.

    Returns:
        sigma_a per radius, in the dtype of the color. Its derivative is 0 at C = 1.

    Reference: Chiang et al. 2016, eq. 9.
    """
    color, b = floats((color,), (b,))
    ratio = jnp.log(color) / _slope(b)
    return ratio * ratio


def chiang_color(sigma_a: Reals, b: Reals) -> Floats:
    """The color that `chiang_sigma_a` takes: C = exp(-d(b) sqrt(sigma_a)).

    Args:
        sigma_a: absorption per radius, >= 0.
        b: azimuthal roughness, perceptual, in [0, 1]. Broadcasts with sigma_a.

    Returns:
        C in [0, 1]. At sigma_a = 0, where dC/dsigma_a is infinite, 0 stands for it.
    """
    sigma_a, b = floats((sigma_a,), (b,))
    return jnp.exp(-_slope(b) * sqrt(sigma_a))
