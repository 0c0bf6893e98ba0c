"""Which rays of a smooth fiber leave at a given azimuth, and where their azimuth turns.

An observer at phi sees the rays whose deflection Phi - p pi is x = phi - p pi up to
whole turns. `crossings` finds them piece by piece and image by image; here each of them
is counted once, has its sign, and derivatives of every order.
"""

from functools import partial
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from fiberjax import numerics
from fiberjax._types import Floats, Reals, floats, lobe_number
from fiberjax.circular import TURN, wrap
from fiberjax.crossings import Piece, inverse, offset_at, pieces
from fiberjax.section import Offset, Section, deflection, deflection_slope, section

Mask: TypeAlias = Bool[Array, "..."]


class Caustics(NamedTuple):
    """Where Phi turns back at an offset h >= 0; the other place is -h, at -phi."""

    h: Floats
    phi: Floats
    exists: Mask


class Roots(NamedTuple):
    """The offsets of the rays that leave at one azimuth, along a new first axis."""

    h: Floats
    exists: Mask


class Rays(NamedTuple):
    """The rays that leave at one azimuth, along a new first axis.

    `offset` is |h|, `sign` the sign of h and `slope` |dPhi/dgamma|.
    Where there is no ray, h is 0 and the slope 1.
    """

    offset: Offset
    sign: Floats
    slope: Floats
    exists: Mask


def _offset_at(gamma: Floats) -> Offset:
    """The offset of angle gamma; pi/2 rounded to float32 is past the pole."""
    offset = offset_at(gamma)
    return offset._replace(cos=jnp.abs(offset.cos))


@partial(jax.custom_jvp, nondiff_argnums=(0, 3))
def _angle(p: int, goal: Floats, section: Section, number: int) -> Floats:
    """The angle in [0, pi/2] where the deflection is `goal`, on one of the pieces.

    The closed form for p <= 1 is as good as it gets; elsewhere a step of Newton's
    method takes out the error that `inverse` may leave. The derivative is that of the
    implicit function; where that is infinite, on a caustic, it is 0.
    """
    piece = pieces(p, section)[number]
    gamma = inverse(p, goal, piece, section)
    if p < 2:
        return gamma
    offset = _offset_at(gamma)
    rest = deflection(p, offset, section) - goal
    step = numerics.quotient(rest, deflection_slope(p, offset, section), 0.0)
    # Of what rises only the half from 0 on is asked for.
    ends = (0, piece.top) if piece.side < 0 else (piece.top, piece.end)
    polished = jnp.clip(gamma - step, *ends)
    inside = (goal > piece.low) & (goal < piece.high)
    return jnp.where(inside, polished, gamma)


@_angle.defjvp
def _angle_jvp(p, number, primals, tangents):
    (goal, here), (dgoal, dhere) = primals, tangents
    gamma = _angle(p, goal, here, number)
    offset = _offset_at(gamma)
    _, moved = jax.jvp(lambda s: deflection(p, offset, s), (here,), (dhere,))
    return gamma, numerics.quotient(
        dgoal - moved, deflection_slope(p, offset, here), 0.0
    )


def _seen(p: int, x: Floats, piece: Piece) -> tuple[Floats, Floats, Mask]:
    """The deflections of a piece that can be seen from x in [0, pi]: value, sign, mask.

    They are the images 2 pi m + x, of offsets h > 0, and 2 pi m - x, of h < 0; at most
    (p - 1) pi is reached, and -pi. The ends of a piece belong to the one that falls,
    but h = 0 to the one that rises wherever Phi does.
    """
    k = np.arange(0 if piece.side < 0 else -1, max(p - 1, 0))
    k = k.reshape(-1, *[1] * x.ndim)
    sign = jnp.asarray(1 - 2 * (k % 2), x.dtype)
    goal = TURN * jnp.asarray((k + 1) // 2, x.dtype) + sign * x
    if piece.side < 0:
        return goal, sign, goal < piece.high
    # Without a caustic the images x and -x of x = 0 are the same ray.
    once = (k < 0) | (piece.high > 0)
    return goal, sign, (goal >= piece.low) & (goal <= piece.high) & once


def rays(p: int, phi: Floats, section: Section) -> Rays:
    """Every ray of lobe p that leaves at phi, among 2 p - 1 places, or 1."""
    section = section._replace(sigma_a=None)
    shape = jnp.broadcast_shapes(phi.shape, section.r.shape)
    x = jnp.broadcast_to(wrap(phi - (p % 2) * jnp.pi), shape)
    side = jnp.where(x < 0, -1, 1).astype(x.dtype)
    # Rounding may lead beyond half a turn.
    x = jnp.where(side * x > jnp.pi, jnp.pi, side * x)
    found = []
    for number, piece in enumerate(pieces(p, section)):
        goal, sign, exists = _seen(p, x, piece)
        gamma = jnp.where(exists, _angle(p, goal, section, number), 0)
        offset = _offset_at(gamma)
        steep = jnp.where(exists, jnp.abs(deflection_slope(p, offset, section)), 1)
        found.append(Rays(offset, sign * side, steep, exists))
    return jax.tree.map(lambda *parts: jnp.concatenate(parts), *found)


def caustics(p: int, theta_d: Reals, *, eta: Reals) -> Caustics:
    """Offset and azimuth of the caustic of lobe p, where dPhi/dh = 0.

    h = sqrt((p^2 - eta'^2)/(p^2 - 1)) = sqrt(1 - k/((p^2 - 1) cos^2 theta_d)), k =
    eta^2 - 1, for p >= 2 and eta' < p. By symmetry there is another at -h and -phi;
    both merge in h = 0 where eta' = p. The light lies on the side of the caustic where
    |Phi - p pi| is smaller.

    Args:
        p: number of internal segments, a static integer >= 0.
        theta_d: difference angle (theta_o - theta_i)/2 in radians, [-pi/2, pi/2].
        eta: index of refraction, >= 1.

    Returns:
        h in [0, 1], phi = Phi(p, h) wrapped to [-pi, pi], and whether there is a
        caustic; if not, h is 0. Shape broadcast(theta_d, eta), dtype of theta_d.
        Where the caustics merge the derivatives of h are infinite, at eta = 1 that of
        phi in eta; a finite number is returned.

    Raises:
        ValueError: p is not a static integer >= 0.

    Reference: Marschner et al. 2003.
    """
    p = lobe_number("p", p)
    here = section(*floats((theta_d,), (eta,)))
    # cos^2 gamma; for p <= 1 there is no angle where Phi turns back.
    square = here.k / here.cos / here.cos / (p * p - 1) if p > 1 else 1 + 0 * here.r
    h = numerics.sqrt(1 - square)
    exists = square < 1
    cos = numerics.sqrt(jnp.where(exists, square, 1))
    offset = Offset(jnp.atan2(h, cos), h, cos)
    phi = wrap(deflection(p, offset, here) + (p % 2) * jnp.pi)
    return Caustics(h, phi, exists)


@partial(jax.jit, static_argnames="p")
def _roots(p, phi, theta_d, eta):
    found = rays(p, phi, section(theta_d, eta))
    h = jnp.where(found.exists, found.sign * found.offset.sin, 0)
    return Roots(h, found.exists)


def roots(p: int, phi: Reals, theta_d: Reals, *, eta: Reals) -> Roots:
    """Offsets h of all rays of lobe p that leave at azimuth phi.

    Phi(p, h) = phi + 2 pi m, whatever the integer m. R has the one h = -sin(phi/2); TT
    has h = sign(phi) cos(phi/2)/sqrt(1 + a^2 - 2 a |sin(phi/2)|), a = 1/eta', phi in
    [-pi, pi], where |sin(phi/2)| >= a, and none elsewhere; TRT has up to 3. What is
    left of Phi(p, h) - phi is a few rounding errors of p pi.

    Args:
        p: number of internal segments, a static integer >= 0.
        phi: azimuth phi_o - phi_i in radians, any real.
        theta_d: difference angle (theta_o - theta_i)/2 in radians, [-pi/2, pi/2].
        eta: index of refraction, >= 1; broadcasts with the angles.

    Returns:
        h in [-1, 1], and whether there is such a ray; h is 0 if not. Both have shape
        (2 p - 1, *broadcast(angles)), or (1, ...) for p <= 1; the rays are in no order.
        dtype of the angles. Derivatives in phi and eta are infinite on a caustic; 0 is
        returned.

    Raises:
        ValueError: p is not a static integer >= 0.

    Reference: Marschner et al. 2003.
    """
    p = lobe_number("p", p)
    return _roots(p, *floats((phi, theta_d), (eta,)))
