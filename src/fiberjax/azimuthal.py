"""The azimuthal function N of a rough fiber."""

from functools import partial

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals, choice, floats, lobe_number
from fiberjax.auto import DEFAULT
from fiberjax.detectors import DETECTORS
from fiberjax.rules import Rule, Seen, check_rule
from fiberjax.section import ray, section


def check_color(name: str, color: Floats) -> None:
    """ValueError unless it is a number or a vector of colors."""
    if color.ndim > 1:
        raise ValueError(f"{name} has shape {color.shape}: must be () or (C,)")


def check_sigma_a(sigma_a: Floats | None) -> None:
    """ValueError unless sigma_a is None, a number or a vector of colors."""
    if sigma_a is not None:
        check_color("sigma_a", sigma_a)


def drop_color(value: Floats, sigma_a: Floats | None) -> Floats:
    """Without the color axis of length 1, where sigma_a has none."""
    return value if sigma_a is not None and sigma_a.ndim else value[..., 0]


@partial(jax.jit, static_argnames=("p", "rule", "detector"))
def _N(p, phi, theta_d, eta, sigma_a, beta_n, rule, detector):
    seen = [Seen(p, beta_n, jnp.ones((), phi.dtype))]
    here = section(theta_d, eta, sigma_a)

    def weights(offset):
        return [ray(offset, here).A(p)]

    value = rule.convolve(seen, weights, phi, here, DETECTORS[detector])
    return drop_color(value, sigma_a)


def N(
    p: int,
    phi: Reals,
    theta_d: Reals,
    *,
    eta: Reals,
    sigma_a: Reals | None,
    beta_n: Reals,
    rule: Rule = DEFAULT,
    detector: str = "normal",
) -> Floats:
    """Azimuthal scattering function of lobe p of a rough fiber, per radian.

    N_p(phi) = 1/2 int_{-1}^{1} A(p, h) D(phi - Phi(p, h)) dh. It is even in phi and in
    theta_d, and int N_p dphi = 1/2 int A(p, h) dh.

    Args:
        p: number of internal segments, a static integer >= 0.
        phi: azimuth phi_o - phi_i in radians, any real.
        theta_d: difference angle (theta_o - theta_i)/2 in radians, [-pi/2, pi/2].
        eta: index of refraction, >= 1; broadcasts with the angles.
        sigma_a: absorption per fiber radius, >= 0, shape () or (C,); None if clear.
        beta_n: azimuthal roughness, the standard deviation of D in radians, > 0;
            broadcasts with the angles.
        rule: how to integrate, static.
        detector: D, static: "normal" (wrapped normal, d'Eon) or "logistic" (trimmed
            logistic of scale sqrt(pi/8) beta_n, Chiang).

    Returns:
        Density per radian, shape broadcast(angles) + sigma_a.shape, dtype of the
        angles.

    Raises:
        ValueError: p negative or not static, sigma_a of more than one axis, unknown
            rule or detector.

    Reference: d'Eon et al. 2011; 2013, eq. 4.
    """
    p = lobe_number("p", p)
    check_rule(rule)
    phi, theta_d, eta, beta_n, *sigma = floats(
        (phi, theta_d), (eta, beta_n) if sigma_a is None else (eta, beta_n, sigma_a)
    )
    sigma_a = sigma[0] if sigma else None
    check_sigma_a(sigma_a)
    choice("detector", detector, tuple(DETECTORS))
    return _N(p, phi, theta_d, eta, sigma_a, beta_n, rule, detector)
