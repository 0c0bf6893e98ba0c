"""R of d'Eon et al. 2014, whose M depends on azimuth: a choice beside that of `lobe`.

A mirror whose normal is turned along the fiber by delta throws light of azimuth phi off
the specular cone by 2 delta cos(phi/2), not by 2 delta: both the shift by the tilt and
the width shrink towards phi = pi. The whole model with it is

    deon2014.evaluate(fiber, ...) + fiberjax.evaluate(fiber, ..., lobes=(1, 2))

of which there is no pdf and no sampler: `pdf` and `sample` here are those of R alone.
"""

import math
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, last_axis
from fiberjax.auto import DEFAULT
from fiberjax.azimuthal import drop_color
from fiberjax.circular import wrap
from fiberjax.detectors import DETECTORS
from fiberjax.fiber import Fiber, cast, lobe_shape
from fiberjax.model import Model, prepare
from fiberjax.rules import Rule, Seen
from fiberjax.sampling import Sample
from fiberjax.section import Offset, colorless, ray
from fiberjax.spherical import M, open_unit, sample_cone


def _model(rule: Rule, detector: str, incidence: str) -> Model:
    return Model((0,), False, rule, detector, incidence)


def _cone(fiber: Fiber, theta_i: Floats, phi: Floats) -> Floats:
    """Where a mirror turned by half the tilt throws the light that leaves at phi.

    The direction of inclination -theta_i and azimuth phi/2 from the mirror's normal is
    turned by the tilt in the plane of tangent and normal. Its inclination is about
    -theta_i + tilt cos(phi/2), and that exactly for theta_i = 0 or phi = 0.
    """
    tilt = lobe_shape(fiber, 0).tilt
    if tilt is None:
        return jnp.broadcast_to(
            -theta_i, jnp.broadcast_shapes(theta_i.shape, phi.shape)
        )
    sin_i, cos_i = jnp.sin(theta_i), jnp.cos(theta_i)
    half = wrap(phi) / 2
    facing, aside = cos_i * jnp.cos(half), cos_i * jnp.sin(half)
    sin, cos = jnp.sin(tilt), jnp.cos(tilt)
    along, out = facing * sin - sin_i * cos, facing * cos + sin_i * sin
    return jnp.atan2(along, numerics.sqrt(out * out + aside * aside))


def _width(fiber: Fiber, phi: Floats) -> Floats:
    """sqrt 2 beta cos(phi/2), but no less than a few roundings of an angle."""
    width = math.sqrt(2) * lobe_shape(fiber, 0).beta_m * jnp.cos(wrap(phi) / 2)
    return jnp.maximum(width, 64 * float(jnp.finfo(width.dtype).eps))


def _scattered(model: Model, fiber: Fiber, weights, theta_i, theta_o, phi) -> Floats:
    """M times the azimuthal integral of the weights."""
    along = M(_cone(fiber, theta_i, phi), theta_o, _width(fiber, phi) ** 2)
    seen = [Seen(0, model.shape(fiber, 0).beta_n, along)]
    section = model.section(fiber, theta_i, theta_o)
    detector = DETECTORS[model.detector]
    return model.rule.convolve(
        seen, lambda offset: weights(offset, section), phi, section, detector
    )


@partial(jax.jit, static_argnames="model")
def _evaluate(model: Model, fiber: Fiber, *angles) -> Floats:
    def weights(offset, section):
        return [model.attenuation(0, ray(offset, section))]

    return drop_color(_scattered(model, fiber, weights, *angles), fiber.sigma_a)


def evaluate(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Floats:
    """Scattered throughput per steradian, S cos(theta_o), of R alone.

    M(theta_cone(phi), theta_o, 2 beta^2 cos^2(phi/2)) N_0(phi, theta_d), with M and N_0
    those of `lobe`. With t the tilt of R, 2 alpha, and c = cos(phi/2), phi in
    [-pi, pi], sin theta_cone = sin t cos theta_i c - cos t sin theta_i, which is
    sin(t - theta_i) for c = 1, and about sin(t c - theta_i). The width is no less than
    64 eps: next to phi = pi, where a rough fiber sends light and no width is left, M is
    a spike. At fixed theta_d the energy of R is that of `lobe`.

    Args:
        fiber, theta_i, theta_o, phi: as in `fiberjax.evaluate`.
        rule, detector, incidence: static, as there.

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles) + sigma_a.shape, dtype of
        the angles.

    Raises:
        ValueError: as `fiberjax.evaluate`.

    Reference: d'Eon, Marschner, Hanika 2014, as Karis 2016 takes it up; the cone here
    is that of a ray trace to first order in the tilt, at any theta_i.
    """
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _evaluate(_model(rule, detector, incidence), fiber, *angles)


@partial(jax.jit, static_argnames="model")
def _pdf(model: Model, fiber: Fiber, *angles) -> Floats:
    def weights(offset, section):
        del section
        return [colorless(jnp.ones_like(offset.cos))]

    return _scattered(model, fiber, weights, *angles)[..., 0]


def pdf(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    *,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Floats:
    """Probability density, per steradian, with which `sample` chooses a direction.

    `evaluate` with 1 in place of the attenuation: int pdf d omega_o = 1.

    Args:
        fiber, theta_i, theta_o, phi, rule, detector, incidence: as in `evaluate`.

    Returns:
        Density per steradian, shape broadcast(angles); no color axis.

    Raises:
        ValueError: as `evaluate`.
    """
    fiber, angles = prepare(fiber, theta_i, theta_o, phi)
    return _pdf(_model(rule, detector, incidence), fiber, *angles)


@partial(jax.jit, static_argnames="model")
def _sample(model: Model, fiber: Fiber, theta_i, u: Any) -> Sample:
    h = 2 * open_unit(u[..., 0]) - 1
    cos = jnp.sqrt((1 - h) * (1 + h))
    offset = Offset(jnp.atan2(h, cos), h, cos)
    seen, beta_n = DETECTORS[model.detector], model.shape(fiber, 0).beta_n
    phi = wrap(
        seen.quantile(open_unit(u[..., 1]), seen.width(beta_n)) - 2 * offset.gamma
    )
    cones, widths = _cone(fiber, theta_i, phi), _width(fiber, phi)
    theta_o = sample_cone(cones, widths, u[..., 2], u[..., 3])
    one = ray(offset, model.section(fiber, theta_i, theta_o))
    weight = drop_color(model.attenuation(0, one).stacked(), fiber.sigma_a)
    phi = jnp.broadcast_to(phi, theta_o.shape)
    return Sample(theta_o, phi, weight, jnp.zeros_like(phi, int))


def sample(
    fiber: Fiber,
    theta_i: Reals,
    u: Reals,
    *,
    rule: Rule = DEFAULT,
    detector: str = "normal",
    incidence: str = "theta_d",
) -> Sample:
    """A direction drawn from `pdf`, and the weight that makes it estimate `evaluate`.

    h uniform; phi = -2 asin h + a deviate of the detector; theta_o from the M of that
    phi; weight = A(0, h), at most 1.

    Args:
        fiber, theta_i: as in `evaluate`.
        u: uniform numbers in [0, 1), shape (..., 4): offset, azimuth, two for M.
        rule: accepted as in `pdf`; nothing is integrated here.
        detector, incidence: static, as in `evaluate`.

    Returns:
        `fiberjax.Sample` of shape broadcast(theta_i, u[..., 0]); p is 0.

    Raises:
        ValueError: u does not end in an axis of 4, and as `evaluate`.
    """
    last_axis(4, u=u)
    theta_i, u = floats((theta_i,), (u,))
    fiber = cast(fiber, theta_i.dtype)
    return _sample(_model(rule, detector, incidence), fiber, theta_i, u)
