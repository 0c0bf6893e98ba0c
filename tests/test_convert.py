"""Converters against the formulas that each system documents, written here again."""

import math
from functools import partial
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


def rtxcr_M(p, given, other, alpha, roughness):
    """Of normal incidence at phi = 0; the deviations are those of theta_h."""
    beta = (math.sqrt(2) / 2, 0.25 * math.sqrt(1.55**2 - 1), 1.0)[p] * roughness
    off = (given + other) / 2 + (1, -0.5, -1.5)[p] * alpha
    return -(off**2) / (2 * beta**2)


def unity_M(p, given, other, alpha, perceptual_roughness):
    """Its Gaussian takes PerceptualRoughnessToRoughness of r, r/2 and 2 r as it is."""
    roughness = (perceptual_roughness * (1, 0.5, 2)[p]) ** 2
    off = (given + other) / 2 - (-1, 0.5, 1.5)[p] * alpha
    return -(off**2) / (2 * roughness)


def karis_M(p, given, other, alpha, beta):
    off = np.sin(given) + np.sin(other) - (-2, 1, 4)[p] * alpha
    return -(off**2) / (2 * (CHIANG[p] * beta) ** 2)


GAUSSIAN = {
    "unity": (
        convert.unity(0.98, 0.7, 1.0, (0.1, 0.2, 0.3)),
        unity_M,
        0.02,
    ),
    "karis": (convert.karis((0.5, 0.4, 0.3), 0.1, DEG), karis_M, 0.01),
    "rtxcr": (
        convert.rtxcr(0.02, 1.0, absorption_coefficient=0.2),
        rtxcr_M,
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
    close(convert.mitsuba(int_ior="Diamond", ext_ior="water").eta, 2.419 / 1.333)
    close(convert.to_mitsuba(fj.Fiber(), ext_ior="water").int_ior, 1.55 * 1.333)


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
    close(convert.cycles(melanin_redness=1.0).sigma_a, brown.sigma_a)
    bright = convert.cycles(color=(2.0, 0.5, 1.0)).sigma_a
    close(bright, (np.log([2.0, 0.5, 1]) / D) ** 2)


def test_random_hair_of_cycles():
    """svm_node_closure_bsdf, with what it makes of the two factors."""
    for random in (0.0, 0.3, 1.0):
        rough = 1 + 2 * (random - 0.5) * 0.4
        for color in (0.25, 3.0):
            dark = 1 + 2 * (random - 0.5) * min(color, 1.0)
            fiber = convert.cycles(
                0.3,
                0.2,
                melanin=0.6,
                melanin_redness=0.25,
                tint=(0.5, 1.0, 1.0),
                random=random,
                random_color=color,
                random_roughness=0.4,
            )
            b, n = 0.3 * rough, 0.2 * rough
            close(fiber.beta_m, 0.726 * b + 0.812 * b**2 + 3.7 * b**20)
            close(fiber.beta_n, 0.265 * n + 1.194 * n**2 + 5.372 * n**22)
            quantity = -math.log(max(1 - 0.6 * dark, 1e-4))
            table = 0.75 * np.asarray([0.506, 0.841, 1.653])
            table += 0.25 * np.asarray([0.343, 0.733, 1.924])
            slope = 5.969 - 0.215 * n + 2.532 * n**2 - 10.73 * n**3 + 5.574 * n**4
            slope += 0.245 * n**5
            dye = np.asarray([(math.log(0.5) / slope) ** 2, 0, 0])
            close(fiber.sigma_a, quantity * table + dye)
    many = jax.vmap(lambda x: convert.cycles(random=x, random_roughness=0.4))
    fibers = many(jnp.asarray([0.1, 0.5, 0.9]))
    close(fibers.beta_m[1], V)
    assert isinstance(fibers.sigma_a, jax.Array)
    assert fibers.sigma_a.shape == (3, 3)


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
    brown, red = (0.657704, 0.498077, 0.254106), (0.829443, 0.670320, 0.349937)
    close(melanin.sigma_a, math.log(0.75) / 2 * np.log([brown, red]).sum(0))
    close(melanin.sigma_a, -math.log(0.75) / 2 * np.asarray([0.606, 1.097, 2.42]), 3e-6)
    redder = convert.materialx(melanin_redness=0.8)
    close(redder.sigma_a, math.log(0.75) * (0.2 * np.log(brown) + 0.8 * np.log(red)))
    own = convert.materialx(eumelanin_color=(0.1, 0.2, 4.0), melanin_redness=0.0)
    close(own.sigma_a, math.log(0.75) * np.log([0.1, 0.2, 1.0]))
    white = convert.materialx(azimuthal_roughness=0.3)
    close(white.sigma_a, [0, 0, 0])


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
    close([fiber.beta_m, fiber.beta_n, fiber.alpha], [1.0, S, -3 * DEG], rtol=1e-12)
    close(lobes(fiber, "widths_m"), [1, 0.5, 2, 2])
    close(lobes(fiber, "tilts"), [2, -1, -3, 0])
    pigments = 1.3 * np.asarray([0.419, 0.697, 1.37])
    close(fiber.sigma_a, pigments + 0.3 * np.asarray([0.187, 0.4, 1.05]))
    close(convert.unity(1.0, 1.0, 3.0, 0.5).beta_m, 0.02)
    color = convert.unity(diffuse_color=(0.0, 0.5, 2.0)).sigma_a
    close(color, (np.log([1e-3, 0.5, 2]) / D) ** 2, rtol=1e-12)
    blocks = convert.unity()
    close(blocks.sigma_a, [0.06, 0.1, 0.2])
    close([blocks.beta_m, blocks.beta_n, blocks.alpha], [1.0, S, -3 * DEG], rtol=1e-12)
    hair = convert.karis((0.5, 0.25, 0.0), 0.5)
    close(hair.sigma_a, [math.log(2) / 4, math.log(2) / 2, 30 * math.log(10) / 4])
    close([hair.beta_m, hair.beta_n, hair.alpha], [0.25, 0.25, -0.035])
    close([convert.karis(0.5, r).beta_m for r in (0.0, 2.0)], [255.0**-2, 1.0])
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
    close(fiber.sigma_a, 0.6 * table)
    normalized = convert.rtxcr(
        0.2, 2.0, melanin=0.5, melanin_redness=0.25, absorption_model="normalized"
    )
    close(normalized.sigma_a, math.log(2) * table)
    sample = convert.rtxcr()
    close([sample.beta_n, sample.alpha, sample.eta], [0.25, -3 * DEG, 1.55])
    table = 0.95 * np.asarray([0.506, 0.841, 1.653])
    table += 0.05 * np.asarray([0.343, 0.733, 1.924])
    close(sample.sigma_a, 2.4 * 0.805**2 * table)
    for phi in (1.0, 3.0, 4.0, 6.0, -2.0):
        narrowing = max(0.01, math.cos(0.5 * math.acos(math.cos(phi))))
        found = convert.rtxcr(0.2, at=(0.0, phi)).beta_m
        close(found, 0.2 * math.sqrt(2) * narrowing)
        close(found, convert.rtxcr(0.2, at=(0.0, 2 * math.pi - phi)).beta_m)
    back = convert.rtxcr(
        0.2, base_color=(0.0, 0.5, 2.0), azimuthal_roughness=0.3, at=(0.0, math.pi)
    )
    close(back.sigma_a, (np.log([1e-4, 0.5, 2]) / D) ** 2)
    close(back.beta_m, 0.2 * math.sqrt(2) * 0.01)


FITS = {
    "pbrt": (convert.pbrt(0.02, 0.9, -3.0, (0.1, 0.0, 5.0), 1.4), convert.to_pbrt),
    "mitsuba": (convert.mitsuba(0.3, 1e-3, 5.0), convert.to_mitsuba),
    "cycles": (convert.cycles(0.4, 0.1, 0.7, 1.6, -0.1), convert.to_cycles),
    "materialx": (
        convert.materialx(cuticle_angle=0.3, color=0.1),
        convert.to_materialx,
    ),
    "tungsten": (convert.tungsten(0.4, -1.0, (0.1, 0.2, 0.3)), convert.to_tungsten),
    "unity": (convert.unity(0.4, 0.2, 2.0, (0.1, 0.2, 0.3)), convert.to_unity),
    "karis": (convert.karis((0.5, 1.0, 0.3), 0.6), convert.to_karis),
    "rtxcr": (convert.rtxcr(0.4, -1.0, 1.4), convert.to_rtxcr),
}


@pytest.mark.parametrize("system", FITS)
def test_there_and_back(system):
    fiber, to = FITS[system]
    short = jax.tree.map(lambda x: x.astype(jnp.float32), fiber)
    assert {x.dtype for x in to(short)} == {np.dtype(np.float32)}
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
        [(0, 1), (0, 9), (0, 1)],
    ),
    "karis": (
        lambda b, a, c: convert.karis(c, b, a),
        [(0, 1), (0, 1), (0, 1)],
    ),
    "rtxcr": (
        lambda b, a, c: convert.rtxcr(b, 1.0, absorption_coefficient=c, at=(a, 3.0)),
        [(1e-9, 1), (0, 1.5), (0, 1e3)],
    ),
}


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
@pytest.mark.parametrize("system", ENDS)
def test_dtypes_and_slopes_at_the_ends(system, dtype):
    of, ends = ENDS[system]

    def numbers(*x):
        fiber = of(*x)
        every = jax.tree.leaves(fiber)
        assert all(y.dtype == dtype for y in every)
        return jnp.concatenate([jnp.ravel(y) for y in every])

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


def test_a_pair_of_directions_of_rtxcr():
    at = (0.4, 2.0)
    fiber = convert.rtxcr(0.2, 2.0, 1.4, (0.1, 0.2, 0.3), at=at)
    there = convert.to_rtxcr(fiber, at=at)
    for name, number in zip(
        there._fields, (0.2, 2.0, 1.4, (0.1, 0.2, 0.3)), strict=True
    ):
        close(getattr(there, name), number)
    with pytest.raises(ValueError, match=r"widths_m = .* of RTXCR are fixed"):
        convert.to_rtxcr(fiber)


FLAT = fj.Fiber(widths_m=(1.0,))
BAD = {
    "both": (
        lambda: convert.pbrt(sigma_a=1.0, reflectance=0.5),
        "sigma_a and reflectance are given",
    ),
    "pheomelanin": (
        lambda: convert.pbrt(sigma_a=1.0, pheomelanin=0.2),
        "sigma_a and pheomelanin are given: must be sigma_a or reflectance or eumelanin"
        " with pheomelanin",
    ),
    "ratio": (
        lambda: convert.tungsten(sigma_a=1.0, melanin_ratio=0.2),
        "sigma_a and melanin_ratio are given",
    ),
    "color and redness": (
        lambda: convert.cycles(color=0.5, melanin_redness=0.2),
        "color and melanin_redness are given",
    ),
    "name": (
        lambda: convert.mitsuba(int_ior="keratin"),
        "int_ior = 'keratin': must be",
    ),
    "many": (lambda: convert.pbrt(np.full(3, 0.3)), "beta_m has shape .*vmap for many"),
    "black": (
        lambda: convert.pbrt(reflectance=(0.5, 0.0)),
        r"reflectance = 0.0: must lie in \(0, inf\); black absorbs without end",
    ),
    "eta": (lambda: convert.pbrt(eta=0.9), r"eta = 0.9: must lie in \[1, inf\)"),
    "mitsuba's range": (
        lambda: convert.mitsuba(longitudinal_roughness=1.1),
        r"longitudinal_roughness = 1.1: must lie in \(0, 1\]",
    ),
    "outside": (lambda: convert.mitsuba(int_ior=1.0, ext_ior=1.3), "int_ior/ext_ior"),
    "tint": (lambda: convert.materialx(tint_TT=(1.0, 0.5, 1.0)), "tint_TT .* is lost"),
    "shape": (lambda: convert.materialx(0.1), r"roughness_R has shape \(\)"),
    "specular": (lambda: convert.karis(0.5, specular=0.5), "specular = 0.5.* lost"),
    "scatter": (lambda: convert.karis(0.5, scatter=0.5), "scatter = 0.5.* other hairs"),
    "diffuse": (
        lambda: convert.rtxcr(diffuse_reflection_weight=0.2),
        "diffuse_reflection_weight = 0.2: must be 0; a Fiber has no diffuse lobe",
    ),
    "model": (
        lambda: convert.rtxcr(0.1, 2.0, melanin=0.1, absorption_model="linear"),
        "absorption_model = 'linear': must be one of",
    ),
    "pole": (
        lambda: convert.rtxcr(0.1, 2.0, at=(math.pi / 2, 0.0)),
        "theta_i of at = 1.57",
    ),
    "table": (lambda: pigment.melanin(1.0, 0.0, table="arnold"), "table = 'arnold'"),
    "widths": (lambda: convert.to_pbrt(FLAT), "widths_m = .*pbrt are fixed.* lost"),
    "tilts": (
        lambda: convert.to_cycles(convert.unity(0.5, 0.5, 3.0, 0.1)),
        "tilts = .* lost",
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
        r"perceptual beta_m = 1.009\d*: must lie in \[0.01, 1\]; pbrt has no .*lost",
    ),
    "azimuth": (lambda: convert.to_tungsten(fj.Fiber()), "beta_n = .* lost"),
    "azimuth of karis": (lambda: convert.to_karis(fj.Fiber()), "beta_n = .* lost"),
    "eta of karis": (lambda: convert.to_karis(fj.Fiber(eta=1.4)), "eta = 1.4.* lost"),
    "coat": (
        lambda: convert.to_cycles(fj.Fiber(widths_m=(1.2, 0.5, 2.0))),
        r"coat = -0.155\d*: must lie in \[0, 1\]; Cycles has no other,.*lost",
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


NEGATIVE = {
    convert.pbrt: {"eta": 0.5},
    convert.mitsuba: {"sigma_a": -1, "eumelanin": -1, "pheomelanin": -1, "ext_ior": 0},
    convert.cycles: {
        "absorption_coefficient": -1,
        "melanin": -0.5,
        "melanin_redness": 2,
        "tint": -1,
        "random": 2,
        "random_roughness": -1,
        "ior": 0.5,
    },
    convert.materialx: {
        "absorption_coefficient": -1,
        "azimuthal_roughness": 2,
        "melanin_concentration": 2,
        "melanin_redness": -1,
        "eumelanin_color": 0,
        "pheomelanin_color": -1,
        "cuticle_angle": 2,
        "ior": 0.5,
    },
    convert.tungsten: {
        "roughness": -1,
        "sigma_a": -1,
        "melanin_concentration": -1,
        "melanin_ratio": 3,
    },
    convert.unity: {
        "smoothness": 2,
        "radial_smoothness": -1,
        "absorption": -1,
        "eumelanin": -1,
        "pheomelanin": -1,
    },
    partial(convert.karis, 0.5): {"beta_n": 0},
    partial(convert.karis): {"base_color": -1},
    convert.rtxcr: {
        "roughness": 0,
        "ior": 1,
        "absorption_coefficient": -1,
        "azimuthal_roughness": 2,
        "melanin": -1,
        "melanin_redness": 2,
    },
    partial(convert.rtxcr, absorption_model="normalized"): {"melanin": 2},
    partial(convert.mitsuba, sigma_a=1.0): {"scale": -1},
}


def test_numbers_outside_of_their_range():
    for of, numbers in NEGATIVE.items():
        for name, number in numbers.items():
            for bad in (number, math.nan):
                with pytest.raises(ValueError, match=f"^(int_ior/)?{name} = "):
                    of(**{name: bad})


def test_contents_are_public():
    names = {name for name in vars(untyped) if not name.startswith("_")}
    systems = {"pbrt", "mitsuba", "cycles", "materialx", "tungsten", "unity", "karis"}
    systems |= {"rtxcr"}
    assert {*systems, *(f"to_{name}" for name in systems)} <= names
    assert all(getattr(convert, name).__doc__ for name in names)
