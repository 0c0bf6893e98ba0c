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
// R + TT + TRT is off by 0.01576 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.02181; 0.01409 on fibers that
// nothing was fitted to, at most 0.01861. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.02444, 0.00227
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
    float beta_n = n - 0.0173189;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + 0.3349415 * beta_n2;
    hair.kP = 1.00001 + 1.0899028 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.07616329, 1e-05);
    float t_r = cos_tilt * over_v;
    hair.slope_r = 2.660041 * t_r;
    hair.slope_r_2 = 7.117943 * t_r;
    hair.slope_r_3 = 5.271912 * t_r;
    float n2 = n * n;
    float b = 4.0 * n2;
    hair.offset = 0.1389833 * b;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m = clamp(2.0 * t_2, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    float t_tt_2 = 0.4441722 - 0.1121949 * m4 - 0.006187551 * b + 0.009473056 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_tt_3 = -0.129688 * m4 - 0.02019231 + 0.01268285 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    float t_trt_2 = 0.1875739 - 0.06498642 * m4_trt - 0.02644084 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    float t_trt_3 = 0.08106777 + 0.4253028 * m4_trt - 0.00411927 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2930459 * b - 2.024604 + 0.06234046 * e);
    float m_r = clamp(material.beta_m, 0.09, 0.49);
    float m4_r = 4.0 * (m_r * m_r);
    hair.k_q_r = 1.442695 * (-0.01198142 * m4_r + 0.08932354 * b);
    hair.k_P = 1.442695 * (0.4204781 - 0.1136672 * b + 0.02057377 * e);
    float t_r_2 = sin(0.5 * t);
    float less = 2.0 * (t_r_2 * t_r_2);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_tilt_r = k_tilt - 2.3976884 + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.05266014 + m4 * (0.496194 - 0.5549781 * m4));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.0922647 - 0.06907443 * m4);
    hair.k_qq_tt = 1.442695
        * (0.06856834 * m4 - 0.1924537 + 0.03103102 * b + 0.008251579 * e);
    hair.k_uuq = 1.442695 * (b * (1.230316 + 0.3213326 * b) - 1.786389);
    hair.k_uuuq = 1.442695 * (0.7728875 * b - 0.781182);
    hair.k_uuu = 1.442695 * (0.5783162 * b - 1.045047);
    hair.k_uu_tt = 1.442695 * (1.65753 * b - 2.778309 + 0.09121322 * e);
    vec3 t_r_3 = min(material.sigma_a, vec3(1.15));
    hair.k_q_tt = 1.442695
        * (0.7416239 * t_r_3 - 1.411358
        + b * (1.29948 - 0.3164097 * b - 0.2773488 * t_r_3)
        + e * (0.2877992 - 0.143763 * b - 0.1522802 * t_r_3));
    hair.k_uq_tt = 1.442695
        * (0.4448393 * t_r_3 - 2.786405 + b * (1.876892 - 0.2738975 * t_r_3)
        + e * (0.3155175 - 0.141261 * b - 0.1077507 * t_r_3));
    hair.k_u_tt = 1.442695
        * (0.4772516 * t_r_3 - 4.537704
        + b * (2.680925 - 0.4644547 * b - 0.3763931 * t_r_3)
        + e * (0.5249351 - 0.2724013 * b - 0.02871551 * e - 0.02299291 * t_r_3));
    float t_tt_4 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    vec3 t_tt_5 = material.sigma_a - t_r_3;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3301181 - 0.2409462 * b - 0.03262938 * e) - 3.4901
        - 1.769108 * t_r_3 + b * (1.340663 - 0.412975 * b - 0.3136846 * t_r_3)
        - 2.0 * t_tt_5));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2075388 + 0.5123832 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.5196805 * r - 0.6336828);
    hair.k_q_trt = 1.442695
        * (0.7010012 * m4_trt - 0.1599284 - 1.148954 * r - 1.07226 * b + 0.224619 * e);
    hair.k_uq_trt = 1.442695 * (4.966842 + 4.833144 * r - 3.152224 * b);
    hair.k_uu_trt = 1.442695 * (0.2383778 * r - 1.318363 + 0.7119805 * b);
    hair.k_u_trt = 1.442695
        * (4.826408 + r * (3.856972 + 0.3907177 * r) - 2.576558 * b - 0.2594113 * e);
    float t_trt_4 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    vec3 t_trt_5 = -4.0 * t_tt_5;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.7975683 * m4_trt - 2.859699 + r * (0.7132258 - 0.6973677 * r)
        - 0.6478227 * b + 0.1337273 * e - 4.876438 * t_r_3 + t_trt_5));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.1189921 - 0.5238097 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.772293 * r - 0.544887);
    hair.k_q_trt_2 = 1.442695
        * (1.727565 - 0.001429565 * r + e * (0.04984926 + 0.8601981 * r));
    hair.k_uq_trt_2 = 1.442695 * (2.131292 + r * (5.027881 - 115.7801 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (190.5256 - 546.8654 * r) - 16.98222 - 0.7933235 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (12.0479 + 72.93129 * r) - 0.1836476 + e * (29.58494 * r - 5.273264));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.394507 * t_r_3 - 4.402579 + r * (2.081444 - 0.1838043 * t_r_3)
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
        * max(max(1.160044 + hair.slope_r * t, hair.slope_r_2 * t - 1.97498),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.44706354 * P);
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
