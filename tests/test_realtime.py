"""Karis' model against the slides written again, and what every tier owes."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj
from fiberjax import artist, karis, realtime, shading

COLOR = np.array([0.65, 0.45, 0.22])
ALPHA = -0.03
HAIR = fj.Fiber(1.55, 0.25, 0.4, ALPHA, -np.log(COLOR) / 4)
RNG = np.random.default_rng(5)
ANGLES = RNG.uniform([-1.5, -1.5, -3.1], [1.5, 1.5, 3.1], (200, 3)).T
EXTREMES = [
    (np.pi / 2, np.pi / 2, np.pi),
    (np.pi / 2, -np.pi / 2, 0.0),
    (0.0, 0.0, np.pi),
    (0.0, 0.0, 0.0),
    (1.4, -1.4, -np.pi),
]


def gaussian(x, beta):
    return np.exp(-(x**2) / (2 * beta**2)) / (beta * np.sqrt(2 * np.pi))


def schlick(x):
    F0 = (1 - 1.55) ** 2 / (1 + 1.55) ** 2
    return F0 + (1 - F0) * (1 - x) ** 5


def printed(theta_i, theta_r, phi, beta=0.25, shift=-ALPHA):
    """R, TT and TRT with C as the slides have them; R also without azimuth in M."""
    both = np.sin(theta_i) + np.sin(theta_r)
    theta_d = (theta_r - theta_i) / 2
    dot = np.sin(theta_i) * np.sin(theta_r)
    dot = dot + np.cos(theta_i) * np.cos(theta_r) * np.cos(phi)
    half = np.cos(phi / 2)
    N_R = half / 4 * schlick(np.sqrt(0.5 + 0.5 * dot))
    tilt = -shift
    moved = np.cos(tilt) * np.cos(theta_r) * half + np.sin(tilt) * np.sin(theta_r)
    M_R = gaussian(both - 2 * np.sin(tilt) * moved, np.sqrt(2) * half * beta)
    eta_prime = 1.19 / np.cos(theta_d) + 0.36 * np.cos(theta_d)
    h = (1 + (0.6 - 0.8 * np.cos(phi)) / eta_prime) * half
    f = schlick(np.cos(theta_d) * np.sqrt(1 - h**2))
    passes = np.sqrt(1 - (h / eta_prime) ** 2) / (2 * np.cos(theta_d))
    D_TT = np.exp(-3.65 * np.cos(phi) - 3.98)
    TT = gaussian(both - shift, beta / 2) * (1 - f) ** 2 * D_TT
    f = schlick(np.cos(theta_d) * np.sqrt(1 - 3 / 4))
    D_TRT = np.exp(17 * np.cos(phi) - 16.78)
    TRT = gaussian(both - 4 * shift, 2 * beta) * (1 - f) ** 2 * f * D_TRT
    each = (
        (M_R * N_R)[:, None] + 0 * COLOR,
        TT[:, None] * COLOR ** passes[:, None],
        TRT[:, None] * COLOR ** (0.8 / np.cos(theta_d))[:, None],
    )
    return each, gaussian(both + 2 * shift, beta) * N_R


def test_karis_is_what_the_slides_print():
    each, without_azimuth = printed(*ANGLES)
    for p, expected in enumerate(each):
        found = realtime.lobe("karis2016", HAIR, p, *ANGLES)
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-300)
    total = realtime.evaluate("karis2016", HAIR, *ANGLES)
    np.testing.assert_allclose(total, sum(each), rtol=1e-11)
    at = shading.of_angles(*map(jnp.asarray, ANGLES))
    found = karis.R_separable(karis.PUBLISHED, shading.of_fiber(HAIR), at)
    np.testing.assert_allclose(found[..., 0], without_azimuth, rtol=1e-11, atol=1e-300)


@pytest.mark.parametrize("theta_i", [-0.8, 0.1, 0.9])
def test_R_leaves_where_a_tilted_mirror_sends_it(theta_i):
    """Along every azimuth; to alpha^2, as cos(phi/2) is that of the normal's turn."""
    fiber = fj.Fiber(1.55, 2e-3, 0.4, ALPHA, None)
    for turn in np.linspace(-1.2, 1.2, 9):
        around = np.cos(ALPHA) * np.array([np.cos(turn), np.sin(turn)])
        normal = np.array([np.sin(ALPHA), *around])
        given = np.array([np.sin(theta_i), np.cos(theta_i), 0])
        out = 2 * (given @ normal) * normal - given
        theta_o, phi = np.arcsin(out[0]), np.arctan2(out[2], out[1])
        near = theta_o + np.linspace(-0.02, 0.02, 801)
        seen = realtime.lobe("karis2016", fiber, 0, theta_i, near, phi)
        center = np.sin(near[np.argmax(seen)])
        assert abs(center - out[0]) < 2 * ALPHA**2 + 1e-4


def test_directions_of_dots_are_those_of_angles():
    theta_i, theta_o, phi = map(jnp.asarray, ANGLES)
    expected = shading.of_angles(theta_i, theta_o, phi)
    found = shading.of_dots(expected.sin_i, expected.sin_o, expected.cos_io)
    for name, a, b in zip(expected._fields, found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-8, err_msg=name)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("point", EXTREMES)
def test_values_and_gradients_are_finite_at_the_edges(point, dtype):
    angles = [jnp.asarray(x, dtype) for x in point]
    for tier in realtime.TIERS:
        for fiber in (HAIR, fj.Fiber(1.0, 0.01, 0.01, 0.05, 1e3), fj.Fiber(1.55)):

            def total(fiber, *angles, tier=tier):
                return realtime.evaluate(tier, fiber, *angles).sum()

            value, slopes = jax.value_and_grad(total, (0, 1, 2, 3))(fiber, *angles)
            assert value.dtype == dtype
            assert all(np.isfinite(x).all() for x in jax.tree.leaves((value, slopes)))


def test_derivatives_in_the_constants_are_those_of_differences():
    k = jax.tree.map(jnp.asarray, karis.PUBLISHED)

    def total(k):
        return realtime.evaluate("karis2016", HAIR, *ANGLES, constants=k).sum()

    slopes, step = jax.tree.leaves(jax.grad(total)(k)), 1e-6
    leaves, shape = jax.tree.flatten(k)
    assert len(leaves) == 10
    for n, slope in enumerate(slopes):
        ends = []
        for sign in (-1, 1):
            moved = [x + sign * step * (m == n) for m, x in enumerate(leaves)]
            ends.append(total(jax.tree.unflatten(shape, moved)))
        np.testing.assert_allclose((ends[1] - ends[0]) / (2 * step), slope, rtol=1e-6)


def test_shapes_follow_sigma_a():
    theta_i, theta_o, phi = ANGLES[0][:4, None], ANGLES[1][:4, None], ANGLES[2][:5]
    for sigma_a, last in (
        (None, ()),
        (0.3, ()),
        (np.ones(3), (3,)),
        (np.ones(1), (1,)),
    ):
        fiber = fj.Fiber(1.55, 0.2, 0.2, None, sigma_a)
        for tier in realtime.TIERS:
            found = realtime.evaluate(tier, fiber, theta_i, theta_o, phi)
            assert found.shape == (4, 5, *last)
            assert realtime.lobe(tier, fiber, 0, 0.1, 0.2, 0.3).shape == last


def test_scattering_and_environment_are_what_the_slides_print():
    chosen = artist.Artist(COLOR, 0.7, 0.5, 0.4, 0.02)
    theta_i, theta_r, phi = (float(x) for x in (0.3, -0.5, 2.0))
    shadow = 0.3
    w_i = np.array([np.sin(theta_i), np.cos(theta_i) * np.cos(-phi), 0])
    w_i[2] = np.cos(theta_i) * np.sin(-phi)
    w_r = np.array([np.sin(theta_r), np.cos(theta_r), 0])
    n = w_r - np.array([1, 0, 0]) * w_r[0]
    n = n / np.linalg.norm(n)
    luma = COLOR @ (0.2126, 0.7152, 0.0722)

    def scattered(w_i, shadow):
        tint = (COLOR / luma) ** (1 - shadow)
        return np.sqrt(COLOR) * (n @ w_i + 1) / (4 * np.pi) * tint

    def direct(theta_i, theta_r, phi, wider=0.0):
        at = np.array([[theta_i], [theta_r], [phi]])
        # printed() has one beta, and its lobes those factors of it.
        betas = [0.25 + wider / factor for factor in (1, 0.5, 2)]
        return [
            printed(at[0], at[1], at[2], beta, 0.02)[0][p][0]
            for p, beta in enumerate(betas)
        ]

    R, TT, TRT = direct(theta_i, theta_r, phi)
    expected = 0.7 * R + TT + TRT + 0.4 * scattered(w_i, shadow)
    found = artist.shade(chosen, theta_i, theta_r, phi, shadow=shadow)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    # By default n, and n . w_r is positive; the other is 119 degrees away.
    for w, theta, away in ((n, 0.0, 0.0), (w_i, theta_i, phi)):
        R, _, TRT = direct(theta, theta_r, away, 0.2)
        seen = np.clip(w @ w_r + 1, 0, 1)
        assert seen == 1 or 0.4 < seen < 0.6
        expected = np.pi * (0.7 * seen * R + TRT + 0.4 * scattered(w, 1.0))
        where: dict[str, Any] = {"theta_i": theta, "phi": away} if theta else {}
        found = artist.environment(chosen, theta_r, **where)
        np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: realtime.evaluate("best", HAIR, 0.1, 0.2, 0.3), "tier = 'best'"),
        (lambda: realtime.lobe("karis2016", HAIR, 3, 0.1, 0.2, 0.3), "p = 3"),
        (lambda: realtime.lobe("karis2016", HAIR, -1, 0.1, 0.2, 0.3), "p = -1"),
        (lambda: artist.shade(artist.Artist(0.5), 0.1, 0.2, 0.3), "base_color"),
        (lambda: artist.environment(artist.Artist((0.5, 0.5)), 0.1), "base_color"),
    ],
)
def test_bad_input_is_named(call, text):
    with pytest.raises(ValueError, match=text):
        call()
