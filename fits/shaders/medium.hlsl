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
// R + TT + TRT is off by 0.01573 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.02193; 0.01476 on other fibers, at
// most 0.02006. Furnace, the same beta and beta_n .05, eta 1.55, tilts to
// 2.5 degrees: albedo off by at most 0.02402, 0.002892 below max(1, exact) at the most.
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
    float beta_n = n - 0.01376115;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + 0.3024827 * beta_n2;
    hair.kP = 1.00001 + 0.9754985 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.05916308, 1e-05);
    float t_r = cos_tilt * over_v;
    hair.slope_r = 2.604743 * t_r;
    hair.slope_r_2 = 6.963426 * t_r;
    hair.slope_r_3 = 5.142012 * t_r;
    float n2 = n * n;
    float b = 4.0 * n2;
    hair.offset = 0.08946164 * b;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m = clamp(2.0 * t_2, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    hair.k_near_tt = 0.1986775 - 0.07947065 * m4 - 0.009886225 * b + 0.00761752 * e;
    float t_tt_2 = -0.1314877 * m4 - 0.01926589 + 0.01244582 * b;
    hair.flat_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    hair.k_near_trt = 0.03306103 - 0.04587922 * m4_trt + 0.01677672 * b;
    float t_trt_2 = 0.0788071 + 0.4722171 * m4_trt - 0.01569421 * b;
    hair.flat_trt = t_trt_2 * t_trt_2 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2445709 * b - 2.032492 + 0.06511939 * e);
    float m_r = clamp(material.beta_m, 0.09, 0.49);
    float m4_r = 4.0 * (m_r * m_r);
    hair.k_q_r = 1.442695 * (-0.01402879 * m4_r + 0.07752983 * b);
    hair.k_P = 1.442695 * (0.4143583 - 0.09248688 * b + 0.01991673 * e);
    float t_r_2 = sin(0.5 * t);
    float less = 2.0 * (t_r_2 * t_r_2);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_tilt_r = k_tilt - 2.4200373 + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.05156944 + m4 * (0.09015499 * m4 - 0.1958052));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09239057 - 0.08152107 * m4);
    hair.k_qq_tt = 1.442695
        * (0.07876807 * m4 - 0.1887191 + 0.02555187 * b + 0.009310307 * e);
    hair.k_uuq = 1.442695 * (b * (1.367544 + 0.3072427 * b) - 1.7756);
    hair.k_uuuq = 1.442695 * (0.8739176 * b - 0.7821446);
    hair.k_uuu = 1.442695 * (0.7787087 * b - 1.212459);
    hair.k_uu_tt = 1.442695 * (1.957012 * b - 3.021177 + 0.07446291 * e);
    float3 t_r_3 = min(material.sigma_a, (float3)1.15);
    hair.k_q_tt = 1.442695
        * (0.7484552 * t_r_3 - 1.400271
        + b * (1.272985 - 0.3053263 * b - 0.2761524 * t_r_3)
        + e * (0.3099827 - 0.1867148 * b - 0.164559 * t_r_3));
    hair.k_uq_tt = 1.442695
        * (0.4531509 * t_r_3 - 2.759111 + b * (1.879805 - 0.2736681 * t_r_3)
        + e * (0.3461986 - 0.2031051 * b - 0.122272 * t_r_3));
    hair.k_u_tt = 1.442695
        * (0.4300852 * t_r_3 - 4.581063
        + b * (2.643438 - 0.3537763 * b - 0.323248 * t_r_3)
        + e * (0.4878615 - 0.2413113 * b - 0.03367111 * e - 0.02448719 * t_r_3));
    float t_tt_3 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_3 * t_tt_3);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    float3 t_tt_4 = material.sigma_a - t_r_3;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3115036 - 0.2180688 * b - 0.03630553 * e) - 3.458183
        - 1.808628 * t_r_3 + b * (1.2175 - 0.3169095 * b - 0.2697386 * t_r_3)
        - 2.0 * t_tt_4));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2845976 + 0.4814196 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.5292037 * r - 0.5828771);
    hair.k_q_trt = 1.442695
        * (0.7826566 * m4_trt - 0.1761447 - 1.165068 * r - 1.081355 * b
        + 0.2484418 * e);
    hair.k_uq_trt = 1.442695 * (4.988277 + 4.440898 * r - 3.030021 * b);
    hair.k_uu_trt = 1.442695 * (-0.1280535 * r - 1.260585 + 0.7778429 * b);
    hair.k_u_trt = 1.442695
        * (5.106896 + r * (2.576824 + 0.9963366 * r) - 2.530974 * b - 0.3402806 * e);
    float t_trt_3 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_3 * t_trt_3);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    float3 t_trt_4 = -4.0 * t_tt_4;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.8165836 * m4_trt - 2.643927 + r * (0.09694014 - 0.3532506 * r)
        - 0.762874 * b + 0.1395163 * e - 4.872649 * t_r_3 + t_trt_4));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.0754012 - 0.4708338 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.589372 * r - 0.669991);
    hair.k_q_trt_2 = 1.442695
        * (1.915865 - 0.3477271 * r + e * (0.9363205 * r - 0.006198183));
    hair.k_uq_trt_2 = 1.442695 * (2.675735 + r * (3.546714 - 115.8904 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (186.5589 - 548.2777 * r) - 16.25259 - 0.5701621 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (12.11941 + 72.55818 * r) - 0.4269903 + e * (28.54871 * r - 4.942771));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.348361 * t_r_3 - 4.50343 + r * (2.261471 - 0.2532883 * t_r_3) + t_trt_4));
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
        * max(max(1.120919 + hair.slope_r * t, hair.slope_r_2 * t - 2.168438),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.38924047 * P);
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
