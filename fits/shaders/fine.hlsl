// Hair of exponentials of longer polynomials: R + TT + TRT.
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
// R + TT + TRT is off by 0.0128 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.01917; 0.01139 on fibers that
// nothing was fitted to, at most 0.01328. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.02493, 0.005499
// below max(1, exact) at the most.
// hair_bsdf_hoisted takes 12 special operations (exp, rsqrt, ...) and 133
// others in the code of a GPU, sm_86, a fused multiply-add as one; 12 and
// 205 in SPIR-V, nothing fused.
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
    float k_u_r;
    float k_q_r;
    float k_PP;
    float k_P;
    float k_1;
    float k_square_tt;
    float k_qqq;
    float k_uqq;
    float k_uuq;
    float k_uuuq;
    float k_uuu;
    float3 k_qq_tt;
    float3 k_q_tt;
    float3 k_uq_tt;
    float3 k_uu_tt;
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
    float n2 = n * n;
    float b = 4.0 * n2;
    float t_r = 0.596616 + 0.0729865 * b;
    float beta_n = n - 0.01253075;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 1.3136415 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.007277476, 1e-05);
    float t_r_2 = cos_tilt * over_v;
    hair.slope_r = 2.265655 * t_r_2;
    hair.slope_r_2 = 6.182125 * t_r_2;
    float m = clamp(material.beta_m, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    hair.slope_r_3 = (4.544527 - 0.3644129 * (m4 * m4)) * t_r_2;
    hair.offset = 0.2575126 * m4;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    float m4_tt = 4.0 * (m_tt * m_tt);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    float t_tt_2 = 0.4390485 - 0.1165322 * m4_tt - 0.01056473 * b + 0.006416138 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_tt_3 = -0.1282287 * m4_tt - 0.01817608 + 0.006489261 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    float t_trt_2 = 0.1870379 - 0.07109288 * m4_trt - 0.01650684 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    float t_trt_3 = -0.4364496 * m4_trt - 0.07737395 + 0.005674146 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2491191 * b - 2.024348 + 0.0365631 * e);
    hair.k_u_r = 0.06320619 * b;
    hair.k_q_r = 1.442695 * (0.2534584 * b - 0.001016988 * e * b);
    hair.k_PP = 1.442695 * (0.01025851 - 0.006056934 * e);
    hair.k_P = 1.442695 * (0.2829859 - 0.1464305 * b + 0.06722132 * e);
    float k_1 = 1.442695 * (0.1520318 * b - 1.735212 - 0.01135865 * e * b);
    float t_r_3 = sin(0.5 * t);
    float less = 2.0 * (t_r_3 * t_r_3);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.09778519 + m4_tt * (0.4335814 - 0.4757962 * m4_tt));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09674595 - 0.06590042 * m4_tt);
    hair.k_uqq = 1.442695 * (0.1492735 * b - 0.0564552);
    hair.k_uuq = 1.442695
        * (b * (5.05847 - 3.057348 * b) - 2.231547 + 0.001749367 * (e * e));
    hair.k_uuuq = 1.442695 * (b * (2.608781 - 1.649553 * b) - 0.9892312);
    hair.k_uuu = 1.442695 * (b * (2.439153 - 1.562538 * b) - 1.337498);
    float3 t_r_4 = min(material.sigma_a, (float3)1.15);
    hair.k_qq_tt = 1.442695
        * (0.06657564 * m4_tt - 0.2363708 + 0.1454849 * b + 0.01420011 * e
        - 0.07825364 * t_r_4);
    hair.k_q_tt = 1.442695
        * (0.7032072 * t_r_4 - 1.4208
        + b * (1.633238 - 0.6624888 * b - 0.274864 * t_r_4)
        + e * (0.2949296 - 0.1573615 * b - 0.01432322 * e - 0.1578016 * t_r_4));
    hair.k_uq_tt = 1.442695
        * (0.3591468 * t_r_4 - 3.029414
        + b * (4.190958 - 2.072516 * b - 0.2855564 * t_r_4)
        + e * (0.3280463 - 0.1596059 * b - 0.1111318 * t_r_4));
    hair.k_uu_tt = 1.442695
        * (-0.3288975 * t_r_4 - 3.250589
        + b * (5.151585 - 3.122548 * b + 0.5669136 * t_r_4)
        + e * (0.06358811 + 0.02496354 * t_r_4));
    hair.k_u_tt = 1.442695
        * (e * (0.4811064 - 0.2655104 * b - 0.05791885 * e) - 4.695472
        + b * (4.510947 - 2.297253 * b + 0.5179766 * t_r_4));
    float t_tt_4 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    float3 t_tt_5 = material.sigma_a - t_r_4;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3123681 - 0.2392955 * b - 0.05089965 * e) - 3.475194
        - 1.906037 * t_r_4 + b * (1.529156 + b * (0.0001220842 * t_r_4 - 0.6719298))
        - 2.0 * t_tt_5));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2088829 + 0.5419959 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.5905557 * r - 0.5975275);
    hair.k_q_trt = 1.442695
        * (0.6969396 * m4_trt - 0.1749641 - 1.118549 * r - 0.998495 * b
        + 0.2298286 * e);
    hair.k_uq_trt = 1.442695 * (3.881717 + 6.31087 * r - 2.430146 * b);
    hair.k_uu_trt = 1.442695 * (-0.1611836 * r - 1.012019 + 0.4346595 * b);
    hair.k_u_trt = 1.442695
        * (4.426536 + r * (4.161178 + 0.7711023 * r) - 2.34354 * b - 0.29759 * e);
    float t_trt_4 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    float3 t_trt_5 = -4.0 * t_tt_5;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.7985971 * m4_trt - 2.724125 + r * (0.3692576 - 0.4761311 * r)
        - 0.7066634 * b + 0.1336967 * e - 4.855103 * t_r_4 + t_trt_5));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.1208095 - 0.5404607 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.599241 * r - 0.6438992);
    hair.k_q_trt_2 = 1.442695
        * (1.765839 - 0.01176545 * r + e * (0.08223132 + 0.7861515 * r));
    hair.k_uq_trt_2 = 1.442695 * (8.68636 + r * (-56.1697 * r - 44.30706));
    hair.k_uu_trt_2 = 1.442695
        * (22.73331 + r * (-145.8878 * r - 110.3122) - 0.4157005 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (29.18851 + 53.97171 * r) - 2.660715 + e * (27.18454 * r - 4.350742));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.360246 * t_r_4 - 4.450132 + r * (2.118819 - 0.2297699 * t_r_4)
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
        * max(max(1.004214 + hair.slope_r * t, hair.slope_r_2 * t - 1.743208),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.08367823 * P);
    return T_2 * rsqrt(square_size)
        * exp2(hair.k_1 + hair.k_square_r * square + hair.k_x * sqrt(max(P, 0.0))
        + hair.k_u_r * cos_phi + hair.k_q_r * q + P * (hair.k_P + hair.k_PP * P));
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
    float q2 = q * q;
    return rise * hair.K_tt
        * exp2(hair.k_tilt_tt + hair.k_square_tt * square + hair.k_qqq * (q2 * q)
        + cos_phi
        * (hair.k_uqq * q2
        + cos_phi * (hair.k_uuq * q + cos_phi * (hair.k_uuu + hair.k_uuuq * q)))
        + q * (hair.k_q_tt + q * hair.k_qq_tt)
        + cos_phi * (hair.k_u_tt + q * hair.k_uq_tt + cos_phi * hair.k_uu_tt));
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
