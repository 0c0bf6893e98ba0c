"""Converter of Karis' hair, that of Unreal.

Its tangent is its own; alpha is along it. All is checked while the numbers are known;
under a transformation of JAX nothing is.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp

from fiberjax import artist, parameters
from fiberjax._types import Reals, floats
from fiberjax.fiber import Fiber
from fiberjax.parameters import ETA, Numbers, clamp, given, within
from fiberjax.shading import PASS

_ROUGHNESS = (1 / 255, 1.0)
_NO_OTHER_ETA = "its Fresnel and eta' are for 1.55, another would be lost"


class Karis(NamedTuple):
    """What Karis' hair takes; `karis` makes a fiber of it."""

    base_color: Any
    roughness: Any
    shift: Any


@parameters.in_their_dtype
def karis(
    base_color: Numbers,
    roughness: Reals = 0.3,
    shift: Reals = 0.035,
    *,
    specular: Reals = 1.0,
    scatter: Reals = 0.0,
    beta_n: Reals | None = None,
) -> Fiber:
    """Fiber that Karis' hair of Unreal, 2016, approximates.

    | theirs | ours | source |
    |---|---|---|
    | roughness r, clamped to [1/255, 1] | r | HairBsdf.ush, HairShading |
    | beta = (1, 1/2, 2) r^2 in sin theta_o + sin theta_i | beta_m = r^2, widths_m \
(1, 1/2, 2) | HairBsdf.ush, HairShading; the slides, "Longitudinal" |
    | alpha = (-2, 1, 4) shift, radians | alpha = -shift along N | the same |
    | base_color C | sigma_a = -log(C)/4, C at least 1e-30 | the slides, "Absorption" |
    | eta 1.55 in eta' | eta | HairBsdf.ush, HairShading |

    N, its tangent, points towards the root, so R leaves towards the tip; for a tangent
    towards the tip alpha = shift. beta is the width in theta_o where cos theta_o = 1
    alone. Its azimuth knows no roughness; beta_n = r^2 unless given. No lobe beyond
    TRT: `rest=False`. `artist` has the whole model.

    Args:
        base_color: C in [0, 1], one or any number of colors.
        roughness: perceptual.
        shift: tilt of TT in radians.
        specular: 1; a Fiber has no factor of R.
        scatter: 0; a factor of the light that other hairs have scattered, of which a
            Fiber has none.
        beta_n: azimuthal deviation in radians, > 0.

    Returns:
        The fiber, in the dtype of the numbers given.

    Raises:
        ValueError: specular is not 1 or scatter not 0, which would be lost; a number
            outside of its range.

    Reference: Karis 2016.
    """
    within(0, 1, {"base_color": base_color})
    within(0, jnp.inf, {"beta_n": beta_n}, open_low=True)
    parameters.equal("specular", specular, 1, "a Fiber has no factor of R, it is lost")
    lost = "a Fiber has no light of other hairs, it is lost"
    parameters.equal("scatter", scatter, 0, lost)
    color, rough, tilt = floats((base_color, roughness, shift))
    beta = clamp(rough, *_ROUGHNESS) ** 2
    return Fiber(
        eta=ETA,
        beta_m=beta,
        beta_n=given(beta_n, beta),
        alpha=-tilt,
        sigma_a=-jnp.log(clamp(color, artist.DARKEST)) / PASS,
    )


def to_karis(fiber: Fiber) -> Karis:
    """What Karis' hair takes of a fiber: the inverse of `karis`.

    Args:
        fiber: fiber of eta 1.55 and beta_n = beta_m, of at most 3 colors, with the
            widths (1, 1/2, 2) and (1,) and the tilts (2, -1, -4, 0).

    Returns:
        The numbers, for `karis(*numbers)`.

    Raises:
        ValueError: what Karis' hair does not have, by name, and what would be lost.
    """
    parameters.marschner(fiber, "Karis")
    parameters.equal("eta", fiber.eta, ETA, _NO_OTHER_ETA)
    lost = "the azimuth of Karis knows no roughness, it would be lost"
    parameters.equal("beta_n", fiber.beta_n, fiber.beta_m, lost)
    roughness = jnp.sqrt(fiber.beta_m)
    parameters.fits("Karis", *_ROUGHNESS, {"roughness": roughness})
    color = jnp.exp(-PASS * parameters.rgb(fiber))
    return Karis(color, roughness, -parameters.tilt(fiber))
