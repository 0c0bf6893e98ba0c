"""The cross-section of a fiber that light of one inclination sees, and a ray in it."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics, programs
from fiberjax._types import Floats
from fiberjax.fresnel import Interface, interface
from fiberjax.path import A, escaping


class Offset(NamedTuple):
    """An offset h = sin gamma in (-1, 1), as the angle and both its functions.

    Carrying the cosine keeps grazing rays accurate.
    """

    gamma: Floats
    sin: Floats
    cos: Floats


class Section(NamedTuple):
    """The cross-section of a fiber that light of one inclination sees.

    cos is |cos theta_d|, k is eta^2 - 1 and r = sqrt(k + cos^2) is eta' cos.
    """

    cos: Floats
    eta: Floats
    k: Floats
    r: Floats
    sigma_a: Floats | None


def section(theta_d: Floats, eta: Floats, sigma_a: Floats | None = None) -> Section:
    """The section at an inclination, with sigma_a of shape () or (C,), or None."""
    return section_of(jnp.cos(theta_d), eta, sigma_a)


def section_of(cos: Floats, eta: Floats, sigma_a: Floats | None = None) -> Section:
    """The section at an inclination of which the cosine is known."""
    cos, k = jnp.abs(cos), (eta - 1) * (eta + 1)
    return Section(cos, eta, k, jnp.sqrt(k + cos * cos), sigma_a)


class Light(NamedTuple):
    """What is left of a ray: what is common to all colors, and a factor for each.

    One array for each color: arrays with an axis of three are slow to add up.
    """

    common: Floats
    colors: tuple[Floats, ...]

    def times(self, factor: Floats | float) -> tuple[Floats, ...]:
        """What is left of a factor, for each color."""
        share = self.common * factor
        return tuple(share * color for color in self.colors)

    def mean(self) -> Floats:
        """The mean over colors."""
        return self.common * (sum(self.colors[1:], self.colors[0]) / len(self.colors))

    def stacked(self) -> Floats:
        """All colors along a last axis."""
        return stacked(self.times(1))


def stacked(colors: Sequence[Floats]) -> Floats:
    """All colors along a last axis.

    Stacked along a first one, which is then moved: XLA interleaves at a tenth of that
    speed on CPUs.
    """
    return jnp.moveaxis(jnp.stack(jnp.broadcast_arrays(*colors)), 0, -1)


def colorless(share: Floats) -> Light:
    """The same for all colors, of which there is one."""
    return Light(share, (jnp.ones((), share.dtype),))


class Ray(NamedTuple):
    """Attenuation of a ray: the surface, and one segment of the inside.

    T and `absorbed`, 1 - T from a formula of its own, have one array for each color;
    both are None for a clear fiber.
    """

    surface: Interface
    T: tuple[Floats, ...] | None
    absorbed: tuple[Floats, ...] | None

    def A(self, p: int) -> Light:
        """A_p of this ray."""
        F, passed, _ = self.surface
        common = A(p, F, 1.0, passed)
        if self.T is None:
            return colorless(common)
        return Light(common, tuple(T**p for T in self.T))

    def A_rest(self, p: int) -> Light:
        """Sum of A_q of this ray over q >= p."""
        F, passed, _ = self.surface
        common = passed * F ** (p - 1)
        if self.T is None or self.absorbed is None:
            # (1 - F)/(1 - F T) is 1.
            return colorless(common)
        each = zip(self.T, self.absorbed, strict=True)
        colors = (escaping(F, passed, lost) * T**p for T, lost in each)
        return Light(common, tuple(colors))


@jax.custom_jvp
def _segment(sin: Floats, cos: Floats, c: Floats, k: Floats, eta: Floats) -> Floats:
    """Length of a segment, 2 eta g/r^2 with r^2 = k + c^2; k = eta^2 - 1."""
    mu = c * cos
    return numerics.sqrt(k + mu * mu) * (2 * eta / (k + c * c))


@_segment.defjvp
def _segment_jvp(primals, tangents):
    """With s = 1 - c^2 and y = (c sin/r)^2 the terms that cancel are left out.

    In eta 2 (y (eta^2 + s) - s)/(g r^2), in c 2 eta c (cos^2 - 2 (g/r)^2)/(g r^2), in
    cos 2 eta c^2 cos/(g r^2). The tangent of k is that of eta.
    """
    sin, cos, c, k, eta = primals
    _, dcos, dc, _, deta = tangents
    mu, s, r2 = c * cos, (1 - c) * (1 + c), k + c * c
    y = (c * sin) * (c * sin / r2)
    square = k + mu * mu
    over = numerics.quotient(2.0, numerics.sqrt(square), 0.0) / r2
    # At grazing (g/r)^2 = 1 - y must not come from a difference.
    by_c = (cos * cos - 2 * (square / r2)) * dc + mu * dcos
    moved = (y * (eta * eta + s) - s) * deta + (eta * c) * by_c
    return _segment(*primals), over * moved


def ray(offset: Offset, section: Section) -> Ray:
    """The ray that enters at `offset`."""
    surface = interface(section.cos * offset.cos, section.eta)
    if section.sigma_a is None:
        return Ray(surface, None, None)
    where = offset.sin, offset.cos, section.cos, section.k, section.eta
    length = programs.stored(lambda: _segment(*where), section.k)
    depths = [sigma_a * length for sigma_a in jnp.atleast_1d(section.sigma_a)]
    T, absorbed = zip(*map(numerics.absorption, depths), strict=True)
    return Ray(surface, T, absorbed)


def _g(offset: Offset, section: Section) -> tuple[Floats, Floats]:
    """Cosine of incidence mu, and g = sqrt(eta^2 - 1 + mu^2)."""
    mu = section.cos * offset.cos
    return mu, numerics.sqrt(section.k + mu * mu)


def refraction(offset: Offset, section: Section) -> Floats:
    """gamma_t = asin(h/eta') = atan2(|cos theta_d| sin gamma, g).

    eta' is never formed, so theta_d = 90 deg and eta = 1 need no care.
    """
    _, g = _g(offset, section)
    return numerics.acute_angle(section.cos * offset.sin, g, section.r)


def deflection(p: int, offset: Offset, section: Section) -> Floats:
    """Phi - p pi = 2 p gamma_t - 2 gamma_i, an odd function of the offset."""
    if p == 0:
        return -2 * offset.gamma
    return 2 * p * refraction(offset, section) - 2 * offset.gamma


def deflection_slope(p: int, offset: Offset, section: Section) -> Floats:
    """Derivative of `deflection` in gamma, 2 (p mu - g)/g.

    Evaluated as 2 ((p^2 - 1) mu^2 - k)/(g (p mu + g)), which keeps its digits where the
    slope of TT vanishes, as eta -> 1. At mu = g = 0 it is 0.
    """
    if p == 0:
        return jnp.full_like(offset.cos, -2)
    mu, g = _g(offset, section)
    over = numerics.quotient(1.0, g, 0.0)
    both = numerics.quotient(1.0, p * mu + g, 0.0)
    return 2 * ((p * p - 1) * (mu * over) * (mu * both) - (section.k * over) * both)
