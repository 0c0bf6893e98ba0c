"""How `sample` chooses offset and lobe, and with which probability: for its pdf too.

- lobe_first   h uniform; a lobe by w_p(h); it leaves by that lobe
- lobe_again   the same with a better w_p, then the lobe it leaves by is chosen with
               theta_o known
- guided       lobe_again, with h from a density
"""

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.fiber import Fiber, LobeShape, cone
from fiberjax.model import Model, longitudinal, shares
from fiberjax.section import Offset, Ray, colorless, ray
from fiberjax.spherical import open_unit

STRATEGIES = ("lobe_first", "lobe_again", "guided")
DEFAULT_STRATEGY = "guided"

_BERNSTEIN = (
    np.array([[6, 0, 0, 0], [-5, 18, -9, 2], [2, -9, 18, -5], [0, 0, 0, 6]]) / 6
)
"""Coefficients of the cubic through four values at 0, 1/3, 2/3, 1."""

_LEAST = 0.02
"""Least coefficient of a density of h, relative to the largest."""


def mean_inclination(theta_i: Floats, shape: LobeShape) -> Floats:
    """About the inclination of the mean direction of M.

    Its sine is that of the cone times coth x - 1/x, x = 1/v; 1/(1 + v + v^2) is within
    .1 of that and costs nothing. Near the poles theta_o lies far from a rough lobe's
    cone, and attenuations at the cone are those of no sample.
    """
    v = shape.beta_m * shape.beta_m
    kept = 1 / (1 + v + v * v)
    lost = (v + v * v) * kept
    theta_c = cone(theta_i, shape)
    sin, cos = jnp.sin(theta_c), jnp.cos(theta_c)
    return jnp.atan2(
        kept * sin, numerics.sqrt(cos * cos + (lost * sin) * ((1 + kept) * sin))
    )


def first_choice(
    model: Model, strategy: str, fiber: Fiber, theta_i: Floats, offset: Offset
) -> tuple[Floats, Any]:
    """Probability w_p(h) of each part, and whether any light is left.

    Where the lobe is chosen again one ray serves all parts, at the mean inclination of
    a lobe with twice the v of the first: the second choice makes up for what the others
    differ by.
    """
    if strategy == "lobe_first":
        return model.selection(fiber, theta_i, offset)
    shape = model.shape(fiber, model.parts[0])
    wider = shape._replace(beta_m=shape.beta_m * math.sqrt(2))
    section = model.section(fiber, theta_i, mean_inclination(theta_i, wider))
    one = ray(offset, section)
    return shares([model.attenuation(part, one).mean() for part in model.parts])


def second_choice(model: Model, along: Floats, one: Ray) -> tuple[Floats, Any]:
    """Probability of leaving by each part, and whether any light is left.

    M_q times the channel mean of A_q, over their sum. `along` holds the M_q on its last
    axis, up to a common factor.
    """
    kept = [model.attenuation(part, one).mean() for part in model.parts]
    return shares([along[..., k] * a for k, a in enumerate(kept)])


def scaled(along: Floats) -> tuple[Floats, Floats]:
    """M of every part, on the last axis, over the largest of them; and the largest.

    The largest is a constant to the derivatives; all are 0 where it is.
    """
    largest = jax.lax.stop_gradient(along.max(-1))
    seen = ~(largest < jnp.finfo(largest.dtype).tiny)
    scale = jnp.where(seen, largest, 1)[..., None]
    return jnp.where(seen[..., None], along / scale, 0), largest


def pick(probability: Floats, u: Floats) -> tuple[Any, Floats]:
    """An index by its probability, and a uniform number from what is left of u."""
    sums = jnp.cumsum(probability, -1)
    # A part of probability 0 ends where the one before it does, so it is never chosen.
    target = open_unit(u) * sums[..., -1]
    index = jnp.sum(sums[..., :-1] <= target[..., None], -1)
    width = jnp.take_along_axis(probability, index[..., None], -1)[..., 0]
    end = jnp.take_along_axis(sums, index[..., None], -1)[..., 0]
    return index, jnp.clip(1 - (end - target) / width, 0, 1)


class OffsetDensity(NamedTuple):
    """A density of |h|: a cubic in y = 3z/(2 + z), z = sqrt(1 - |h|), times its slope.

    r = (3 - y)^3/12 q(y) relative to uniform. z is sqrt 2 sin((pi/2 - gamma)/2): r is
    smooth in gamma up to grazing, where Fresnel's terms are steep, and y is made to
    follow those. q has four Bernstein coefficients, all positive, and int 2 y q dy = 1.
    """

    bernstein: tuple[Floats, Floats, Floats, Floats]

    def _power(self) -> tuple[Floats, ...]:
        """The coefficients of q in powers of y."""
        a, b, c, d = self.bernstein
        return a, 3 * (b - a), 3 * (a - 2 * b + c), 3 * (b - c) + (d - a)

    def _q(self, y: Floats) -> Floats:
        a, b, c, d = self.bernstein
        x = 1 - y
        return x * x * (x * a + 3 * y * b) + y * y * (3 * x * c + y * d)

    def ratio(self, y: Floats) -> Floats:
        """Density of h over that of a uniform h."""
        x = 3 - y
        return x * x * x * self._q(y) / 12

    def quantile(self, s: Floats) -> Floats:
        """y with int_0^y 2 t q(t) dt = s^2.

        The integral is y^2 P(y). Newton's steps solve y sqrt P = s, which has no
        double root; a step out of the bracket halves it. Two more steps give the first
        and second derivatives.
        """
        c = self._power()

        def residual(y):
            root = jnp.sqrt(
                c[0] + y * (2 / 3 * c[1] + y * (c[2] / 2 + y * (2 / 5 * c[3])))
            )
            return y * root - s, root

        def newton(y):
            off, root = residual(y)
            return off, y - off * root / self._q(y)

        y, low, high = s, jnp.zeros_like(s), jnp.ones_like(s)
        for _ in range(8):
            off, y_next = newton(y)
            low, high = jnp.where(off < 0, y, low), jnp.where(off < 0, high, y)
            inside = (low <= y_next) & (y_next <= high)
            y = jnp.where(inside, y_next, (low + high) / 2)
        y = jax.lax.stop_gradient(y)
        for _ in range(2):
            y = newton(y)[1]
        return jnp.clip(y, 0, 1)


def _offset(z: Floats, side: Floats | float = 1.0) -> Offset:
    """The offset side (1 - z^2)."""
    h, cos = side * (1 - z) * (1 + z), z * jnp.sqrt(2 - z * z)
    return Offset(jnp.atan2(h, cos), h, cos)


def offset_density(model: Model, fiber: Fiber, theta_i: Floats) -> OffsetDensity:
    """The density of h that follows the light left in all parts together.

    q interpolates their attenuation at four offsets, at the inclination of the first
    part. A coefficient is at least _LEAST times the largest, which bounds the weights.
    """
    theta_i = theta_i[..., None]
    theta = mean_inclination(theta_i, model.shape(fiber, model.parts[0]))
    y = jnp.asarray(np.arange(4) / 3, theta_i.dtype)
    one = ray(_offset(2 * y / (3 - y)), model.section(fiber, theta_i, theta))
    left = sum(model.attenuation(part, one).mean() for part in model.parts)
    fit = jnp.asarray(_BERNSTEIN * 12 / (3 - np.arange(4) / 3) ** 3, theta_i.dtype)
    fitted = jnp.matmul(left, fit.T, precision=jax.lax.Precision.HIGHEST)
    largest = jax.lax.stop_gradient(fitted.max(-1, keepdims=True))
    alive = ~(largest < jnp.finfo(fitted.dtype).tiny)
    positive = jnp.maximum(fitted / jnp.where(alive, largest, 1), _LEAST)
    a, b, c, d = jnp.moveaxis(jnp.where(alive, positive, 1), -1, 0)
    mass = (a + 2 * b + 3 * c + 4 * d) / 10
    return OffsetDensity((a / mass, b / mass, c / mass, d / mass))


def draw_offset(
    model: Model, strategy: str, fiber: Fiber, theta_i: Floats, u: Floats
) -> tuple[Offset, Floats]:
    """An offset, and its density over the uniform one."""
    u = open_unit(u)
    if strategy != "guided":
        h = 2 * u - 1
        cos = jnp.sqrt((1 - h) * (1 + h))
        return Offset(jnp.atan2(h, cos), h, cos), jnp.ones_like(h)
    density = offset_density(model, fiber, theta_i)
    above = u >= 0.5
    y = density.quantile(jnp.sqrt(2 * jnp.where(above, 1 - u, u)))
    side = jnp.where(above, 1, -1).astype(u.dtype)
    return _offset(2 * y / (3 - y), side), density.ratio(y)


def offset_ratio(density: OffsetDensity, offset: Offset) -> Floats:
    """The density of h at an offset, over the uniform one."""
    z = offset.cos / jnp.sqrt(1 + jnp.abs(offset.sin))
    return density.ratio(3 * z / (2 + z))


def direction_weights(
    model: Model, strategy: str, fiber: Fiber, theta_i: Floats, theta_o: Floats
) -> tuple[Any, Floats]:
    """What `Rule.total` integrates to the pdf of a strategy that chooses again.

    Weights r(h) (sum_p w_p M_p) M_q A_q/(sum M A), and the factor they lack.
    """
    section = model.section(fiber, theta_i, theta_o)
    each = longitudinal(model, fiber, model.parts, theta_i, theta_o)
    along, largest = scaled(jnp.stack(jnp.broadcast_arrays(*each), -1))
    density = offset_density(model, fiber, theta_i) if strategy == "guided" else None

    def weights(offset):
        first, _ = first_choice(model, strategy, fiber, theta_i, offset)
        second, _ = second_choice(model, along, ray(offset, section))
        mixture = (first * along).sum(-1)
        if density is not None:
            mixture = mixture * offset_ratio(density, offset)
        parts = mixture[..., None] * second
        return [colorless(parts[..., k]) for k in range(len(model.parts))]

    return weights, largest
