"""What converters share: clamps, checks of numbers, and what a system can represent."""

from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from fiberjax._types import Floats, Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.pigment import chiang_sigma_a

Numbers: TypeAlias = Reals | tuple[Any, ...]
"""Reals, or a tuple of them: a color, most often."""

WIDTHS = (1.0, 0.5, 2.0)
"""Factors of beta_m for R, TT, TRT and what follows, Marschner et al. 2003."""

TILTS = (2.0, -1.0, -4.0, 0.0)
"""Factors of alpha, d'Eon et al. 2013."""

ETA = 1.55
"""The index of refraction of systems that have no other."""

_SAME = 1e-5
"""Numbers that agree to this, relative to the larger of 1 and themselves, are equal."""


def clamp(x: Numbers, low: float, high: float = np.inf) -> Floats:
    """The nearest number in [low, high]; the derivative is 1 there and 0 beyond."""
    (x,) = floats((x,))
    return jnp.where(x < low, low, jnp.where(x > high, high, x))


def known(*values: Any) -> bool:
    """Whether the numbers can be looked at: not while JAX traces."""
    return not any(isinstance(x, Tracer) for x in jax.tree.leaves(values))


def within(name: str, value: Any, low: float, high: float, *, open_low=False) -> None:
    """ValueError unless every number that is known lies in [low, high]."""
    if value is None or not known(value):
        return
    x = np.asarray(value, np.float64)
    inside = ((x > low) if open_low else (x >= low)) & (x <= high)
    if not inside.all():
        bad = x[~inside].flat[0]
        left = "(" if open_low else "["
        right = ")" if np.isinf(high) else "]"
        raise ValueError(f"{name} = {bad}: must lie in {left}{low:g}, {high:g}{right}")


def equal(name: str, value: Any, allowed: Any, lost: str) -> None:
    """ValueError saying what is lost unless the numbers, if known, are the allowed."""
    if not known(value, allowed):
        return
    x, y = np.broadcast_arrays(np.asarray(value, float), np.asarray(allowed, float))
    if not (abs(x - y) <= _SAME * np.maximum(1, abs(y))).all():
        raise ValueError(f"{name} = {np.asarray(value)}: must be {allowed}; {lost}")


def per_lobe(name: str, factors: Any, allowed: tuple[float, ...], lost: str) -> None:
    """`equal` for factors of which the last goes on."""

    def lobe(f: Any) -> Any:
        return [f[min(p, len(f) - 1)] for p in range(max(len(allowed), len(factors)))]

    if known(factors):
        equal(name, lobe(np.asarray(factors)), lobe(np.asarray(allowed)), lost)


def given(**ways: Any) -> str | None:
    """The way that is not None, if one is; ValueError if several are."""
    names = [name for name, way in ways.items() if way is not None]
    if len(names) > 1:
        raise ValueError(
            f"{' and '.join(names)} are given: must be one of {tuple(ways)}, "
            "each is an absorption of its own"
        )
    return names[0] if names else None


def required(**ways: Any) -> str:
    """The one way that is not None; ValueError if none or several are."""
    way = given(**ways)
    if way is None:
        raise ValueError(f"no absorption is given: must be one of {tuple(ways)}")
    return way


def of_color(name: str, color: Any, b: Reals, *, least: float = 0.0) -> Floats:
    """Chiang's absorption of a color, clamped to [least, 1]; ValueError if infinite."""
    if least == 0:
        within(name, color, 0, np.inf, open_low=True)
    return chiang_sigma_a(clamp(color, least, 1), b)


def rgb(fiber: Fiber) -> Floats:
    """sigma_a in three colors; ValueError if it has another number of them."""
    sigma_a = jnp.zeros_like(fiber.eta) if fiber.sigma_a is None else fiber.sigma_a
    if sigma_a.shape not in ((), (3,)):
        raise ValueError(
            f"sigma_a has shape {sigma_a.shape}: must be () or (3,), red, green and "
            "blue; other colors would be lost"
        )
    return jnp.broadcast_to(sigma_a, (3,))


def tilt(fiber: Fiber) -> Floats:
    """alpha in radians, 0 if there is none."""
    return jnp.zeros_like(fiber.eta) if fiber.alpha is None else fiber.alpha


def marschner(fiber: Fiber, system: str, *, widths=WIDTHS, tilts=TILTS) -> None:
    """ValueError unless the lobes of a fiber have the widths and tilts of a system."""
    own = f"the factors of {system} are fixed, others would be lost"
    per_lobe("widths_m", fiber.widths_m, widths, own)
    per_lobe("widths_n", fiber.widths_n, (1.0,), own)
    if fiber.alpha is not None:
        per_lobe("tilts", fiber.tilts, tilts, own)
