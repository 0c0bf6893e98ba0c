"""Where the exit azimuth of a smooth fiber takes a given value.

On [0, pi/2] the deflection Phi - p pi rises from 0 to the caustic and falls from there
to its value at grazing; for p <= 1 it only falls.
"""

import jax
import jax.numpy as jnp

from fiberjax import numerics
from fiberjax._types import Floats
from fiberjax.path import Offset, deflection, deflection_slope

_STEPS = 48


def offset_at(gamma: Floats) -> Offset:
    """The offset of angle gamma."""
    return Offset(gamma, jnp.sin(gamma), jnp.cos(gamma))


def caustic(p: int, theta_d: Floats, eta: Floats) -> Floats:
    """Angle gamma in [0, pi/2] at which Phi turns back; 0 if it does not.

    cos^2 gamma = (eta'^2 - 1)/(p^2 - 1), for p >= 2 and eta' < p.
    """
    if p < 2:
        return jnp.zeros(jnp.broadcast_shapes(theta_d.shape, eta.shape), theta_d.dtype)
    c = jnp.abs(jnp.cos(theta_d))
    cosine = numerics.sqrt((eta - 1) * (eta + 1)) / (c * (p * p - 1) ** 0.5)
    return jnp.arccos(jnp.minimum(cosine, 1))


def _crossing(p, target, theta_d, eta, low, high) -> Floats:
    """The gamma in [low, high] where the monotone deflection is `target`.

    Newton's method inside a bracket. Where the target is not reached it is the end that
    comes nearest, with derivative 0; elsewhere the derivative is that of the implicit
    function.
    """
    fixed = jax.lax.stop_gradient((theta_d, eta))
    goal, low, high = jax.lax.stop_gradient(jnp.broadcast_arrays(target, low, high))

    def excess(gamma):
        return deflection(p, offset_at(gamma), *fixed) - goal

    def slope(gamma):
        return deflection_slope(p, offset_at(gamma), *fixed)

    at_low, at_high = excess(low), excess(high)
    inside = (at_low < 0) != (at_high < 0)
    rising = at_high > at_low

    def step(_, state):
        low, high, gamma = state
        value = excess(gamma)
        before = (value < 0) == rising
        low, high = jnp.where(before, gamma, low), jnp.where(before, high, gamma)
        newton = gamma - numerics.quotient(value, slope(gamma), jnp.inf)
        safe = (newton > low) & (newton < high)
        return low, high, jnp.where(safe, newton, (low + high) / 2)

    start = (low, high, (low + high) / 2)
    root = jax.lax.fori_loop(0, _STEPS, step, start)[2]
    # One more Newton step, which carries the derivatives.
    rest = deflection(p, offset_at(root), theta_d, eta) - target
    root = root - numerics.quotient(rest, slope(root), 0.0)
    nearest = jnp.where(jnp.abs(at_low) < jnp.abs(at_high), low, high)
    return jnp.where(inside, root, nearest)


def half_turns(p: int, x: Floats, theta_d: Floats, eta: Floats) -> Floats:
    """Every gamma in (0, pi/2) where x - Phi or x + Phi is half a turn from p pi.

    In ascending order along a new first axis, as many as there can be for this p: those
    that do not exist coincide with an end of the piece they would lie on.

    Args:
        p: lobe.
        x: phi - p pi in radians, in [-pi, pi].
        theta_d: difference angle in radians.
        eta: index of refraction.
    """
    x = jnp.abs(x)
    top = caustic(p, theta_d, eta)
    # At most (p - 1) pi is reached at the caustic, and -pi at grazing.
    odd = [jnp.pi * (2 * m + 1) + sign * x for m in range(p) for sign in (-1, 1)]
    values = [x - jnp.pi, *odd[: max(p - 1, 0)]]
    falling = jnp.stack(values[::-1])
    end = jnp.full_like(top, jnp.pi / 2)
    found = [_crossing(p, falling, theta_d, eta, top, end)]
    if p > 1:
        rising = jnp.stack(values[1:])
        found = [_crossing(p, rising, theta_d, eta, jnp.zeros_like(top), top), *found]
    return jnp.concatenate(found)
