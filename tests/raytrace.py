"""Rays through a dielectric cylinder, in three dimensions and in NumPy.

It knows vectors, Snell's and Fresnel's laws and a circle, and nothing of fiberjax. The
cylinder has radius 1 and its axis is the first axis, the tangent. Directions point away
from it: omega = (sin theta, cos theta cos phi, cos theta sin phi).

Seen along the tangent, from its tip to its root, phi grows counterclockwise. A ray that
arrives from omega_i with offset h = sin(gamma_i) enters at the azimuth phi_i - gamma_i:
h > 0 is the side of smaller phi.
"""

from typing import NamedTuple

import numpy as np


class Trace(NamedTuple):
    """What becomes of each ray; the last axis of `omega_o` holds coordinates.

    Attributes:
        omega_o: direction in which the ray leaves.
        entry: point at which it enters, shape (..., 3).
        segments: length of each internal segment, shape (p, ...).
        cosines: cosine of the angle to the normal on the outer side, at each of its
            encounters with the surface, shape (p + 1, ...), or (1, ...) for p = 0.
        kept: fraction of the light that takes this path through all encounters.
    """

    omega_o: np.ndarray
    entry: np.ndarray
    segments: np.ndarray
    cosines: np.ndarray
    kept: np.ndarray


def direction(theta, phi):
    """The unit vector of inclination theta and azimuth phi."""
    theta, phi = np.broadcast_arrays(theta, phi)
    across = np.cos(theta)
    return np.stack([np.sin(theta), across * np.cos(phi), across * np.sin(phi)], -1)


def trace(p, h, theta_i, phi_i, eta, alpha=0.0):
    """Follow rays with p internal segments through cylinders of index eta.

    With `alpha` every surface normal is turned by that angle towards +tangent, as by
    tilted scales, while the surface itself stays a cylinder.
    """
    azimuth = phi_i - np.arcsin(h)
    entry = point = direction(np.zeros_like(azimuth), azimuth)
    travel = -direction(theta_i, phi_i)
    cosines, segments = [], []
    normal = _tilted(point, alpha)
    inside = -_dot(travel, normal)
    cosines.append(inside)
    reflected = _reflectance(inside, 1.0, eta)
    if p == 0:
        omega_o = _reflect(travel, normal)
        return Trace(omega_o, entry, np.array([]), np.array(cosines), reflected)
    kept = 1 - reflected
    travel = _refract(travel, -normal, 1 / eta)
    for segment in range(p):
        across = travel[..., 1:]
        length = -2 * _dot(point[..., 1:], across) / _dot(across, across)
        point = point + length[..., None] * travel
        segments.append(length)
        surface = point * [0, 1, 1]
        normal = _tilted(surface, alpha)
        inside = _dot(travel, normal)
        cosines.append(np.sqrt(1 - eta**2 * (1 - inside**2)))
        reflected = _reflectance(inside, eta, 1.0)
        if segment < p - 1:
            kept = kept * reflected
            travel = _reflect(travel, normal)
        else:
            kept = kept * (1 - reflected)
            travel = _refract(travel, normal, eta)
    return Trace(travel, entry, np.array(segments), np.array(cosines), kept)


def _dot(a, b):
    return np.sum(a * b, -1)


def _tilted(outward, alpha):
    return np.cos(alpha) * outward + np.sin(alpha) * np.array([1.0, 0.0, 0.0])


def _reflect(travel, normal):
    return travel - 2 * _dot(travel, normal)[..., None] * normal


def _refract(travel, forward, ratio):
    """Snell's law; `forward` is the normal on the far side, `ratio` n_here/n_there."""
    ratio = np.asarray(ratio)[..., None]
    along = _dot(travel, forward)[..., None]
    sideways = ratio * (travel - along * forward)
    return sideways + np.sqrt(1 - _dot(sideways, sideways)[..., None]) * forward


def _reflectance(cosine, here, there):
    """Unpolarized, from the cosine on this side and both indices."""
    beyond = np.sqrt(1 - (here / there) ** 2 * (1 - cosine**2))
    r_s = (here * cosine - there * beyond) / (here * cosine + there * beyond)
    r_p = (there * cosine - here * beyond) / (there * cosine + here * beyond)
    return (r_s**2 + r_p**2) / 2
