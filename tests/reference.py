"""The equations in mpmath, as the corrected papers print them.

Nothing here is arranged for accuracy or speed: the working precision (`mp.dps`)
pays for cancellation. Arguments are real mpmath numbers; all but `p`, `detector`
and the arguments of `bracket_sizes` may also be complex, for complex steps.
"""

import itertools
import math
from typing import Any

import mpmath

# Their functions are made at run time, out of a type checker's sight.
mp: Any = mpmath.mp
mpf: Any = mpmath.mpf

DETECTORS = ("normal", "logistic")


def _abs_cos(theta):
    # float32(pi/2) lies past pi/2, where the cosine is negative.
    return mp.sqrt(mp.cos(theta) ** 2)


def reflectance(cos_theta_i, eta):
    """Unpolarized Fresnel reflectance of a dielectric, from outside."""
    if eta == 1:
        return mpf(0)
    cos_theta_t = mp.sqrt(1 - (1 - cos_theta_i**2) / eta**2)
    r_s = (cos_theta_i - eta * cos_theta_t) / (cos_theta_i + eta * cos_theta_t)
    r_p = (eta * cos_theta_i - cos_theta_t) / (eta * cos_theta_i + cos_theta_t)
    return (r_s**2 + r_p**2) / 2


def eta_prime(theta_d, eta):
    """Index of the cross-section: Bravais, `sqrt(eta^2 - sin^2)/cos`."""
    return mp.sqrt(eta**2 - mp.sin(theta_d) ** 2) / _abs_cos(theta_d)


def Phi(p, h, eta_p):
    """Azimuth at which path p leaves."""
    return 2 * p * mp.asin(h / eta_p) - 2 * mp.asin(h) + p * mp.pi


def transmittance(h, theta_d, eta, sigma_a):
    """What one internal segment lets through."""
    gamma_t = mp.asin(h / eta_prime(theta_d, eta))
    theta_t = mp.asin(mp.sin(theta_d) / eta)
    return mp.exp(-sigma_a * 2 * mp.cos(gamma_t) / mp.cos(theta_t))


def A(p, F, T):
    """Attenuation of path p."""
    return F if p == 0 else (1 - F) ** 2 * F ** (p - 1) * T**p


def A_rest(p, F, T):
    """`A` summed over the paths p, p + 1, ...: a geometric series."""
    return A(p, F, T) / (1 - F * T)


def A_rest_partial(p, F, T, terms):
    """The first terms of the same sum, one by one."""
    return mp.fsum(A(q, F, T) for q in range(p, p + terms))


def M(theta_cone, theta_o, v):
    """d'Eon's longitudinal density, without its 1/cos(theta_o)."""
    return (
        mp.csch(1 / v)
        / (2 * v)
        * mp.exp(mp.sin(theta_cone) * mp.sin(theta_o) / v)
        * mp.besseli(0, mp.cos(theta_cone) * mp.cos(theta_o) / v)
    )


def sample_M(theta_cone, v, xi, u1):
    """Inclination drawn from `M` by xi in (0, 1) and u1 in [0, 1)."""
    u = v * mp.log(mp.exp(1 / v) - 2 * xi * mp.sinh(1 / v))
    across = mp.sqrt(1 - u**2) * mp.cos(2 * mp.pi * u1)
    return mp.asin(u * mp.sin(theta_cone) + across * mp.cos(theta_cone))


def wrap(phi):
    """The angle moved by whole turns to [-pi, pi]."""
    return phi - 2 * mp.pi * mp.nint(mp.re(phi) / (2 * mp.pi))


def wrapped_normal(phi, beta):
    """Normal density of deviation beta, summed over all turns."""
    width = mp.re(beta)
    reach = math.sqrt(2 * math.log(10) * (mp.dps + 5))
    if width > 1:
        # The transformed sum: the direct one cannot show exp(-beta^2/2) beside 1.
        terms = math.ceil(reach / width)
        cosines = (
            mp.exp(-((k * beta) ** 2) / 2) * mp.cos(k * phi)
            for k in range(1, terms + 2)
        )
        return (1 + 2 * mp.fsum(cosines)) / (2 * mp.pi)
    phi = wrap(phi)
    turns = math.ceil(reach * width / (2 * math.pi)) + 1
    images = (
        mp.exp(-(((phi - 2 * mp.pi * k) / beta) ** 2) / 2)
        for k in range(-turns, turns + 1)
    )
    return mp.fsum(images) / (beta * mp.sqrt(2 * mp.pi))


def trimmed_logistic(phi, s):
    """Logistic density of scale s, cut to [-pi, pi] and normalized there."""

    def cdf(x):
        return 1 / (1 + mp.exp(-x / s))

    density = 1 / (4 * s * mp.cosh(wrap(phi) / (2 * s)) ** 2)
    return density / (cdf(mp.pi) - cdf(-mp.pi))


def detector_density(detector, phi, beta_n):
    """The detector of `N` named by `detector`, of deviation beta_n."""
    if detector == "normal":
        return wrapped_normal(phi, beta_n)
    return trimmed_logistic(phi, mp.sqrt(mp.pi / 8) * beta_n)


def N_integrand(p, gamma, phi, theta_d, eta, sigma_a, beta_n, detector):
    """Integrand of `N` in gamma, `h = sin gamma`."""
    h = mp.sin(gamma)
    F = reflectance(_abs_cos(theta_d) * mp.cos(gamma), eta)
    T = transmittance(h, theta_d, eta, sigma_a)
    turn = phi - Phi(p, h, eta_prime(theta_d, eta))
    D = detector_density(detector, turn, beta_n)
    return A(p, F, T) * D * mp.cos(gamma) / 2


def N(p, phi, theta_d, eta, sigma_a, beta_n, detector="normal", step=None):
    """Azimuthal density of path p.

    With `step`, one argument carries that imaginary part, and the pair
    (value, derivative in it) comes back.
    """

    def f(gamma):
        y = N_integrand(p, gamma, phi, theta_d, eta, sigma_a, beta_n, detector)
        # Both parts at one scale, so that the error estimate sees them both.
        return y if step is None else mp.mpc(mp.re(y), mp.im(y) / step)

    at = {"phi": phi, "theta_d": theta_d, "eta": eta, "beta_n": beta_n}
    at = {name: float(mp.re(x)) for name, x in at.items()}
    value = _integrate(f, N_breaks(p, **at, detector=detector))
    return value if step is None else (mp.re(value), mp.im(value))


def N_breaks(p, phi, theta_d, eta, beta_n, detector="normal"):
    """Where to split [-pi/2, pi/2] so that each part of `N` is smooth (floats).

    At the caustics, at distances from grazing in proportion to its width, and
    around each image of the target: for the normal where its exponent has grown by
    0, 1, 4, 16, ..., for the logistic where it has grown by 0, 1, 2, 4, ... and at
    the kink half a turn away.
    """
    cos_d = abs(math.cos(theta_d))
    eta_p = math.sqrt(cos_d**2 + (eta - 1) * (eta + 1)) / cos_d

    def azimuth(gamma):
        gamma_t = math.asin(min(1.0, max(-1.0, math.sin(gamma) / eta_p)))
        return 2 * p * gamma_t - 2 * gamma + p * math.pi

    half = math.pi / 2
    pieces = [-half, half]
    if 1 < eta_p < p:
        caustic = math.acos(math.sqrt((eta_p**2 - 1) / (p**2 - 1)))
        pieces = [-half, -caustic, caustic, half]
    scale = beta_n if detector == "normal" else math.sqrt(math.pi / 8) * beta_n
    breaks = {*pieces, 0.0}
    delta = math.sqrt((eta - 1) * (eta + 1)) / cos_d
    while 0 < delta < half:
        breaks |= {half - delta, delta - half}
        delta *= 4
    for a, b in itertools.pairwise(pieces):
        low, high = sorted((azimuth(a), azimuth(b)))
        first = math.floor((low - math.pi - phi) / (2 * math.pi))
        last = math.ceil((high + math.pi - phi) / (2 * math.pi))
        for k in range(first, last + 1):
            target = phi + 2 * math.pi * k
            away = max(low - target, target - high, 0.0)
            for growth in [0.0, *(2.0**j for j in range(60))]:
                if detector == "normal":
                    reach = math.hypot(away, growth * scale)
                else:
                    reach = min(away + growth * scale, math.pi)
                if reach > math.pi:
                    break
                for level in (target - reach, target + reach):
                    if low < level < high:
                        breaks.add(_bisect(azimuth, level, a, b))
                if reach == math.pi:
                    break
    points = sorted(breaks)
    gaps = itertools.pairwise(points)
    return [mpf(x) for x, y in gaps if y - x > 1e-14 or x == -half] + [mp.pi / 2]


def _bisect(f, level, a, b):
    rising = f(b) > f(a)
    for _ in range(60):
        middle = (a + b) / 2
        if (f(middle) < level) == rising:
            a = middle
        else:
            b = middle
    return (a + b) / 2


def _integrate(f, points):
    """Sum of `mp.quad` over the parts, halving those that have not converged."""
    points[0] = -mp.pi / 2
    parts = list(itertools.pairwise(points))
    # mp.quad stops at an absolute error, so the integrand is brought to order 1.
    peak = max(
        abs(f(a + (b - a) * fraction / 8)) for a, b in parts for fraction in (1, 4, 7)
    )
    if peak == 0:
        return mpf(0)
    scale = 1 / peak
    total = mpf(0)
    while parts:
        a, b = parts.pop()
        value, error = mp.quad(
            lambda x: f(x) * scale,
            [a, b],
            method="gauss-legendre",
            maxdegree=6,
            error=True,
        )
        if error > mpf(10) ** (5 - mp.dps) and b - a > mpf(10) ** -15:
            parts += [(a, (a + b) / 2), ((a + b) / 2, b)]
        else:
            total += value
    return total / scale


def bracket_sizes(theta_cone, theta_o, v):
    """Sum of |terms| of each derivative of log M, by argument names.

    First derivatives are "theta_cone", "theta_o", "v", second ones "v,v" and so on.
    The terms are those of the form that suits the point: in `1 - I1/I0` or in
    `I1/I0`, and in `1/x` and `expm1` or in `coth x - 1/x`. A derivative of M cannot
    be more accurate, in proportion, than sum |terms| allows.
    """
    x = 1 / mpf(v)
    D = theta_o - theta_cone
    sin_c, cos_c = abs(mp.sin(theta_cone)), abs(mp.cos(theta_cone))
    sin_o, cos_o = abs(mp.sin(theta_o)), abs(mp.cos(theta_o))
    a = x * mp.cos(theta_cone) * mp.cos(theta_o)
    r = mp.besseli(1, a) / mp.besseli(0, a)
    slope = abs(1 - r / a - r**2) if a != 0 else mpf(1) / 2
    if a > 2:
        r = 1 - r
        along, across = abs(mp.cos(D)), abs(mp.sin(D))
        opposite, up_c, up_o = along, across, across
        value_x = 2 * mp.sin(D / 2) ** 2
    else:
        r = abs(r)
        along, opposite = sin_c * sin_o, cos_c * cos_o
        up_c, up_o = sin_o * cos_c, sin_c * cos_o
        value_x = sin_c * sin_o
    if x > 2:
        flat = 1 / x + 2 / mp.expm1(2 * x)
        flat_x = 1 / x**2 + 4 * mp.exp(2 * x) / mp.expm1(2 * x) ** 2
    else:
        flat = mp.coth(x) - 1 / x
        flat_x = 1 / x**2 - mp.csch(x) ** 2
    size_c = up_c + cos_o * sin_c * r
    size_o = up_o + cos_c * sin_o * r
    size_x = value_x + cos_c * cos_o * r + flat
    size_cc = along + cos_c * cos_o * r + x * (cos_o * sin_c) ** 2 * slope
    size_oo = along + cos_c * cos_o * r + x * (cos_c * sin_o) ** 2 * slope
    size_co = opposite + sin_c * sin_o * r + x * sin_c * cos_o * cos_c * sin_o * slope
    size_cx = size_c + x * cos_o * sin_c * cos_c * cos_o * slope
    size_ox = size_o + x * cos_c * sin_o * cos_c * cos_o * slope
    size_xx = (cos_c * cos_o) ** 2 * slope + flat_x
    return {
        "theta_cone": x * size_c,
        "theta_o": x * size_o,
        "v": x**2 * size_x,
        "theta_cone,theta_cone": x * size_cc,
        "theta_cone,theta_o": x * size_co,
        "theta_cone,v": x**2 * size_cx,
        "theta_o,theta_o": x * size_oo,
        "theta_o,v": x**2 * size_ox,
        "v,v": 2 * x**3 * size_x + x**4 * size_xx,
    }
