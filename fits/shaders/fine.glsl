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
// R + TT + TRT is off by 0.01262 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.01891; 0.01115 on fibers that
// nothing was fitted to, at most 0.01321. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.02471, 0.005488
// below max(1, exact) at the most.
// hair_bsdf_hoisted takes 12 special operations (exp, rsqrt, ...) and 133
// others in the code of a GPU, sm_86, a fused multiply-add as one; 12 and
// 205 in SPIR-V, nothing fused.
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
    vec3 k_qq_tt;
    vec3 k_q_tt;
    vec3 k_uq_tt;
    vec3 k_uu_tt;
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
    float n2 = n * n;
    float b = 4.0 * n2;
    float t_r = 0.5795086 + 0.08189466 * b;
    float beta_n = n - 0.007850412;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 1.2697482 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.005917674, 1e-05);
    float t_r_2 = cos_tilt * over_v;
    hair.slope_r = 2.29701 * t_r_2;
    hair.slope_r_2 = 6.277528 * t_r_2;
    float m = clamp(material.beta_m, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    hair.slope_r_3 = (4.614109 - 0.3889932 * (m4 * m4)) * t_r_2;
    hair.offset = 0.2697037 * m4;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    float m4_tt = 4.0 * (m_tt * m_tt);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    float t_tt_2 = 0.4396182 - 0.1170789 * m4_tt - 0.01056449 * b + 0.005512732 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_tt_3 = -0.1283475 * m4_tt - 0.01833169 + 0.006837561 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    float t_trt_2 = 0.1945672 - 0.06982152 * m4_trt - 0.0249188 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    float t_trt_3 = 0.07691289 + 0.4421957 * m4_trt - 0.005561792 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2470547 * b - 2.023896 + 0.03700953 * e);
    hair.k_u_r = 0.06302438 * b;
    hair.k_q_r = 1.442695 * (0.2484877 * b - 0.000321661 * e * b);
    hair.k_PP = 1.442695 * (0.01002634 - 0.006063678 * e);
    hair.k_P = 1.442695 * (0.2871238 - 0.1445222 * b + 0.0670517 * e);
    float k_1 = 1.442695 * (0.1471017 * b - 1.727477 - 0.01076271 * e * b);
    float t_r_3 = sin(0.5 * t);
    float less = 2.0 * (t_r_3 * t_r_3);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt - 0.4283617 + m4_tt * (2.530858 - 2.092063 * m4_tt));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09543684 - 0.06478382 * m4_tt);
    hair.k_uqq = 1.442695 * (0.146061 * b - 0.05560903);
    hair.k_uuq = 1.442695
        * (b * (3.912274 - 2.059276 * b) - 2.026243 + 0.005719695 * (e * e));
    hair.k_uuuq = 1.442695 * (b * (1.964385 - 1.076578 * b) - 0.8796664);
    hair.k_uuu = 1.442695 * (b * (2.040718 - 1.211855 * b) - 1.272328);
    vec3 t_r_4 = min(material.sigma_a, vec3(1.15));
    hair.k_qq_tt = 1.442695
        * (0.06540268 * m4_tt - 0.2346678 + 0.1422927 * b + 0.01162089 * e
        - 0.07772095 * t_r_4);
    hair.k_q_tt = 1.442695
        * (0.7037316 * t_r_4 - 1.406942
        + b * (1.602277 - 0.6449768 * b - 0.2726668 * t_r_4)
        + e * (0.2979114 - 0.1625881 * b - 0.0170338 * e - 0.1582594 * t_r_4));
    hair.k_uq_tt = 1.442695
        * (0.3598916 * t_r_4 - 2.919562
        + b * (3.661349 - 1.632932 * b - 0.2839531 * t_r_4)
        + e * (0.3305548 - 0.165744 * b - 0.1134917 * t_r_4));
    hair.k_uu_tt = 1.442695
        * (-0.3311291 * t_r_4 - 3.130415
        + b * (4.506592 - 2.572142 * b + 0.5699995 * t_r_4)
        + e * (0.0610519 + 0.02445542 * t_r_4));
    hair.k_u_tt = 1.442695
        * (e * (0.4810667 - 0.2713661 * b - 0.0607481 * e) - 4.632871
        + b * (4.263073 - 2.101929 * b + 0.514823 * t_r_4));
    float t_tt_4 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    vec3 t_tt_5 = material.sigma_a - t_r_4;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.314536 - 0.243788 * b - 0.0540458 * e) - 3.468002
        - 1.904719 * t_r_4 + b * (1.535772 + b * (-0.005081812 * t_r_4 - 0.684537))
        - 2.0 * t_tt_5));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2197464 + 0.5334085 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.5027286 * r - 0.6043915);
    hair.k_q_trt = 1.442695
        * (0.6766885 * m4_trt - 0.1516209 - 1.072285 * r - 1.009986 * b
        + 0.2270408 * e);
    hair.k_uq_trt = 1.442695 * (5.20089 + 4.876989 * r - 3.58327 * b);
    hair.k_uu_trt = 1.442695 * (0.1059534 * r - 1.238991 + 0.6469104 * b);
    hair.k_u_trt = 1.442695
        * (4.242497 + r * (6.044214 - 1.074879 * r) - 2.424301 * b - 0.2955647 * e);
    float t_trt_4 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    vec3 t_trt_5 = -4.0 * t_tt_5;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.7968398 * m4_trt - 2.936562 + r * (0.9568584 - 0.8503967 * r)
        - 0.5643704 * b + 0.1323583 * e - 4.856318 * t_r_4 + t_trt_5));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.1589149 - 0.5809225 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.769346 * r - 0.5725835);
    hair.k_q_trt_2 = 1.442695
        * (1.790454 - 0.06148194 * r + e * (0.05805872 + 0.8539056 * r));
    hair.k_uq_trt_2 = 1.442695 * (2.768116 + r * (2.370767 - 116.293 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (199.9868 - 567.9435 * r) - 17.89926 - 1.208133 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (11.5163 + 75.27749 * r) - 0.1893976 + e * (30.26086 * r - 5.49619));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.346944 * t_r_4 - 4.495041 + r * (2.18128 - 0.235132 * t_r_4) + t_trt_5));
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
        * max(max(1.01974 + hair.slope_r * t, hair.slope_r_2 * t - 1.776015),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.093156256 * P);
    return T_2 * inversesqrt(square_size)
        * exp2(hair.k_1 + hair.k_square_r * square + hair.k_x * sqrt(max(P, 0.0))
        + hair.k_u_r * cos_phi + hair.k_q_r * q + P * (hair.k_P + hair.k_PP * P));
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
