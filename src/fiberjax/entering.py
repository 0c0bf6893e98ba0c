"""One ray that enters a fiber at a known offset, in sines and cosines.

What `fiberjax.nearfield` evaluates, samples and gives the density of.
"""

from collections.abc import Sequence
from functools import partial, reduce
from itertools import accumulate
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.azimuthal import drop_color
from fiberjax.circular import TURN, wrap
from fiberjax.compat import MITSUBA, PBRT, M_renderers
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import Fiber, LobeShape
from fiberjax.model import Model, portions, positive
from fiberjax.section import (
    Light,
    Offset,
    Section,
    deflection,
    ray,
    refraction,
    section_of,
    stacked,
)
from fiberjax.spherical import (
    Inclination,
    M_around,
    inclination,
    open_unit,
    sample_around,
    turned,
)

LONGITUDINAL = {
    None: M_around,
    "pbrt": partial(M_renderers, terms=PBRT),
    "mitsuba": partial(M_renderers, terms=MITSUBA),
}


class Entering(NamedTuple):
    """A ray that enters, what is left of it in each part, and each part's shape."""

    given: Inclination
    offset: Offset
    section: Section
    left: list[Light]
    shapes: list[LobeShape]

    def cone(self, k: int) -> Inclination:
        """The specular cone of a part, not folded."""
        mirrored, tilt = (
            Inclination(-self.given.sin, self.given.cos),
            self.shapes[k].tilt,
        )
        return mirrored if tilt is None else turned(mirrored, inclination(tilt))

    def portions(self) -> tuple[list[Floats], Any]:
        """Probability of each part, and whether any light is left."""
        return portions([light.mean() for light in self.left])


def _entering(model: Model, fiber: Fiber, given: Inclination, h: Floats) -> Entering:
    cos = numerics.sqrt((1 - h) * (1 + h))
    offset = Offset(numerics.acute_angle(h, cos, jnp.ones_like(h)), h, cos)
    section = section_of(given.cos, fiber.eta, fiber.sigma_a)
    one = ray(offset, section)
    left = [model.attenuation(part, one) for part in model.parts]
    shapes = [model.shape(fiber, part) for part in model.parts]
    # A roughness of 0 is one: what is sampled has a density.
    shapes = [
        s._replace(beta_m=positive(s.beta_m), beta_n=positive(s.beta_n)) for s in shapes
    ]
    return Entering(given, offset, section, left, shapes)


def _each_density(
    model: Model, compat, one: Entering, out: Inclination, phi: Floats
) -> list[Floats]:
    seen, found = DETECTORS[model.detector], []
    for k, (part, shape) in enumerate(zip(model.parts, one.shapes, strict=True)):
        along = LONGITUDINAL[compat](one.cone(k), out, shape.beta_m**2)
        if part == model.tail:
            found.append(along / TURN)
            continue
        away = phi - part * jnp.pi - deflection(part, one.offset, one.section)
        found.append(along * seen.density(away, shape.beta_n))
    return found


def _densities(
    model: Model, compat, one: Entering, out: Inclination, phi: Floats
) -> list[Floats]:
    """M D of each part, which no color is to compute anew."""
    return numerics.stored(
        lambda: _each_density(model, compat, one, out, phi), one.offset.sin
    )


def _sum(left: list[Light], factors: Sequence[Floats]) -> list[Floats]:
    """What is left of each part times its factor, added, for each color."""
    each = [light.times(x) for light, x in zip(left, factors, strict=True)]
    return [reduce(jnp.add, one) for one in zip(*each, strict=True)]


def _mixture(probability: Sequence[Floats], densities: Sequence[Floats]) -> Floats:
    return reduce(jnp.add, map(jnp.multiply, probability, densities))


class Seen(NamedTuple):
    """Two directions: their inclinations and the azimuth between them."""

    given: Inclination
    out: Inclination
    phi: Floats


@partial(jax.jit, static_argnames=("model", "compat", "seen"))
def evaluate(model: Model, compat, seen, fiber: Fiber, where, h) -> Floats:
    """The sum over parts of A_p M_p D; `seen` makes a `Seen` of `where`."""

    def value(where, h):
        given, out, phi = seen(*where)
        one = _entering(model, fiber, given, h)
        return _sum(one.left, _densities(model, compat, one, out, phi))

    colors = numerics.in_blocks(value, where, h)
    return drop_color(stacked(colors), fiber.sigma_a)


@partial(jax.jit, static_argnames=("model", "compat", "seen"))
def pdf(model: Model, compat, seen, fiber: Fiber, where, h) -> Floats:
    """The same with the probabilities of the parts in place of A_p."""

    def value(where, h):
        given, out, phi = seen(*where)
        one = _entering(model, fiber, given, h)
        probability, _ = one.portions()
        return _mixture(probability, _densities(model, compat, one, out, phi))

    return numerics.in_blocks(value, where, h)


def _pick(probability: Sequence[Floats], u: Floats) -> Any:
    """An index by its probability."""
    sums = list(accumulate(probability))
    target = open_unit(u) * sums[-1]
    # A part of probability 0 ends where the one before it does, so it is never chosen.
    return reduce(jnp.add, [(x <= target).astype(int) for x in sums[:-1]], 0)


def _chosen(values: Sequence[Any], index: Any) -> Any:
    """The value of that index, element by element."""
    found = values[0]
    for k, value in enumerate(values[1:], 1):
        found = jax.tree.map(partial(jnp.where, index == k), value, found)
    return found


@partial(jax.jit, static_argnames=("model", "compat", "gradient", "seen", "shown"))
def sample(model: Model, compat, gradient, seen, shown, fiber: Fiber, where, h, u):
    """A direction drawn from `pdf`, evaluate/pdf there, and the part.

    `seen` makes an inclination of `where`, and `shown` what is returned of that drawn,
    phi and `where`. The probabilities of the parts are held fixed. Then the derivative
    of the estimate is unbiased: sum_p w_p int f (S/sum_q w_q q_q) q_p dx is int f S dx
    for any w. With positions held as well, so is that with the whole density.
    """

    def drawn(where, h, u):
        given = seen(*where)
        out, phi, colors, p = _drawn(model, compat, gradient, fiber, given, h, u)
        return shown(out, phi, *where), colors, p

    found, colors, p = numerics.in_blocks(drawn, where, h, unstacked(u))
    return found, drop_color(stacked(colors), fiber.sigma_a), p


def unstacked(x: Floats) -> tuple[Floats, ...]:
    """The entries of a last axis."""
    return tuple(x[..., k] for k in range(x.shape[-1]))


def _drawn(model: Model, compat, gradient, fiber: Fiber, given, h, u):
    one = _entering(model, fiber, given, h)
    probability, alive = jax.lax.stop_gradient(one.portions())
    index = _pick(probability, u[0])
    cone = _chosen([one.cone(k) for k in range(len(model.parts))], index)
    beta_m = _chosen([s.beta_m for s in one.shapes], index)
    beta_n = _chosen([s.beta_n for s in one.shapes], index)
    out = sample_around(cone, beta_m, u[1], u[2])

    parts = [jnp.full_like(index, part) for part in model.parts]
    p, v = _chosen(parts, index), open_unit(u[3])
    turn = p.astype(v.dtype) * (2 * refraction(one.offset, one.section) + jnp.pi)
    deviate = DETECTORS[model.detector].quantile(v, beta_n)
    phi = wrap(turn - 2 * one.offset.gamma + deviate)
    phi = jnp.where(p == model.tail, TURN * (v - 0.5), phi)

    detached = gradient == "detached"
    if detached:
        out, phi = jax.lax.stop_gradient((out, phi))
    found = _densities(model, compat, one, out, phi)
    density = _mixture(probability, found)
    density = jax.lax.stop_gradient(density) if detached else density
    kept = [jnp.where(alive, x / density, 0) for x in found]
    shape = jnp.broadcast_shapes(given.sin.shape, h.shape, v.shape)
    out = jax.tree.map(lambda x: jnp.broadcast_to(x, shape), out)
    return out, phi, _sum(one.left, kept), jnp.broadcast_to(p, shape)
