"""Where the exit azimuth of a smooth fiber takes a given value.

The deflection Phi - p pi is an odd function of gamma = asin h. On [0, pi/2] it rises
from 0 to the caustic and falls from there to its value at grazing; for p <= 1, and
where eta' >= p, it only falls. Azimuths repeat every turn, so that an observer at
x = phi - p pi sees the deflections x + 2 pi m.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.circular import TURN
from fiberjax.section import Offset, Section, deflection, deflection_slope

_STEPS = 4


def offset_at(gamma: Floats) -> Offset:
    """The offset of angle gamma."""
    return Offset(gamma, *numerics.sin_cos(gamma))


def caustic(p: int, section: Section) -> Floats:
    """Angle gamma in [0, pi/2] at which Phi turns back; 0 if it does not.

    cos^2 gamma = (eta'^2 - 1)/(p^2 - 1), for p >= 2 and eta' < p.
    """
    if p < 2:
        return jnp.zeros_like(section.r)
    cosine = numerics.sqrt(section.k) / (section.cos * (p * p - 1) ** 0.5)
    return jnp.arccos(jnp.minimum(cosine, 1))


class Piece(NamedTuple):
    """A range of gamma in [-pi/2, pi/2] on which the deflection is monotone.

    `top` and `end` are the angles where it is largest and smallest, `high` and `low`
    the deflections there; side is 1 where gamma grows from top to end, -1 otherwise.
    All are constants to the derivatives: what is integrated over all pieces does not
    depend on where they meet.
    """

    top: Floats
    end: Floats
    high: Floats
    low: Floats
    side: Any


def pieces(p: int, section: Section) -> list[Piece]:
    """The pieces that together with their mirror images cover [-pi/2, pi/2].

    For p <= 1 all of it falls. Otherwise it rises on [-top, top], which is its own
    mirror image, and falls on [top, pi/2].
    """
    section = jax.lax.stop_gradient(section)
    top = caustic(p, section)
    end = jnp.full_like(top, jnp.pi / 2)
    low = deflection(p, offset_at(end), section)
    if p < 2:
        return [Piece(-end, end, -low, low, 1)]
    high = deflection(p, offset_at(top), section)
    return [Piece(top, -top, high, -high, -1), Piece(top, end, high, low, 1)]


def _inverse_fixed(p, goal, piece, section) -> Floats:
    """The angle of the piece where the deflection is `goal`, which lies in its range.

    With u the distance from the caustic and y^2 how far the deflection fell since, y is
    a power of u between 1 and 3/2 with a slowly varying factor: Newton's method in log
    u and log y. What rounding leaves of y^2 next to the caustic is no signal.
    """
    if p == 0:
        return -goal / 2
    if p == 1:
        # b + atan2(sin b, eta' - cos b)
        c, b = section.cos, -goal / 2
        sin_half, cos_half = numerics.sin_cos(b / 2)
        up = 2 * c * sin_half * cos_half
        ahead = section.k / (section.r + c) + 2 * c * sin_half * sin_half
        return b + jnp.atan2(up, ahead)
    # What rises is odd: the half from 0 to the caustic stands for all of it.
    rises = jnp.asarray(piece.side) < 0
    mirror = jnp.where(rises & (goal < 0), -1, 1)
    low, end = (jnp.where(rises, 0, x) for x in (piece.low, piece.end))
    noise = 8 * p * jnp.finfo(goal.dtype).eps
    fall = jnp.maximum(piece.high - mirror * goal, noise)
    whole = jnp.maximum(piece.high - low, noise)
    length = jnp.abs(end - piece.top)

    def step(_, u):
        here = offset_at(piece.top + piece.side * u)
        fallen = jnp.maximum(piece.high - deflection(p, here, section), noise)
        slope = jnp.abs(deflection_slope(p, here, section))
        # (fall/fallen)^(1/power), by a Pade approximant that is exact for power 1.
        power = jnp.clip(u * slope / fallen, 1, 4)
        up, down = (power + 1) * fall, (power - 1) * fall
        grown = (up + (power - 1) * fallen) / (down + (power + 1) * fallen)
        return jnp.minimum(u * grown, length)

    u = jax.lax.fori_loop(0, _STEPS, step, length * jnp.sqrt(fall / whole))
    return mirror * (piece.top + piece.side * u)


def inverse(p: int, goal: Floats, piece: Piece, section: Section) -> Floats:
    """The angle of the piece where the deflection is `goal`; an end if it is beyond.

    Derivatives are those of the implicit function, 0 at the ends.
    """
    fixed = jax.lax.stop_gradient(section)
    inside = (goal > piece.low) & (goal < piece.high)
    root = _inverse_fixed(p, jax.lax.stop_gradient(goal), piece, fixed)
    root = jnp.clip(root, -jnp.pi / 2, jnp.pi / 2)
    here = offset_at(root)
    slope = jnp.abs(deflection_slope(p, here, fixed))
    slope = jnp.maximum(slope, jnp.finfo(slope.dtype).eps ** 0.5)
    # One more Newton step, which carries the derivatives.
    step = (goal - deflection(p, here, section)) / slope
    found = jnp.clip(root - piece.side * step, -jnp.pi / 2, jnp.pi / 2)
    return jnp.where(inside, found, jnp.where(goal >= piece.high, piece.top, piece.end))


def half_turns(p: int, x: Floats, section: Section) -> Floats:
    """Every gamma in (0, pi/2) where x - Phi or x + Phi is half a turn from p pi.

    In ascending order along a new first axis, as many as there can be for this p: those
    that do not exist coincide with an end of the piece they would lie on.

    Args:
        p: lobe.
        x: phi - p pi in radians, in [-pi, pi].
        section: what the light sees.
    """
    found = []
    # At most (p - 1) pi is reached at the caustic, and -pi at grazing.
    x = jnp.pi - jnp.abs(x)
    turns = [TURN * m + sign * x for m in range(p // 2 + 1) for sign in (-1, 1)]
    for piece in pieces(p, section):
        # What lies beyond the range of the piece leads to its ends.
        goals = turns[1:p] if piece.side < 0 else turns[max(p, 1) - 1 :: -1]
        if goals:
            found.append(inverse(p, jnp.stack(goals), piece, section))
    return jnp.maximum(jnp.concatenate(found), 0)
