"""What converters share: clamps, checks of numbers, and what a system can represent."""

from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from fiberjax import perceptual
from fiberjax._types import Floats, Reals, floats
from fiberjax.fiber import Fiber, cast
from fiberjax.pigment import chiang_sigma_a

Numbers: TypeAlias = Reals | tuple[Any, ...]
"""Reals, or a tuple of them: a color, most often."""

WIDTHS = (1.0, 0.5, 2.0)
"""Factors of beta_m for R, TT, TRT and what follows, Marschner et al. 2003."""

TILTS = (2.0, -1.0, -4.0, 0.0)
"""Factors of alpha, d'Eon et al. 2013."""

CUTICLE_TILTS = (2.0, -1.0, -3.0, 0.0)
"""The same of lobes at -c, c/2 and 3 c/2 in theta_h, Marschner et al. 2003."""

ETA = 1.55
"""The index of refraction of systems that have no other."""

_SAME = 1e-5
"""Numbers that agree to this, relative to the larger of 1 and themselves, are equal."""

P = ParamSpec("P")


def in_their_dtype(converter: Callable[P, Fiber]) -> Callable[P, Fiber]:
    """A converter whose numbers, and whose fiber, all have the dtype of those given."""

    @wraps(converter)
    def cast_converter(*args: P.args, **kwargs: P.kwargs) -> Fiber:
        given = jax.tree.leaves((args, kwargs))
        dtype = floats((0.0, *(x for x in given if not isinstance(x, str))))[0].dtype

        def number(x: Any) -> Any:
            return x if x is None or isinstance(x, str) else jnp.asarray(x, dtype)

        of_any: Callable[..., Fiber] = converter
        named = {name: number(x) for name, x in kwargs.items()}
        return cast(of_any(*map(number, args), **named), dtype)

    return cast_converter


def clamp(x: Numbers, low: float, high: float = np.inf) -> Floats:
    """The nearest number in [low, high]; the derivative is 1 there and 0 beyond."""
    (x,) = floats((x,))
    return jnp.where(x < low, low, jnp.where(x > high, high, x))


def known(*values: Any) -> bool:
    """Whether the numbers can be looked at: not while JAX traces."""
    return not any(isinstance(x, Tracer) for x in jax.tree.leaves(values))


def within(
    low: float,
    high: float,
    numbers: dict[str, Any],
    *,
    open_low=False,
    slack=0.0,
    why="",
) -> None:
    """ValueError unless all numbers, if given and known, are finite and in [low, high].

    They may lie beyond a limit by `slack` of it, of 1 if it is 0.
    """
    for name, value in numbers.items():
        if value is None or not known(value):
            continue
        x = np.asarray(value, np.float64)
        least = low - slack * (low or 1)
        most = high if np.isinf(high) else high + slack * high
        inside = ((x > least) if open_low else (x >= least)) & (x <= most)
        inside &= np.isfinite(x)
        if not inside.all():
            bad = np.asarray(value)[~inside].flat[0]
            left = "(" if open_low else "["
            right = ")" if np.isinf(high) else "]"
            limits = f"must lie in {left}{low:g}, {high:g}{right}"
            raise ValueError(f"{name} = {bad!s}: {limits}{why and f'; {why}'}")


def fits(
    system: str, low: float, high: float, numbers: dict[str, Any], *, open_low=False
) -> None:
    """ValueError unless a system keeps these numbers as they are."""
    why = f"{system} has no other, what is beyond would be lost"
    within(low, high, numbers, open_low=open_low, slack=_SAME, why=why)


def equal(name: str, value: Any, allowed: Any, lost: str) -> None:
    """ValueError saying what is lost unless the numbers, if known, are the allowed."""
    if not known(value, allowed):
        return
    x, y = np.broadcast_arrays(np.asarray(value, float), np.asarray(allowed, float))
    if not (abs(x - y) <= _SAME * np.maximum(1, abs(y))).all():
        found, must = np.asarray(value), np.asarray(allowed)
        raise ValueError(f"{name} = {found}: must be {must}; {lost}")


def per_lobe(name: str, factors: Any, allowed: Any, lost: str) -> None:
    """`equal` for factors of which the last goes on."""

    def lobe(f: Any) -> Any:
        return [f[min(p, len(f) - 1)] for p in range(max(len(allowed), len(factors)))]

    if known(factors, allowed):
        equal(name, lobe(np.asarray(factors)), lobe(np.asarray(allowed)), lost)


def given(number: Any, default: Any) -> Any:
    """The number, or the default if it is None."""
    return default if number is None else number


def way(*ways: dict[str, Any]) -> str:
    """The first name of the way to absorb of which a number is given; "" if none is.

    ValueError if numbers of several are.
    """
    names = [[name for name, x in way.items() if x is not None] for way in ways]
    chosen = [next(iter(way)) for way, own in zip(ways, names, strict=True) if own]
    if len(chosen) > 1:
        both = " and ".join(name for own in names for name in own)
        allowed = " or ".join(" with ".join(way) for way in ways)
        raise ValueError(
            f"{both} are given: must be {allowed}; each is an absorption of its own"
        )
    return "".join(chosen)


def of_color(b: Reals, color: dict[str, Any], *, least=0.0, most=np.inf) -> Floats:
    """Chiang's absorption of a color, clamped to [least, most]; ValueError if infinite.

    Above 1 the absorption grows again, where a system does not clamp.
    """
    if least == 0:
        why = "black absorbs without end, which a Fiber cannot"
        within(0, np.inf, color, open_low=True, why=why)
    b, value = floats((b,), tuple(color.values()))
    return chiang_sigma_a(clamp(value, least, most), b)


def chiang(b_m: Reals, b_n: Reals, alpha: Any, sigma_a: Any, eta: Reals) -> Fiber:
    """Fiber of two perceptual roughnesses and an alpha in degrees."""
    (angle,) = floats((alpha,))
    beta_m, beta_n = perceptual.longitudinal(b_m), perceptual.azimuthal(b_n)
    return Fiber(eta, beta_m, beta_n, jnp.radians(angle), sigma_a)


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


def marschner(fiber: Fiber, system: str, *, widths: Any = WIDTHS, tilts=TILTS) -> None:
    """ValueError unless the lobes of a fiber have the widths and tilts of a system."""
    own = f"the factors of {system} are fixed, others would be lost"
    per_lobe("widths_m", fiber.widths_m, widths, own)
    per_lobe("widths_n", fiber.widths_n, (1.0,), own)
    if fiber.alpha is not None:
        per_lobe("tilts", fiber.tilts, tilts, own)
