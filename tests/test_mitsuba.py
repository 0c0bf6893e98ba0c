"""The near field against the hair of Mitsuba: pip install '.[oracle]'.

Its sampler is no truth: what it draws of the rest leaves at theta_o = 0.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import fiberjax as fj
from fiberjax import convert, directions
from fiberjax.mitsuba3 import INDICES

mitsuba: Any = pytest.importorskip("mitsuba", reason="pip install '.[oracle]'")

COUNT = 5000
# Mitsuba adds up numbers as large as 1/v in float32, which costs eps/v: at a roughness
# of 0.2, v of TT is 0.008. The angle of its acos is off by eps/(2 |h|): at |h| = 0.05,
# where queries begin, by 1e-6. They end at |h| = 0.999 and at |theta| = 1.5.
ROUGHNESS = (0.2, 0.3, 0.5, 0.7, 1.0)
MATERIALS = tuple(
    (along, around, tilt, eta, color)
    for k, along in enumerate(ROUGHNESS)
    for around, tilt, eta, color in (
        (ROUGHNESS[k], 2.0, 1.55, (0.1, 0.4, 2.0)),
        (ROUGHNESS[-1 - k], -5.0, 1.45, (0.0, 0.0, 0.0)),
        (0.3, 0.0, 1.65, (0.3, 0.3, 0.3)),
        (0.9, 2.0, 1.55, (30.0, 30.0, 30.0)),
    )
)


LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
"""By which it chooses lobes, where `pdf` takes the mean of the channels."""


class Queries(NamedTuple):
    """Directions as Mitsuba has them, the tangent second, and the offset."""

    given: np.ndarray
    out: np.ndarray
    h: np.ndarray


def queries(seed):
    rng = np.random.default_rng(seed)
    theta = rng.uniform(-1.5, 1.5, (2, COUNT))
    h = rng.uniform(0.05, 0.999, COUNT) * rng.choice([-1, 1], COUNT)
    phi = rng.uniform(-np.pi, np.pi, COUNT)

    def vectors(theta, x, z):
        sides = np.cos(theta) * x, np.sin(theta), np.cos(theta) * z
        return np.stack(sides, -1).astype(np.float32)

    given = vectors(theta[0], -h, np.sqrt(1 - h * h))
    out = vectors(theta[1], np.cos(phi), np.sin(phi))
    wide = given.astype(float)
    return Queries(given, out, -wide[:, 0] / np.hypot(wide[:, 0], wide[:, 2]))


@cache
def theirs(k):
    """evaluate and pdf of a material at its queries."""
    mitsuba.set_variant("scalar_rgb")
    along, around, tilt, eta, color = MATERIALS[k]
    hair = mitsuba.load_dict(
        {
            "type": "hair",
            "longitudinal_roughness": along,
            "azimuthal_roughness": around,
            "scale_tilt": tilt,
            "int_ior": eta,
            "ext_ior": 1.0,
            "sigma_a": {"type": "rgb", "value": list(color)},
            "scale": 1.0,
        }
    )
    context, at = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    value, density = np.empty((COUNT, 3)), np.empty(COUNT)
    asked = queries(k)
    for n, (given, out) in enumerate(zip(asked.given, asked.out, strict=True)):
        at.wi = given
        value[n], density[n] = hair.eval_pdf(context, at, mitsuba.Vector3f(out))
    return value, density


def ours(k, compat):
    """evaluate and the density by luminance, that of a gray fiber by `pdf` as well."""
    along, around, tilt, eta, color = MATERIALS[k]
    fiber = convert.mitsuba(along, around, tilt, color, eta, 1.0)
    asked = queries(k)
    given, out = (x[:, [1, 0, 2]].astype(float) for x in (asked.given, asked.out))
    value = directions.evaluate(fiber, given, out, asked.h, compat=compat)
    theta_i = np.arcsin(given[:, 0])
    F = fj.reflectance(np.cos(theta_i) * np.sqrt(1 - asked.h**2), eta)[:, None]
    T = fj.transmittance(asked.h[:, None], theta_i[:, None], eta, np.array(color))
    # sum_p lum(A_p) q_p over sum_p lum(A_p), of which R and all others are two.
    likely = (value @ LUMINANCE) / ((fj.A(0, F, T) + fj.A_rest(1, F, T)) @ LUMINANCE)
    if len(set(color)) == 1:
        by_mean = directions.pdf(fiber, given, out, asked.h, compat=compat)
        # The vectors are of unit length to float32 alone.
        np.testing.assert_allclose(by_mean, likely, rtol=3e-6)
    return np.asarray(value), np.asarray(likely)


def test_evaluation_and_density():
    """1e5 queries in 20 materials."""
    assert COUNT * len(MATERIALS) == 100_000
    for k, material in enumerate(MATERIALS):
        (value, density), (exact, likely) = theirs(k), ours(k, "mitsuba")
        # Below this float32 has no digits left.
        np.testing.assert_allclose(value, exact, 1e-4, 1e-30, err_msg=str(material))
        np.testing.assert_allclose(density, likely, 1e-4, 1e-30, err_msg=str(material))


def test_what_its_bessel_function_costs():
    """Exact M differs: by more than rounding, and by no more than log I0 is off."""
    off = [
        np.abs(theirs(k)[0] / ours(k, None)[0] - 1).max()
        for k, material in enumerate(MATERIALS)
        if material[0] <= 0.5 and material[-1] != (30.0, 30.0, 30.0)
    ]
    assert min(off) > 4e-3
    assert max(off) < 6.5e-3


def test_defaults_and_names():
    """What it makes of its defaults, of pigments, of scale and of names of indices."""
    mitsuba.set_variant("scalar_rgb")
    context, at = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    asked = queries(99)
    some = [n for n in range(200) if asked.h[n] ** 2 < 0.98]
    given, out = (x[some][:, [1, 0, 2]].astype(float) for x in (asked.given, asked.out))
    cases: tuple[dict[str, Any], ...] = (
        {},
        {"eumelanin": 0.2},
        {"pheomelanin": 0.7},
        {"sigma_a": (0.1, 0.2, 0.3), "scale": 3.0, "int_ior": "pyrex"},
    )
    for numbers in cases:
        theirs = dict(numbers)
        if "sigma_a" in theirs:
            theirs["sigma_a"] = {"type": "rgb", "value": list(theirs["sigma_a"])}
        hair = mitsuba.load_dict({"type": "hair", **theirs})
        value = []
        for n in some:
            at.wi = asked.given[n]
            value.append(hair.eval(context, at, mitsuba.Vector3f(asked.out[n])))
        fiber = convert.mitsuba(**numbers)
        ours = directions.evaluate(fiber, given, out, asked.h[some], compat="mitsuba")
        np.testing.assert_allclose(value, ours, 1e-4, 1e-30)
    for name, index in INDICES.items():
        if name == "vacuum":
            continue
        hair = mitsuba.load_dict({"type": "hair", "int_ior": name, "ext_ior": "vacuum"})
        assert mitsuba.traverse(hair)["eta"] == pytest.approx(index, rel=1e-7)
        assert float(convert.mitsuba(int_ior=name, ext_ior=1.0).eta) == index


def test_what_its_sampler_and_its_clear_fiber_get_wrong():
    """Rows `mitsuba_residual` and `mitsuba_nan` of the errata, on the plugin."""
    mitsuba.set_variant("scalar_rgb")
    clear = {"type": "rgb", "value": [0.0, 0.0, 0.0]}
    hair = mitsuba.load_dict({"type": "hair", "sigma_a": clear})
    context, at = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    theta = np.radians(80)
    at.wi = [-0.5 * np.cos(theta), np.sin(theta), np.sqrt(0.75) * np.cos(theta)]
    for u in (0.2, 0.5, 0.8):
        draw, _ = hair.sample(context, at, 0.9999, [u, 0.3])
        assert abs(draw.wo[1]) < 1e-6
        draw, _ = hair.sample(context, at, 0.01, [u, 0.3])
        assert draw.wo[1] < -0.5
    at.wi = [-1.0, 0.0, 0.0]
    forward = mitsuba.Vector3f(-1.0, 0.0, 0.0)
    assert max(hair.eval(context, at, forward)) == 0
