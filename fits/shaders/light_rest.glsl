// Hair of exponentials, one for TRT: R + TT + TRT.
// Form: exponentials of polynomials in cos phi and q = cos 2 theta_d. Y is
// 4 cos^2 theta_d, X = 2 - 2 cos(theta_i + theta_o), square that of the cone.
// Fitted to S over both directions; absorption follows the path, 1/cos theta_t.
// Domain: eta 1.45 to 1.65, beta_m 0.09 to 0.49, beta_n 0.05 to 0.49, sigma_a 0 to
// 1.15, |alpha| to 2.5 degrees.
// Beyond it the polynomials are those of the nearest fiber; M follows beta_m, to
// 0.8, and alpha, absorption sigma_a.
// Constants: fits/tiers.py.
// With the rest, all lobes above TRT as one. Constants of the rest: fits/tail.py
// in fiberjax, for eta 1.4 to 1.7, beta_m 0.05 to 0.55, sigma_a 0 to 1.2.
//
// L points towards the light, V towards the eye, T along the fiber: unit vectors.
// hair_bsdf returns what one light adds per unit of its irradiance across L, per
// steradian: S cos(theta). Do not multiply by the cosine of an inclination again.
// R + TT + TRT is off by 0.03014 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.04589; 0.02852 on fibers that
// nothing was fitted to, at most 0.0428. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.03198, 0.009551
// below max(1, exact) at the most.
// The rest itself is off by 0.06291 in L2, mean over fibers that nothing was
// fitted to, at most 0.1361; its albedo by at most 0.01166 to 89 degrees.
// hair_bsdf_hoisted takes 12 special operations (exp, rsqrt, ...) and 110
// others in the code of a GPU, sm_86, a fused multiply-add as one; 12 and
// 171 in SPIR-V, nothing fused.
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
    float offset;
    float kF;
    float tan_tilt_tt;
    float tan_tilt_tt_2;
    float k_near_tt;
    float flat_tt;
    float tan_tilt_trt;
    float tan_tilt_trt_2;
    float k_near_trt;
    float flat_trt;
    float q1;
    float q0;
    float c;
    float o;
    float k_square_r;
    float k_PP;
    float k_P;
    float k_1;
    float k_square_tt;
    float k_qq;
    float k_uq_tt;
    float k_uuq;
    float k_uuu;
    float k_uu;
    float k_u_tt;
    vec3 k_q_tt;
    float k_tilt_tt;
    vec3 K_tt;
    float k_square_trt;
    float k_q_trt;
    float k_uq_trt;
    float k_u_trt;
    float k_tilt_trt;
    vec3 K_trt;
    vec3 K1;
    vec3 K0;
    float narrow;
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
    float t_r = 0.1682948 + 0.208484 * b;
    float beta_n = n + 0.2021096;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 0.34764042 * beta_n2;
    float m = clamp(material.beta_m, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.08293843, 1e-05);
    float t_r_2 = cos_tilt * over_v;
    hair.slope_r = (1.612684 - 0.2314041 * m4) * t_r_2;
    hair.slope_r_2 = (3.715234 + m4 * (0.0549443 * m4 - 0.8994488)) * t_r_2;
    hair.offset = 0.7220926 * m4 - 0.7205815;
    float t_r_3 = 3.80106 - 0.1816369 * b;
    hair.kF = t_r_3 * t_r_3;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    float m4_tt = 4.0 * (m_tt * m_tt);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    float t_tt_2 = 0.519575 - 0.1254077 * m4_tt - 0.04739175 * b - 0.002757437 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_tt_3 = 0.01253917 + 0.1139801 * m4_tt + 0.001269197 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    float t_trt_2 = 0.2500525 - 0.06417479 * m4_trt - 0.215042 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    float t_trt_3 = 0.071232 + 0.6605182 * m4_trt - 0.009133246 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    float z = 10.0 * ((material.eta - 1.0) / (material.eta + 1.0) - 0.21568628);
    hair.q1 = exp2(1.1893578 * z - 0.48315856);
    hair.q0 = exp2(1.1795474 * z - 5.221113);
    float beta = t_3;
    float v = beta * beta;
    float u = v / (v + 0.3);
    hair.c = exp2(1.442695 * (-0.04524 * u - 1.832) * u + 2.6514962) / v;
    hair.o = exp2(1.442695 * (-1.501 * u + 1.514) * u - 0.25247163);
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_PP = 1.442695 * (0.02675776 - 0.007209218 * b - 0.01207695 * e);
    hair.k_P = 1.442695 * (0.05198296 * b - 0.292333 + 0.1161786 * e);
    float k_1 = 1.442695
        * (m4 * (0.06874559 - 0.05857935 * m4) - 2.102622 - 0.05883912 * (b * b));
    float t_r_4 = sin(0.5 * t);
    float less = 2.0 * (t_r_4 * t_r_4);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.01727227 + m4_tt * (4.318105 - 4.324023 * m4_tt));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qq = 1.442695
        * (-0.01784703 * m4_tt - 0.07984253 + 0.0175378 * b + 0.01414628 * e);
    hair.k_uq_tt = 1.442695
        * (1.100528 * b - 2.135332 + e * (0.2527311 - 0.113265 * b));
    hair.k_uuq = 1.442695 * (b * (0.3295557 * b - 0.1557623) - 0.519515);
    hair.k_uuu = 1.442695 * (0.5777042 * b - 0.994164);
    hair.k_uu = 1.442695 * (1.589484 * b - 2.614387 + 0.04399148 * e);
    hair.k_u_tt = 1.442695
        * (b * (2.326978 - 0.2941853 * b) - 4.273355
        + e * (0.4059128 - 0.2385784 * b - 0.01865304 * e));
    vec3 t_r_5 = min(material.sigma_a, vec3(1.15));
    hair.k_q_tt = 1.442695
        * (0.3556778 * t_r_5 - 1.303915
        + b * (1.150996 - 0.2995638 * b + 0.002739143 * t_r_5)
        + e * (0.2324941 - 0.1206498 * b - 0.02616528 * t_r_5));
    float t_tt_4 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    vec3 t_tt_5 = material.sigma_a - t_r_5;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.2517921 - 0.2064123 * b - 0.02052502 * e) - 3.336103
        - 2.183416 * t_r_5 + b * (1.100374 - 0.3003412 * b - 0.0006769631 * t_r_5)
        - 2.0 * t_tt_5));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2931307 + 0.1010013 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_q_trt = 1.442695
        * (0.05853233 - 0.1512033 * m4_trt + 0.2223634 * r + 0.1332661 * e);
    hair.k_uq_trt = 1.442695 * (r * (17.0374 - 3.845232 * r) - 0.9611902);
    hair.k_u_trt = 1.442695 * (0.5995087 + r * (14.27247 - 2.464647 * r));
    float t_trt_4 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.6122684 * m4_trt - 2.710374 + 0.413128 * r - 0.3894705 * b
        + 0.1122846 * e - 4.088261 * t_r_5 - 4.0 * t_tt_5));
    float t_rest = tanh(1.0 / v);
    float level = 0.07957747 * (1.0 + t_rest) * exp2(1.1606481 * z - 4.408876)
        / (t_rest * v);
    vec3 less_rest = level
        / (1.0 + exp2(0.030412013 * z + 1.7413329) * material.sigma_a);
    hair.K1 = material.sigma_a * less_rest
        * exp2(-0.5610641 * z + 0.9406372 - 9.029644 * material.sigma_a);
    hair.K0 = less_rest
        * exp2(-1.442695 * exp2(-0.30585134 * z + 2.8940463) * material.sigma_a);
    float narrow = -0.5 / v;
    hair.narrow = 1.442695 * narrow;
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
    float square = X - hair.tan_tilt_r_2 * turned - 4.0 * max(-a, 0.0);
    float T_2 = cos_phi + hair.kT;
    float P = Y * (cos_phi + hair.kP);
    float t = abs(a);
    float square_size = T_2
        * max(0.616815 + hair.slope_r * t, hair.offset + hair.slope_r_2 * t)
        * (1.0 + hair.kF * P);
    return T_2 * inversesqrt(square_size)
        * exp2(hair.k_1 + hair.k_square_r * square + P * (hair.k_P + hair.k_PP * P));
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
        * exp2(hair.k_tilt_tt + hair.k_square_tt * square + hair.k_qq * (q * q)
        + cos_phi
        * (hair.k_u_tt + hair.k_uq_tt * q
        + cos_phi * (hair.k_uu + hair.k_uuq * q + hair.k_uuu * cos_phi))
        + q * hair.k_q_tt);
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
        * exp2(hair.k_tilt_trt + hair.k_square_trt * square + hair.k_q_trt * q
        + u * (hair.k_u_trt + hair.k_uq_trt * q)) * hair.K_trt;
}

// All lobes above TRT, uniform in azimuth: exp(-X/(2 v)) Y rsqrt(Y (q0 + q1 Y + Y^2)^2
// (o + c/v cos theta_i cos theta_o)) (K0 + K1 Y), X = 2 - 2 cos(theta_i + theta_o), Y =
// 4 cos^2 theta_d.
vec3 hair_rest(HairConstants hair, float sin_i, float sin_o, float cos_i, float cos_o) {
    float both = sin_i + sin_o;
    float apart = cos_i - cos_o;
    float together = cos_i + cos_o;
    float square_both = both * both;
    float X = square_both + apart * apart;
    float Y = square_both + together * together;
    float quadratic = hair.q0 + Y * (hair.q1 + Y);
    float across = cos_i * cos_o;
    float square = Y * (hair.o + hair.c * across) * (quadratic * quadratic);
    return Y * inversesqrt(square) * exp2(hair.narrow * X) * (hair.K0 + Y * hair.K1);
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
        + hair_TRT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_rest(hair, sin_i, sin_o, cos_i, cos_o);
}

// L towards the light, V towards the eye, T along the fiber: unit.
vec3 hair_bsdf(HairMaterial material, vec3 L, vec3 V, vec3 T) {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
