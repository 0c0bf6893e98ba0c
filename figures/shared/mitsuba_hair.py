"""Mitsuba's hair on its LLVM back end, on one core, as calls that can be timed."""

import importlib
import subprocess
import sys
from functools import partial
from typing import Any

import numpy as np

PROBE = """
import mitsuba, drjit
mitsuba.set_variant("llvm_ad_rgb")
assert drjit.sum(drjit.arange(mitsuba.Float, 10))[0] == 45
"""
ROUGHNESS, TILT = 0.5, -2.0
SCALARS = ("longitudinal_roughness", "azimuthal_roughness", "scale_tilt", "eta")


def runs() -> bool:
    """Whether it is installed and its LLVM works, which may crash the process."""
    probe = [sys.executable, "-c", PROBE]
    return subprocess.run(probe, capture_output=True, check=False).returncode == 0


def deviations(roughness: float) -> tuple[float, float]:
    """beta_m and beta_n of its roughness: Chiang et al. 2016."""
    r = roughness
    beta_m = 0.726 * r + 0.812 * r**2 + 3.7 * r**20
    return beta_m, 0.265 * r + 1.194 * r**2 + 5.372 * r**22


def calls(given, out, u, eta, sigma_a) -> dict[str, Any]:
    """eval, pdf, sample and the gradient; vectors have the tangent first."""
    mi: Any = importlib.import_module("mitsuba")
    dr: Any = importlib.import_module("drjit")
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    shape = {"int_ior": eta, "ext_ior": 1.0, "scale_tilt": TILT, "scale": 1.0}
    rough = {"longitudinal_roughness": ROUGHNESS, "azimuthal_roughness": ROUGHNESS}
    color = {"type": "rgb", "value": list(sigma_a)}
    hair = mi.load_dict({"type": "hair", **shape, **rough, "sigma_a": color})
    numbers = [mi.Float(np.ascontiguousarray(u[:, k])) for k in range(3)]
    at = dr.zeros(mi.SurfaceInteraction3f, len(given))
    columns = [
        [mi.Float(np.ascontiguousarray(w[:, k])) for k in (1, 0, 2)]
        for w in (given, out)
    ]
    at.wi, to = (mi.Vector3f(*sides) for sides in columns)
    context = mi.BSDFContext()
    dr.eval(numbers, at, to)

    def done(x):
        dr.eval(x)
        dr.sync_thread()

    def gradient():
        held = mi.traverse(hair)
        leaves = [held[k] for k in SCALARS] + [held["sigma_a.value"]]
        for leaf in leaves:
            dr.enable_grad(leaf)
        held.update()
        dr.backward(dr.sum(dr.sum(hair.eval(context, at, to))))
        done([dr.grad(leaf) for leaf in leaves])
        for leaf in leaves:
            dr.disable_grad(leaf)
        held.update()

    first, second = numbers[0], mi.Point2f(*numbers[1:])
    return {
        "eval": lambda: done(hair.eval(context, at, to)),
        "pdf": lambda: done(hair.pdf(context, at, to)),
        "sample": lambda: done(hair.sample(context, at, first, second)),
        "gradient": partial(gradient),
    }
