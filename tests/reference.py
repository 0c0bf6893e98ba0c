"""The equations in mpmath, as the corrected papers print them.

Nothing here is arranged for accuracy or speed: the working precision (`mp.dps`)
pays for cancellation. Arguments are real mpmath numbers; all but `p`, `detector`
and those of `N`, `N_jet` and `bracket_sizes` may also be complex, for complex steps.
"""

import functools
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


def ray(p, gamma, theta_d, eta, sigma_a):
    """A and Phi of path p at the offset sin(gamma)."""
    h = mp.sin(gamma)
    F = reflectance(_abs_cos(theta_d) * mp.cos(gamma), eta)
    T = transmittance(h, theta_d, eta, sigma_a)
    return A(p, F, T), Phi(p, h, eta_prime(theta_d, eta))


def N_integrand(p, gamma, phi, theta_d, eta, sigma_a, beta_n, detector):
    """Integrand of `N` in gamma, `h = sin gamma`."""
    weight, azimuth = ray(p, gamma, theta_d, eta, sigma_a)
    D = detector_density(detector, phi - azimuth, beta_n)
    return weight * D * mp.cos(gamma) / 2


def N_jet_integrand(p, gamma, phi, theta_d, eta, sigma_a, beta_n, detector):
    """The integrand of `N` and its derivatives in phi, ..., beta_n.

    At eta = 1 the one in eta is 0 here: that of N is one-sided, and is not the integral
    of the derivative.
    """
    path = (theta_d, eta, sigma_a)
    rays = [complex_step(lambda *x: ray(p, gamma, *x), path, k) for k in range(3)]
    (weight, azimuth), _ = rays[0]
    if eta == 1:
        rays[1] = (weight, azimuth), (0, 0)
    turn = (phi - azimuth, beta_n)
    (D, D_turn), (_, D_beta) = (
        complex_step(lambda *x: detector_density(detector, *x), turn, k)
        for k in range(2)
    )
    by_path = [dA * D - weight * D_turn * dPhi for _, (dA, dPhi) in rays]
    terms = [weight * D, weight * D_turn, *by_path, weight * D_beta]
    return [term * mp.cos(gamma) / 2 for term in terms]


def complex_step(f, x, k):
    """Value of `f(*x)` and derivative in `x[k]`: a number each, or a list each."""
    step = mpf(10) ** -mp.dps
    y = f(*x[:k], mp.mpc(x[k], step), *x[k + 1 :])
    if isinstance(y, tuple):
        return [mp.re(z) for z in y], [mp.im(z) / step for z in y]
    return mp.re(y), mp.im(y) / step


LOBES = ((2, 1), (-1, mpf(1) / 2), (-4, 2))
"""Factors of alpha and beta_m of R, TT and TRT."""


def S_parts(theta_i, theta_o, phi, h, eta, beta_m, beta_n, alpha, sigma_a):
    """What R, TT, TRT and the rest scatter at an offset: Chiang et al. 2016."""
    F = reflectance(_abs_cos(theta_i) * mp.cos(mp.asin(h)), eta)
    T = transmittance(h, theta_i, eta, sigma_a)
    s = mp.sqrt(mp.pi / 8) * beta_n
    for p, (tilt, width) in enumerate(LOBES):
        along = M(-theta_i + tilt * alpha, theta_o, (width * beta_m) ** 2)
        away = phi - Phi(p, h, eta_prime(theta_i, eta))
        yield A(p, F, T) * along * trimmed_logistic(away, s)
    yield A_rest(3, F, T) * M(-theta_i, theta_o, (2 * beta_m) ** 2) / (2 * mp.pi)


def N_smooth(p, phi, theta_d, eta, sigma_a):
    """Azimuthal density of path p of a smooth fiber, off its caustics."""

    def off(gamma):
        return wrap(Phi(p, mp.sin(gamma), eta_prime(theta_d, eta)) - phi)

    grid = [mp.pi * (mpf(k) / 200 - mpf(1) / 2) for k in range(1, 200)]
    grid = [-mp.pi / 2, *grid, mp.pi / 2]
    total = mpf(0)
    for a, b in itertools.pairwise(grid):
        if off(a) * off(b) > 0 or abs(off(a) - off(b)) > 1:
            continue
        gamma = mp.findroot(off, (a, b), solver="anderson")
        path = gamma, theta_d, eta, sigma_a
        (weight, _), (_, slope) = complex_step(lambda *x: ray(p, *x), path, 0)
        total += weight * mp.cos(gamma) / (2 * abs(slope))
    return total


def N(p, phi, theta_d, eta, sigma_a, beta_n, detector="normal"):
    """Azimuthal density of path p."""
    x = [mpf(y) for y in (phi, theta_d, eta, sigma_a, beta_n)]
    breaks = N_breaks(p, phi, theta_d, eta, beta_n, detector)
    f = functools.partial(N_integrand, p, detector=detector)
    return integrate(lambda gamma: [f(gamma, *x)], breaks)[0][0]


def N_jet(p, phi, theta_d, eta, sigma_a, beta_n, detector="normal"):
    """`N` and its derivatives in phi, ..., beta_n, as pairs from `integrate`."""
    x = [mpf(y) for y in (phi, theta_d, eta, sigma_a, beta_n)]
    breaks = N_breaks(p, phi, theta_d, eta, beta_n, detector)
    f = functools.partial(N_jet_integrand, p, detector=detector)
    return integrate(lambda gamma: f(gamma, *x), breaks)


# Gauss-Legendre of `ORDER` nodes resolves a detector between two of these.
WIDTHS = [0.0, 4.0, 8.0, 12.0, *(2.0**j for j in range(4, 60))]


def N_breaks(p, phi, theta_d, eta, beta_n, detector="normal"):
    """Where to split [-pi/2, pi/2] so that each part of `N` is smooth.

    At the caustics, at distances from grazing in proportion to its width, at `levels`
    of the azimuth, and for the logistic where it has its kink: there the integrand is
    not smooth, so that those places are found in full precision.
    """
    half = math.pi / 2
    delta = math.sqrt((eta - 1) * (eta + 1)) / abs(math.cos(theta_d))
    eta_p = math.hypot(1, delta)

    def azimuth(gamma):
        gamma_t = math.asin(min(1.0, max(-1.0, math.sin(gamma) / eta_p)))
        return 2 * p * gamma_t - 2 * gamma + p * math.pi

    def exact_azimuth(gamma):
        return Phi(p, mp.sin(gamma), eta_prime(mpf(theta_d), mpf(eta)))

    pieces = [-half, half]
    if 1 < eta_p < p:
        caustic = math.acos(delta / math.sqrt(p**2 - 1))
        pieces = [-half, -caustic, caustic, half]
    breaks = {*pieces, 0.0, *_near_grazing(delta)}
    for a, b in itertools.pairwise(pieces):
        low, high = sorted((azimuth(a), azimuth(b)))
        for level in levels(low, high, phi, beta_n, detector):
            breaks.add(_bisect(azimuth, level, a, b, 48))
        kinks = _turns(low, high, mpf(phi) + mp.pi) if detector == "logistic" else ()
        for level in kinks:
            breaks.add(_bisect(exact_azimuth, level, mpf(a), mpf(b), mp.prec))
    gaps = itertools.pairwise(sorted(breaks))
    inner = [mpf(x) for x, y in gaps if y - x > 1e-14 and x > -half]
    return [-mp.pi / 2, *inner, mp.pi / 2]


def _near_grazing(delta):
    """Angles at distances delta, 4 delta, ... from both ends of the range."""
    while 0 < delta < math.pi / 2:
        yield from (math.pi / 2 - delta, delta - math.pi / 2)
        delta *= 4


def levels(low, high, phi, beta_n, detector):
    """Azimuths in (low, high) between which the detector at phi is smooth.

    `WIDTHS` from each image of phi, where that lies outside from the end at which the
    logistic is largest, and for the normal from where its exponent is the least.
    """
    for target in _turns(low - math.pi, high + math.pi, phi):
        away = max(low - target, target - high, 0.0)
        for width in WIDTHS:
            if detector == "normal":
                reach = math.hypot(away, width * beta_n)
            else:
                reach = away + width * math.sqrt(math.pi / 8) * beta_n
            if reach > math.pi:
                break
            for level in (target - reach, target + reach):
                if low < level < high:
                    yield level


def _turns(low, high, phi):
    """The angles in (low, high) that are whole turns from phi."""
    first = math.floor((low - phi) / (2 * math.pi)) + 1
    last = math.ceil((high - phi) / (2 * math.pi)) - 1
    turn = 2 * mp.pi if isinstance(phi, mpf) else 2 * math.pi
    return [phi + turn * k for k in range(first, last + 1)]


def _bisect(f, level, a, b, steps):
    rising = f(b) > f(a)
    for _ in range(steps):
        middle = (a + b) / 2
        if (f(middle) < level) == rising:
            a = middle
        else:
            b = middle
    return (a + b) / 2


def integrate(f, points):
    """Pairs (integral of y, integral of |y|) of each number y that `f` returns.

    Parts that the first number shows to be far too small are left out, the others are
    halved until their errors are below `10^(7 - mp.dps)` of the integral of |y|.
    """
    parts = {part: _part(f, *part) for part in _needed(f, points)}
    while True:
        sums, sizes, _ = (_totals(rows) for rows in zip(*parts.values(), strict=True))
        allowed = [size * mpf(10) ** (7 - mp.dps) for size in sizes]
        coarse = [
            part
            for part, (_, _, errors) in parts.items()
            if any(error > most for error, most in zip(errors, allowed, strict=True))
        ]
        if not coarse:
            return list(zip(sums, sizes, strict=True))
        for a, b in coarse:
            del parts[a, b]
            for half in ((a, (a + b) / 2), ((a + b) / 2, b)):
                parts[half] = _part(f, *half)


def _totals(rows):
    return [mp.fsum(column) for column in zip(*rows, strict=True)]


def _needed(f, points):
    """The parts between two points each that are not negligible."""
    sizes = {
        (a, b): max(abs(f(a + (b - a) * k / 8)[0]) for k in (1, 4, 7)) * (b - a)
        for a, b in itertools.pairwise(points)
    }
    least = max(sizes.values()) * mpf(10) ** (-2 * mp.dps)
    return [part for part, size in sizes.items() if size >= least]


def _part(f, a, b):
    """Lists of the integrals of y, of |y| and of the errors over [a, b].

    The coefficients of degree n fall as r^n, and Gauss-Legendre of n nodes errs by the
    one of degree 2 n: the square of the last ones, in proportion.
    """
    nodes, weights, rows = gauss_legendre(mp.prec)
    half, middle = (b - a) / 2, (a + b) / 2
    columns = list(zip(*(f(middle + half * x) for x in nodes), strict=True))
    sums = [half * mp.fdot(weights, y) for y in columns]
    sizes = [half * mp.fdot(weights, map(abs, y)) for y in columns]
    last = [half * max(abs(mp.fdot(row, y)) for row in rows) for y in columns]
    errors = [
        x**2 / size if size else size for x, size in zip(last, sizes, strict=True)
    ]
    return sums, sizes, errors


ORDER = 40


@functools.cache
def gauss_legendre(precision):
    """Nodes and weights on [-1, 1], at `mp.prec`.

    Also, for each of the last polynomials, a row that turns the values of a function
    at the nodes into its coefficient.
    """
    guesses = (mp.cos(mp.pi * (k + 0.75) / (ORDER + 0.5)) for k in range(ORDER))
    nodes = [_node(x) for x in guesses]
    values = [legendre(x) for x in nodes]
    weights = [
        2 * (1 - x**2) / (ORDER * P[-2]) ** 2
        for x, P in zip(nodes, values, strict=True)
    ]
    rows = [
        [(n + mpf(1) / 2) * w * P[n] for w, P in zip(weights, values, strict=True)]
        for n in range(ORDER - 4, ORDER)
    ]
    return nodes, weights, rows


def _node(x):
    # The guess has four digits; Newton's method doubles them each time.
    for _ in range(mp.prec.bit_length()):
        P = legendre(x)
        x -= P[-1] * (1 - x**2) / (ORDER * (P[-2] - x * P[-1]))
    return x


def legendre(x):
    """The Legendre polynomials of degree 0 to `ORDER`."""
    P = [mpf(1), x]
    for n in range(1, ORDER):
        P.append(((2 * n + 1) * x * P[n] - n * P[n - 1]) / (n + 1))
    return P


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
