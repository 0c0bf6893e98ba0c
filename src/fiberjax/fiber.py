"""The parameters of a fiber, and what each lobe takes from them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from fiberjax._types import Floats, Reals
from fiberjax.azimuthal import check_sigma_a


def _number(x: Any) -> Any:
    """A floating array: a plain float in a PyTree would retrace and get no gradient."""
    if x is None:
        return None
    x = jnp.asarray(x)
    return x.astype(jnp.result_type(float, x))


class Fiber(eqx.Module):
    """One hair fiber. All fields are numbers: traced, differentiable, batched by vmap.

    The defaults are pbrt-v4's human hair (eta 1.55, beta_m = beta_n = 0.3 perceptual,
    alpha 2 degrees, eumelanin 1.3), converted: longitudinal deviation
    0.726 b + 0.812 b^2 + 3.7 b^20, azimuthal scale sqrt(pi/8)(0.265 b + 1.194 b^2 +
    5.372 b^22) divided by sqrt(pi/8), sigma_a = 1.3 (0.419, 0.697, 1.37). The tilt is
    negative because a root-to-tip tangent sees scales that turn the surface normals
    towards the root; pbrt-v4 itself turns them towards its dp/du, see `convert.pbrt`.

    Fields:
        eta: index of refraction relative to the surroundings, >= 1.
        beta_m: longitudinal roughness, standard deviation in radians, > 0.
        beta_n: azimuthal roughness, standard deviation in radians, > 0.
        alpha: scale tilt in radians; positive turns the surface normals towards
            +tangent, so that at normal incidence R leaves at theta_o = +2 alpha. None
            for no tilt.
        sigma_a: absorption per fiber radius, >= 0, shape () or (C,) for C colors. None
            for a clear fiber.
        widths_m: factors of beta_m for lobes 0, 1, ...; the last goes on. (1, 1/2, 2)
            is what renderers use, after Marschner et al. 2003.
        widths_n: factors of beta_n for lobes 0, 1, ...; the last goes on.
        tilts: factors of alpha for lobes 0, 1, ...; the last goes on. (2, -1, -4, 0),
            d'Eon et al. 2013; by ray trace at normal incidence 2, -1.1, -4.2.

    What is None is not compiled.
    """

    eta: Inexact[Array, "..."] = eqx.field(default=1.55, converter=_number)
    beta_m: Inexact[Array, "..."] = eqx.field(default=0.29088, converter=_number)
    beta_n: Inexact[Array, "..."] = eqx.field(default=0.18696, converter=_number)
    alpha: Inexact[Array, "..."] | None = eqx.field(
        default=-2 * np.pi / 180, converter=_number
    )
    sigma_a: Inexact[Array, "..."] | None = eqx.field(
        default=(0.5447, 0.9061, 1.781), converter=_number
    )
    widths_m: Inexact[Array, "..."] = eqx.field(
        default=(1.0, 0.5, 2.0), converter=_number
    )
    widths_n: Inexact[Array, "..."] = eqx.field(default=(1.0,), converter=_number)
    tilts: Inexact[Array, "..."] = eqx.field(
        default=(2.0, -1.0, -4.0, 0.0), converter=_number
    )


DOMAINS = {
    "eta": (1.0, np.inf),
    "beta_m": (0.0, np.inf),
    "beta_n": (0.0, np.inf),
    "alpha": (-np.pi / 2, np.pi / 2),
    "sigma_a": (0.0, np.inf),
    "widths_m": (0.0, np.inf),
    "widths_n": (0.0, np.inf),
    "tilts": (-np.inf, np.inf),
}
MAY_TOUCH = ("eta", "sigma_a")  # the lower bound itself is allowed
MAY_MISS = ("alpha", "sigma_a")
PER_LOBE = ("widths_m", "widths_n", "tilts")


def _present(fiber: Fiber, name: str) -> Any:
    """The field; ValueError if it is None and may not be."""
    value = getattr(fiber, name)
    if value is None and name not in MAY_MISS:
        raise ValueError(f"{name} is None: must be a number; only {MAY_MISS} may be")
    return value


def check(fiber: Fiber) -> Fiber:
    """The fiber itself, if every number lies in its domain.

    For use before a long run, outside jit: it looks at values. Batched fibers, as for
    vmap, are checked element by element.

    Args:
        fiber: fiber of concrete numbers.

    Returns:
        The same fiber.

    Raises:
        ValueError: naming the field, the value and what is allowed.
    """
    for name, (low, high) in DOMAINS.items():
        value = _present(fiber, name)
        if value is None:
            continue
        value = np.asarray(value, np.float64)
        if name in PER_LOBE and not value.size:
            raise ValueError(f"{name} is empty: must have a factor for lobe 0")
        inside = (value >= low) if name in MAY_TOUCH else (value > low)
        inside &= value < high
        if not inside.all():
            bad = value[~inside].flat[0]
            left = "[" if name in MAY_TOUCH else "("
            raise ValueError(f"{name} = {bad}: must lie in {left}{low:g}, {high:g})")
    return fiber


class LobeShape(NamedTuple):
    """What one lobe takes from a fiber: the tilt of its cone and its two widths."""

    tilt: Floats | None
    beta_m: Floats
    beta_n: Floats


def cast(fiber: Fiber, dtype: Any) -> Fiber:
    """The fiber in another dtype; ValueError if it is not one fiber."""
    for name in DOMAINS:
        value = _present(fiber, name)
        if value is None or name == "sigma_a":
            check_sigma_a(fiber.sigma_a)
        elif name in PER_LOBE:
            if value.ndim != 1 or not value.size:
                raise ValueError(
                    f"{name} has shape {value.shape}: must be (L,), L >= 1"
                )
        elif value.ndim:
            raise ValueError(
                f"{name} has shape {value.shape}: must be (), a Fiber is one fiber; "
                "use jax.vmap for many"
            )
    return jax.tree.map(lambda x: x.astype(dtype), fiber)


def lobe_shape(fiber: Fiber, p: int) -> LobeShape:
    """Tilt and widths of lobe p; the last factor of each field goes on."""

    def factor(factors):
        return factors[min(p, factors.shape[0] - 1)]

    tilt = None if fiber.alpha is None else factor(fiber.tilts) * fiber.alpha
    return LobeShape(
        tilt,
        factor(fiber.widths_m) * fiber.beta_m,
        factor(fiber.widths_n) * fiber.beta_n,
    )


def rest_shape(fiber: Fiber) -> LobeShape:
    """The lobe that stands for all higher ones: untilted, of the last width."""
    beta_m = fiber.widths_m[-1] * fiber.beta_m
    return LobeShape(None, beta_m, fiber.widths_n[-1] * fiber.beta_n)


def cone(theta_i: Floats, shape: LobeShape) -> Floats:
    """Inclination of a lobe's specular cone, not folded: -theta_i + tilt."""
    return -theta_i if shape.tilt is None else -theta_i + shape.tilt


def fold(theta: Reals) -> Floats:
    """The inclination in [-pi/2, pi/2] of a direction that has passed a pole."""
    return 2 * jnp.clip(theta, -jnp.pi / 2, jnp.pi / 2) - theta
