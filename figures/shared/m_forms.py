"""M in four forms: as printed, as renderers have it, by i0e, and the library's."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from shared import precise
from shared.naive import printed_M, scaled_M, textbook_M
from shared.style import progress
from shared.timing import Row

import fiberjax

FORMS = {
    "naive": jax.jit(printed_M),
    "log_I0": jax.jit(textbook_M),
    "i0e": jax.jit(scaled_M),
    "ours": jax.jit(fiberjax.M),
}
DTYPES = ("float64", "float32")
V = (1e-4, 0.01, 0.1, 1.0)
# Inclinations of the cone are among those probed, so the peaks of narrow M are too.
THETA_O = np.linspace(-np.pi / 2, np.pi / 2, 8194).astype(np.float32)[1:-1]
PROBED = np.s_[63::64]
CONES = THETA_O[PROBED][::8]


def places(v, dtype):
    """Cones by inclinations, flat, and v: numbers that float32 holds."""
    theta_c, theta_o = np.broadcast_arrays(CONES[:, None], THETA_O)
    flat = (jnp.asarray(x.ravel(), dtype) for x in (theta_c, theta_o))
    return *flat, jnp.asarray(np.float32(v), dtype)


def truth(v):
    """M in extended precision, shape (cones, probed inclinations)."""
    theta_c, theta_o = np.broadcast_arrays(CONES[:, None], THETA_O[PROBED])
    wide = np.full(theta_c.size, np.float32(v))
    exact = precise.M(theta_c.ravel(), theta_o.ravel(), wide)[0]
    return exact.reshape(theta_c.shape)


def error(value, exact):
    """Largest error relative to the peak over theta_o; NaN if any is no number."""
    value = np.asarray(value, precise.WIDE).reshape(len(CONES), -1)[:, PROBED]
    with np.errstate(invalid="ignore"):
        off = np.abs(value - exact) / exact.max(axis=1, keepdims=True)
    return float(off.max()) if np.isfinite(value).all() else float("nan")


def calls():
    """What is to be timed, after a first run; keys are (form, dtype, v)."""
    found = {}
    for v in V:
        for dtype in DTYPES:
            at = places(v, dtype)
            for form, M in FORMS.items():
                progress(f"M, {form}, {dtype}")
                found[form, dtype, v] = partial(M, *at)
                jax.block_until_ready(found[form, dtype, v]())
    return found


def rows(calls, times):
    """One row for each form, dtype and variance."""
    exact = {v: truth(v) for v in V}
    count = len(CONES) * len(THETA_O)
    return [
        Row("M", form, "", dtype, "", v, error(call(), exact[v]), times[key] / count)
        for key, call in calls.items()
        for form, dtype, v in [key]
    ]
