"""One ray that enters a fiber at a known offset, in sines and cosines.

What `fiberjax.nearfield` evaluates, samples and gives the density of.
"""

from collections.abc import Sequence
from functools import partial, reduce
from itertools import accumulate
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics, programs
from fiberjax._types import Floats
from fiberjax.azimuthal import drop_color
from fiberjax.circular import TURN, wrap
from fiberjax.compat import LONGITUDINAL
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import Fiber
from fiberjax.model import Model, light, portions, positive
from fiberjax.section import (
    Light,
    Offset,
    ray,
    refraction,
    section_of,
    stacked,
)
from fiberjax.spherical import (
    Inclination,
    Width,
    inclination,
    open_unit,
    sample_around,
    turned,
    width,
)


class Shape(NamedTuple):
    """What a part takes from the fiber: the turn of its cone and its two widths."""

    tilt: Inclination | None
    along: Width
    across: Any


def _shapes(model: Model, fiber: Fiber) -> list[Shape]:
    """All parts'. A roughness of 0 is one: what is sampled has a density."""
    found, blur = [], DETECTORS[model.detector].width
    for tilt, *betas in (model.shape(fiber, part) for part in model.parts):
        along, across = map(positive, betas)
        # The rest has no tilt, but is chosen from among those that have.
        turn = jnp.zeros_like(along) if tilt is None else tilt
        turn = None if fiber.alpha is None else inclination(turn)
        found.append(Shape(turn, width(along), blur(across)))
    return found


class Entering(NamedTuple):
    """A ray that enters, and what is left of it in each part.

    `mirrored` is the untilted cone, gamma_i and gamma_t the angles of the ray outside
    and inside.
    """

    mirrored: Inclination
    gamma_i: Floats
    gamma_t: Floats
    left: list[Light]

    def cone(self, shape: Shape) -> Inclination:
        """The specular cone of a part, not folded."""
        tilt = shape.tilt
        return self.mirrored if tilt is None else turned(self.mirrored, tilt)

    def amounts(self) -> list[Floats]:
        """What is left in each part, the mean over colors."""
        return [x.mean() for x in self.left]


def _entering(model: Model, fiber: Fiber, given: Inclination, h: Floats) -> Entering:
    cos = numerics.sqrt((1 - h) * (1 + h))
    offset = Offset(numerics.acute_angle(h, cos, jnp.ones_like(h)), h, cos)
    section = section_of(given.cos, fiber.eta, fiber.sigma_a)
    one = ray(offset, section)
    angles = offset.gamma, refraction(offset, section)
    (gamma_i, gamma_t), surface = programs.apart((angles, one.surface), h)
    one = one._replace(surface=surface)
    left = [model.attenuation(part, one) for part in model.parts]
    return Entering(Inclination(-given.sin, given.cos), gamma_i, gamma_t, left)


def _densities(
    model: Model, compat, shapes: list[Shape], one: Entering, out: Inclination, phi
) -> list[Floats]:
    """M D of each part, which no color is to compute anew."""
    density, found = DETECTORS[model.detector].density, []
    for part, shape in zip(model.parts, shapes, strict=True):
        along = LONGITUDINAL[compat](one.cone(shape), out, shape.along)
        if part == model.tail:
            found.append(along / TURN)
            continue
        away = phi + 2 * one.gamma_i - part * (2 * one.gamma_t + jnp.pi)
        found.append(along * density(away, shape.across))
    return programs.apart(found, one.gamma_i)


def _sum(left: list[Light], factors: Sequence[Floats]) -> list[Floats]:
    """What is left of each part times its factor, added, for each color."""
    each = [of.times(x) for of, x in zip(left, factors, strict=True)]
    return [reduce(jnp.add, one) for one in zip(*each, strict=True)]


class Seen(NamedTuple):
    """Two directions: their inclinations and the azimuth between them."""

    given: Inclination
    out: Inclination
    phi: Floats


Places = tuple[tuple[Floats, ...], tuple[Floats, ...]]
"""Numbers, of which h is the last, and vectors, that say where all directions are."""


def _columns(numbers, vectors) -> tuple[list[Floats], list[tuple[Floats, ...]]]:
    """The numbers, and the vectors as their entries, which are slow to read."""
    return numbers, programs.apart([unstacked(x) for x in vectors], numbers[-1])


def _met(model: Model, compat, seen, fiber: Fiber, places: Places, shapes: list[Shape]):
    """The ray that enters, and M D of each part in the direction that is looked at."""
    (*where, h), vectors = _columns(*places)
    given, out, phi = programs.apart(seen(*where, *vectors), h)
    one = _entering(model, fiber, given, h)
    return one, _densities(model, compat, shapes, one, out, phi)


@partial(jax.jit, static_argnames=("model", "compat", "seen"))
def evaluate(model: Model, compat, seen, fiber: Fiber, places: Places) -> Floats:
    """The sum over parts of A_p M_p D; `seen` makes a `Seen` of what is but h."""
    shapes = _shapes(model, fiber)

    def value(*places):
        one, found = _met(model, compat, seen, fiber, places, shapes)
        return stacked(programs.apart(_sum(one.left, found), one.gamma_i))

    return drop_color(programs.in_blocks(value, *places), fiber.sigma_a)


@partial(jax.jit, static_argnames=("model", "compat", "seen"))
def pdf(model: Model, compat, seen, fiber: Fiber, places: Places) -> Floats:
    """The same with the probabilities of the parts in place of A_p."""
    shapes = _shapes(model, fiber)

    def value(*places):
        one, found = _met(model, compat, seen, fiber, places, shapes)
        return reduce(jnp.add, map(jnp.multiply, portions(one.amounts()), found))

    return programs.in_blocks(value, *places)


def _pick(amounts: Sequence[Floats], u: Floats) -> Any:
    """An index in proportion to the amounts."""
    sums = list(accumulate(amounts))
    target = open_unit(u) * sums[-1]
    # A part of which there is nothing ends where the one before it does, so it is never
    # chosen. 32 bits, as float32 has: 64 would take longer.
    each = [(x <= target).astype("int32") for x in sums[:-1]]
    return reduce(jnp.add, each, jnp.zeros_like(target, "int32"))


def _chosen(values: Sequence[Any], index: Any) -> Any:
    """The value of that index, element by element."""
    found = values[0]
    for k, value in enumerate(values[1:], 1):
        found = jax.tree.map(partial(jnp.where, index == k), value, found)
    return found


@partial(jax.jit, static_argnames=("model", "compat", "gradient", "seen", "shown"))
def sample(model: Model, compat, gradient, seen, shown, fiber: Fiber, places: Places):
    """A direction drawn from `pdf`, evaluate/pdf there, and the part.

    `seen` makes an inclination of what is but h and the uniform numbers, which are the
    last vectors, and `shown` what is returned of that drawn, phi and the rest. The
    probabilities of the parts are held fixed. Then the derivative of the estimate is
    unbiased: sum_p w_p int f (S/sum_q w_q q_q) q_p dx is int f S dx for any w. With
    positions held as well, so is that with the whole density.
    """
    shapes = _shapes(model, fiber)

    def drawn(*places):
        (*where, h), (*directions, u) = _columns(*places)
        given = programs.apart(seen(*where, *directions), h)
        one = _entering(model, fiber, given, h)
        out, phi, colors, p = _drawn(model, compat, gradient, shapes, one, u)
        found = shown(out, phi, *where, *directions)
        return found, stacked(programs.apart(colors, h)), p

    found, colors, p = programs.in_blocks(drawn, *places)
    return found, drop_color(colors, fiber.sigma_a), p


def unstacked(x: Floats) -> tuple[Floats, ...]:
    """The entries of a last axis."""
    return tuple(x[..., k] for k in range(x.shape[-1]))


def _drawn(model: Model, compat, gradient, shapes: list[Shape], one: Entering, u):
    fixed = jax.lax.stop_gradient(one)
    amounts = fixed.amounts()
    _, alive = light(amounts)
    even = [jnp.where(alive, x, 1) for x in amounts]
    index = programs.apart(_pick(even, u[0]), one.gamma_i)
    shape = _chosen(shapes, index)
    out = sample_around(one.cone(shape), shape.along, u[1], u[2])

    parts = [jnp.full_like(index, part) for part in model.parts]
    p, v = _chosen(parts, index), open_unit(u[3])
    turn = p.astype(v.dtype) * (2 * one.gamma_t + jnp.pi)
    deviate = DETECTORS[model.detector].quantile(v, shape.across)
    phi = wrap(turn - 2 * one.gamma_i + deviate)
    phi = jnp.where(p == model.tail, TURN * (v - 0.5), phi)
    out, phi = programs.apart((out, phi), one.gamma_i)

    detached = gradient == "detached"
    if detached:
        out, phi = jax.lax.stop_gradient((out, phi))
    found = _densities(model, compat, shapes, one, out, phi)
    both = _sum(one.left, found), _sum(fixed.left, found)
    colors, held = programs.apart(both, one.gamma_i)
    # The density is the mean of what its parts give to each color, over all there is.
    density = reduce(jnp.add, held)
    density = jax.lax.stop_gradient(density) if detached else density
    share = len(colors) * reduce(jnp.add, even) / jnp.where(alive, density, 1)
    weights = [jnp.where(alive, x * share, 0) for x in colors]
    size = jnp.broadcast_shapes(one.gamma_t.shape, v.shape)
    out = jax.tree.map(lambda x: jnp.broadcast_to(x, size), out)
    return out, phi, weights, jnp.broadcast_to(p, size)
