"""Real-time approximations of `evaluate`, by the name of their tier.

    karis2016   Karis 2016 as published. It knows beta_n of no lobe, and eta only in F:
                its eta' is fitted for 1.55. fiberjax.artist has its artist parameters,
                scattering and environment light.
    light, medium, fine
                fiberjax.exponential: ours, by rising cost, for every roughness and eta
                of its domain and for the path of light in the fiber.

What they are worth is in fits/quality.json. All lobes above TRT are one term, the same
for every tier: fiberjax.tail.
"""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import exponential, karis, tail
from fiberjax._types import Floats, Reals, choice, flag, lobe_number
from fiberjax.fiber import Fiber
from fiberjax.model import prepare
from fiberjax.shading import LOBES, added, of_angles, of_fiber


class Tier(NamedTuple):
    """An approximation: M N of a lobe from constants, a hair and directions."""

    lobe: Callable[..., Floats]
    constants: Any


DATA = Path(__file__).parent / "data"
"""Constants of `FITTED`, which fits/tiers.py writes."""

FITTED = ("light", "medium", "fine")
"""The tiers of fiberjax.exponential, by rising cost."""


def _fitted(name: str) -> Tier:
    """A tier of fiberjax.exponential."""
    return Tier(exponential.lobe, json.loads((DATA / f"{name}.json").read_text()))


_TIERS = {"karis2016": Tier(karis.lobe, karis.PUBLISHED)} | {
    name: _fitted(name) for name in FITTED
}

_REST = Tier(tail.lobe, tail.FITTED)

TIERS = tuple(_TIERS)
"""The names of all tiers."""


COSTS = DATA / "operations.json"
"""Operations of each shader; fits/shaders.py counts them."""


class Cost(NamedTuple):
    """Operations of one color from directions, what hangs on the fiber alone left out.

    Of the special-function unit (exp, log, reciprocal, roots, sine, cosine) and others.
    """

    special: int
    other: int


def cost(tier: str, counted: str = "assembly", *, rest: bool = False) -> Cost:
    """The operations of `hair_bsdf_hoisted` in a tier's shader.

    Args:
        tier: one of `TIERS`.
        counted: "assembly", instructions of a GPU, NVIDIA's sm_86, where a fused
            multiply-add is one and exp has a multiplication of its own; "spirv",
            optimized SPIR-V, nothing fused. fits/shared/assembly.py and
            fits/shared/spirv.py say what counts as one.
        rest: with all lobes above TRT, as in `evaluate`.

    Returns:
        special and other.

    Raises:
        ValueError: an unknown tier or count; rest is not True or False.
    """
    choice("tier", tier, TIERS)
    choice("counted", counted, ("assembly", "spirv"))
    name = f"{tier}_rest" if flag("rest", rest) else tier
    return Cost(**json.loads(COSTS.read_text())[name][counted])


def tier_of(name: str) -> Tier:
    """The approximation of this name; ValueError if there is none."""
    choice("tier", name, TIERS)
    return _TIERS[name]


@partial(jax.jit, static_argnums=(0, 1))
def _sum(
    lobe: Callable[..., Floats], parts: tuple[int, ...], constants, fiber, *angles
):
    directions = of_angles(*jnp.broadcast_arrays(*angles))
    hair = of_fiber(fiber)
    total = added([lobe(p, constants, hair, directions) for p in parts])
    if fiber.sigma_a is None or not fiber.sigma_a.ndim:
        return total[..., 0]
    shape = (*directions.cos_d.shape, *fiber.sigma_a.shape)
    return jnp.broadcast_to(total, shape)


def _called(tier: Tier, parts, fiber, angles, constants):
    fiber, angles = prepare(fiber, *angles)
    constants = tier.constants if constants is None else constants
    dtype = angles[0].dtype
    constants = jax.tree.map(lambda x: jnp.asarray(x, dtype), constants)
    return _sum(tier.lobe, parts, constants, fiber, *angles)


def evaluate(
    tier: str,
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    rest: bool = False,
    constants: Any = None,
) -> Floats:
    """What `fiberjax.evaluate` returns, by an approximation.

    R + TT + TRT, and the rest if asked for.

    Args:
        tier: static, one of `TIERS`.
        fiber: one fiber; jax.vmap makes many.
        theta_i: inclination towards the light in radians, [-pi/2, pi/2].
        theta_o: inclination towards the eye in radians, [-pi/2, pi/2].
        phi: azimuth phi_o - phi_i in radians, any real.
        rest: static, whether all lobes above TRT are added, by `realtime.rest`.
        constants: a PyTree in place of the tier's own, as a fit has it.

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles) + sigma_a.shape, dtype of
        the angles.

    Raises:
        ValueError: an unknown tier; rest is not True or False; a field of the fiber has
            the wrong shape.
    """
    given = fiber, (theta_i, theta_o, phi)
    value = _called(tier_of(tier), LOBES, *given, constants)
    if not flag("rest", rest):
        return value
    return value + _called(_REST, (tail.REST,), *given, None)


def lobe(
    tier: str,
    fiber: Fiber,
    p: int,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    constants: Any = None,
) -> Floats:
    """One lobe of `evaluate`.

    Args:
        tier, fiber, theta_i, theta_o, phi, constants: as in `evaluate`.
        p: 0 R, 1 TT, 2 TRT.

    Returns:
        M_p N_p per steradian, shape broadcast(angles) + sigma_a.shape.

    Raises:
        ValueError: p is none of these, and as `evaluate`.
    """
    p = lobe_number("p", p)
    if p not in LOBES:
        raise ValueError(f"p = {p}: must be one of {LOBES}")
    return _called(tier_of(tier), (p,), fiber, (theta_i, theta_o, phi), constants)


def rest(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    constants: tail.Constants | None = None,
) -> Floats:
    """All lobes above TRT as one term, the same for every tier.

    Args:
        fiber, theta_i, theta_o: as in `evaluate`.
        phi: as in `evaluate`; the term is uniform in it.
        constants: in place of `fiberjax.tail.FITTED`, as a fit has them.

    Returns:
        M N per steradian, shape broadcast(angles) + sigma_a.shape, dtype of the angles.

    Raises:
        ValueError: a field of the fiber has the wrong shape.
    """
    return _called(_REST, (tail.REST,), fiber, (theta_i, theta_o, phi), constants)
