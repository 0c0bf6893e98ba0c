"""How many nodes graded in gamma a lobe needs: a model, fitted to searches."""

import math
from typing import Any, NamedTuple

REST = 3
"""All other lobes together are as smooth in h as this one."""


class Fit(NamedTuple):
    """Constants of `needed`: numbers of nodes, the last three for each e-fold of error.

    detector   for a turn from node to node in units of the detector's wave length
    power      exponent by which the two terms are joined
    least      for any lobe
    segment    for each segment inside
    graded     for each e-fold of the grading
    even       for a lobe without one
    bounce     for each segment beside it
    """

    detector: float
    power: float
    least: float
    segment: float
    graded: float
    even: float
    bounce: float


FIT = Fit(1.06, 2.4, 4.3, 0.5, 0.355, 0.43, 0.1)
"""Near the fit that figures/nodes.py makes, and hardly ever below what it finds."""


def turning(p: int, cos: Any, eta: Any, delta: Any, xp: Any):
    """The fastest that Phi turns from node to node, times their number.

    |Phi'|/2 over the density of Gauss-Legendre nodes, at its largest along the map of
    `graded_offsets`, for every |cos theta_d| from cos on. eta, the scale delta of the
    grading and the result are arrays of xp, NumPy or jax.numpy.
    """
    stretch = xp.arcsinh(math.pi / 2 / delta)
    t = xp.linspace(0, 1, 9, dtype=delta.dtype)
    x = delta[..., None] * xp.sinh(stretch[..., None] * (1 - t))
    spacing = xp.sqrt((delta * delta)[..., None] + x * x)
    k = ((eta - 1) * (eta + 1))[..., None]

    def bent(cos):
        mu = cos * xp.sin(xp.minimum(x, math.pi / 2))
        # Not 0/0 at x = 0 and eta = 1.
        return p * mu / xp.sqrt(k + mu * mu + 1e-30)

    # Phi'/2 = bent - 1 grows with the cosine: one end or the other is fastest.
    rate = xp.maximum(1 - bent(cos), bent(1.0) - 1)
    return stretch * xp.max(spacing * rate * xp.sqrt(t * (1 - t) + 0.02), -1)


LAYER = 0.16
"""Nodes of an average for each e-fold of error and of the grading of its layer.

0.14 serves all that figures/nodes.py looks at.
"""

FEWEST = FIT.least + FIT.segment * REST
"""Nodes of an average before any digit."""


def averaged(delta: Any, layer: Any, digits: Any, xp: Any):
    """Nodes of an average for an error below exp(-digits), relative to it.

    As `needed` for what changes over `delta`, and for the rest, which changes over
    `layer` but is small there: fewer are needed for that.
    """
    smooth = needed(0.0, delta, REST, digits, xp)
    stretch = xp.arcsinh(math.pi / 2 / layer)
    return xp.maximum(smooth, FEWEST + LAYER * stretch * digits)


def resolved(order: int) -> float:
    """The tolerance to which so many nodes have the layer of that tolerance.

    `averaged` for the layer tolerance^(2/5), solved.
    """
    linear, more = math.log(math.pi) / 0.8, max(order - FEWEST, 0) / (0.4 * LAYER)
    return math.exp(linear - math.sqrt(linear * linear + more))


def needed(turns: Any, delta: Any, p: Any, digits: Any, xp: Any, fit: Fit = FIT):
    """Nodes for an error below exp(-digits), relative to the peak over phi.

    One term is for the detector, of which `turns` is the bandwidth times `turning`, one
    for the optics, which change over `delta` at grazing.
    """
    stretch = xp.arcsinh(math.pi / 2 / delta)
    rate = xp.maximum(fit.graded * stretch, fit.even + fit.bounce * p)
    smooth = fit.least + fit.segment * p + rate * digits
    return ((fit.detector * turns) ** fit.power + smooth**fit.power) ** (1 / fit.power)
