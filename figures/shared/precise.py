"""N, M and their derivatives to more digits than float64 has, by brute force.

Everything is numpy.longdouble, of eps 1e-19 on x86. N is a sum of Gauss-Legendre panels
that are halved until the integrand is smooth on each; M has Bessel's integral.
Derivatives are complex steps through the equations, in which no difference of close
numbers is formed. The tests hold both to the 20-digit tables.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ive

Array = np.ndarray[Any, Any]

WIDE = np.longdouble
STEP = 1e-30


def require_wide() -> None:
    """RuntimeError where longdouble is no wider than double."""
    eps = np.finfo(WIDE).eps
    if eps > 1e-18:
        raise RuntimeError(
            f"numpy.longdouble has eps {eps:.1e} on this platform: the exact values "
            "need more than double precision, as x86 on Linux and macOS has"
        )


def pi(dtype: Any) -> Any:
    """The number pi, to the last digit of the dtype."""
    return 4 * np.arctan(np.ones((), dtype))


def _legendre(order: int, x: Array) -> tuple[Array, Array]:
    """Legendre's polynomial and its derivative."""
    before, now = np.ones_like(x), x
    for n in range(2, order + 1):
        before, now = now, ((2 * n - 1) * x * now - (n - 1) * before) / n
    return now, order * (x * now - before) / (x * x - 1)


@cache
def gauss_legendre(order: int) -> tuple[Array, Array]:
    """Nodes and weights on [0, 1]: numpy's, refined by Newton's method."""
    x: Array = np.polynomial.legendre.leggauss(order)[0].astype(WIDE)
    for _ in range(2):
        value, slope = _legendre(order, x)
        x = x - value / slope
    slope = _legendre(order, x)[1]
    return (1 + x) / 2, 1 / ((1 - x * x) * slope * slope)


class Points(NamedTuple):
    """Where N is wanted: arrays of one length and dtype."""

    phi: Array
    theta_d: Array
    eta: Array
    sigma_a: Array
    beta_n: Array

    def take(self, index: Any) -> "Points":
        """The points of these numbers."""
        return Points(*(x[index] for x in self))


class Accuracy(NamedTuple):
    """How finely N is integrated.

    order: nodes on a panel.
    span: widths of the detector that a panel may cover.
    margin: exponent that a panel must be below the largest by to be left out.
    """

    order: int
    span: float
    margin: float


EXACT = Accuracy(20, 2.0, 80.0)
ROUGH = Accuracy(8, 3.0, 20.0)


def _angle(y: Any, x: Any) -> Any:
    """atan2 of numbers whose imaginary parts are infinitesimal."""
    value = np.arctan2(y.real, x.real)
    if not np.iscomplexobj(x):
        return value
    slope = x.real * y.imag - y.real * x.imag
    return value + 1j * (slope / (x.real**2 + y.real**2))


class Ray(NamedTuple):
    """A ray at distance x = pi/2 - gamma from grazing."""

    mu: Array
    g: Array
    length: Array
    turn: Array


def ray(p: int, x: Array, theta_d: Array, eta: Array) -> Ray:
    """Cosine of incidence, eta times the refracted one, a segment, and Phi - p pi."""
    c: Any = np.cos(theta_d)
    c = np.where(c.real < 0, -c, c)
    k = (eta - 1) * (eta + 1)
    mu = c * np.sin(x)
    g = np.sqrt(k + mu * mu)
    length = 2 * eta * g / (k + c * c)
    turn = 2 * p * _angle(c * np.cos(x), g) - (pi(x.dtype) - 2 * x)
    return Ray(mu, g, length, turn)


def attenuation(p: int, ray: Ray, eta: Array, sigma_a: Array) -> Array:
    """A_p, with F and 1 - F multiplied out."""
    mu, g, length, _ = ray
    k = (eta - 1) * (eta + 1)
    s, t = mu + g, eta * eta * mu + g
    F = ((k / s / s) ** 2 + (k * ((eta * eta + 1) * mu * mu - 1) / t / t) ** 2) / 2
    if p == 0:
        return F
    passed = 2 * (mu / s * (g / s) + eta * eta * (mu / t) * (g / t))
    return passed**2 * F ** (p - 1) * np.exp(-p * sigma_a * length)


def wrap(x: Array) -> Array:
    """The angle of [-pi, pi] that differs from x by whole turns."""
    turn = 2 * pi(x.dtype)
    return x - turn * np.round(x / turn)


def _images(x: Array, beta: Array) -> Array:
    turn = 2 * pi(x.dtype)
    total = np.zeros((3, *x.shape), x.dtype)
    for k in range(-2, 3):
        y = (x - turn * k) / beta
        image = np.exp(-y * y / 2) / (beta * np.sqrt(turn))
        total += np.stack([image, -image * y / beta, image * (y * y - 1) / beta])
    return total


def _harmonics(x: Array, beta: Array) -> Array:
    turn = 2 * pi(x.dtype)
    total = np.zeros((3, *x.shape), x.dtype)
    total[0] = 1 / turn
    for n in range(1, 8):
        size = 2 * np.exp(-((n * beta) ** 2) / 2) / turn
        wave, slope = size * np.cos(n * x), -size * n * np.sin(n * x)
        total += np.stack([wave, slope, -n * n * beta * wave])
    return total


def density(x: Array, beta: Array) -> Array:
    """Wrapped normal and its derivatives in x and beta, along a new first axis."""
    x, narrow = wrap(x), beta <= 1.5
    images = _images(x, np.where(narrow, beta, 1))
    if narrow.all():
        return images
    return np.where(narrow, images, _harmonics(x, np.where(narrow, 2, beta)))


def caustic(p: int, theta_d: Array, eta: Array) -> Array:
    """The x at which Phi turns back; pi/2 if it does not."""
    if p < 2:
        return np.full_like(theta_d, np.pi / 2)
    scale = np.abs(np.cos(theta_d)) * np.sqrt(p * p - 1)
    sine = np.sqrt((eta - 1) * (eta + 1)) / scale
    return np.arcsin(np.minimum(sine, 1))


class Panels(NamedTuple):
    """Parts of [0, pi/2] in x, whose point each is, and the sign of h."""

    owner: Array
    sign: Array
    low: Array
    high: Array

    def take(self, index: Any) -> "Panels":
        """The panels of these numbers."""
        return Panels(*(x[index] for x in self))

    def halves(self) -> "Panels":
        """Each panel in two."""
        middle = (self.low + self.high) / 2
        left, right = self._replace(high=middle), self._replace(low=middle)
        return Panels(*map(np.concatenate, zip(left, right, strict=True)))


def _whole(p: int, points: Points) -> Panels:
    """Both sides of the caustic, for both signs of h."""
    count = len(points.phi)
    split = caustic(p, points.theta_d, points.eta)
    zero, end = np.zeros(count), np.full(count, np.pi / 2)
    owner, one = np.arange(count), np.ones(count)
    pieces = [
        Panels(owner, sign * one, low, high)
        for sign in (-1, 1)
        for low, high in ((zero, split), (split, end))
    ]
    whole = Panels(*map(np.concatenate, zip(*pieces, strict=True)))
    return whole.take(whole.low < whole.high)


def panels(p: int, points: Points, accuracy: Accuracy) -> Panels:
    """Where the integrand of N matters, in parts on which it is smooth (float64).

    A part is halved while Phi moves by more than the detector's width on it, or the
    absorption by much, or while it is longer than its distance from the branch points
    of the Fresnel terms. Its exponent is bounded by the ends: Phi is monotone on it.
    """
    points = Points(*(x.astype(float) for x in points))
    best = np.full(len(points.phi), -np.inf)
    k = (points.eta - 1) * (points.eta + 1)
    near = np.maximum(np.sqrt(k) / np.abs(np.cos(points.theta_d)), 1e-7)
    todo, done = _whole(p, points), []
    while todo.owner.size:
        own = points.take(todo.owner)
        ends = [ray(p, x, own.theta_d, own.eta) for x in (todo.low, todo.high)]
        depth = [p * own.sigma_a * end.length for end in ends]
        off = [own.phi - p * np.pi - todo.sign * end.turn for end in ends]
        half = np.abs(off[1] - off[0]) / 2
        away = np.maximum(np.abs(wrap((off[0] + off[1]) / 2)) - half, 0)
        bound = -np.minimum(*depth) - (away / own.beta_n) ** 2 / 2
        for y, x in zip(depth, off, strict=True):
            np.maximum.at(best, todo.owner, -y - (wrap(x) / own.beta_n) ** 2 / 2)
        matters = bound >= best[todo.owner] - accuracy.margin
        length = todo.high - todo.low
        long = length > np.minimum(todo.low + near[todo.owner], 0.4)
        long |= 2 * half > accuracy.span * own.beta_n
        long |= np.abs(depth[1] - depth[0]) > 2 * accuracy.span
        done.append(todo.take(matters & ~long))
        todo = todo.take(matters & long).halves()
    return Panels(*map(np.concatenate, zip(*done, strict=True)))


def _panel_sums(p: int, own: Points, part: Panels, order: int) -> Array:
    """Value and derivatives of N from each panel, along the first axis."""
    dtype = own.phi.dtype
    t, w = (z.astype(dtype) for z in gauss_legendre(order))
    phi, theta_d, eta, sigma_a, beta_n = (z[:, None] for z in own)
    sign, low = part.sign[:, None], part.low[:, None].astype(dtype)
    # The double nearest to pi/2 falls short of it by a part of the integral.
    high = np.where(part.high == np.pi / 2, pi(dtype) / 2, part.high.astype(dtype))
    length = high[:, None] - low
    x = low + length * t
    steps = ((theta_d + 1j * STEP, eta), (theta_d, eta + 1j * STEP))
    rays = [ray(p, x, *step) for step in steps]
    A = [
        attenuation(p, one, step[1], sigma_a)
        for one, step in zip(rays, steps, strict=True)
    ]
    value, turn = A[0].real, rays[0].turn.real
    seen, by_x, by_beta = density(phi - p * pi(dtype) - sign * turn, beta_n)
    terms = [value * seen, value * by_x]
    for a, one in zip(A, rays, strict=True):
        moved = a.imag * seen - value * by_x * (sign * one.turn.imag)
        terms.append(moved / STEP)
    terms.append(-p * rays[0].length.real * value * seen)
    terms.append(value * by_beta)
    weight = length * w * np.sin(x) / 2
    return np.stack([(weight * term).sum(axis=1) for term in terms])


def N(p: int, points: Points, accuracy: Accuracy = EXACT) -> Array:
    """N_p and its derivatives in the order of `Points`, along a new first axis.

    The error is below 1e-17 of the peak over phi for beta_n of order 1. For small
    beta_n it grows as the best that float64 can do, and is 1/2000 of that.
    """
    every = panels(p, points, accuracy)
    total = np.zeros((1 + len(points), len(points.phi)), points.phi.dtype)
    for start in range(0, len(every.owner), 4000):
        part = every.take(slice(start, start + 4000))
        sums = _panel_sums(p, points.take(part.owner), part, accuracy.order)
        for line, found in zip(total, sums, strict=True):
            np.add.at(line, part.owner, found)
    return total


def landmarks(p: int, theta_d: Array, eta: Array, h: float) -> Array:
    """Phi - p pi at offset h, at the caustic and at grazing (float64)."""
    places = np.arccos(np.full_like(theta_d, h)), caustic(p, theta_d, eta), 0 * theta_d
    return np.stack([ray(p, x, theta_d, eta).turn for x in places])


def _likely(p: int, fibers: Points) -> Array:
    """Azimuths among which the largest values are, along the first axis.

    A grid, and the surroundings of the caustic and of grazing: evenly on the scale of
    the detector, and at distances that grow from there to half a turn.
    """
    s = np.minimum(fibers.beta_n, 1)
    marks = landmarks(p, fibers.theta_d, fibers.eta, 0.0)[1:] + p * np.pi
    near = np.arange(-4, 4.25, 0.5)[:, None] * s
    far = 4 * s * (np.pi / (4 * s)) ** np.linspace(0.08, 1, 12)[:, None]
    around = marks[:, None] + np.concatenate([near, far, -far])
    grid = np.linspace(0, np.pi, 25)[:, None] + 0 * s
    return wrap(np.concatenate([*around, grid]))


def N_peaks(p: int, fibers: Points) -> Array:
    """Largest modulus over phi of N_p and its derivatives, nearly (float64).

    Within a few percent for most fibers; `phi` of the fibers is ignored.
    """
    fibers = Points(*(x.astype(float) for x in fibers))
    phi = _likely(p, fibers)
    repeated = Points(*(np.tile(x, len(phi)) for x in fibers))
    found = N(p, repeated._replace(phi=phi.ravel()), ROUGH)
    return np.abs(found).reshape(-1, *phi.shape).max(axis=1)


def _scaled_bessel(a: Array) -> Array:
    """I0(a) exp(-a) = 1/pi int_0^pi exp(-a (1 - cos t)) dt, for a >= 1."""
    t, w = gauss_legendre(24)
    end = 2 * np.arcsin(np.sqrt(np.minimum(30 / a.real, 1)))[:, None]
    total = np.zeros_like(a)
    for k in range(4):
        y = 2 * np.sin(end * (k + t) / 8) ** 2
        total = total + (end / 4 * w * np.exp(-a[:, None] * y)).sum(axis=1)
    return total / pi(WIDE)


def _series(y: Array, divisors: Sequence[int]) -> Array:
    """1 + y/d_1 + y^2/(d_1 d_2) + ..."""
    total = term = np.ones_like(y)
    for d in divisors:
        term = term * y / d
        total = total + term
    return total


def _M(theta_c: Array, theta_o: Array, v: Array) -> Array:
    """The equation, with the exponents of its factors joined, or as power series."""
    x = 1 / v
    sines: Any = np.sin(theta_c) * np.sin(theta_o)
    a = x * np.cos(theta_c) * np.cos(theta_o)
    peaked, narrow = a.real > 2, x.real > 2
    E = -2 * x * np.sin((theta_o - theta_c) / 2) ** 2
    # x (sin sin - 1) is E - a, but in the angles the derivatives of those cancel.
    fall = E - a
    fall = fall.real + 1j * (x.real * sines.imag + x.imag * (fall / x).real)
    n, b = (np.where(which, x, 1 + 0 * x) for which in (narrow, ~narrow))
    sinh = _series(b * b, [2 * k * (2 * k + 1) for k in range(1, 25)])
    front = np.where(narrow, n / (1 - np.exp(-2 * n)), 1 / (2 * sinh))
    small = np.where(peaked, 0 * a, a)
    bessel = _series(small * small / 4, [k * k for k in range(1, 25)])
    flat = np.exp(np.where(narrow, fall, b * sines)) * bessel
    steep = np.exp(E) * _scaled_bessel(np.where(peaked, a, 2 + 0 * a))
    return front * np.where(peaked, steep, flat)


def M(theta_cone: Array, theta_o: Array, v: Array) -> Array:
    """M and its derivatives in theta_cone, theta_o and v, along a new first axis."""
    given = np.stack([theta_cone, theta_o, v]).astype(WIDE)
    stepped = [_M(*(given + 1j * STEP * row[:, None])) for row in np.eye(3)]
    return np.stack([stepped[0].real, *(z.imag / STEP for z in stepped)])


def M_scales(theta_cone: Array, theta_o: Array, v: Array) -> Array:
    """What rounding errors of M and its derivatives are in proportion to (float64).

    1 + |E|/2 times the modulus, E the exponent; for a derivative also M times the sum
    of the moduli of the terms that make up that of log M.
    """
    exact = np.abs(M(theta_cone, theta_o, v)).astype(float)
    sin_c, cos_c = np.abs(np.sin(theta_cone)), np.abs(np.cos(theta_cone))
    sin_o, cos_o = np.abs(np.sin(theta_o)), np.abs(np.cos(theta_o))
    D, x = theta_o - theta_cone, 1 / v
    a = x * cos_c * cos_o
    r, away = ive(1, a) / ive(0, a), 2 * np.sin(D / 2) ** 2
    peaked, narrow = a > 2, x > 2
    rest = np.where(peaked, 1 - r, r)
    by_c = np.where(peaked, np.abs(np.sin(D)), sin_o * cos_c) + cos_o * sin_c * rest
    by_o = np.where(peaked, np.abs(np.sin(D)), sin_c * cos_o) + cos_c * sin_o * rest
    y = np.where(narrow, 1, x)
    flat = np.where(narrow, 1 / x + 2 / np.expm1(2 * np.clip(x, 2, 40)), 1 / np.tanh(y))
    flat = flat - np.where(narrow, 0, 1 / y)
    by_x = np.where(peaked, away, sin_c * sin_o) + cos_c * cos_o * rest + flat
    terms = np.stack([0 * x, x * by_c, x * by_o, x * x * by_x])
    return exact * (1 + x * away / 2) + exact[0] * terms
