"""Converters against the formulas that each system documents, written here again."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

import fiberjax as fj
from fiberjax import convert, perceptual, pigment

untyped: Any = convert  # for input that a type checker refuses
DEG = math.pi / 180
V = 0.726 * 0.3 + 0.812 * 0.3**2 + 3.7 * 0.3**20  # deviation of b = 0.3
S = 0.265 * 0.3 + 1.194 * 0.3**2 + 5.372 * 0.3**22
D = 5.969 - 0.215 * 0.3 + 2.532 * 0.3**2 - 10.73 * 0.3**3 + 5.574 * 0.3**4
D += 0.245 * 0.3**5


def lobes(fiber, name):
    factors = np.asarray(getattr(fiber, name))
    return [factors[min(p, len(factors) - 1)] for p in range(4)]


def close(found: Any, expected: Any, rtol=1e-13):
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=1e-15)


def test_perceptual_roughness_and_its_inverse():
    b = np.linspace(1e-6, 1, 101)
    close(perceptual.longitudinal(0.3), V)
    close(perceptual.azimuthal(0.3), S)
    close(perceptual.longitudinal(1.0), 0.726 + 0.812 + 3.7)
    close(perceptual.azimuthal(1.0), 0.265 + 1.194 + 5.372)
    for there, back in [
        (perceptual.longitudinal, perceptual.from_longitudinal),
        (perceptual.azimuthal, perceptual.from_azimuthal),
    ]:
        close(back(there(b)), b, rtol=1e-14)
        for y in (0.01, 0.7, 6.0, 40.0):
            root = brentq(lambda x, there=there, y=y: there(x) - y, 0, 3, xtol=1e-15)
            close(back(y), root)
        points = jnp.asarray([0.0, 1e-9, 0.3, 5.0])
        slopes = jax.vmap(jax.grad(back))(points)
        at = jax.vmap(jax.grad(there))(back(points))
        close(slopes, 1 / at)
        second = jax.grad(jax.grad(back))(0.3)
        step = 1e-5
        first = [float(jax.grad(back)(0.3 + s * step)) for s in (1, -1)]
        close(second, (first[0] - first[1]) / (2 * step), rtol=1e-7)


def test_pigments():
    close(pigment.melanin(1.3, 0.2), [0.5821, 0.9861, 1.991])
    close(pigment.melanin(1.0, 0.5, table="cycles"), [0.6775, 1.2075, 2.615])
    close(pigment.concentrations(0.5, 0.25), [0.75 * math.log(2), 0.25 * math.log(2)])
    # 1 - 1e-9 is read as 0.9999: what is left of it is 1e-4, with no slope.
    assert float(pigment.concentrations(1 - 1e-9, 0.0)[0]) == pytest.approx(9.21034037)
    assert jax.grad(lambda m: pigment.concentrations(m, 0.0)[0])(1.0) == 0
    close(jax.grad(lambda m: pigment.concentrations(m, 0.0)[0])(0.5), 2.0)
    close(pigment.concentrations(1e-12, 0.0)[0], 1e-12)  # log(1 - 1e-12) has 4 digits
    color = jnp.asarray([0.01, 0.5, 1.0])
    close(pigment.chiang_sigma_a(color, 0.3), (np.log(color) / D) ** 2)
    close(pigment.chiang_color(pigment.chiang_sigma_a(color, 0.3), 0.3), color)
    for sigma_a in (0.0, 1e-20, 1.0, 1e3):
        slope = jax.grad(pigment.chiang_color)(sigma_a, 0.3)
        assert np.isfinite(slope)


# Each system's M of one lobe, from its documented formula, up to a factor. The given
# direction is the one that the system turns; the other follows a density.


def rotated(angles, widths):
    """Renderers turn a direction by `angles` alpha; log of von Mises-Fisher's M."""

    def of(p, given, other, alpha, beta):
        turned, v = given + angles[p] * alpha, (widths[p] * beta) ** 2
        a, b = (f(turned) * f(other) / v for f in (np.cos, np.sin))
        return np.log(np.i0(a)) - b

    return of


CHIANG = (1, 0.5, 2)
VIEW = rotated((-2, 1, 4, 0), (*CHIANG, 2))  # sin(theta_o - 2 alpha) for R
LIGHT = rotated((2, -1, -4, 0), (*CHIANG, 2))  # sin(theta_i + 2 alpha) for R
A = 3 * DEG
TURNED = {
    "pbrt": (convert.pbrt(alpha=3.0), VIEW, V, 4),
    "mitsuba": (convert.mitsuba(scale_tilt=3.0), VIEW, V, 4),
    "tungsten": (convert.tungsten(0.1, 3.0), VIEW, 0.05 * math.pi, 3),
    "cycles": (convert.cycles(offset=A), LIGHT, V, 4),
    "materialx": (
        convert.materialx(
            *convert.materialx_roughness(0.3, 0.3), 0.5 + A / math.pi, color=0.4
        ),
        LIGHT,
        V,
        4,
    ),
}


@pytest.mark.parametrize("system", TURNED)
def test_M_of_renderers_is_ours(system):
    fiber, theirs, beta, count = TURNED[system]
    given, other = np.meshgrid([-0.9, 0.0, 0.5], np.linspace(-1.4, 1.4, 7))
    for p in range(count):
        tilt = float(lobes(fiber, "tilts")[p] * fiber.alpha)
        width = float(lobes(fiber, "widths_m")[p] * fiber.beta_m)
        ours = np.log(np.asarray(fj.M(-given + tilt, other, width**2)))
        ratio = ours - theirs(p, given, other, A, beta)
        np.testing.assert_allclose(ratio, ratio[0, 0], atol=1e-9)


def half_angle(shifts, widths):
    """Log of a Gaussian in theta_h."""

    def of(p, given, other, alpha, beta):
        off = (given + other) / 2 - shifts[p] * alpha
        return -(off**2) / (2 * (widths[p] * beta) ** 2)

    return of


def karis_M(p, given, other, alpha, beta):
    off = np.sin(given) + np.sin(other) - (-2, 1, 4)[p] * alpha
    return -(off**2) / (2 * (CHIANG[p] * beta) ** 2)


RTXCR_WIDTHS = (math.sqrt(2) / 2, 0.25 * math.sqrt(1.55**2 - 1), 1.0)
GAUSSIAN = {
    "unity": (
        convert.unity(0.9, 0.7, 1.0, (0.1, 0.2, 0.3)),
        half_angle((-1, 0.5, 1.5), (1, 0.25, 4)),
        0.01,
    ),
    "karis": (convert.karis((0.5, 0.4, 0.3), 0.1, DEG), karis_M, 0.01),
    "rtxcr": (
        convert.rtxcr(0.02, 1.0, absorption=0.2),
        half_angle((-1, 0.5, 1.5), RTXCR_WIDTHS),
        0.02,
    ),
}


@pytest.mark.parametrize("system", GAUSSIAN)
def test_M_of_engines_peaks_and_is_wide_as_ours(system):
    """At normal incidence, where sin theta and theta agree to first order."""
    fiber, theirs, beta = GAUSSIAN[system]
    for p in range(3):
        tilt = float(lobes(fiber, "tilts")[p] * fiber.alpha)
        width = float(lobes(fiber, "widths_m")[p] * fiber.beta_m)
        other = tilt + 1e-4 * np.arange(-200, 201)
        curve, slope, _ = np.polyfit(other, theirs(p, 0.0, other, DEG, beta), 2)
        assert -slope / (2 * curve) == pytest.approx(tilt, rel=2e-3)
        assert -1 / (2 * curve) == pytest.approx(width**2, rel=0.01)


def test_numbers_of_pbrt():
    fiber = convert.pbrt()
    close([fiber.beta_m, fiber.beta_n], [V, S])
    close(fiber.alpha, 2 * DEG)
    close(fiber.sigma_a, 1.3 * np.asarray([0.419, 0.697, 1.37]))
    close(lobes(fiber, "widths_m"), [1, 0.5, 2, 2])
    close(lobes(fiber, "widths_n"), [1, 1, 1, 1])
    # The default fiber has pbrt's numbers, rounded, and the other sign of the tilt.
    own = fj.Fiber()
    close([own.beta_m, own.beta_n], [fiber.beta_m, fiber.beta_n], rtol=2e-5)
    close(own.sigma_a, fiber.sigma_a, rtol=2e-5)
    close([own.alpha, fiber.alpha], [-2 * DEG, 2 * DEG])
    least = convert.pbrt(0.0, 0.0)
    close(least.beta_m, 0.00726 + 0.0000812)
    close(least.beta_n, 0.00265 + 0.0001194)
    close(convert.pbrt(3.0, 2.0).beta_m, 5.238)
    black = convert.pbrt(reflectance=(0.5, 0.2, 2.0), beta_n=0.3).sigma_a
    close(black, (np.log([0.5, 0.2, 1]) / D) ** 2)
    close(convert.pbrt(pheomelanin=2.0).sigma_a, [0.374, 0.8, 2.1])
    close(convert.pbrt(sigma_a=(-1.0, 2.0)).sigma_a, [0, 2])


def test_numbers_of_mitsuba():
    fiber = convert.mitsuba()
    close(fiber.eta, 1.55 / 1.000277)
    close(fiber.sigma_a, [0.5821, 0.9861, 1.991])
    close(fiber.alpha, 2 * DEG)
    close([fiber.beta_m, fiber.beta_n], [V, S])
    close(convert.mitsuba(sigma_a=(0.2, 0.25, 0.7), scale=200.0).sigma_a, [40, 50, 140])
    close(convert.mitsuba(eumelanin=0.2).sigma_a, [0.1212, 0.2194, 0.484])
    close(convert.mitsuba(eumelanin=0.2, scale=9.0).sigma_a, [0.1212, 0.2194, 0.484])


def test_numbers_of_cycles():
    fiber = convert.cycles()
    close(fiber.sigma_a, (np.log([0.017513, 0.005763, 0.002059]) / D) ** 2)
    close(fiber.alpha, -2 * DEG)
    close([fiber.eta, fiber.beta_m, fiber.beta_n], [1.55, V, S])
    quantity = math.log(5)
    brown = convert.cycles(melanin=0.8)
    close(brown.sigma_a, quantity * np.asarray([0.343, 0.733, 1.924]))
    dyed = convert.cycles(melanin=0.8, melanin_redness=0.0, tint=(0.5, 1.0, 1.0))
    expected = quantity * np.asarray([0.506, 0.841, 1.653])
    close(dyed.sigma_a, expected + np.asarray([(math.log(0.5) / D) ** 2, 0, 0]))
    half = 0.726 * 0.15 + 0.812 * 0.15**2 + 3.7 * 0.15**20
    close(lobes(convert.cycles(coat=0.5), "widths_m"), [half / V, 0.5, 2, 2])
    thin = 0.726e-3 + 0.812e-6
    close(lobes(convert.cycles(coat=1.0), "widths_m")[0], thin / V)
    close(convert.cycles(roughness=0.0).beta_m, thin)


def test_numbers_of_materialx():
    fiber = convert.materialx()
    close(fiber.beta_m, math.sqrt(0.1))
    close(lobes(fiber, "widths_m")[:3], np.sqrt([1, 0.5, 2]))
    close(np.asarray(lobes(fiber, "widths_n")) * fiber.beta_n, [0.1, 0.05, 0.2, 0.2])
    close(fiber.alpha, 0.0)
    assert fiber.sigma_a is None
    r, tt, trt = convert.materialx_roughness(0.3, 0.3, 0.5, 3.0)
    close([r, tt, trt], [[V**2, S], [V**2 / 4, S], [9 * V**2, S]])
    close(convert.materialx_roughness(0.0, 9.0)[0], [(0.726e-3 + 0.812e-6) ** 2, 6.831])
    clamped = convert.materialx(*convert.materialx_roughness(1e-3, 9.0))
    close([clamped.beta_m, clamped.beta_n], [math.sqrt(1e-3), 1.0])
    color = convert.materialx(color=(0.0, 0.5, 2.0), azimuthal_roughness=0.3)
    close(color.sigma_a, (np.log([1e-3, 0.5, 1]) / D) ** 2)
    melanin = convert.materialx(melanin_concentration=0.25, melanin_redness=0.5)
    close(melanin.sigma_a, -math.log(0.75) / 2 * np.asarray([0.606, 1.097, 2.42]))


def test_numbers_of_tungsten():
    fiber = convert.tungsten()
    close([fiber.beta_m, fiber.beta_n], [math.pi / 20] * 2)
    close(fiber.sigma_a, 0.125 * np.asarray([0.606, 1.097, 2.42]))
    close(fiber.alpha, 2 * DEG)
    close(convert.tungsten(0.0).beta_n, 0.04)
    close(convert.tungsten(melanin_ratio=1.0).sigma_a, [0.04675, 0.1, 0.2625])
    close(lobes(fiber, "widths_n"), [1, 1, 1, 1])


def test_numbers_of_engines():
    fiber = convert.unity(0.5, 0.7, 3.0, eumelanin=1.3)
    close([fiber.beta_m, fiber.beta_n, fiber.alpha], [0.5, S, -3 * DEG], rtol=1e-12)
    close(lobes(fiber, "tilts"), [2, -1, -3, 0])
    close(fiber.sigma_a, [0.5447, 0.9061, 1.781])
    close(convert.unity(1.0, 1.0, 3.0, 0.5).beta_m, 2e-4)
    color = convert.unity(0.5, 0.7, 3.0, diffuse_color=(0.1, 0.5, 1.0)).sigma_a
    close(color, (np.log([0.1, 0.5, 1]) / D) ** 2, rtol=1e-12)
    hair = convert.karis((0.5, 0.25, 0.0), 0.5)
    close(hair.sigma_a, [math.log(2) / 4, math.log(2) / 2, 30 * math.log(10) / 4])
    close([hair.beta_m, hair.beta_n, hair.alpha], [0.25, 0.25, -0.035])
    # T = C^(1/2) through the middle, as the slides have it.
    close(
        fj.transmittance(0.0, 0.0, 1.55, jnp.asarray(hair.sigma_a))[..., 0],
        math.sqrt(0.5),
    )


def test_numbers_of_rtxcr():
    at = (0.4, 2.0)
    fiber = convert.rtxcr(0.2, 2.0, melanin=0.5, melanin_redness=0.25, at=at)
    widths = 0.2 * np.asarray(
        [
            math.sqrt(2) * math.cos(1.0),
            math.sqrt(1.55**2 - 1) / (2 * math.cos(0.4)),
            2 + 0.4**1.5,
        ]
    )
    close(lobes(fiber, "widths_m")[:3] * np.asarray(fiber.beta_m), widths)
    close([fiber.beta_n, fiber.alpha], [0.2, -2 * DEG])
    table = 0.75 * np.asarray([0.506, 0.841, 1.653])
    table += 0.25 * np.asarray([0.343, 0.733, 1.924])
    close(fiber.sigma_a, math.log(2) * table)
    physics = convert.rtxcr(
        0.2, 2.0, melanin=0.5, melanin_redness=0.25, absorption_model="physics"
    )
    close(physics.sigma_a, 0.6 * table)
    back = convert.rtxcr(0.2, 2.0, base_color=(0.0, 0.5, 1.0), at=(0.0, math.pi))
    close(back.sigma_a, (np.log([1e-4, 0.5, 1]) / D) ** 2)
    close(back.beta_m, 0.2 * math.sqrt(2) * 0.01)


FITS = {
    "pbrt": (convert.pbrt(0.02, 0.9, -3.0, (0.1, 0.0, 5.0), 1.4), convert.to_pbrt),
    "mitsuba": (convert.mitsuba(0.3, 1e-3, 5.0), convert.to_mitsuba),
    "cycles": (convert.cycles(0.4, 0.1, 0.7, 1.6, -0.1), convert.to_cycles),
    "materialx": (convert.materialx(cuticle_angle=0.3, color=0.1), None),
    "tungsten": (convert.tungsten(0.4, -1.0, (0.1, 0.2, 0.3)), convert.to_tungsten),
    "unity": (convert.unity(0.4, 0.2, 2.0, (0.1, 0.2, 0.3)), convert.to_unity),
    "karis": (convert.karis((0.5, 1.0, 0.3), 0.6), convert.to_karis),
}
FITS["materialx"] = (FITS["materialx"][0], convert.to_materialx)


@pytest.mark.parametrize("system", FITS)
def test_there_and_back(system):
    fiber, to = FITS[system]
    of = getattr(convert, system)
    numbers = to(fiber)
    again = of(*numbers)
    for name in ("eta", "beta_m", "beta_n", "alpha", "sigma_a"):
        close(getattr(again, name), getattr(fiber, name), rtol=1e-12)
    for name in ("widths_m", "widths_n", "tilts"):
        close(lobes(again, name), lobes(fiber, name), rtol=1e-12)
    for there, back in zip(numbers, to(again), strict=True):
        np.testing.assert_allclose(back, there, rtol=1e-12, atol=1e-14)
    # Nothing is looked at under a transformation, and slopes are finite.
    slope = jax.jit(jax.grad(lambda f: sum(x.sum() for x in to(f))))(fiber)
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(slope))


ENDS = {
    "pbrt": (lambda b, a, c: convert.pbrt(b, b, a, c), [(0, 1), (-9, 9), (0, 1e3)]),
    "pbrt color": (
        lambda b, a, c: convert.pbrt(b, b, a, reflectance=c),
        [(0, 1), (0, 9), (1e-30, 1)],
    ),
    "mitsuba": (
        lambda b, a, c: convert.mitsuba(b, b, a, c),
        [(1e-9, 1), (0, 9), (0, 1e3)],
    ),
    "cycles": (
        lambda b, a, c: convert.cycles(b, b, a, color=c),
        [(0, 1), (0, 1), (1e-30, 1)],
    ),
    "cycles melanin": (
        lambda b, a, c: convert.cycles(b, b, melanin=a, melanin_redness=c),
        [(0, 1), (0, 1), (0, 1)],
    ),
    "materialx": (
        lambda b, a, c: convert.materialx(
            *convert.materialx_roughness(b, b), a, color=c
        ),
        [(0, 1), (0, 1), (0, 1)],
    ),
    "tungsten": (
        lambda b, a, c: convert.tungsten(b, a, melanin_concentration=c),
        [(0, 1), (0, 9), (0, 8)],
    ),
    "unity": (
        lambda b, a, c: convert.unity(b, b, a, diffuse_color=c),
        [(0, 1), (0, 9), (1e-30, 1)],
    ),
    "karis": (
        lambda b, a, c: convert.karis(c, b, a),
        [(1e-9, 1), (0, 1), (0, 1)],
    ),
    "rtxcr": (
        lambda b, a, c: convert.rtxcr(b, 1.0, at=(a, 3.0), absorption=c),
        [(1e-9, 1), (0, 1.5), (0, 1e3)],
    ),
}


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("system", ENDS)
def test_dtypes_and_slopes_at_the_ends(system, dtype):
    of, ends = ENDS[system]

    def numbers(*x):
        fiber = of(*x)
        varied = (fiber.beta_m, fiber.beta_n, fiber.alpha, fiber.sigma_a)
        assert all(y.dtype == dtype for y in varied)
        widths = fiber.widths_m.astype(dtype)  # constants have the default dtype
        return jnp.concatenate([jnp.ravel(y) for y in (*varied, widths)])

    both = jax.jit(lambda *x: (numbers(*x), jax.jacfwd(numbers, (0, 1, 2))(*x)))
    for side in (0, 1):
        x = [jnp.asarray(end[side], dtype) for end in ends]
        values, slopes = both(*x)
        np.testing.assert_allclose(values, numbers(*x), rtol=1e-4)
        assert np.isfinite(values).all()
        assert np.isfinite(slopes).all()
    if dtype == jnp.float64:
        x = [jnp.asarray(0.3 * low + 0.7 * high) for low, high in ends]
        for k, slope in enumerate(both(*x)[1]):
            step = 1e-6 * float(x[k])
            moved = [
                both(*(y + s * step * (m == k) for m, y in enumerate(x)))[0]
                for s in (1, -1)
            ]
            central = (moved[0] - moved[1]) / (2 * step)
            np.testing.assert_allclose(slope, central, rtol=1e-6, atol=1e-6)


def test_a_batch_of_random_roughness():
    """What Cycles' random roughness makes: many fibers."""
    factors = 1 + 2 * (jnp.asarray([0.1, 0.5, 0.9]) - 0.5) * 0.4
    fibers = jax.vmap(lambda f: convert.cycles(0.3 * f, 0.3 * f))(factors)
    close(fibers.beta_m[1], V)
    assert isinstance(fibers.sigma_a, jax.Array)
    assert fibers.sigma_a.shape == (3, 3)


FLAT = fj.Fiber(widths_m=(1.0,))
BAD = {
    "both": (
        lambda: convert.pbrt(sigma_a=1.0, reflectance=0.5),
        "sigma_a and reflectance are given",
    ),
    "black": (
        lambda: convert.pbrt(reflectance=(0.5, 0.0)),
        r"reflectance = 0.0: must lie in \(0, inf\)",
    ),
    "eta": (lambda: convert.pbrt(eta=0.9), r"eta = 0.9: must lie in \[1, inf\)"),
    "mitsuba's range": (
        lambda: convert.mitsuba(longitudinal_roughness=1.1),
        r"longitudinal_roughness = 1.1: must lie in \(0, 1\]",
    ),
    "outside": (lambda: convert.mitsuba(int_ior=1.0, ext_ior=1.3), "int_ior/ext_ior"),
    "tint": (lambda: convert.materialx(tints=(1.0, 0.5, 1.0)), "tints .* is lost"),
    "shape": (lambda: convert.materialx(0.1), r"roughness_R has shape \(\)"),
    "specular": (lambda: convert.karis(0.5, specular=0.5), "specular = 0.5.* lost"),
    "no absorption": (
        lambda: convert.unity(0.5, 0.5, 3.0),
        "no absorption is given: must be one of .'absorption', 'diffuse_color'",
    ),
    "diffuse": (
        lambda: convert.rtxcr(0.1, 2.0, absorption=0.1, diffuse_weight=0.2),
        "diffuse_weight = 0.2: must be 0; a Fiber has no diffuse lobe",
    ),
    "model": (
        lambda: convert.rtxcr(0.1, 2.0, melanin=0.1, absorption_model="linear"),
        "absorption_model = 'linear': must be one of",
    ),
    "pole": (
        lambda: convert.rtxcr(0.1, 2.0, absorption=0.1, at=(math.pi / 2, 0.0)),
        "theta_i of at = 1.57",
    ),
    "table": (lambda: pigment.melanin(1.0, 0.0, table="arnold"), "table = 'arnold'"),
    "widths": (lambda: convert.to_pbrt(FLAT), "widths_m = .*pbrt are fixed.* lost"),
    "tilts": (
        lambda: convert.to_cycles(convert.unity(0.5, 0.5, 3.0, 0.1)),
        "widths_m = .* lost",
    ),
    "tilts of materialx": (
        lambda: convert.to_materialx(fj.Fiber(tilts=(2.0, -1.0, -3.0, 0.0))),
        "tilts = .*MaterialX are fixed",
    ),
    "colors": (
        lambda: convert.to_pbrt(fj.Fiber(sigma_a=np.ones(5))),
        r"sigma_a has shape \(5,\).* lost",
    ),
    "too rough": (
        lambda: convert.to_pbrt(fj.Fiber(beta_m=6.0)),
        "perceptual beta_m of pbrt = 1.0",
    ),
    "azimuth": (lambda: convert.to_tungsten(fj.Fiber()), "beta_n = .* lost"),
    "azimuth of karis": (lambda: convert.to_karis(fj.Fiber()), "beta_n = .* lost"),
    "eta of karis": (lambda: convert.to_karis(fj.Fiber(eta=1.4)), "eta = 1.4.* lost"),
    "coat": (
        lambda: convert.to_cycles(fj.Fiber(widths_m=(1.2, 0.5, 2.0))),
        "coat of Cycles = ",
    ),
    "a fourth width": (
        lambda: convert.to_materialx(fj.Fiber(widths_m=(1.0, 0.5, 2.0, 3.0))),
        "widths_m has 4 factors",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_lost_is_an_error(case):
    call, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        call()


def test_contents_are_public():
    names = {name for name in vars(untyped) if not name.startswith("_")}
    systems = {"pbrt", "mitsuba", "cycles", "materialx", "tungsten", "unity", "karis"}
    assert {*systems, *(f"to_{name}" for name in systems), "rtxcr"} <= names
    assert all(getattr(convert, name).__doc__ for name in names)
