"""The near-field model: S cos(theta_o) of a fiber of which the offset h is known.

S = sum_p A_p(h) M_p D(phi - Phi(p, h)), Chiang et al. 2016. The far field with
incidence="theta_i" is its mean over h, 1/2 int S dh: attenuations and eta' are taken at
theta_i, so that a clear fiber returns all light at every h, whatever the widths and
tilts of its lobes. `fiberjax.directions` has the same functions of unit vectors. Static
choices:

    lobes      the lobes p that are told apart; default R, TT, TRT
    rest       whether all lobes above the highest of them are added in closed form, as
               one untilted lobe of the last width, uniform in azimuth
    detector   density in azimuth, "logistic" (Chiang; scale sqrt(pi/8) beta_n) or
               "normal" (d'Eon)
    compat     None, or "pbrt" or "mitsuba" for the M of that renderer, with its log I0

theta_i belongs to the direction that h is the offset of: in a path tracer that walks
from the camera, the direction towards the camera.
"""

from typing import Any

import jax
import jax.numpy as jnp

from fiberjax import entering, numerics
from fiberjax._types import Floats, Reals, choice, floats, last_axis
from fiberjax.auto import DEFAULT
from fiberjax.compat import LONGITUDINAL
from fiberjax.fiber import Fiber, cast
from fiberjax.model import Model
from fiberjax.sampling import GRADIENTS, Sample
from fiberjax.spherical import Inclination

Lobes = tuple[int, ...]


def near_model(lobes: Lobes, rest: bool, detector: str, compat: Any) -> Model:
    """The static choices; ValueError if one is unknown."""
    choice("compat", compat, tuple(LONGITUDINAL))
    return Model(lobes, rest, DEFAULT, detector, "theta_i")


def prepare(fiber: Fiber, leading: tuple, others: tuple) -> tuple[Fiber, list[Floats]]:
    """Fiber and numbers in the dtype of the leading ones, angles or directions."""
    count = len(leading) + len(others)
    arrays = floats(leading, (*others, *jax.tree.leaves(fiber)))[:count]
    return cast(fiber, arrays[0].dtype), arrays


def _inclination(theta: Floats) -> Inclination:
    return Inclination(*numerics.sin_cos(theta))


def _seen(theta_i: Floats, theta_o: Floats, phi: Floats) -> entering.Seen:
    return entering.Seen(_inclination(theta_i), _inclination(theta_o), phi)


def _shown(out: Inclination, phi: Floats, *_: Floats) -> tuple[Floats, Floats]:
    return numerics.acute_angle(*out, jnp.ones_like(phi)), phi


def evaluate(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    h: Reals,
    *,
    lobes: Lobes = (0, 1, 2),
    rest: bool = True,
    detector: str = "logistic",
    compat: str | None = None,
) -> Floats:
    """Scattered throughput per steradian at an offset, S cos(theta_o).

    sum_p A_p(h) M(theta_cone_p, theta_o, v_p) D(phi - Phi(p, h)), theta_cone_p =
    -theta_i + tilt, the difference wrapped to [-pi, pi], plus
    A_rest(h) M(-theta_i, theta_o, v_last)/(2 pi). Its integral over the directions of
    theta_o is sum_p A_p(h), 1 for a clear fiber with the rest.

    Args:
        fiber: one fiber; jax.vmap makes many. A beta below 64 eps is 64 eps.
        theta_i: inclination of the given direction in radians, [-pi/2, pi/2].
        theta_o: inclination of the direction scattered into, radians, [-pi/2, pi/2].
        phi: azimuth phi_o - phi_i in radians, any real.
        h: offset of the given direction, in [-1, 1], sin(gamma_i). Derivatives in h are
            infinite at |h| = 1; 0 is returned.
        lobes, rest, detector, compat: static, see the module.

    Returns:
        S cos(theta_o) per steradian, shape broadcast(angles, h) + sigma_a.shape, dtype
        of the angles. The papers' f is this over cos(theta_o).

    Raises:
        ValueError: a field of the fiber has the wrong shape, or a choice is unknown.

    Reference: Chiang et al. 2016; errata: seed codes leave phi - Phi unwrapped, and
    gamma_i = acos(n . omega) loses the sign of h.
    """
    model = near_model(lobes, rest, detector, compat)
    fiber, (*where, h) = prepare(fiber, (theta_i, theta_o, phi), (h,))
    return entering.evaluate(model, compat, _seen, fiber, ((*where, h), ()))


def pdf(
    fiber: Fiber,
    theta_i: Reals,
    theta_o: Reals,
    phi: Reals,
    h: Reals,
    *,
    lobes: Lobes = (0, 1, 2),
    rest: bool = True,
    detector: str = "logistic",
    compat: str | None = None,
) -> Floats:
    """Probability density, per steradian, with which `sample` chooses a direction.

    sum_p w_p M_p D(phi - Phi(p, h)), w_p the channel mean of A_p(h) over the sum of
    them, all equal where no light is left. int pdf d omega_o = 1.

    Args:
        fiber, theta_i, theta_o, phi, h: as in `evaluate`.
        lobes, rest, detector, compat: static, as given to `sample`.

    Returns:
        Density per steradian, shape broadcast(angles, h); no color axis.

    Raises:
        ValueError: as `evaluate`.

    Reference: Chiang et al. 2016.
    """
    model = near_model(lobes, rest, detector, compat)
    fiber, (*where, h) = prepare(fiber, (theta_i, theta_o, phi), (h,))
    return entering.pdf(model, compat, _seen, fiber, ((*where, h), ()))


def sample(
    fiber: Fiber,
    theta_i: Reals,
    h: Reals,
    u: Reals,
    *,
    lobes: Lobes = (0, 1, 2),
    rest: bool = True,
    detector: str = "logistic",
    compat: str | None = None,
    gradient: str = "reparameterized",
) -> Sample:
    """A direction drawn from `pdf` at an offset, and evaluate/pdf there.

    A lobe by its share of the channel mean of A_p(h), theta_o from its M, exactly, phi
    = Phi(p, h) + a deviate of the detector; that of the rest is uniform.

    Args:
        fiber: one fiber; beta_m = 0 and beta_n = 0 are allowed, as 64 eps.
        theta_i: inclination of the given direction in radians, [-pi/2, pi/2].
        h: offset of the given direction, in [-1, 1].
        u: uniform numbers in [0, 1), shape (..., 4): lobe, two for M, azimuth; none is
            split in two. They are moved to the centers of their cells.
        lobes, rest, detector: static, see the module.
        compat: static, as in `evaluate`, for the weight; directions are drawn from the
            exact M in any case.
        gradient: static, "reparameterized" or "detached", as in `fiberjax.sample`.

    Returns:
        `Sample` of shape broadcast(theta_i, h, u[..., 0]). Where no light is left in
        any lobe the weight is 0.

    Raises:
        ValueError: u does not end in an axis of 4, and as `evaluate`.

    Reference: Chiang et al. 2016; d'Eon et al. 2013 for M. Renderers that split one
    number in two, or leave the inclination of the rest at 0, fail a chi-square test.
    """
    model = near_model(lobes, rest, detector, compat)
    choice("gradient", gradient, GRADIENTS)
    last_axis(4, u=u)
    fiber, (theta_i, h, u) = prepare(fiber, (theta_i,), (h, u))
    (theta_o, phi), weight, p = entering.sample(
        model, compat, gradient, _inclination, _shown, fiber, ((theta_i, h), (u,))
    )
    return Sample(theta_o, phi, weight, p)
