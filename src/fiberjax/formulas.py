"""Formulas that a tolerance allows: of M and angles, and of the detector."""

import math
from collections.abc import Sequence

import numpy as np

from fiberjax.along import Along
from fiberjax.detectors import DETECTORS
from fiberjax.scenes import Scene

FORMS = 1 / 16
"""Share of the tolerance for the form of M and angles, and for that of the detector."""


def _bessel_range(scene: Scene) -> tuple[float, float]:
    """The range of cos theta_cone cos theta_o/v of all lobes, from below and above."""
    tilts = [
        t * a for t in scene.tilts for a in (scene.low("alpha"), scene.high("alpha"))
    ]
    spread = max(map(abs, tilts))
    steepest = max(map(abs, scene.ends("theta_i"))) + spread
    cos = [
        math.cos(min(x, math.pi / 2))
        for x in (steepest, max(map(abs, scene.ends("theta_o"))))
    ]
    betas = [scene.roughness("m", p) for p in (0, 1, 2, None)]
    low = max(0.0, cos[0]) * max(0.0, cos[1]) / max(high for _, high in betas) ** 2
    return 0.99 * low, 1.01 / min(low for low, _ in betas) ** 2


def along(scene: Scene) -> tuple[Along | None, float]:
    """The form of M, and the bound of its error; None for the exact one.

    Sines and cosines rounded to eps move the exponent, the square of their distance
    over 2 v, by some eps/beta_m; what I0 is a polynomial of has a small a to 16 eps.
    """
    tolerance = FORMS * scene.tolerance
    least = min(scene.roughness("m", p)[0] for p in (0, 1, 2, None))
    rounding = (8 / min(least, 1) + 16) * float(np.finfo(scene.dtype).eps)
    power = math.floor(math.log10(max(tolerance, 1e-300)))
    if rounding > tolerance / 2 or 10.0**power < 1e-9:
        return None, 0.0
    return Along(*_bessel_range(scene), 10.0**power / 2), tolerance


def density_tolerance(scene: Scene, lobe: int) -> float:
    """What a formula of the detector may leave out, of its peak.

    The peak of N is at least that of D times the width of D, over a turn.
    """
    low = min(scene.roughness("n", lobe)[0], 1.0)
    return max(FORMS * scene.tolerance * low / 3, float(np.finfo(scene.dtype).eps))


def formulas_said(scene: Scene, lobes: Sequence[int]) -> str:
    """How many formulas of the detector its roughness needs: what a plan says."""
    detector, kept, every = DETECTORS[scene.detector], 0, 0
    for p in lobes:
        tolerance = density_tolerance(scene, p)
        needed = detector.within(*scene.roughness("n", p)).forms(tolerance)
        kept, every = max(kept, len(needed)), len(detector.forms(tolerance))
    return f"at most {kept} of {every} formulas a lobe"
