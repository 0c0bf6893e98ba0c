"""The static choices of the far-field model, and what its parts let through."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics, programs
from fiberjax._types import Floats, Reals, choice, flag, floats, lobe_number
from fiberjax.along import Along
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import Fiber, LobeShape, cast, cone, fold, lobe_shape, rest_shape
from fiberjax.rules import Rule, Seen, Uniform, check_rule
from fiberjax.section import Light, Offset, Ray, Section, ray, section, section_of
from fiberjax.spherical import Inclination, M, inclination, turned

INCIDENCES = ("theta_d", "theta_i")


@dataclass(frozen=True)
class Model:
    """Which lobes, and by which rules: everything about the model that is not a number.

    A part is a lobe p, or P = max(lobes) + 1 for the rest, all lobes from P on. Where
    `along` is given, M and angle functions are those of a tolerance.
    """

    lobes: tuple[int, ...]
    rest: bool
    rule: Rule
    detector: str
    incidence: str
    along: Along | None = None

    def __post_init__(self):
        try:
            lobes = tuple(self.lobes)
        except TypeError as error:
            raise ValueError(f"lobes = {self.lobes!r}: must be a tuple") from error
        if not lobes:
            raise ValueError("lobes = (): must name at least one lobe")
        lobes = tuple(lobe_number("lobes", p) for p in lobes)
        if len(set(lobes)) < len(lobes):
            raise ValueError(f"lobes = {lobes}: must not name a lobe twice")
        object.__setattr__(self, "lobes", lobes)
        object.__setattr__(self, "rest", flag("rest", self.rest))
        check_rule(self.rule)
        choice("detector", self.detector, tuple(DETECTORS))
        choice("incidence", self.incidence, INCIDENCES)

    @property
    def parts(self) -> tuple[int, ...]:
        """The lobes, and P if there is a rest."""
        return (*self.lobes, self.tail) if self.rest else self.lobes

    @property
    def tail(self) -> int:
        """P, the first lobe of the rest."""
        return max(self.lobes) + 1

    def shape(self, fiber: Fiber, part: int) -> LobeShape:
        """Tilt and widths of a part."""
        return rest_shape(fiber) if part == self.tail else lobe_shape(fiber, part)

    def seen(self, fiber: Fiber, part: int, factor: Floats) -> Seen | Uniform:
        """A part as it is seen, with a factor."""
        if part == self.tail:
            return Uniform(factor)
        return Seen(part, self.shape(fiber, part).beta_n, factor)

    def section(self, fiber: Fiber, theta_i: Floats, theta_o: Floats) -> Section:
        """The cross-section that attenuations and eta' are taken at."""
        at = (theta_o - theta_i) / 2 if self.incidence == "theta_d" else theta_i
        if self.along is None:
            return section(at, fiber.eta, fiber.sigma_a)
        return section_of(numerics.sin_cos(at)[1], fiber.eta, fiber.sigma_a)

    def attenuation(self, part: int, one: Ray) -> Light:
        """A_p of a ray, or its sum over the rest."""
        return one.A_rest(part) if part == self.tail else one.A(part)

    def selection(
        self, fiber: Fiber, theta_i: Floats, offset: Offset
    ) -> tuple[Floats, Any]:
        """Probability w_p(h) of choosing each part, and whether any light is left.

        The probabilities, stacked on a last axis, are in proportion to the channel mean
        of the attenuations at each part's specular cone, folded where it has passed a
        pole; they are equal where no light is left (`shares`).
        """
        spec = []
        for part in self.parts:
            cone_p = fold(cone(theta_i, self.shape(fiber, part)))
            one = ray(offset, self.section(fiber, theta_i, cone_p))
            spec.append(self.attenuation(part, one).mean())
        return shares(spec)


class Attenuations(NamedTuple):
    """The weights of some parts: what an offset lets through at a section."""

    model: Model
    parts: tuple[int, ...]
    section: Section

    def __call__(self, offset: Offset) -> list[Light]:
        one = ray(offset, self.section)
        return [self.model.attenuation(part, one) for part in self.parts]

    def only(self, which: Sequence[int]) -> "Attenuations":
        """Those of some of the parts, by their places."""
        return self._replace(parts=tuple(self.parts[k] for k in which))

    def at(self, section: Section) -> "Attenuations":
        """The same at another section."""
        return self._replace(section=section)


def light(values: Sequence[Floats]) -> tuple[Floats, Any]:
    """The largest value, a constant to the derivatives, and whether any light is left.

    None is where all are below the root of the smallest number: the reverse pass
    divides by them.
    """
    largest = jax.lax.stop_gradient(reduce(jnp.maximum, values))
    # NaN is light of some kind: it must reach the result.
    return largest, ~(largest < float(jnp.finfo(largest.dtype).tiny) ** 0.5)


def portions(values: Sequence[Floats]) -> list[Floats]:
    """Each value over their sum; all are equal where no light is left."""
    largest, alive = light(values)
    # Scaling by the largest keeps 1/total^2 finite.
    over = 1 / jnp.where(alive, largest, 1)
    scaled = [jnp.where(alive, x * over, 1) for x in values]
    over = 1 / reduce(jnp.add, scaled)
    return [x * over for x in scaled]


def shares(values: Sequence[Floats]) -> tuple[Floats, Any]:
    """`portions` on a last axis, and whether any light is left."""
    values = jnp.broadcast_arrays(*values)
    return jnp.stack(portions(values), -1), light(values)[1]


def entry(values: Floats, index: Any) -> Floats:
    """The entry `index` of the last axis, element by element."""
    return jnp.take_along_axis(values, index[..., None], -1)[..., 0]


def positive(beta: Floats) -> Floats:
    """The roughness, or a few roundings of an angle: densities must be numbers."""
    least = 64 * float(jnp.finfo(beta.dtype).eps)
    return beta + jax.lax.stop_gradient(jnp.maximum(least - beta, 0))


def prepare(fiber: Fiber, *angles: Reals) -> tuple[Fiber, list[Floats]]:
    """The fiber and the angles in one dtype, that of the angles."""
    arrays = floats(angles, tuple(jax.tree.leaves(fiber)))[: len(angles)]
    return cast(fiber, arrays[0].dtype), arrays


def longitudinal(
    model: Model, fiber: Fiber, parts: Sequence[int], theta_i: Floats, theta_o: Floats
) -> list[Floats]:
    """M of some parts."""
    shapes = [model.shape(fiber, part) for part in parts]
    form = model.along
    if form is None:
        return [M(cone(theta_i, x), theta_o, x.beta_m**2) for x in shapes]
    angles = numerics.sin_cos(theta_i), numerics.sin_cos(theta_o)
    # XLA would compute them anew in every M.
    (sin, cos), out = programs.apart(angles, fiber.eta)
    opposite, out = Inclination(-sin, cos), Inclination(*out)

    def along(shape):
        tilted = shape.tilt is not None
        around = turned(opposite, inclination(shape.tilt)) if tilted else opposite
        return form.M(around, out, shape.beta_m**2)

    return [along(shape) for shape in shapes]
