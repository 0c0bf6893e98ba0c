"""The fibers that our tiers are fitted to, and the clear ones that bound them."""

from itertools import product

import jax.numpy as jnp
import numpy as np

from fiberjax.fiber import Fiber

SIGMA_A = (0.0, 0.15, 0.5, 1.15)
TILT = np.radians(2.5)
ROUGH = [(0.09, 0.09), (0.16, 0.16), (0.25, 0.25), (0.36, 0.36), (0.49, 0.49)]
MIXED = [(0.09, 0.25), (0.25, 0.09), (0.49, 0.25), (0.25, 0.49)]
CORNERS = [(0.09, 0.49), (0.49, 0.05)]
OPTICS = [(1.55, 0.0), (1.55, TILT), (1.45, TILT), (1.65, TILT / 2)]
BOUNDING = [(0.09, 0.05), (0.09, 0.09), (0.25, 0.25), (0.49, 0.49), *CORNERS]
OF_MIXED = [(1.5, TILT), (1.6, TILT)]


def fibers() -> list[Fiber]:
    """Those whose lobes are fitted."""
    cases = [(w, o) for w in [*ROUGH, (0.09, 0.05)] for o in OPTICS]
    cases += [(w, o) for w in [*MIXED, *CORNERS] for o in OF_MIXED]
    sigma_a = jnp.asarray(SIGMA_A)
    return [Fiber(eta, *widths, alpha, sigma_a) for widths, (eta, alpha) in cases]


def clear() -> list[Fiber]:
    """Those that must give back no more than they get."""
    cases = product(BOUNDING, (1.45, 1.55, 1.65), (0.0, TILT / 2, TILT))
    return [Fiber(eta, *widths, alpha, jnp.zeros(1)) for widths, eta, alpha in cases]
