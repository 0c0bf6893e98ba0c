// Hair of exponentials, two for TRT and its caustic: R + TT + TRT.
// Form: exponentials of polynomials in cos phi and q = cos 2 theta_d. Y is
// 4 cos^2 theta_d, X = 2 - 2 cos(theta_i + theta_o), square that of the cone.
// Fitted to S over both directions; absorption follows the path, 1/cos theta_t.
// Domain: eta 1.45 to 1.65, beta_m 0.09 to 0.49, beta_n 0.05 to 0.49, sigma_a 0 to
// 1.15, |alpha| to 2.5 degrees.
// Beyond it the polynomials are those of the nearest fiber; M follows beta_m, to
// 0.8, and alpha, absorption sigma_a.
// Constants: fits/tiers.py.
//
// L points towards the light, V towards the eye, T along the fiber: unit vectors.
// hair_bsdf returns what one light adds per unit of its irradiance across L, per
// steradian: S cos(theta). Do not multiply by the cosine of an inclination again.
// R + TT + TRT is off by 0.01585 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.0222; 0.01435 on fibers that
// nothing was fitted to, at most 0.01857. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.02418, 0.002257
// below max(1, exact) at the most.
// hair_bsdf_hoisted takes 12 special operations (exp, rsqrt, ...) and 124
// others in the code of a GPU, sm_86, a fused multiply-add as one; 12 and
// 189 in SPIR-V, nothing fused.
//
// Emitted by fits/shaders.py.

struct HairMaterial {
    float eta;  // index of refraction, >= 1
    vec3 sigma_a;  // absorption per fiber radius, >= 0
    float beta_m;  // longitudinal width of R in radians; TT half, TRT twice
    float beta_n;  // azimuthal roughness in radians
    float alpha;  // tilt of the scales in radians, < 0 if T points to the tip
};

// What depends on the material alone.
struct HairConstants {
    float tan_tilt_r;
    float tan_tilt_r_2;
    float kT;
    float kP;
    float slope_r;
    float slope_r_2;
    float slope_r_3;
    float offset;
    float tan_tilt_tt;
    float tan_tilt_tt_2;
    float k_near_tt;
    float flat_tt;
    float tan_tilt_trt;
    float tan_tilt_trt_2;
    float k_near_trt;
    float flat_trt;
    float k_square_r;
    float k_x;
    float k_q_r;
    float k_P;
    float k_tilt_r;
    float k_square_tt;
    float k_qqq;
    float k_qq_tt;
    float k_uuq;
    float k_uuuq;
    float k_uuu;
    float k_uu_tt;
    vec3 k_q_tt;
    vec3 k_uq_tt;
    vec3 k_u_tt;
    float k_tilt_tt;
    vec3 K_tt;
    float k_square_trt;
    float k_qq_trt;
    float k_q_trt;
    float k_uq_trt;
    float k_uu_trt;
    float k_u_trt;
    float k_tilt_trt;
    vec3 K_trt;
    float k_square_trt_2;
    float k_qq_trt_2;
    float k_q_trt_2;
    float k_uq_trt_2;
    float k_uu_trt_2;
    float k_u_trt_2;
    float k_tilt_trt_2;
    vec3 K_trt_2;
};

HairConstants hair_constants(HairMaterial material) {
    HairConstants hair;
    float t = clamp(2.0 * material.alpha, -1.2, 1.2);
    float cos_tilt = cos(t);
    hair.tan_tilt_r = sin(t) / cos_tilt;
    hair.tan_tilt_r_2 = 2.0 * hair.tan_tilt_r;
    float n = clamp(material.beta_n, 0.05, 0.49);
    float beta_n = n - 0.0205258;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + 0.3389224 * beta_n2;
    hair.kP = 1.00001 + 1.1115127 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.07406055, 1e-05);
    float t_r = cos_tilt * over_v;
    hair.slope_r = 2.479576 * t_r;
    hair.slope_r_2 = 6.644261 * t_r;
    hair.slope_r_3 = 4.912695 * t_r;
    float n2 = n * n;
    float b = 4.0 * n2;
    hair.offset = 0.1217689 * b;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m = clamp(2.0 * t_2, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    float t_tt_2 = 0.4434343 - 0.111523 * m4 - 0.006888913 * b + 0.008872306 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_tt_3 = -0.1287957 * m4 - 0.02019158 + 0.01223142 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    float t_trt_2 = 0.1867956 - 0.05503049 * m4_trt - 0.02959522 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    float t_trt_3 = 0.08087018 + 0.4255175 * m4_trt - 0.003712502 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2984501 * b - 2.021713 + 0.06319123 * e);
    float m_r = clamp(material.beta_m, 0.09, 0.49);
    float m4_r = 4.0 * (m_r * m_r);
    hair.k_q_r = 1.442695 * (-0.01208819 * m4_r + 0.09100375 * b);
    hair.k_P = 1.442695 * (0.4198494 - 0.1162923 * b + 0.02075545 * e);
    float t_r_2 = sin(0.5 * t);
    float less = 2.0 * (t_r_2 * t_r_2);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_tilt_r = k_tilt - 2.4488204 + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.2900098 + m4 * (0.08298741 * m4 - 0.3644677));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09014673 - 0.06762194 * m4);
    hair.k_qq_tt = 1.442695
        * (0.06762423 * m4 - 0.1914799 + 0.03052772 * b + 0.009556286 * e);
    hair.k_uuq = 1.442695 * (b * (1.350912 + 0.3180433 * b) - 1.763141);
    hair.k_uuuq = 1.442695 * (0.8618829 * b - 0.7812372);
    hair.k_uuu = 1.442695 * (0.7430493 * b - 1.121523);
    hair.k_uu_tt = 1.442695 * (1.852892 * b - 2.854842 + 0.06063455 * e);
    vec3 t_r_3 = min(material.sigma_a, vec3(1.15));
    hair.k_q_tt = 1.442695
        * (0.7440799 * t_r_3 - 1.39126
        + b * (1.265408 - 0.3048647 * b - 0.2734982 * t_r_3)
        + e * (0.2907126 - 0.1546793 * b - 0.1573552 * t_r_3));
    hair.k_uq_tt = 1.442695
        * (0.4485309 * t_r_3 - 2.745285 + b * (1.883986 - 0.27125 * t_r_3)
        + e * (0.3203763 - 0.1555511 * b - 0.1144651 * t_r_3));
    hair.k_u_tt = 1.442695
        * (0.4663015 * t_r_3 - 4.498648
        + b * (2.523504 - 0.3121293 * b - 0.3580836 * t_r_3)
        + e * (0.4790315 - 0.2609635 * b - 0.02791481 * e - 0.02240395 * t_r_3));
    float t_tt_4 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    vec3 t_tt_5 = material.sigma_a - t_r_3;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3139358 - 0.2314467 * b - 0.03093946 * e) - 3.452938
        - 1.778172 * t_r_3 + b * (1.178658 - 0.2899257 * b - 0.2985957 * t_r_3)
        - 2.0 * t_tt_5));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.190339 + 0.4972761 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.5981865 * r - 0.6026376);
    hair.k_q_trt = 1.442695
        * (0.6978724 * m4_trt - 0.1515231 - 1.205935 * r - 1.046235 * b
        + 0.2241366 * e);
    hair.k_uq_trt = 1.442695 * (4.713267 + 5.298569 * r - 2.961158 * b);
    hair.k_uu_trt = 1.442695 * (0.07792014 * r - 1.236247 + 0.6349294 * b);
    hair.k_u_trt = 1.442695
        * (4.595517 + r * (4.210609 + 0.4042384 * r) - 2.401818 * b - 0.2685503 * e);
    float t_trt_4 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    vec3 t_trt_5 = -4.0 * t_tt_5;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.7980537 * m4_trt - 2.725732 + r * (0.3433343 - 0.4642799 * r)
        - 0.725753 * b + 0.1351 * e - 4.879442 * t_r_3 + t_trt_5));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.1387644 - 0.5524011 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.729379 * r - 0.5519602);
    hair.k_q_trt_2 = 1.442695
        * (1.710138 + 0.01862562 * r + e * (0.06993582 + 0.808273 * r));
    hair.k_uq_trt_2 = 1.442695 * (2.638281 + r * (0.25671 - 106.7057 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (86.46951 - 392.1968 * r) - 3.66291 - 0.9493295 * e);
    hair.k_u_trt_2 = 1.442695
        * (1.014084 + r * (3.745145 + 80.9385 * r) + e * (28.06481 * r - 4.929277));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.386338 * t_r_3 - 4.414324 + r * (2.106199 - 0.1991565 * t_r_3)
        + t_trt_5));
    return hair;
}

// Reflected: T = cos phi + kT and P = Y (cos phi + kP) are about 2 cos^2(phi/2) and 8
// cos^2(phi/2) cos^2 theta_d; the largest of the lines is that of I0 in M. One
// exponential for F, N and M.
float hair_R(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o,
    float cos_phi) {
    float cc = cos_i * cos_o;
    float sc = sin_i * cos_o;
    float q = cc + sin_i * sin_o;
    float both = sin_i + sin_o;
    float apart = cos_i - cos_o;
    float together = cos_i + cos_o;
    float square_both = both * both;
    float X = square_both + apart * apart;
    float Y = square_both + together * together;
    float turned = sc + sin_o * cos_i;
    float a = cc + hair.tan_tilt_r * sc;
    float square = X - hair.tan_tilt_r_2 * turned - 4.0 * max(-a, 0.0);
    float T_2 = cos_phi + hair.kT;
    float P = Y * (cos_phi + hair.kP);
    float t = abs(a);
    float square_size = T_2
        * max(max(1.081118 + hair.slope_r * t, hair.slope_r_2 * t - 1.861939),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.45443386 * P);
    return T_2 * inversesqrt(square_size)
        * exp2(hair.k_tilt_r + hair.k_square_r * square
        + hair.k_x * sqrt(max(P, 0.0)) + hair.k_q_r * q + hair.k_P * P);
}

// Through the fiber: a factor of M and F at grazing, and one exponential for each
// color, a polynomial in cos phi and q less square/(2 v) of M.
vec3 hair_TT(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o,
    float cos_phi) {
    float cc = cos_i * cos_o;
    float sc = sin_i * cos_o;
    float q = cc + sin_i * sin_o;
    float both = sin_i + sin_o;
    float apart = cos_i - cos_o;
    float together = cos_i + cos_o;
    float square_both = both * both;
    float X = square_both + apart * apart;
    float Y = square_both + together * together;
    float turned = sc + sin_o * cos_i;
    float a = cc + hair.tan_tilt_tt * sc;
    float square = X - hair.tan_tilt_tt_2 * turned - 4.0 * max(-a, 0.0);
    float near = Y + hair.k_near_tt;
    float square_rise = near * near * (abs(a) + hair.flat_tt);
    float rise = Y * inversesqrt(square_rise);
    return rise * hair.K_tt
        * exp2(hair.k_tilt_tt + hair.k_square_tt * square
        + q * q * (hair.k_qq_tt + hair.k_qqq * q)
        + cos_phi * cos_phi
        * (hair.k_uu_tt + hair.k_uuq * q + cos_phi * (hair.k_uuu + hair.k_uuuq * q))
        + q * hair.k_q_tt + cos_phi * (hair.k_u_tt + q * hair.k_uq_tt));
}

// Reflected inside: a factor as that of TT, and one or two exponentials of polynomials
// in cos phi - 1 and q less square/(2 v), for all colors.
vec3 hair_TRT(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o,
    float cos_phi) {
    float cc = cos_i * cos_o;
    float sc = sin_i * cos_o;
    float q = cc + sin_i * sin_o;
    float both = sin_i + sin_o;
    float apart = cos_i - cos_o;
    float together = cos_i + cos_o;
    float square_both = both * both;
    float X = square_both + apart * apart;
    float Y = square_both + together * together;
    float turned = sc + sin_o * cos_i;
    float a = cc + hair.tan_tilt_trt * sc;
    float square = X - hair.tan_tilt_trt_2 * turned - 4.0 * max(-a, 0.0);
    float near = Y + hair.k_near_trt;
    float square_rise = near * near * (abs(a) + hair.flat_trt);
    float rise = Y * inversesqrt(square_rise);
    float u = cos_phi - 1.0;
    return rise
        * exp2(hair.k_tilt_trt + hair.k_square_trt * square
        + q * (hair.k_q_trt + hair.k_qq_trt * q)
        + u * (hair.k_u_trt + hair.k_uq_trt * q + hair.k_uu_trt * u)) * hair.K_trt
        + rise * exp2(hair.k_tilt_trt_2 + hair.k_square_trt_2 * square
        + q * (hair.k_q_trt_2 + hair.k_qq_trt_2 * q)
        + u * (hair.k_u_trt_2 + hair.k_uq_trt_2 * q + hair.k_uu_trt_2 * u))
        * hair.K_trt_2;
}

// With constants that have been made before.
vec3 hair_bsdf_hoisted(HairConstants hair, vec3 L, vec3 V, vec3 T) {
    float sin_i = dot(T, L);
    float sin_o = dot(T, V);
    float cos_io = dot(L, V);
    float square_i = max(1.0 - sin_i * sin_i, 1e-12);
    float over_i = inversesqrt(square_i);
    float cos_i = square_i * over_i;
    float square_o = max(1.0 - sin_o * sin_o, 1e-12);
    float over_o = inversesqrt(square_o);
    float cos_o = square_o * over_o;
    float along = sin_i * sin_o;
    float cos_phi = clamp((cos_io - along) * over_i * over_o, -1.0, 1.0);
    return hair_R(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_TT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_TRT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi);
}

// L towards the light, V towards the eye, T along the fiber: unit.
vec3 hair_bsdf(HairMaterial material, vec3 L, vec3 V, vec3 T) {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
