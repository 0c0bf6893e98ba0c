"""ERRATA.md: every entry is shown to be wrong as printed and right as corrected.

A function below is the entry of its name. It writes the printed form in NumPy, asserts
that it misses an independent truth (a ray trace, quadrature, mpmath) while fiberjax
meets that truth, and returns the numbers of the entry's last cell, in their order.
"""

import json
import re
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import raytrace
import reference
from scipy import special
from test_farfield import independent_albedo, naive_attenuation
from test_raytrace import traced_tilt, wrapped
from test_sampling import FALSE_ALARM, p_value, uniforms

import fiberjax as fj

TEXT = (Path(__file__).parents[1] / "ERRATA.md").read_text()
HALF_PI = np.pi / 2
ETA = 1.55
BETA_N = 0.18696  # of the default fiber
ENTRIES: dict[str, Any] = {}
mp = reference.mp


def erratum(f):
    """Registers the entry of this name."""
    ENTRIES[f.__name__] = f
    return f


def nodes(low, high, parts=64, order=16):
    """Composite Gauss-Legendre: nodes and weights."""
    x, w = np.polynomial.legendre.leggauss(order)
    edges = np.linspace(low, high, parts + 1)
    half = np.diff(edges)[:, None] / 2
    return ((edges[1:] + edges[:-1])[:, None] / 2 + half * x).ravel(), (
        half * w
    ).ravel()


THETA, THETA_WEIGHT = nodes(-HALF_PI, HALF_PI, 256)
COS = np.cos(THETA)


def eta_prime(theta_d, eta=ETA):
    return np.sqrt(eta**2 - np.sin(theta_d) ** 2) / np.cos(theta_d)


def Phi(p, h, theta_d=0.0, eta=ETA):
    return 2 * p * np.arcsin(h / eta_prime(theta_d, eta)) - 2 * np.arcsin(h) + p * np.pi


def M(theta_c, theta_o, v):
    """Eq. 5 of 2013 without 1/cos(theta_o), with the exponentials taken together."""
    a = np.cos(theta_c) * np.cos(theta_o) / v
    E = np.sin(theta_c) * np.sin(theta_o) / v + np.abs(a) - 1 / v
    return np.exp(E) * special.i0e(a) / (-v * np.expm1(-2 / v))


def logistic(x, s):
    return 1 / (4 * s * np.cosh(x / (2 * s)) ** 2)


def exit_azimuth(p, h, theta_i):
    """phi of the traced ray, in (-pi, pi]."""
    h, theta_i = np.broadcast_arrays(h, theta_i)
    omega_o = raytrace.trace(p, h, theta_i, np.zeros_like(h), np.full(h.shape, ETA))[0]
    return np.arctan2(omega_o[..., 2], omega_o[..., 1])


def longest_miss(p, azimuth, h, theta_i):
    """Largest difference, in degrees, of an azimuth from that of the traced rays."""
    off = wrapped(azimuth - exit_azimuth(p, h, theta_i))
    return np.degrees(np.abs(off)).max()


H = np.linspace(-0.999, 0.999, 201)


# d'Eon, Marschner, Hanika 2013


@erratum
def deon2013_eta_prime():
    theta_d = np.radians(np.linspace(-80, 80, 161))[:, None]
    printed = np.sqrt(ETA**2 - np.sin(theta_d)) / np.cos(theta_d)
    gamma_t = np.arcsin(H / printed)
    off = longest_miss(1, 2 * gamma_t - 2 * np.arcsin(H) + np.pi, H, -theta_d)
    found = fj.Phi(1, H, fj.eta_prime(theta_d, ETA))
    assert longest_miss(1, np.asarray(found), H, -theta_d) < 1e-10
    assert off > 5
    return off / 2, off, 80, ETA


@erratum
def deon2013_gamma():
    eta_p = eta_prime(0.0)
    misses = []
    for p in (0, 1):
        printed = 2 * p * np.arcsin(H) - 2 * np.arcsin(H / eta_p) + p * np.pi
        misses.append(longest_miss(p, printed, H, 0.0))
        found = np.asarray(fj.Phi(p, H, fj.eta_prime(0.0, ETA)))
        assert longest_miss(p, found, H, 0.0) < 1e-10
    assert min(misses) > 60
    return misses


@erratum
def deon2013_reciprocity():
    v, theta_i, other = 0.3**2, np.radians(80), 0.3
    both = (
        M(-theta_i, other, v) / np.cos(other),
        M(-other, theta_i, v) / np.cos(theta_i),
    )
    assert both[0] / both[1] == pytest.approx(
        np.cos(theta_i) / np.cos(other), rel=1e-12
    )
    # With the term that the text names, the M of eq. 5 would not be normalized.
    printed = THETA_WEIGHT @ (M(-theta_i, THETA, v) / np.cos(theta_i) * COS**2)
    eq_5 = THETA_WEIGHT @ (M(-theta_i, THETA, v) / COS * COS**2)
    assert eq_5 == pytest.approx(1, abs=1e-12)
    assert printed > 1.3
    there, back = fj.M(-theta_i, other, v), fj.M(-other, theta_i, v)
    np.testing.assert_allclose(there, back, rtol=1e-14)
    np.testing.assert_allclose(there, both[0] * np.cos(other), rtol=1e-13)
    return printed, 80, 0.3


@erratum
def deon2013_clamp():
    fiber, lost = fj.Fiber(ETA, 0.6, 0.6, np.radians(2.5), None), []
    for degrees in (85, 89):
        theta_i = np.radians(degrees)
        truth = independent_albedo(fiber, theta_i, (0, 1, 2, 3))
        u = uniforms(6, 400_000)
        weight = np.asarray(fj.sample(fiber, theta_i, u, strategy="lobe_first").weight)
        error = weight.std() / np.sqrt(weight.size)
        assert abs(weight.mean() - truth) < 4.5 * error < 0.05 * truth
        lost.append(100 * (1 - np.minimum(weight, 2).mean() / truth))
    assert min(lost) > 25
    return lost[0], 85, lost[1], 89, 0.6, 2.5


@erratum
def deon2013_pole():
    theta_i, alpha, count = np.radians(87), np.radians(2.5), 400_000
    fiber = fj.Fiber(ETA, 0.6, 0.6, alpha, None)
    truth = independent_albedo(fiber, theta_i, (0, 1, 2, 3))
    rng = np.random.default_rng(1)
    h, chosen = rng.uniform(-1, 1, count), rng.uniform(size=count)
    tilts, betas = (2, -1, -4, 0), (0.6, 0.3, 1.2, 1.2)
    cones = [-theta_i + k * alpha for k in tilts]
    specular = []
    for p, cone in enumerate(cones):
        # Past 90 degrees the cosine of theta_d is negative: nothing gets in.
        d = (cone - theta_i) / 2
        dark = np.full(count, float(p == 0))
        A = naive_attenuation(p, h, d, ETA, 0.0, p == 3) if np.cos(d) > 0 else dark
        specular.append(A)
    total = np.sum(specular, 0)
    share = np.cumsum(specular, 0) / total
    p = (chosen > share[:-1]).sum(0)
    weight = np.zeros(count)
    for q, (cone, beta) in enumerate(zip(cones, betas, strict=True)):
        at = p == q
        u = rng.uniform(size=(at.sum(), 2))
        theta_o = np.asarray(fj.sample_M(cone, beta**2, u))
        A = naive_attenuation(q, h[at], (theta_o - theta_i) / 2, ETA, 0.0, q == 3)
        weight[at] = A * total[at] / specular[q][at]
    printed = weight.mean()
    s = fj.sample(fiber, theta_i, uniforms(6, count), strategy="lobe_first")
    found = np.asarray(s.weight)
    assert abs(found.mean() - truth) < 4.5 * found.std() / np.sqrt(count)
    # Folded, the cone of TRT is at -pi - theta_cone.
    d = (-np.pi - cones[2] - theta_i) / 2
    folded = [*specular[:2], naive_attenuation(2, h, d, ETA, 0.0), specular[3]]
    expected = np.mean(folded[2] / np.sum(folded, 0))
    assert expected > 0.05
    assert np.mean(np.asarray(s.p) == 2) == pytest.approx(expected, abs=3e-3)
    assert printed < truth - 6 * weight.std() / np.sqrt(count)
    # What is missing is the whole of TRT.
    rest = independent_albedo(fiber, theta_i, (0, 1, 3))
    assert abs(printed - rest) < 4.5 * weight.std() / np.sqrt(count)
    return rest, truth, 87, 0.6, 2.5


def lambert(phi):
    """A Lambertian cylinder seen from afar, from its definition."""
    gamma, w = nodes(-HALF_PI, HALF_PI, 512)
    seen = np.maximum(np.cos(gamma - phi[:, None]), 0)
    return (np.cos(gamma) * seen) @ w / (2 * np.pi)


@erratum
def deon2013_eq9():
    def printed(phi):
        return np.abs((np.pi - phi) * np.cos(phi) + np.sin(phi)) / (4 * np.pi)

    phi, w = nodes(-np.pi, np.pi)
    truth = lambert(phi)
    d = np.pi - np.abs(phi)
    corrected = (np.sin(d) - d * np.cos(d)) / (4 * np.pi)
    np.testing.assert_allclose(corrected, truth, atol=2e-6)
    np.testing.assert_allclose(printed(phi + np.pi), lambert(phi + np.pi), atol=2e-6)
    energy = [np.pi / 2 * (f @ w) for f in (corrected, printed(phi))]
    assert energy[0] == pytest.approx(1, abs=1e-12)
    assert energy[1] > 1.6
    # Next to phi = pi the value is d^3/(12 pi), a difference of numbers near d.
    near = np.linspace(3.1, 3.13, 1000).astype(np.float32)
    with mp.workdps(40):
        gaps = [mp.pi - mp.mpf(float(x)) for x in near]
        exact = [float((mp.sin(d) - d * mp.cos(d)) / (4 * mp.pi)) for d in gaps]
    off = np.abs(printed(near) / np.array(exact) - 1).max()
    d = np.pi - near.astype(float)
    series = d**3 / 3 * (1 - d**2 / 10 + d**4 / 280) / (4 * np.pi)
    np.testing.assert_allclose(series, exact, rtol=1e-12)
    return energy[1], 100 * off, 3.13


@erratum
def deon2013_eq6():
    least = []
    for dtype in (np.float32, np.float64):
        edge = 1 / np.log(np.finfo(dtype).max)
        for v, finite in ((dtype(0.99 * edge), False), (dtype(1.01 * edge), True)):
            with np.errstate(all="ignore"):
                xi = dtype(0.3)
                up = np.exp(1 / v) - 2 * xi * np.sinh(1 / v)
                assert np.isfinite(v * np.log(up)) == finite
        least.append(np.sqrt(edge))
        v = dtype(0.9 * edge)
        u = np.array([0.3, 0.1], dtype)
        xi = mp.mpf(float(u[0])) + mp.mpf(float(np.finfo(dtype).eps)) / 2
        with mp.workdps(40):
            cone, u1 = mp.mpf(float(dtype(0.4))), mp.mpf(float(u[1]))
            truth = reference.sample_M(cone, mp.mpf(float(v)), xi, u1)
        found = fj.sample_M(dtype(0.4), v, u)
        assert abs(float(found) - float(truth)) < 8 * np.finfo(dtype).eps
    return least


@erratum
def deon2013_single_root():
    """At theta_d = 0, where TT has no root for |phi| < 2 asin(1/eta)."""
    beta_n, edge, count = 0.5, 2 * np.arcsin(1 / ETA), 1_000_000
    rng = np.random.default_rng(2)
    phi = Phi(1, rng.uniform(-1, 1, count)) + beta_n * rng.normal(size=count)
    share = np.mean(np.abs(wrapped(phi)) < edge)
    gamma, w = nodes(-HALF_PI, HALF_PI)
    ends = np.array([[edge], [-edge]]) + 2 * np.pi * np.arange(-2, 3)
    below = special.ndtr((ends[..., None] - Phi(1, np.sin(gamma))) / beta_n).sum(1)
    exact = (below[0] - below[1]) @ (np.cos(gamma) * w) / 2
    assert abs(share - exact) < 4.5 * np.sqrt(share / count)
    fiber = fj.Fiber(ETA, 0.3, beta_n, None, None)
    only = {"lobes": (1,), "rest": False}
    inside, w = nodes(-edge, edge, 8)
    smooth = fj.pdf_smooth(
        fiber, 0.0, 0.0, inside[np.abs(inside) < 0.999 * edge], **only
    )
    assert not np.asarray(smooth).any()
    rule = fj.GaussGamma(64)
    density = fj.pdf(fiber, 0.0, 0.0, inside, rule=rule, strategy="lobe_first", **only)
    mass = np.asarray(density) @ w / float(fj.M(0.0, 0.0, 0.15**2))
    assert mass == pytest.approx(exact, rel=1e-7)
    assert share > 0.02
    return 100 * mass, beta_n


@erratum
def deon2013_tilt():
    traced = [traced_tilt(p) for p in (0, 1, 2)]
    np.testing.assert_allclose(traced, [2, 2 - 2 * ETA, 2 - 4 * ETA], rtol=1e-6)
    assert abs(traced[1] + 1) > 0.09
    assert abs(traced[2] + 4) > 0.19
    printed = [traced_tilt(p, 1.5) for p in (0, 1, 2)]
    np.testing.assert_allclose(printed, [2, -1, -4], rtol=1e-6)
    # The factors are fields of the fiber: those of the trace can be given.
    alpha, theta_o = 0.02, np.linspace(-0.2, 0.2, 2001)
    fiber = fj.Fiber(ETA, 0.005, alpha=alpha, sigma_a=None, tilts=tuple(traced))
    for p in (1, 2):
        rule = fj.GaussGamma(32)
        density = fj.lobe(fiber, p, 0.0, theta_o, p * np.pi, rule=rule)
        center = np.average(theta_o, weights=density) / alpha
        assert center == pytest.approx(traced[p], rel=5e-3)
    return traced[1], traced[2], ETA, 1.5


@erratum
def deon2013_energy():
    alpha = np.radians(2.5)
    cases = [(85, 0.6, None), (-82, 0.05, alpha)]
    found = []
    for degrees, beta, tilt in cases:
        fiber, theta_i = fj.Fiber(ETA, beta, beta, tilt, None), np.radians(degrees)
        truth = independent_albedo(fiber, theta_i, (0, 1, 2, 3))
        assert float(fj.albedo(fiber, theta_i)) == pytest.approx(truth, abs=1e-12)
        kept = fj.albedo(fiber, theta_i, incidence="theta_i")
        assert float(kept) == pytest.approx(1, abs=1e-12)
        found.append(truth)
    assert found[0] < 0.8
    assert found[1] > 1.1
    return found[0], 85, 0.6, found[1], -82, 0.05, 2.5


def wrapped_normal(x, beta):
    turns = x[..., None] + 2 * np.pi * np.arange(-3, 4)
    return np.exp(-((turns / beta) ** 2) / 2).sum(-1) / (beta * np.sqrt(2 * np.pi))


@erratum
def deon2013_quadrature():
    """R at theta_d = 0.3, against 16384 nodes in gamma."""
    theta_d, beta_n = 0.3, 0.02
    phi = np.linspace(0, np.pi, 181)
    x, w = np.polynomial.legendre.leggauss(70)

    def integral(h, weight):
        A = naive_attenuation(0, h, theta_d, ETA, 0.0)
        return wrapped_normal(phi[:, None] - Phi(0, h, theta_d), beta_n) @ (A * weight)

    gamma, w_gamma = nodes(-HALF_PI, HALF_PI, 1024)
    truth = integral(np.sin(gamma), np.cos(gamma) * w_gamma / 2)
    off = np.abs(integral(x, w / 2) - truth).max() / truth.max()
    found = fj.N(0, phi, theta_d, eta=ETA, sigma_a=None, beta_n=beta_n)
    np.testing.assert_allclose(found, truth, atol=1e-11 * truth.max())
    assert off > 0.3
    return 100 * off, beta_n


# Hair Rendering, notes of 2023 on Chiang et al. 2016 in Mitsuba 3


@erratum
def notes2023_measure():
    numbers = []
    for theta_c, beta in ((0.5, 0.02), (np.radians(80), 0.02)):
        density = M(theta_c, THETA, beta**2)
        assert THETA_WEIGHT @ (density * COS) == pytest.approx(1, abs=1e-12)
        numbers.append(THETA_WEIGHT @ (density * COS**2))
        found = np.asarray(fj.M(theta_c, THETA, beta**2))
        assert THETA_WEIGHT @ (found * COS) == pytest.approx(1, abs=1e-12)
    assert numbers[0] < 0.88
    assert numbers[1] < 0.2
    return numbers[0], 0.5, numbers[1], 80


def mean_attenuation(theta, sigma_a):
    gamma, w = nodes(-HALF_PI, HALF_PI)
    A = naive_attenuation(1, np.sin(gamma), theta, ETA, sigma_a)
    return A @ (np.cos(gamma) * w) / 2


@erratum
def notes2023_theta_h():
    totals = []
    for degrees in (0, 80):
        theta_i, beta = np.radians(degrees), 0.1
        half = (theta_i + THETA) / 2
        gaussian = np.exp(-((half / beta) ** 2) / 2) / (beta * np.sqrt(2 * np.pi))
        totals.append(THETA_WEIGHT @ (gaussian * COS))
        # Of the same width in theta_o.
        found = np.asarray(fj.M(-theta_i, THETA, (2 * beta) ** 2))
        assert THETA_WEIGHT @ (found * COS) == pytest.approx(1, abs=1e-12)
    assert totals[0] > 1.9
    assert totals[1] < 0.5
    return totals[0], 0, totals[1], 80, beta


@erratum
def notes2023_theta_i():
    """What TT lets through on its way from a to b and back."""
    a, b, sigma_a = np.radians(75), np.radians(-15), 0.5
    there, back = mean_attenuation(a, sigma_a), mean_attenuation(b, sigma_a)
    both = mean_attenuation((b - a) / 2, sigma_a)
    fiber = fj.Fiber(ETA, 0.3, 0.3, None, sigma_a)
    phi, w = nodes(-np.pi, np.pi, 4)
    along = float(fj.M(-a, b, 0.15**2))

    def passed(theta_i, theta_o, incidence):
        rule = fj.GaussGamma(64)
        S = fj.lobe(fiber, 1, theta_i, theta_o, phi, rule=rule, incidence=incidence)
        return np.asarray(S) @ w / along

    for incidence, expected in (("theta_i", (there, back)), ("theta_d", (both, both))):
        assert passed(a, b, incidence) == pytest.approx(expected[0], rel=1e-9)
        assert passed(b, a, incidence) == pytest.approx(expected[1], rel=1e-9)
    assert back / there > 1.3
    return there, back, both, 75, -15, sigma_a


@erratum
def notes2023_sign_h():
    h, theta_i = -0.5, 0.4
    # The ray comes from azimuth 0 and enters where the normal has azimuth -asin h.
    azimuth = -np.arcsin(h)
    unsigned = np.arccos(np.cos(azimuth))
    signed = np.arctan2(-np.sin(azimuth), np.cos(azimuth))
    printed = longest_miss(1, Phi(1, np.sin(unsigned), theta_i), h, theta_i)
    found = fj.Phi(1, np.sin(signed), fj.eta_prime(-theta_i, ETA))
    assert longest_miss(1, np.asarray(found), h, theta_i) < 1e-10
    assert printed > 20
    return printed, h


@erratum
def notes2023_wrap():
    s = np.sqrt(np.pi / 8) * BETA_N
    phi, w = nodes(-np.pi, np.pi, 512)
    kept = []
    for h in (0.0, -0.9):
        x = phi - Phi(1, h)
        trimmed = logistic(x, s) / np.tanh(np.pi / (2 * s))
        kept.append(trimmed @ w)
        found = np.asarray(fj.trimmed_logistic(x, s))
        assert found @ w == pytest.approx(1, abs=1e-6)
    assert kept[0] < 0.51
    assert kept[1] < 1e-3
    return kept[0], 0, kept[1], -0.9, s


@erratum
def notes2023_demux():
    """Odd and even bits of a float32 in [1/2, 1) scaled to 32 bits."""
    f = np.random.default_rng(3).uniform(0.5, 1, 1_000_000).astype(np.float32)
    f = np.minimum(f, np.float32(1 - 2**-24))
    bits = (f.astype(np.float64) * 2.0**32).astype(np.uint64)
    one = np.zeros_like(bits)
    for k in range(16):
        one |= (bits >> np.uint64(2 * k) & np.uint64(1)) << np.uint64(k)
    values = np.unique(one)
    found = np.unique(uniforms(3, f.size, 1, jnp.float32))
    assert np.log2(values.size) == 12
    assert found.size > 2**19
    # The last value is half a cell from 1: a quantile of the logistic stops there.
    s, u = 0.1, 1 - 2.0**-13
    return np.log2(values.size), s * np.log(u / (1 - u)) / s


def simpson(f, low, high, parts):
    x = np.linspace(low, high, parts + 1, axis=-1)
    w = np.ones(parts + 1)
    w[1:-1:2], w[2:-1:2] = 4, 2
    return f(x) @ w * (high - low) / (3 * parts)


@erratum
def notes2023_chi_square():
    s, count, bins = 0.01, 1_000_000, 101
    rng = np.random.default_rng(4)
    center = Phi(0, 0.3)
    mass = np.tanh(np.pi / (2 * s))
    x = 2 * s * np.arctanh((2 * rng.uniform(size=count) - 1) * mass)
    edges = np.linspace(-np.pi, np.pi, bins + 1)
    observed, _ = np.histogram(wrapped(center + x), edges)

    def density(phi):
        return np.asarray(fj.trimmed_logistic(phi - center, s))

    p = []
    for parts in (4, 64):
        expected = simpson(density, edges[:-1], edges[1:], parts)
        p.append(p_value(observed.copy(), expected * count))
    exact = np.diff(special.expit((edges - center) / s)) / mass
    assert p_value(observed.copy(), exact * count) > FALSE_ALARM
    assert p[0] < 1e-12
    assert p[1] > FALSE_ALARM
    return 4, 64, s, bins


# Karis 2016


@erratum
def karis2016_absorption():
    theta_i = np.radians(np.array([-70.0, 0.0, 40.0]))[:, None]
    h, angles = np.broadcast_arrays(H, theta_i)
    traced = raytrace.trace(1, h, angles, 0 * h, np.full(h.shape, ETA)).segments[0]
    gamma_t = np.arcsin(h / eta_prime(angles))
    cos_theta_t = np.sqrt(1 - (np.sin(angles) / ETA) ** 2)
    ratio = 2 * (1 + np.cos(2 * gamma_t)) / cos_theta_t / traced
    found = -np.log(fj.transmittance(h, -angles, ETA, 1.0))
    np.testing.assert_allclose(found, traced, rtol=1e-12)
    assert ratio.min() > 1.5
    return ratio.min(), ratio.max()


@erratum
def karis2016_M_overflow():
    def printed(a, b, v, lib=np):
        scale = 1 / (v * lib.exp(2 / v) - v)
        I0 = special.i0 if lib is np else (lambda x: mp.besseli(0, x))
        exponent = (1 - lib.sin(a) * lib.sin(b)) / v
        return scale * lib.exp(exponent) * I0(lib.cos(a) * lib.cos(b) / v)

    a, b = 0.3, -0.25
    edge = 2 / np.log(float(np.finfo(np.float32).max))
    for v, right in ((0.99 * edge, False), (1.2 * edge, True)):
        with mp.workdps(40):
            exact = float(printed(mp.mpf(a), mp.mpf(b), mp.mpf(v), mp))
        with np.errstate(all="ignore"):
            single = printed(np.float32(a), np.float32(b), np.float32(v))
        good = bool(abs(single / exact - 1) < 1e-3)
        assert good == right
        found = fj.M(np.float32(-a), np.float32(b), np.float32(v))
        assert abs(float(found) / exact - 1) < 1e-5
    return edge, np.sqrt(edge)


@erratum
def karis2016_h_TT():
    """On [-pi, pi]; only rays with sin(|phi|/2) >= 1/eta' leave at phi."""

    def printed(phi, a):
        side = np.sign(phi)
        root = 1 + a * a - 2 * a * side * np.sin(phi / 2)
        return side * np.cos(phi / 2) / np.sqrt(root)

    a = 1 / eta_prime(0.3)
    edge = 2 * np.arcsin(a)
    phi = np.linspace(-3.141, 3.141, 1001)
    at = np.asarray(fj.Phi(1, printed(phi, a), np.float64(1 / a)))
    off = np.degrees(np.abs(wrapped(at - phi)))
    there = np.abs(phi) >= edge
    assert off[there].max() < 1e-5
    assert off[np.abs(phi) < 0.99 * edge].min() > 0.1
    low, high = np.degrees(edge), off[~there].max()
    assert high > 90
    return low, high


def one_lobe(constants, s, center, energy):
    """Integrals of exp(k0 cos phi + k1) and its target; largest error over the peak."""
    phi, w = nodes(0, 2 * np.pi, 256)
    x = (phi - center + np.pi) % (2 * np.pi) - np.pi
    target = energy * logistic(x, s)
    k0, k1 = constants
    lobe = np.exp(k0 * np.cos(phi) + k1)
    return lobe @ w, target @ w, np.abs(lobe - target).max() * 4 * s / energy


def shipped(kind, name):
    """Constants of the fits that this repository writes."""
    path = Path(__file__).parents[1] / "fits" / "constants" / f"{name}.json"
    return json.loads(path.read_text())["constants"][kind].values()


@erratum
def karis2016_D_TT():
    whole, target, off = one_lobe((-3.65, -3.98), 0.35, np.pi, 1.0)
    assert target == pytest.approx(1, abs=3e-4)
    assert off > 0.023
    better = one_lobe(shipped("minimax", "d_tt"), 0.35, np.pi, 1.0)
    assert better[2] < 0.75 * off
    return whole, 100 * off


@erratum
def karis2016_D_TRT():
    whole, target, off = one_lobe((17, -16.78), 0.15, 0.0, 0.75)
    assert target == pytest.approx(0.75, abs=1e-6)
    assert off > 0.05
    better = one_lobe(shipped("minimax", "d_trt"), 0.15, 0.0, 0.75)
    assert better[2] < 0.55 * off
    return whole, 0.75, 100 * off


@erratum
def karis2016_D_blind():
    phi, (h, weight) = np.linspace(0, np.pi, 361), nodes(-1, 1)
    beta_n, theta_d = 0.7, np.radians(75)
    h_TT = np.cos(phi / 2) * (1 + (0.6 - 0.8 * np.cos(phi)) / eta_prime(theta_d))
    misses = []
    for p, at, k in ((1, h_TT, (-3.65, -3.98)), (2, np.sqrt(3) / 2, (17, -16.78))):
        away = phi[:, None] - Phi(p, h, theta_d)
        images = (away + 2 * np.pi * m for m in range(-3, 4))
        D = sum(np.exp(-((x / beta_n) ** 2) / 2) for x in images)
        A = naive_attenuation(p, h, theta_d, ETA, 0.0)
        truth = (A * weight * D).sum(1) / (2 * beta_n * np.sqrt(2 * np.pi))
        found = fj.N(p, phi, theta_d, eta=ETA, sigma_a=None, beta_n=beta_n)
        np.testing.assert_allclose(found, truth, rtol=0, atol=1e-5 * truth.max())
        A = naive_attenuation(p, np.minimum(at, 1), theta_d, ETA, 0.0)
        off = np.abs(A * np.exp(k[0] * np.cos(phi) + k[1]) - truth).max() / truth.max()
        assert off > 1
        misses.append(100 * off)
    return *misses, beta_n, 75


def two_segments(theta):
    """Length of both segments of TRT at Karis' offset, by trace."""
    h, angle = np.full(1, np.sqrt(3) / 2), np.full(1, theta)
    return raytrace.trace(2, h, angle, 0 * h, np.full(1, ETA)).segments.sum()


@erratum
def karis2016_T_TRT():
    """C is what both halves of a pass make of it: sigma_a = -ln(C)/4."""
    exponent = two_segments(0.0) / 4
    one = float(-np.log(fj.transmittance(np.sqrt(3) / 2, 0.0, ETA, 1.0)))
    assert 2 * one / 4 == pytest.approx(exponent, rel=1e-12)
    assert abs(0.8 - exponent) < 0.05
    assert abs(2 * 0.8 - exponent) > 0.7
    return exponent, 2 * 0.8


@erratum
def karis2016_cos_theta_d():
    theta = np.radians(60)
    grown = two_segments(theta) / two_segments(0.0)
    gamma_t = [np.arcsin(np.sqrt(0.75) / eta_prime(x)) for x in (0.0, theta)]
    bend = np.cos(gamma_t[1]) / np.cos(gamma_t[0])
    over = 1 / np.cos(theta) / (grown / bend)
    for x in (0.0, theta):
        T = fj.transmittance(np.sqrt(0.75), x, ETA, 1.0)
        assert -2 * np.log(T) == pytest.approx(two_segments(x), rel=1e-12)
    assert over > 1.5
    return over, 60


@erratum
def karis2016_M_gaussian():
    lost = []
    for degrees in (90, 75):
        theta_i, beta = np.radians(degrees), 0.3
        off = (np.sin(theta_i) + np.sin(THETA)) / beta
        gaussian = np.exp(-(off**2) / 2) / (beta * np.sqrt(2 * np.pi))
        lost.append(THETA_WEIGHT @ (gaussian * COS))
        found = np.asarray(fj.M(-theta_i, THETA, beta**2))
        assert THETA_WEIGHT @ (found * COS) == pytest.approx(1, abs=1e-12)
    assert lost[0] == pytest.approx(0.5, abs=1e-9)
    assert lost[1] < 0.6
    return lost[0], 90, lost[1], 75, 0.3


@erratum
def karis2016_shift():
    """R of the ray through the middle, reflected at a normal turned by alpha."""
    theta_i, alpha = np.radians(60), np.radians(2.5)
    zero, angle = np.zeros(1), np.full(1, theta_i)
    omega_o = raytrace.trace(0, zero, angle, zero, np.full(1, ETA), alpha).omega_o
    traced = np.arcsin(omega_o[0, 0])
    fiber = fj.Fiber(ETA, 1e-3, alpha=alpha, sigma_a=None)
    near = traced + np.linspace(-0.005, 0.005, 2001)
    density = np.asarray(fj.lobe(fiber, 0, theta_i, near, 0.0, rule=fj.GaussGamma(32)))
    assert abs(near[density.argmax()] - traced) < 1e-4
    same_sign = np.arcsin(-np.sin(theta_i) - 2 * alpha)
    opposite = np.arcsin(-np.sin(theta_i) + 2 * alpha)
    misses = np.degrees(np.abs([same_sign - traced, opposite - traced]))
    assert misses.min() > 3
    return misses[0], misses[1], 60, 2.5


# Hair Simulator, a student report on Marschner's model in Tungsten


@erratum
def report_cone_TT():
    theta_i = np.radians(40)
    h = np.zeros(1)
    omega_o = raytrace.trace(1, h, np.full(1, theta_i), h, np.full(1, ETA)).omega_o
    traced = np.arcsin(omega_o[0, 0])
    off = np.degrees(abs(theta_i - traced))
    fiber = fj.Fiber(ETA, 0.01, alpha=None, sigma_a=None)
    S = np.asarray(fj.lobe(fiber, 1, theta_i, THETA, np.pi, rule=fj.GaussGamma(32)))
    assert abs(THETA[S.argmax()] - traced) < 0.02
    assert off > 79
    return off, 40


@erratum
def report_variance():
    u = np.asarray(uniforms(8, 200_000, 2))
    spread = []
    for v in (1.0, 0.2**2):
        cosine = 1 + v * np.log(u[:, 0] + (1 - u[:, 0]) * np.exp(-2 / v))
        across = np.sqrt(1 - cosine**2) * np.cos(2 * np.pi * u[:, 1])
        spread.append(np.arcsin(across).std())
    truth = np.sqrt(THETA_WEIGHT @ (M(0.0, THETA, 0.2**2) * COS * THETA**2))
    found = np.asarray(fj.sample_M(0.0, 0.2**2, u))
    assert found.std() == pytest.approx(truth, rel=0.01)
    assert spread[1] == pytest.approx(truth, rel=0.01)
    assert spread[0] > 2 * truth
    wide = np.sqrt(THETA_WEIGHT @ (M(0.0, THETA, 1.0) * COS * THETA**2))
    assert spread[0] == pytest.approx(wide, rel=0.01)
    return wide, truth, 0.2


@erratum
def report_weight():
    """Clear fiber, normal incidence, all lobes smooth: the mean of sum w_p A_p."""
    gamma, w = nodes(-HALF_PI, HALF_PI)
    h, w = np.sin(gamma), np.cos(gamma) * w / 2
    A = np.stack([naive_attenuation(p, h, 0.0, ETA, 0.0, p == 3) for p in range(4)])
    printed = (A**2 / A.sum(0)).sum(0) @ w
    assert A.sum(0) @ w == pytest.approx(1, abs=1e-12)
    fiber = fj.Fiber(ETA, 1e-3, 1e-3, None, None)
    s = fj.sample(fiber, 0.0, uniforms(12, 200_000), strategy="lobe_first")
    weight = np.asarray(s.weight)
    assert weight.mean() == pytest.approx(1, abs=1e-5)
    assert printed < 0.9
    return (printed,)


# Shipped implementations


def log_I0(x, terms=10):
    """Of pbrt, Tungsten, Mitsuba, Unity and MaterialX, in the dtype of x."""
    large = x + (-np.log(2 * np.pi) + np.log(1 / x) + 1 / (8 * x)) / 2
    series = sum((x * x / 4) ** k / special.factorial(k) ** 2 for k in range(terms))
    return np.where(x > 12, large, np.log(series))


@erratum
def renderers_log_I0():
    x = np.linspace(12.001, 200, 2000)
    exact = np.log(special.i0e(x)) + x
    off = np.expm1(log_I0(x) - exact)
    assert -off.min() > 0.005
    moved = x - np.log(2 * np.pi * x) / 2 + 1 / (8 * x)
    assert np.abs(np.expm1(moved - exact)).max() < 6e-4
    found = M_error(12.001)
    assert found < 1e-14
    return 100 * -off.min(), 12


def M_error(a):
    """Relative error of fiberjax.M where the argument of I0 is a."""
    v = 1 / a
    with mp.workdps(40):
        exact = reference.M(mp.mpf(0), mp.mpf(0), mp.mpf(v))
        return abs(float(mp.mpf(float(fj.M(0.0, 0.0, v))) / exact - 1))


@erratum
def renderers_I0_series():
    x = np.linspace(0.1, 12, 2000)
    off = np.expm1(log_I0(x) - np.log(special.i0(x)))
    assert -off.min() > 0.019
    assert M_error(12.0) < 1e-14
    return 10, 100 * -off.min(), 12


@erratum
def renderers_M_float32():
    v = np.float32(1e-6)
    theta = np.linspace(-1.4, 1.4, 2001).astype(np.float32)
    a, b = np.cos(theta) ** 2 / v, -(np.sin(theta) ** 2) / v
    one, half = np.float32(1), np.float32(0.5)
    large = a + half * (
        -np.log(np.float32(2 * np.pi)) + np.log(one / a) + one / (8 * a)
    )
    with np.errstate(over="ignore"):
        printed = np.exp(large - b - one / v + np.float32(0.6931) + np.log(half / v))
    assert printed.dtype == np.float32
    exact = M(theta.astype(float), theta.astype(float), float(v))
    off = np.abs(printed / exact - 1).max()
    found = np.asarray(fj.M(theta, theta, v))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, exact, rtol=2e-6)
    assert off > 0.1
    return 100 * off, 1e-6


@erratum
def renderers_sample_M():
    beta, u = np.float32(1e-4), np.asarray(uniforms(10, 200_000, 2, jnp.float32))
    v, one = beta * beta, np.float32(1)
    cosine = one + v * np.log(u[:, 0] + (one - u[:, 0]) * np.exp(-2 / v))
    across = np.sqrt(np.maximum(one - cosine * cosine, 0))
    printed = np.arcsin(across * np.cos(np.float32(2 * np.pi) * u[:, 1]))
    assert printed.dtype == np.float32
    off = abs(printed.std() / float(beta) - 1)
    found = np.asarray(fj.sample_M(np.float32(0), v, u))
    assert found.std() == pytest.approx(float(beta), rel=0.01)
    levels = np.unique(cosine).size
    assert levels < 10
    assert off > 0.05
    return levels, 1e-4


@erratum
def jax_i0e():
    """d log M/d theta_o carries the same ratio; fiberjax keeps it."""
    derivative = jax.jit(jax.grad(jax.scipy.special.i0e))
    found = []
    for x in (1e5, 1e7):
        a = np.float32(x)
        with mp.workdps(40):
            y = mp.mpf(float(a))
            exact = float(mp.exp(-y) * (mp.besseli(1, y) - mp.besseli(0, y)))
        found.append(abs(float(derivative(a)) / exact - 1))
    slope = jax.jit(jax.grad(lambda t, v: jnp.log(fj.M(np.float32(0.5), t, v))))
    for x in (1e5, 1e7):
        t, v = np.float32(0.5), np.float32(1 / x)
        with mp.workdps(40):
            c, o, w = (mp.mpf(float(y)) for y in (t, t, v))
            a = mp.cos(c) * mp.cos(o) / w
            r = mp.besseli(1, a) / mp.besseli(0, a)
            exact = float((mp.sin(c) * mp.cos(o) - r * mp.cos(c) * mp.sin(o)) / w)
        assert float(slope(t, v)) == pytest.approx(exact, rel=1e-5)
    assert found[0] > 3e-4
    assert found[1] > 0.9
    return 100 * found[0], 1e5, 100 * found[1], 1e7


@erratum
def mitsuba_residual():
    """sin and cos of its cone are never set: theta_o = 0 for every sample."""
    theta_i, beta = np.radians(80), 0.3
    v = (2 * beta) ** 2
    u = np.asarray(uniforms(13, 100_000, 2))
    cosine = 1 + v * np.log(u[:, 0] + (1 - u[:, 0]) * np.exp(-2 / v))
    across = np.sqrt(1 - cosine**2) * np.cos(2 * np.pi * u[:, 1])
    tilted = {0: theta_i, 1: theta_i, 2: theta_i}
    p, sin_ip, cos_ip = 3, 0.0, 0.0
    for j in range(3):
        sin_ip = np.sin(tilted[j]) if p == j else sin_ip
        cos_ip = np.cos(tilted[j]) if p == j else cos_ip
    printed = np.arcsin(-cosine * sin_ip + across * cos_ip)
    right = np.arcsin(-cosine * np.sin(theta_i) + across * np.cos(theta_i))
    truth = THETA_WEIGHT @ (M(-theta_i, THETA, v) * COS * np.sin(THETA))
    assert abs(np.sin(right).mean() - truth) < 0.01
    assert abs(np.sin(printed).mean() - truth) > 0.5
    fiber = fj.Fiber(ETA, beta, 0.3, None, None)
    s = fj.sample(
        fiber,
        theta_i,
        uniforms(14, 100_000),
        strategy="lobe_first",
        incidence="theta_i",
    )
    rest = np.asarray(s.p) == 3
    sine = np.sin(np.asarray(s.theta_o)[rest])
    assert abs(sine.mean() - truth) < 4.5 * sine.std() / np.sqrt(rest.sum())
    gamma, w = nodes(-HALF_PI, HALF_PI)
    energy = naive_attenuation(3, np.sin(gamma), theta_i, ETA, 0.0, True)
    share = energy @ (np.cos(gamma) * w) / 2
    assert abs(rest.mean() - share) < 4.5 * np.sqrt(share / rest.size)
    assert truth < -0.5
    return 100 * share, 80, truth, 0, beta


def tungsten_R(beta, period, phi):
    """N of R from its table of 2048 samples of D, at 64 azimuths, without Fresnel."""
    x, w = np.polynomial.legendre.leggauss(140)
    samples = 2048
    table = wrapped_normal(np.arange(samples) / (samples - 1) * 2 * np.pi, beta)
    u = np.abs((phi[:, None] + 2 * np.arcsin(x)) * (samples - 1) / (2 * np.pi))
    low = u.astype(int)
    part = u - low
    D = table[low % period] * (1 - part) + table[(low + 1) % period] * part
    return D @ w / 2


@erratum
def tungsten_table():
    """A period of 2048 samples where the last repeats the first: one too many."""
    numbers = []
    phi = np.linspace(0, 2 * np.pi, 64)
    for roughness in (0.1, 0.0255):
        beta = max(HALF_PI * roughness, 0.04)
        gamma, w = nodes(-HALF_PI, HALF_PI, 256)
        D = wrapped_normal(phi[:, None] + 2 * gamma, beta)
        truth = D @ (np.cos(gamma) * w) / 2
        printed, right = (tungsten_R(beta, period, phi) for period in (2048, 2047))
        off = np.abs([printed - truth, right - truth]).max(1) / truth.max()
        assert off[0] > 2 * off[1]
        numbers.append(100 * off[0])
        fiber = fj.Fiber(ETA, 0.3, beta, None, None)
        only = {"lobes": (0,), "rest": False, "strategy": "lobe_first"}
        rule = fj.GaussGamma(400)
        density = fj.pdf(fiber, 0.0, 0.0, phi, rule=rule, **only)
        found = np.asarray(density) / float(fj.M(0.0, 0.0, 0.09))
        np.testing.assert_allclose(found, truth, atol=1e-9)
    return numbers[0], 0.1, numbers[1], 0.0255


@erratum
def tungsten_pdf():
    """Samples fill 64 bins, whose probabilities are looked up as 63.

    The table of R at roughness 0.1, dilated as there; N itself is the weight of both.
    """
    size, beta = 64, HALF_PI * 0.1
    table = tungsten_R(beta, 2048, np.linspace(0, 2 * np.pi, size))
    for step in (slice(None), slice(None, None, -1)):
        row = table[step]
        for k in range(size - 1):
            row[k] = max(row[k], row[k + 1])
    phi, w = nodes(0, 2 * np.pi, 63 * 64, 2)
    turn = phi / (2 * np.pi)
    drawn = table[(size * turn).astype(int)] / table.sum() * size / (2 * np.pi)
    printed = table[((size - 1) * turn).astype(int)] / table.sum() * size / (2 * np.pi)
    assert drawn @ w == pytest.approx(1, abs=1e-9)
    # The weights N/pdf are wrong by this ratio, azimuth by azimuth.
    error = np.abs(drawn / printed - 1).max()
    assert error > 0.05
    fiber = fj.Fiber(ETA, 0.3, beta, None, None)
    choices = {"lobes": (0,), "rest": False, "strategy": "lobe_first"}
    s = fj.sample(fiber, 0.0, uniforms(15, 400_000), **choices)
    gamma, w = nodes(-HALF_PI, HALF_PI, 256)
    edges = np.linspace(-np.pi, np.pi, 65)
    observed, _ = np.histogram(np.asarray(s.phi), edges)
    x = edges[:, None] + 2 * gamma
    turns = special.ndtr((x[..., None] + 2 * np.pi * np.arange(-3, 4)) / beta).sum(-1)
    expected = np.diff(turns @ (np.cos(gamma) * w) / 2) * observed.sum()
    assert p_value(observed, expected) > FALSE_ALARM
    return 64, 63, 100 * error, 0.1


@erratum
def materialx_furnace():
    """Clear, at normal incidence: the ray through the middle, and all rays."""
    gamma, w = nodes(-HALF_PI, HALF_PI)
    h, w = np.sin(gamma), np.cos(gamma) * w / 2
    found = []
    for at, weight in ((np.zeros(1), np.ones(1)), (h, w)):
        A = [naive_attenuation(p, at, 0.0, ETA, 0.0, p == 3) @ weight for p in range(4)]
        assert sum(A) == pytest.approx(1, abs=1e-12)
        # N of the rest is (1/2 pi) read as pi/2, and all is divided by pi.
        found.append((sum(A[:3]) + A[3] * 2 * np.pi * (1 / 2.0 * np.pi)) / np.pi)
    fiber = fj.Fiber(ETA, 0.3, 0.3, None, None)
    assert float(fj.albedo(fiber, 0.0, incidence="theta_i")) == pytest.approx(1)
    assert max(found) < 0.35
    return found


@erratum
def unity_rest():
    """What R, TT and TRT leave of the light of a clear fiber."""
    gamma, w = nodes(-HALF_PI, HALF_PI)
    lost = []
    for degrees in (0, 85):
        theta = np.radians(degrees)
        A = naive_attenuation(3, np.sin(gamma), theta, ETA, 0.0, True)
        lost.append(A @ (np.cos(gamma) * w) / 2)
        fiber = fj.Fiber(ETA, 0.3, 0.3, None, None)
        for rest, kept in ((False, 1 - lost[-1]), (True, 1)):
            found = fj.albedo(fiber, theta, rest=rest, incidence="theta_i")
            assert float(found) == pytest.approx(kept, abs=1e-12)
    assert lost[1] > 0.1
    return 100 * lost[0], 0, 100 * lost[1], 85


@erratum
def renderers_schlick():
    """F0 + (1 - F0)(1 - c)^5 against the mean of both polarizations."""
    c = np.linspace(0, 1, 100_001)
    F0 = ((1 - ETA) / (1 + ETA)) ** 2
    printed = F0 + (1 - F0) * (1 - c) ** 5
    inside = np.sqrt(ETA**2 - 1 + c**2)
    s, p = (c - inside) / (c + inside), (ETA**2 * c - inside) / (ETA**2 * c + inside)
    truth = (s**2 + p**2) / 2
    found = np.asarray(fj.reflectance(c, ETA))
    np.testing.assert_allclose(found, truth, atol=1e-13)
    relative, off = np.abs(printed / truth - 1).max(), np.abs(printed - truth).max()
    assert relative > 0.2
    return ETA, 100 * relative, off


@erratum
def tungsten_width():
    """The three tables of D, one for each lobe, are all filled with the width of R."""
    beta = HALF_PI * 0.1
    gamma, w = nodes(-HALF_PI, HALF_PI, 256)
    h, w = np.sin(gamma), np.cos(gamma) * w / 2
    phi = np.linspace(-np.pi, np.pi, 181)
    off = []
    for p, factor in ((1, 0.5), (2, 2.0)):
        A = naive_attenuation(p, h, 0.0, ETA, 0.0, False)
        off_axis = phi[:, None] - Phi(p, h)
        printed, own = (
            wrapped_normal(off_axis, b) @ (A * w) for b in (beta, factor * beta)
        )
        off.append(np.abs(printed - own).max() / own.max())
        fiber = fj.Fiber(ETA, 0.3, beta, None, None, widths_n=(1.0, 0.5, 2.0))
        N = fj.lobe(fiber, p, 0.0, 0.0, phi, rule=fj.GaussGamma(400))
        width = 0.3 * (1.0, 0.5, 2.0)[p]
        found = np.asarray(N) / float(fj.M(0.0, 0.0, width**2))
        np.testing.assert_allclose(found, own, atol=1e-7 * own.max())
    assert min(off) > 0.03
    return 100 * off[0], 100 * off[1], 0.1


@erratum
def mitsuba_nan():
    """A of p >= 3 where F = T = 1: at grazing incidence on a clear fiber."""
    F = T = np.float32(1)
    A = [F, (1 - F) ** 2 * T]
    A.append(A[1] * T * F)
    with np.errstate(invalid="ignore"):
        A.append(A[2] * F * T / (1 - T * F))
    total = np.sum(A)
    # Mitsuba's own mask, which is the erratum: all light is gone with the NaN.
    printed = 0.0 if np.isnan(total) else float(total)
    right = sum(float(fj.A(p, 1.0, 1.0)) for p in range(3)) + float(
        fj.A_rest(3, 1.0, 1.0)
    )
    assert np.isnan(A[3])
    assert right == 1
    assert printed != right
    return printed, right


@erratum
def materialx_units():
    """The path through the middle is two radii, so T = exp(-2 sigma_a)."""
    sigma_a = 0.5
    documented, coded = np.exp(-sigma_a), np.exp(-2 * sigma_a)
    fiber = fj.convert.materialx(absorption_coefficient=sigma_a, cuticle_angle=0.51)
    absorbed: Any = fiber.sigma_a
    found = float(fj.transmittance(0.0, 0.0, ETA, absorbed))
    assert found == pytest.approx(coded, abs=1e-12)
    assert abs(found - documented) > 0.2
    tilt: Any = fiber.alpha
    assert float(tilt) == pytest.approx(-0.01 * np.pi)
    return documented, coded, sigma_a, np.degrees(0.01), np.degrees(0.01 * np.pi), 0.51


@erratum
def unity_cinematic():
    """R of the table, of theta_o - 2 alpha with alpha = 3, and of the reference, -c."""
    turned = []
    for alpha in (np.radians(3), -np.radians(3)):
        density = M(2 * alpha, THETA, 0.01**2) * COS
        turned.append(np.degrees(THETA_WEIGHT @ (density * THETA)))
    fiber = fj.convert.unity(cuticle_angle=3.0)
    tilt: Any = fiber.alpha
    ours = np.degrees(float(fiber.tilts[0] * tilt))
    assert ours == pytest.approx(turned[1], abs=1e-2)
    assert abs(ours - turned[0]) > 10
    return turned[0], turned[1], 3


@erratum
def unity_tilt():
    """A shift of 3/2 in (theta_i + theta_o)/2 is one of 3 in theta_o."""
    traced = traced_tilt(2)
    printed = 2 * -1.5
    tilts = (2, 2 - 2 * ETA, 2 - 4 * ETA)
    fiber = fj.Fiber(ETA, 0.005, alpha=0.02, sigma_a=None, tilts=tilts)
    theta_o = np.linspace(-0.2, 0.2, 801)
    rule = fj.GaussGamma(32)
    density = fj.lobe(fiber, 2, 0.0, theta_o, 0.0, rule=rule)
    center = np.average(theta_o, weights=density) / 0.02
    assert abs(center / traced - 1) < 1e-3
    assert abs(printed / traced - 1) > 0.28
    return printed, traced, ETA


@erratum
def unity_preintegration():
    """Rectangles of width 0.1 from h = -1, and the detector without A: TRT."""
    s = np.sqrt(np.pi / 8) * BETA_N
    phi = np.linspace(-np.pi, np.pi, 181)
    gamma, w = nodes(-HALF_PI, HALF_PI, 512)

    def integral(h, weight):
        # FastASin(h/eta') lies within 1 here: its clamp does nothing.
        x = wrapped(phi[:, None] - Phi(2, h))
        return logistic(x, s) / np.tanh(np.pi / (2 * s)) @ weight / 2

    truth = integral(np.sin(gamma), np.cos(gamma) * w)
    printed = integral(-1 + 0.1 * np.arange(20), np.full(20, 0.1))
    off = np.abs(printed - truth).max() / truth.max()
    assert np.abs(truth - truth[::-1]).max() < 1e-5 * truth.max()
    lean = np.abs(printed - printed[::-1]).max() / truth.max()
    fiber = fj.Fiber(ETA, 0.3, BETA_N, None, None)
    choices = {"lobes": (2,), "rest": False, "strategy": "lobe_first"}
    density = fj.pdf(
        fiber, 0.0, 0.0, phi, detector="logistic", rule=fj.GaussGamma(400), **choices
    )
    found = np.asarray(density) / float(fj.M(0.0, 0.0, 0.6**2))
    np.testing.assert_allclose(found, truth, atol=1e-4 * truth.max())
    assert off > 0.05
    assert lean > 0.05
    return 100 * off, 100 * lean, BETA_N


ROWS = {
    cells[0].strip("` "): cells[-1]
    for cells in (
        line.strip("|").split(" | ")
        for line in TEXT.splitlines()
        if line.startswith("| `")
    )
}
NUMBER = re.compile(r"(?<![\w^.])-?\d+(?:\.\d+)?(?:e-?\d+)?")
"""One that is no part of a name, as float32, and no exponent, as cos^2."""


def step(shown):
    """One unit of the last digit of a number as it is written."""
    mantissa, _, exponent = shown.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


@pytest.mark.parametrize("name", sorted(ENTRIES))
def test_erratum(name):
    """Its assertions hold, and the last cell of its row has the numbers they give."""
    found = list(ENTRIES[name]())
    shown = NUMBER.findall(ROWS[name])
    assert len(shown) == len(found), (shown, found)
    for text, number in zip(shown, found, strict=True):
        assert abs(float(text) - number) <= 0.5001 * step(text), (shown, found)


def test_every_row_has_a_test_and_every_test_a_row():
    assert sorted(ROWS) == sorted(ENTRIES)
    assert len(ROWS) == len(re.findall(r"^\| `", TEXT, re.M))


def test_the_text_around_the_rows_has_no_numbers_of_its_own():
    """Years and equation numbers aside, what is measured stands in a row."""
    around = [line for line in TEXT.splitlines() if not line.startswith("|")]
    assert not re.findall(r"\d%|\d %|\d\.\d", "\n".join(around))
