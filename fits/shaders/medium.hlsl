// Hair of exponentials, two for TRT and its caustic: R + TT + TRT.
// Form: exponentials of polynomials in cos phi and q = cos 2 theta_d. Y is
// 4 cos^2 theta_d, X = 2 - 2 cos(theta_i + theta_o), square that of the cone.
// Fitted to S over both directions; absorption follows the path, 1/cos theta_t.
// Domain: eta 1.45 to 1.65, beta_m 0.09 to 0.49, beta_n 0.05 to 0.49, sigma_a 0 to
// 1.15, |alpha| to 2.5 degrees.
// Beyond it the polynomials are those of the nearest fiber; M follows beta_m
// and alpha, absorption sigma_a.
// Constants: fits/tiers.py.
//
// L points towards the light, V towards the eye, T along the fiber: unit vectors.
// hair_bsdf returns what one light adds per unit of its irradiance across L, per
// steradian: S cos(theta). Do not multiply by the cosine of an inclination again.
// R + TT + TRT is off by 0.01522 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.02062; 0.01391 on other fibers, at
// most 0.01894. Furnace, the same beta and beta_n .05, eta 1.55, tilts to
// 2.5 degrees: albedo off by at most 0.023, 0.003003 below max(1, exact) at the most.
// hair_bsdf_hoisted takes 12 special operations (exp, rsqrt, ...) and 124
// others in the code of a GPU, sm_86, a fused multiply-add as one; 12 and
// 189 in SPIR-V, nothing fused.
//
// Emitted by fits/shaders.py.

struct HairMaterial {
    float eta;  // index of refraction, >= 1
    float3 sigma_a;  // absorption per fiber radius, >= 0
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
    float3 k_q_tt;
    float3 k_uq_tt;
    float3 k_u_tt;
    float k_tilt_tt;
    float3 K_tt;
    float k_square_trt;
    float k_qq_trt;
    float k_q_trt;
    float k_uq_trt;
    float k_uu_trt;
    float k_u_trt;
    float k_tilt_trt;
    float3 K_trt;
    float k_square_trt_2;
    float k_qq_trt_2;
    float k_q_trt_2;
    float k_uq_trt_2;
    float k_uu_trt_2;
    float k_u_trt_2;
    float k_tilt_trt_2;
    float3 K_trt_2;
};

HairConstants hair_constants(HairMaterial material) {
    HairConstants hair;
    float t = clamp(2.0 * material.alpha, -1.2, 1.2);
    float cos_tilt = cos(t);
    hair.tan_tilt_r = sin(t) / cos_tilt;
    hair.tan_tilt_r_2 = 2.0 * hair.tan_tilt_r;
    float n = clamp(material.beta_n, 0.05, 0.49);
    float beta_n = n - 0.0217958;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + 0.355721 * beta_n2;
    hair.kP = 1.00001 + 1.1915644 * beta_n2;
    float over_v = max(1.0 / (material.beta_m * material.beta_m) - 0.05965294, 1e-05);
    float t_r = cos_tilt * over_v;
    hair.slope_r = 2.158519 * t_r;
    hair.slope_r_2 = 5.761591 * t_r;
    hair.slope_r_3 = 4.238235 * t_r;
    float n2 = n * n;
    float b = 4.0 * n2;
    hair.offset = 0.1633502 * b;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m = clamp(2.0 * t_2, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    hair.k_near_tt = 0.1948676 - 0.09445745 * m4 + 0.00287764 * b + 0.01119712 * e;
    float t_tt_2 = 0.01732339 + 0.1508104 * m4 - 0.02689742 * b;
    hair.flat_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    hair.k_near_trt = 0.02784617 - 0.04615284 * m4_trt + 0.04212551 * b;
    float t_trt_2 = -0.5040515 * m4_trt - 0.06970201 - 0.03822508 * b;
    hair.flat_trt = t_trt_2 * t_trt_2 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.3485575 * b - 1.995569 + 0.06611885 * e);
    float m_r = clamp(material.beta_m, 0.09, 0.49);
    float m4_r = 4.0 * (m_r * m_r);
    hair.k_q_r = 1.442695 * (-0.005406963 * m4_r + 0.1067857 * b);
    hair.k_P = 1.442695 * (0.4186806 - 0.1381652 * b + 0.01889108 * e);
    float t_r_2 = sin(0.5 * t);
    float less = 2.0 * (t_r_2 * t_r_2);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_tilt_r = k_tilt - 2.5580542 + log_peak;
    float over_v_tt = 1.0 / (t_2 * t_2);
    float scale_tt = 1.442695
        * (over_v_tt + 0.2034227 + m4 * (-0.06764823 * m4 - 0.1669281));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09225344 - 0.07799596 * m4);
    hair.k_qq_tt = 1.442695
        * (0.06989617 * m4 - 0.1963157 + 0.0388691 * b + 0.01073968 * e);
    hair.k_uuq = 1.442695 * (b * (1.253348 + 0.3105359 * b) - 1.795987);
    hair.k_uuuq = 1.442695 * (0.7756827 * b - 0.7856965);
    hair.k_uuu = 1.442695 * (0.6392582 * b - 1.07963);
    hair.k_uu_tt = 1.442695 * (1.752832 * b - 2.831018 + 0.08389567 * e);
    float3 t_r_3 = min(material.sigma_a, (float3)1.15);
    hair.k_q_tt = 1.442695
        * (0.7233236 * t_r_3 - 1.398196
        + b * (1.282631 - 0.3081252 * b - 0.2554074 * t_r_3)
        + e * (0.2920741 - 0.1744625 * b - 0.1433271 * t_r_3));
    hair.k_uq_tt = 1.442695
        * (0.4251588 * t_r_3 - 2.780367 + b * (1.878002 - 0.2487656 * t_r_3)
        + e * (0.324415 - 0.1763694 * b - 0.09761561 * t_r_3));
    hair.k_u_tt = 1.442695
        * (0.473161 * t_r_3 - 4.549319
        + b * (2.680015 - 0.4317592 * b - 0.389167 * t_r_3)
        + e * (0.5058711 - 0.2617105 * b - 0.02974871 * e - 0.02273471 * t_r_3));
    float t_tt_3 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_3 * t_tt_3);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / t_2;
    float3 t_tt_4 = material.sigma_a - t_r_3;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3213393 - 0.2331051 * b - 0.03298123 * e) - 3.482702
        - 1.773577 * t_r_3 + b * (1.304724 - 0.3839336 * b - 0.3243981 * t_r_3)
        - 2.0 * t_tt_4));
    float over_v_trt = 1.0 / (t_3 * t_3);
    float scale_trt = 1.442695 * (over_v_trt - 0.3308086 + 0.3677345 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.9348278 * r - 0.4817989);
    hair.k_q_trt = 1.442695
        * (0.1220866 + 0.7102205 * m4_trt - 1.729176 * r - 1.418722 * b
        + 0.2506058 * e);
    hair.k_uq_trt = 1.442695 * (6.325593 + 2.269481 * r - 4.197222 * b);
    hair.k_uu_trt = 1.442695 * (0.2768356 * r - 1.368779 + 0.913686 * b);
    hair.k_u_trt = 1.442695
        * (5.030944 + r * (3.961805 - 1.014872 * r) - 2.691539 * b - 0.3026849 * e);
    float t_trt_3 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_3 * t_trt_3);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / t_3;
    float3 t_trt_4 = -4.0 * t_tt_4;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.8103713 * m4_trt - 2.838551 + r * (0.698553 - 0.8299944 * r)
        - 0.6336235 * b + 0.1447347 * e - 4.87551 * t_r_3 + t_trt_4));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.2015874 - 0.5289548 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.779848 * r - 0.5434128);
    hair.k_q_trt_2 = 1.442695
        * (1.756346 - 0.03763479 * r + e * (0.03740132 + 0.8621255 * r));
    hair.k_uq_trt_2 = 1.442695 * (2.887308 + r * (0.166621 - 105.8083 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (158.1217 - 480.7456 * r) - 13.39011 - 0.7843353 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (16.83079 + 65.50121 * r) - 1.010574 + e * (28.34889 * r - 5.030809));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.35369 * t_r_3 - 4.350656 + r * (2.051262 - 0.2740953 * t_r_3) + t_trt_4));
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
        * max(max(0.9339232 + hair.slope_r * t, hair.slope_r_2 * t - 1.626727),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.52011704 * P);
    return T_2 * rsqrt(square_size)
        * exp2(hair.k_tilt_r + hair.k_square_r * square
        + hair.k_x * sqrt(max(P, 0.0)) + hair.k_q_r * q + hair.k_P * P);
}

// Through the fiber: a factor of M and F at grazing, and one exponential for each
// color, a polynomial in cos phi and q less square/(2 v) of M.
float3 hair_TT(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o,
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
    float rise = Y * rsqrt(square_rise);
    return rise * hair.K_tt
        * exp2(hair.k_tilt_tt + hair.k_square_tt * square
        + q * q * (hair.k_qq_tt + hair.k_qqq * q)
        + cos_phi * cos_phi
        * (hair.k_uu_tt + hair.k_uuq * q + cos_phi * (hair.k_uuu + hair.k_uuuq * q))
        + q * hair.k_q_tt + cos_phi * (hair.k_u_tt + q * hair.k_uq_tt));
}

// Reflected inside: a factor as that of TT, and one or two exponentials of polynomials
// in cos phi - 1 and q less square/(2 v), for all colors.
float3 hair_TRT(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o,
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
    float rise = Y * rsqrt(square_rise);
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
float3 hair_bsdf_hoisted(HairConstants hair, float3 L, float3 V, float3 T) {
    float sin_i = dot(T, L);
    float sin_o = dot(T, V);
    float cos_io = dot(L, V);
    float square_i = max(1.0 - sin_i * sin_i, 1e-12);
    float over_i = rsqrt(square_i);
    float cos_i = square_i * over_i;
    float square_o = max(1.0 - sin_o * sin_o, 1e-12);
    float over_o = rsqrt(square_o);
    float cos_o = square_o * over_o;
    float along = sin_i * sin_o;
    float cos_phi = clamp((cos_io - along) * over_i * over_o, -1.0, 1.0);
    return hair_R(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_TT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_TRT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi);
}

// L towards the light, V towards the eye, T along the fiber: unit.
float3 hair_bsdf(HairMaterial material, float3 L, float3 V, float3 T) {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
