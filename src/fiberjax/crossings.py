"""Where the exit azimuth of a smooth fiber takes a given value.

The deflection Phi - p pi is an odd function of gamma = asin h. On [0, pi/2] it rises
from 0 to the caustic and falls from there to its value at grazing; for p <= 1, and
where eta' >= p, it only falls. Azimuths repeat every turn, so that an observer at
x = phi - p pi sees the deflections x + 2 pi m of [0, pi/2] and, from the other half,
-x + 2 pi m.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.path import Offset, Section, deflection, deflection_slope

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
    """A piece of [0, pi/2] on which the deflection is monotone.

    `top` and `end` are the angles where it is largest and smallest, `high` and `low`
    the deflections there. All are constants to the derivatives: what is integrated over
    all pieces does not depend on where they meet.
    """

    top: Floats
    end: Floats
    high: Floats
    low: Floats
    rising: bool


def pieces(p: int, section: Section) -> list[Piece]:
    """The pieces in ascending order of gamma: one for p <= 1, else two."""
    section = jax.lax.stop_gradient(section)
    top = caustic(p, section)
    high = deflection(p, offset_at(top), section)
    ends = [(jnp.zeros_like(top), True), (jnp.full_like(top, jnp.pi / 2), False)]
    return [
        Piece(top, end, high, deflection(p, offset_at(end), section), rising)
        for end, rising in (ends if p > 1 else ends[1:])
    ]


def images(p: int, x: Floats, piece: Piece) -> list[Floats]:
    """The deflections of a piece that an observer at x can see, in ascending order.

    Besides those in the range of the piece they are the nearest ones on either side.
    """
    x = jnp.abs(x)
    turn = 2 * jnp.pi
    pairs = [(turn * m - x, turn * m + x) for m in range(p // 2 + 2)]
    ascending = [seen for pair in pairs for seen in pair]
    # At most (p - 1) pi is reached at the caustic, and -pi at grazing.
    return (
        ascending[: p + 1] if piece.rising else [x - turn, *ascending[: max(p, 1) + 1]]
    )


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
    noise = 8 * p * jnp.finfo(goal.dtype).eps
    fall = jnp.maximum(piece.high - goal, noise)
    whole = jnp.maximum(piece.high - piece.low, noise)
    length = jnp.abs(piece.end - piece.top)
    side = -1 if piece.rising else 1

    def step(_, u):
        here = offset_at(piece.top + side * u)
        fallen = jnp.maximum(piece.high - deflection(p, here, section), noise)
        slope = jnp.abs(deflection_slope(p, here, section))
        # (fall/fallen)^(1/power), by a Pade approximant that is exact for power 1.
        power = jnp.clip(u * slope / fallen, 1, 4)
        up, down = (power + 1) * fall, (power - 1) * fall
        grown = (up + (power - 1) * fallen) / (down + (power + 1) * fallen)
        return jnp.minimum(u * grown, length)

    u = jax.lax.fori_loop(0, _STEPS, step, length * jnp.sqrt(fall / whole))
    return piece.top + side * u


def inverse(p: int, goal: Floats, piece: Piece, section: Section) -> Floats:
    """The angle of the piece where the deflection is `goal`; an end if it is beyond.

    Derivatives are those of the implicit function, 0 at the ends.
    """
    fixed = jax.lax.stop_gradient(section)
    inside = (goal > piece.low) & (goal < piece.high)
    root = _inverse_fixed(p, jax.lax.stop_gradient(goal), piece, fixed)
    root = jnp.clip(root, 0, jnp.pi / 2)
    here = offset_at(root)
    slope = jnp.abs(deflection_slope(p, here, fixed))
    slope = jnp.maximum(slope, jnp.finfo(slope.dtype).eps ** 0.5)
    # One more Newton step, which carries the derivatives.
    step = (goal - deflection(p, here, section)) / slope
    found = jnp.clip(root + (step if piece.rising else -step), 0, jnp.pi / 2)
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
    for piece in pieces(p, section):
        # What lies beyond the range of the piece leads to its ends.
        seen = images(p, jnp.pi - jnp.abs(x), piece)[1:-1]
        goals = jnp.stack(seen if piece.rising else seen[::-1])
        found.append(inverse(p, goals, piece, section))
    return jnp.concatenate(found)
