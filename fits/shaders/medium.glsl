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
// R + TT + TRT is off by 0.0158 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.02181; 0.01412 on fibers that
// nothing was fitted to, at most 0.0185. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.02448, 0.002544
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
    float beta_n = n - 0.01694457;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + 0.33353707 * beta_n2;
    hair.kP = 1.00001 + 1.0875695 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.07694909, 1e-05);
    float t_r = cos_tilt * over_v;
    hair.slope_r = 2.615094 * t_r;
    hair.slope_r_2 = 6.992103 * t_r;
    hair.slope_r_3 = 5.176139 * t_r;
    float n2 = n * n;
    float b = 4.0 * n2;
    hair.offset = 0.133571 * b;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m = clamp(2.0 * t_2, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    float t_tt_2 = 0.4424784 - 0.1118545 * m4 - 0.005871167 * b + 0.01068322 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_tt_3 = -0.1297842 * m4 - 0.0202936 + 0.01237474 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    float t_trt_2 = 0.180236 - 0.06285059 * m4_trt - 0.02071319 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    float t_trt_3 = -0.4214476 * m4_trt - 0.08047677 + 0.003122795 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2933627 * b - 2.023944 + 0.06236836 * e);
    float m_r = clamp(material.beta_m, 0.09, 0.49);
    float m4_r = 4.0 * (m_r * m_r);
    hair.k_q_r = 1.442695 * (-0.01203741 * m4_r + 0.08946533 * b);
    hair.k_P = 1.442695 * (0.4209191 - 0.1139839 * b + 0.02048751 * e);
    float t_r_2 = sin(0.5 * t);
    float less = 2.0 * (t_r_2 * t_r_2);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_tilt_r = k_tilt - 2.4110968 + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.2362714 + m4 * (-0.02006454 * m4 - 0.2167253));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09290164 - 0.06896768 * m4);
    hair.k_qq_tt = 1.442695
        * (0.0692371 * m4 - 0.1940416 + 0.03173074 * b + 0.009969527 * e);
    hair.k_uuq = 1.442695 * (b * (1.22696 + 0.3277328 * b) - 1.79151);
    hair.k_uuuq = 1.442695 * (0.7724232 * b - 0.7823877);
    hair.k_uuu = 1.442695 * (0.5788275 * b - 1.043702);
    hair.k_uu_tt = 1.442695 * (1.65952 * b - 2.778392 + 0.09386242 * e);
    vec3 t_r_3 = min(material.sigma_a, vec3(1.15));
    hair.k_q_tt = 1.442695
        * (0.7419672 * t_r_3 - 1.413195
        + b * (1.3027 - 0.3185328 * b - 0.276955 * t_r_3)
        + e * (0.2862549 - 0.141939 * b - 0.1516123 * t_r_3));
    hair.k_uq_tt = 1.442695
        * (0.4452095 * t_r_3 - 2.793437 + b * (1.882051 - 0.2728957 * t_r_3)
        + e * (0.3145644 - 0.1379025 * b - 0.1064823 * t_r_3));
    hair.k_u_tt = 1.442695
        * (0.4770682 * t_r_3 - 4.53802
        + b * (2.661 - 0.4437526 * b - 0.3755141 * t_r_3)
        + e * (0.5264368 - 0.2685512 * b - 0.02768471 * e - 0.02306023 * t_r_3));
    float t_tt_4 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    vec3 t_tt_5 = material.sigma_a - t_r_3;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3295139 - 0.2376071 * b - 0.03128531 * e) - 3.490036
        - 1.769158 * t_r_3 + b * (1.3229 - 0.3958529 * b - 0.3125702 * t_r_3)
        - 2.0 * t_tt_5));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2016538 + 0.5239759 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.6952547 * r - 0.5757406);
    hair.k_q_trt = 1.442695
        * (0.6959904 * m4_trt - 0.1191243 - 1.285045 * r - 1.051597 * b
        + 0.2190637 * e);
    hair.k_uq_trt = 1.442695 * (3.877722 + 6.103787 * r - 2.242499 * b);
    hair.k_uu_trt = 1.442695 * (-0.1247851 * r - 1.037291 + 0.4747127 * b);
    hair.k_u_trt = 1.442695
        * (4.374546 + r * (4.101122 + 0.6857094 * r) - 2.170287 * b - 0.2586438 * e);
    float t_trt_4 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    vec3 t_trt_5 = -4.0 * t_tt_5;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.7929089 * m4_trt - 2.78444 + r * (0.5081931 - 0.5811327 * r)
        - 0.6848691 * b + 0.1307234 * e - 4.870587 * t_r_3 + t_trt_5));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.1089088 - 0.5209025 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.613898 * r - 0.6216004);
    hair.k_q_trt_2 = 1.442695
        * (1.721408 + 0.02986428 * r + e * (0.06790326 + 0.8062476 * r));
    hair.k_uq_trt_2 = 1.442695 * (8.607683 + r * (-55.87264 * r - 44.46227));
    hair.k_uu_trt_2 = 1.442695
        * (22.66545 + r * (-146.0684 * r - 110.2975) - 0.3188047 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (28.77021 + 54.3321 * r) - 2.57051 + e * (26.96101 * r - 4.408567));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.379369 * t_r_3 - 4.407317 + r * (2.088836 - 0.2182356 * t_r_3)
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
        * max(max(1.138498 + hair.slope_r * t, hair.slope_r_2 * t - 1.946931),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.4502217 * P);
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
