// Hair of three exponentials and a root per lobe: R + TT + TRT.
// Form: exponentials of polynomials in cos phi and q = cos 2 theta_d. Y is
// 4 cos^2 theta_d, chord that between the directions of the cone and theta_o, X the
// same without tilt. Fitted to S over both directions; absorption along the path of
// light, 1/cos theta_t.
// Domain: eta 1.45 to 1.65, beta_m 0.09 to 0.49, beta_n 0.05 to 0.49, sigma_a 0.0 to 1.15.
// Beyond it the polynomials are those of the nearest fiber; M follows beta_m.
// Constants: fits/tiers.py.
//
// L points towards the light, V towards the eye, T along the fiber: unit vectors.
// hair_bsdf returns what one light adds per unit of its irradiance across L, per
// steradian: S cos(theta). Do not multiply by the cosine of an inclination again.
// R + TT + TRT is off by 0.021 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.03074; 0.01862 on other fibers, at
// most 0.02136. Furnace: the albedo of a clear fiber is off by at most 0.03073,
// tilts to 2.5 degrees; above max(1, exact) by -0.00439.
// hair_bsdf_hoisted takes 10 special operations (exp, rsqrt, ...) and 105
// others in the code of a GPU, sm_86, a fused multiply-add as one; 10 and
// 160 in SPIR-V, nothing fused.
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
    float tan_tilt_tt;
    float tan_tilt_tt_2;
    float k_near_tt;
    float flat_tt;
    float tan_tilt_trt;
    float tan_tilt_trt_2;
    float k_near_trt;
    float flat_trt;
    float slope_r;
    float slope_r_2;
    float offset;
    float kF;
    float k_chord_r;
    float k_PP;
    float k_P;
    float k_1;
    float k_chord_tt;
    float k_qqq;
    float k_qq;
    float k_uuq;
    float k_uuuq;
    float k_uuu;
    float k_uu;
    float3 k_q_tt;
    float3 k_uq_tt;
    float3 k_u_tt;
    float k_tilt_tt;
    float3 K_tt;
    float k_chord_trt;
    float k_q_trt;
    float k_uq_trt;
    float k_u_trt;
    float k_tilt_trt;
    float3 K_trt;
};

HairConstants hair_constants(HairMaterial material) {
    HairConstants hair;
    float t = 2.0 * material.alpha;
    float cos_tilt = cos(t);
    hair.tan_tilt_r = sin(t) / cos_tilt;
    hair.tan_tilt_r_2 = 2.0 * hair.tan_tilt_r;
    float n = clamp(material.beta_n, 0.05, 0.49);
    float n2 = n * n;
    float b = 4.0 * n2;
    float t_r = 0.4028085 + 0.1415609 * b;
    float beta_n = n + 0.06300065;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 0.70239115 * beta_n2;
    float t_2 = -material.alpha;
    float cos_tilt_tt = cos(t_2);
    hair.tan_tilt_tt = sin(t_2) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_3 = 0.5 * material.beta_m;
    float m = clamp(2.0 * t_3, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    hair.k_near_tt = 0.1767637 - 0.06557242 * m4 - 0.008299997 * b - 0.009222445 * e;
    float t_tt = 0.01051801 + 0.1162085 * m4 + 0.009695475 * b;
    hair.flat_tt = t_tt * t_tt + 1e-05;
    float t_4 = -4.0 * material.alpha;
    float cos_tilt_trt = cos(t_4);
    hair.tan_tilt_trt = sin(t_4) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_5 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_5, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    hair.k_near_trt = 0.07469901 + 0.03767948 * m4_trt - 0.1035907 * b;
    float t_trt = 0.05122377 + 0.7080903 * m4_trt + 0.01590899 * b;
    hair.flat_trt = t_trt * t_trt + 1e-05;
    float m_r = clamp(material.beta_m, 0.09, 0.49);
    float m4_r = 4.0 * (m_r * m_r);
    float over_v = max(1.0 / (material.beta_m * material.beta_m) - 0.02039933, 1e-05);
    float t_r_2 = cos_tilt * over_v;
    hair.slope_r = (2.133746 - 0.01592209 * m4_r) * t_r_2;
    hair.slope_r_2 = (4.606529 + m4_r * (0.07375086 * m4_r - 1.075683)) * t_r_2;
    hair.offset = 0.9740579 * m4_r - 0.9719761;
    float t_r_3 = 3.550113 - 0.6638526 * b;
    hair.kF = t_r_3 * t_r_3;
    float scale = 1.442695 * over_v;
    hair.k_chord_r = -0.5 * scale * cos_tilt;
    hair.k_PP = 1.442695 * (0.03455602 - 0.008644856 * b - 0.01049166 * e);
    hair.k_P = 1.442695 * (0.05059768 * b - 0.3505979 + 0.1071406 * e);
    float k_1 = 1.442695
        * (m4_r * (0.06387476 * m4_r - 0.07705591) - 2.021131 - 0.1411209 * (b * b));
    float t_r_4 = sin(0.5 * t);
    float less = 2.0 * (t_r_4 * t_r_4);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    float v = t_3 * t_3;
    float scale_tt = 1.442695
        * (1.0 / v + 0.06175565 + m4 * (0.1086659 * m4 - 0.239718));
    hair.k_chord_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.08819346 - 0.07757014 * m4);
    hair.k_qq = 1.442695
        * (0.06951042 * m4 - 0.1960938 + 0.04562963 * b + 0.002198294 * e);
    hair.k_uuq = 1.442695 * (b * (1.398864 + 0.2241791 * b) - 1.719301);
    hair.k_uuuq = 1.442695 * (0.7370233 * b - 0.7151679);
    hair.k_uuu = 1.442695 * (0.7293518 * b - 1.068635);
    hair.k_uu = 1.442695 * (1.868521 * b - 2.80964 + 0.06962299 * e);
    float3 t_r_5 = min(material.sigma_a, (float3)1.15);
    hair.k_q_tt = 1.442695
        * (0.7396856 * t_r_5 - 1.376812
        + b * (1.182164 - 0.2158675 * b - 0.2806183 * t_r_5)
        + e * (0.3079882 - 0.1873648 * b - 0.1419995 * t_r_5));
    hair.k_uq_tt = 1.442695
        * (0.4189279 * t_r_5 - 2.751649 + b * (1.973073 - 0.3129806 * t_r_5)
        + e * (0.3334953 - 0.2017671 * b - 0.09312708 * t_r_5));
    hair.k_u_tt = 1.442695
        * (0.3726851 * t_r_5 - 4.462699
        + b * (2.501204 - 0.2848295 * b - 0.2538131 * t_r_5)
        + e * (0.4462497 - 0.2083232 * b - 0.04548706 * e - 0.03162454 * t_r_5));
    float t_tt_2 = sin(-0.5 * material.alpha);
    float less_tt = 2.0 * (t_tt_2 * t_tt_2);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float3 t_tt_3 = material.sigma_a - t_r_5;
    hair.K_tt = rsqrt(6.2831855 * v)
        * exp2(1.442695
        * (e * (0.2678549 - 0.1899319 * b - 0.03820941 * e) - 3.428533
        - 1.87644 * t_r_5 + b * (1.138493 - 0.2629557 * b - 0.2240339 * t_r_5)
        - 2.0 * t_tt_3));
    float v_trt = t_5 * t_5;
    float scale_trt = 1.442695 * (1.0 / v_trt + 0.1920892 - 0.3717029 * m4_trt);
    hair.k_chord_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_q_trt = 1.442695
        * (-0.1454802 * m4_trt - 0.0004160824 + 0.2736819 * r + 0.1440689 * e);
    hair.k_uq_trt = 1.442695 * (r * (18.57322 - 5.99022 * r) - 1.527495);
    hair.k_u_trt = 1.442695 * (0.4573359 + r * (15.4122 - 4.370121 * r));
    float t_trt_2 = sin(0.5 * t_4);
    float less_trt = 2.0 * (t_trt_2 * t_trt_2);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    hair.K_trt = rsqrt(6.2831855 * v_trt)
        * exp2(1.442695
        * (0.6832372 * m4_trt - 2.635823 + 0.3484531 * r - 0.4626901 * b
        + 0.1203657 * e - 4.07358 * t_r_5 - 4.0 * t_tt_3));
    return hair;
}

// Reflected: T = cos phi + kT and P = Y (cos phi + kP) are about 2 cos^2(phi/2) and 8
// cos^2(phi/2) cos^2 theta_d; the largest of the lines is that of I0 in M. One
// exponential for F, N and M.
float hair_R(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o,
    float cos_phi) {
    float cc = cos_i * cos_o;
    float sc = sin_i * cos_o;
    float both = sin_i + sin_o;
    float apart = cos_i - cos_o;
    float together = cos_i + cos_o;
    float square_both = both * both;
    float X = square_both + apart * apart;
    float Y = square_both + together * together;
    float turned = sc + sin_o * cos_i;
    float a = cc + hair.tan_tilt_r * sc;
    float chord = X - hair.tan_tilt_r_2 * turned - 4.0 * max(-a, 0.0);
    float T_2 = cos_phi + hair.kT;
    float P = Y * (cos_phi + hair.kP);
    float t = abs(a);
    return T_2
        * rsqrt(T_2
        * max(0.7259547 + hair.slope_r * t, hair.offset + hair.slope_r_2 * t)
        * (1.0 + hair.kF * P))
        * exp2(hair.k_1 + hair.k_chord_r * chord + P * (hair.k_P + hair.k_PP * P));
}

// Through the fiber: a factor of M and F at grazing, and one exponential for each
// color, a polynomial in cos phi and q less M's chord^2/(2 v).
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
    float chord = X - hair.tan_tilt_tt_2 * turned - 4.0 * max(-a, 0.0);
    float near = Y + hair.k_near_tt;
    float rise = Y * rsqrt(near * near * (abs(a) + hair.flat_tt));
    return rise * hair.K_tt
        * exp2(hair.k_tilt_tt + hair.k_chord_tt * chord
        + q * q * (hair.k_qq + hair.k_qqq * q)
        + cos_phi * cos_phi
        * (hair.k_uu + hair.k_uuq * q + cos_phi * (hair.k_uuu + hair.k_uuuq * q))
        + q * hair.k_q_tt + cos_phi * (hair.k_u_tt + q * hair.k_uq_tt));
}

// Reflected inside: a factor as that of TT, and exponentials of polynomials in cos phi
// - 1 and q less chord^2/(2 v), for all colors.
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
    float chord = X - hair.tan_tilt_trt_2 * turned - 4.0 * max(-a, 0.0);
    float near = Y + hair.k_near_trt;
    float rise = Y * rsqrt(near * near * (abs(a) + hair.flat_trt));
    float u = cos_phi - 1.0;
    return rise
        * exp2(hair.k_tilt_trt + hair.k_chord_trt * chord + hair.k_q_trt * q
        + u * (hair.k_u_trt + hair.k_uq_trt * q)) * hair.K_trt;
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
