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
// R + TT + TRT is off by 0.01278 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.01875; 0.01157 on other fibers, at
// most 0.01409. Furnace, the same beta and beta_n .05, eta 1.55, tilts to
// 2.5 degrees: albedo off by at most 0.02552, 0.005137 below max(1, exact) at the most.
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
    float t_r = 0.6038181 + 0.07893227 * b;
    float beta_n = n - 0.01617085;
    float beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 1.3837475 * beta_n2;
    float width = min(material.beta_m, 0.8);
    float over_v = max(1.0 / (width * width) - 0.006251717, 1e-05);
    float t_r_2 = cos_tilt * over_v;
    hair.slope_r = 2.279574 * t_r_2;
    hair.slope_r_2 = 6.168951 * t_r_2;
    float m = clamp(material.beta_m, 0.09, 0.49);
    float m4 = 4.0 * (m * m);
    hair.slope_r_3 = (4.563912 - 0.2798637 * (m4 * m4)) * t_r_2;
    hair.offset = 0.1442182 * m4;
    float t_tt = clamp(-material.alpha, -1.2, 1.2);
    float cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    float t_2 = 0.5 * material.beta_m;
    float m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    float m4_tt = 4.0 * (m_tt * m_tt);
    float e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    hair.k_near_tt = 0.1892081 - 0.08218343 * m4_tt - 0.005037452 * b + 0.004928882 * e;
    float t_tt_2 = 0.01725863 + 0.1298832 * m4_tt - 0.006282691 * b;
    hair.flat_tt = t_tt_2 * t_tt_2 + 1e-05;
    float t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    float cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    float t_3 = 2.0 * material.beta_m;
    float m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    float m4_trt = 4.0 * (m_trt * m_trt);
    hair.k_near_trt = 0.03538306 - 0.03764988 * m4_trt + 0.00343052 * b;
    float t_trt_2 = 0.07701718 + 0.4473487 * m4_trt - 0.009602546 * b;
    hair.flat_trt = t_trt_2 * t_trt_2 + 1e-05;
    float scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2540192 * b - 2.022652 + 0.04035076 * e);
    hair.k_u_r = 0.06462092 * b;
    hair.k_q_r = 1.442695 * (0.2618032 * b + 0.002037813 * e * b);
    hair.k_PP = 1.442695 * (0.008104682 - 0.005737142 * e);
    hair.k_P = 1.442695 * (0.3209138 - 0.1499862 * b + 0.06339683 * e);
    float k_1 = 1.442695 * (0.1611019 * b - 1.735852 - 0.009914496 * e * b);
    float t_r_3 = sin(0.5 * t);
    float less = 2.0 * (t_r_3 * t_r_3);
    float k_tilt = -(scale * less);
    float log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    float width_tt = min(t_2, 0.4);
    float over_v_tt = 1.0 / (width_tt * width_tt);
    float scale_tt = 1.442695
        * (over_v_tt + 0.02666871 + m4_tt * (0.2005031 - 0.192494 * m4_tt));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09940767 - 0.07783242 * m4_tt);
    hair.k_uqq = 1.442695 * (0.1625824 * b - 0.0707234);
    hair.k_uuq = 1.442695
        * (b * (5.240127 - 3.058413 * b) - 2.334118 - 0.0005734475 * (e * e));
    hair.k_uuuq = 1.442695 * (b * (2.760767 - 1.706611 * b) - 1.049326);
    hair.k_uuu = 1.442695 * (b * (2.541686 - 1.584867 * b) - 1.381943);
    vec3 t_r_4 = min(material.sigma_a, vec3(1.15));
    hair.k_qq_tt = 1.442695
        * (0.07746077 * m4_tt - 0.2523955 + 0.1585156 * b + 0.01302607 * e
        - 0.07693309 * t_r_4);
    hair.k_q_tt = 1.442695
        * (0.7075514 * t_r_4 - 1.4219
        + b * (1.596934 - 0.6168704 * b - 0.2915101 * t_r_4)
        + e * (0.3003821 - 0.1711468 * b - 0.01312224 * e - 0.1526522 * t_r_4));
    hair.k_uq_tt = 1.442695
        * (0.3654538 * t_r_4 - 3.074708
        + b * (4.191738 - 1.974587 * b - 0.3068712 * t_r_4)
        + e * (0.334523 - 0.1778401 * b - 0.1054162 * t_r_4));
    hair.k_uu_tt = 1.442695
        * (-0.3263105 * t_r_4 - 3.331916
        + b * (5.387603 - 3.214404 * b + 0.5030824 * t_r_4)
        + e * (0.05671246 + 0.02537619 * t_r_4));
    hair.k_u_tt = 1.442695
        * (e * (0.4719656 - 0.2654728 * b - 0.05953424 * e) - 4.731579
        + b * (4.649802 - 2.368833 * b + 0.4466193 * t_r_4));
    float t_tt_3 = sin(0.5 * t_tt);
    float less_tt = 2.0 * (t_tt_3 * t_tt_3);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    float peak = 0.3989423 / width_tt;
    vec3 t_tt_4 = material.sigma_a - t_r_4;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3101788 - 0.2402638 * b - 0.05188338 * e) - 3.475742
        - 1.908044 * t_r_4 + b * (1.537143 + b * (-0.0118389 * t_r_4 - 0.674304))
        - 2.0 * t_tt_4));
    float width_trt = min(t_3, 1.6);
    float over_v_trt = 1.0 / (width_trt * width_trt);
    float scale_trt = 1.442695 * (over_v_trt - 0.2136688 + 0.5201127 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    float r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.552842 * r - 0.5947339);
    hair.k_q_trt = 1.442695
        * (0.7575423 * m4_trt - 0.1328005 - 1.161838 * r - 1.091215 * b
        + 0.2378369 * e);
    hair.k_uq_trt = 1.442695 * (4.931579 + 4.678818 * r - 3.213339 * b);
    hair.k_uu_trt = 1.442695 * (0.09039429 * r - 1.285291 + 0.6856879 * b);
    hair.k_u_trt = 1.442695
        * (5.126118 + r * (2.805487 + 0.9429194 * r) - 2.795132 * b - 0.323166 * e);
    float t_trt_3 = sin(0.5 * t_trt);
    float less_trt = 2.0 * (t_trt_3 * t_trt_3);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    float peak_trt = 0.3989423 / width_trt;
    vec3 t_trt_4 = -4.0 * t_tt_4;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.8134827 * m4_trt - 2.751771 + r * (0.4302124 - 0.5372137 * r)
        - 0.7063224 * b + 0.1369798 * e - 4.862427 * t_r_4 + t_trt_4));
    float scale_trt_2 = 1.442695 * (over_v_trt + 0.1001094 - 0.5025221 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.748608 * r - 0.5609986);
    hair.k_q_trt_2 = 1.442695
        * (1.773035 - 0.1003903 * r + e * (0.07898724 + 0.8201097 * r));
    hair.k_uq_trt_2 = 1.442695 * (2.583662 + r * (3.56327 - 115.6012 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (186.5809 - 548.2265 * r) - 16.15425 - 0.5542693 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (12.22795 + 72.90064 * r) - 0.3464273 + e * (29.17706 * r - 4.906359));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.341025 * t_r_4 - 4.484442 + r * (2.196408 - 0.2514659 * t_r_4)
        + t_trt_4));
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
        * max(max(1.000575 + hair.slope_r * t, hair.slope_r_2 * t - 1.755049),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.17395864 * P);
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
