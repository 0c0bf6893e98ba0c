"""What the files of shaders say about themselves."""

from textwrap import wrap

from fiberjax.exponential import DOMAIN

MEANING = {
    "eta": "index of refraction, >= 1",
    "sigma_a": "absorption per fiber radius, >= 0",
    "beta_m": "longitudinal width of R in radians; TT half, TRT twice",
    "beta_n": "azimuthal roughness in radians",
    "alpha": "tilt of the scales in radians, < 0 if T points to the tip",
    "base_color": "linear, in [0, 1]",
    "specular": "factor of R",
    "roughness": "in (0, 1]; its square is the width of R",
    "scatter": "factor of the scattering",
    "shift": "tilt of TT in radians; R -2 times, TRT 4 times",
    "shadow": "light that reaches the hair, in [0, 1]",
}


KARIS = {
    "R": "Reflected. d'Eon et al. 2014: a Gaussian in sin theta, squeezed by "
    "cos(phi/2) and centered where a mirror of the scales' tilt throws the light; "
    "Schlick's F.",
    "TT": "Through the fiber. (1 - F)^2 C^(cos gamma_t/(2 cos theta_d)) D(phi) at one "
    "offset h for each phi, a = 1/eta'; a Gaussian in sin theta. The exponents of all "
    "three are one.",
    "TRT": "Reflected inside. (1 - F)^2 F C^(0.8/cos theta_d) D(phi) at the offset "
    "h = sqrt(3)/2; a Gaussian in sin theta. The exponents of all three are one.",
    "scattering": "What other hairs have scattered: sqrt(C) (n . L + 1)/(4 pi) "
    "(C/luma)^(1 - shadow), n the part of V across the fiber.",
}
EXPONENTIAL = {
    "R": "Reflected: T = cos phi + kT and P = Y (cos phi + kP) are about "
    "2 cos^2(phi/2) and 8 cos^2(phi/2) cos^2 theta_d; the largest of the lines is that "
    "of I0 in M. One exponential for F, N and M.",
    "TT": "Through the fiber: a factor of M and F at grazing, and one exponential for "
    "each color, a polynomial in cos phi and q less square/(2 v) of M.",
    "TRT": "Reflected inside: a factor as that of TT, and one or "
    "two exponentials of polynomials in cos phi - 1 and q less square/(2 v), for all "
    "colors.",
}
TITLES = {
    "light": "Hair of exponentials, one for TRT: R + TT + TRT.",
    "medium": "Hair of exponentials, two for TRT and its caustic: R + TT + TRT.",
    "fine": "Hair of exponentials of longer polynomials: R + TT + TRT.",
}
FITTED = (
    "Form: exponentials of polynomials in cos phi and q = cos 2 theta_d. Y is",
    "4 cos^2 theta_d, X = 2 - 2 cos(theta_i + theta_o), square that of the cone.",
    "Fitted to S over both directions; absorption follows the path, 1/cos theta_t.",
    *wrap(
        "Domain: "
        + ", ".join(f"{x} {low:g} to {high:g}" for x, (low, high) in DOMAIN.items())
        + ", |alpha| to 2.5 degrees.",
        85,
    ),
    "Beyond it the polynomials are those of the nearest fiber; M follows beta_m, to",
    "0.8, and alpha, absorption sigma_a.",
    "Constants: fits/tiers.py.",
)
REST = (
    "All lobes above TRT, uniform in azimuth: exp(-X/(2 v)) Y rsqrt(Y (q0 + q1 Y + "
    "Y^2)^2 (o + c/v cos theta_i cos theta_o)) (K0 + K1 Y), X = 2 - 2 cos(theta_i + "
    "theta_o), Y = 4 cos^2 theta_d."
)
WITH_REST = (
    "With the rest, all lobes above TRT as one. Constants of the rest: fits/tail.py",
    "in fiberjax, for eta 1.4 to 1.7, beta_m 0.05 to 0.55, sigma_a 0 to 1.2.",
)
DIRECTIONS = (
    "L points towards the light, V towards the eye, T along the fiber: unit vectors.",
    "hair_bsdf returns what one light adds per unit of its irradiance across L, per",
    "steradian: S cos(theta). Do not multiply by the cosine of an inclination again.",
)
