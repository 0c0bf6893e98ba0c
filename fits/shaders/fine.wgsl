// Hair of exponentials of longer polynomials: R + TT + TRT.
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
// R + TT + TRT is off by 0.01239 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.01817; 0.01093 on other fibers, at
// most 0.01262. Furnace, the same beta and beta_n .05, eta 1.55, tilts to
// 2.5 degrees: albedo off by at most 0.02356, 0.005793 below max(1, exact) at the most.
// hair_bsdf_hoisted takes 12 special operations (exp, rsqrt, ...) and 133
// others in the code of a GPU, sm_86, a fused multiply-add as one; 12 and
// 205 in SPIR-V, nothing fused.
//
// Emitted by fits/shaders.py.

struct HairMaterial {
    eta: f32,  // index of refraction, >= 1
    sigma_a: vec3f,  // absorption per fiber radius, >= 0
    beta_m: f32,  // longitudinal width of R in radians; TT half, TRT twice
    beta_n: f32,  // azimuthal roughness in radians
    alpha: f32,  // tilt of the scales in radians, < 0 if T points to the tip
}

// What depends on the material alone.
struct HairConstants {
    tan_tilt_r: f32,
    tan_tilt_r_2: f32,
    kT: f32,
    kP: f32,
    slope_r: f32,
    slope_r_2: f32,
    slope_r_3: f32,
    offset: f32,
    tan_tilt_tt: f32,
    tan_tilt_tt_2: f32,
    k_near_tt: f32,
    flat_tt: f32,
    tan_tilt_trt: f32,
    tan_tilt_trt_2: f32,
    k_near_trt: f32,
    flat_trt: f32,
    k_square_r: f32,
    k_x: f32,
    k_u_r: f32,
    k_q_r: f32,
    k_PP: f32,
    k_P: f32,
    k_1: f32,
    k_square_tt: f32,
    k_qqq: f32,
    k_uqq: f32,
    k_uuq: f32,
    k_uuuq: f32,
    k_uuu: f32,
    k_qq_tt: vec3f,
    k_q_tt: vec3f,
    k_uq_tt: vec3f,
    k_uu_tt: vec3f,
    k_u_tt: vec3f,
    k_tilt_tt: f32,
    K_tt: vec3f,
    k_square_trt: f32,
    k_qq_trt: f32,
    k_q_trt: f32,
    k_uq_trt: f32,
    k_uu_trt: f32,
    k_u_trt: f32,
    k_tilt_trt: f32,
    K_trt: vec3f,
    k_square_trt_2: f32,
    k_qq_trt_2: f32,
    k_q_trt_2: f32,
    k_uq_trt_2: f32,
    k_uu_trt_2: f32,
    k_u_trt_2: f32,
    k_tilt_trt_2: f32,
    K_trt_2: vec3f,
}

fn hair_constants(material: HairMaterial) -> HairConstants {
    var hair: HairConstants;
    let t = clamp(2.0 * material.alpha, -1.2, 1.2);
    let cos_tilt = cos(t);
    hair.tan_tilt_r = sin(t) / cos_tilt;
    hair.tan_tilt_r_2 = 2.0 * hair.tan_tilt_r;
    let n = clamp(material.beta_n, 0.05, 0.49);
    let n2 = n * n;
    let b = 4.0 * n2;
    let t_r = 0.628304 + 0.06860541 * b;
    let beta_n = n - 0.0209929;
    let beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 1.4713058 * beta_n2;
    let over_v = max(1.0 / (material.beta_m * material.beta_m) - 0.03147887, 1e-05);
    let t_r_2 = cos_tilt * over_v;
    hair.slope_r = 2.232387 * t_r_2;
    hair.slope_r_2 = 6.05789 * t_r_2;
    let m = clamp(material.beta_m, 0.09, 0.49);
    let m4 = 4.0 * (m * m);
    hair.slope_r_3 = (4.413899 - 0.3997366 * (m4 * m4)) * t_r_2;
    hair.offset = 0.2592427 * m4;
    let t_tt = clamp(-material.alpha, -1.2, 1.2);
    let cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    let t_2 = 0.5 * material.beta_m;
    let m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    let m4_tt = 4.0 * (m_tt * m_tt);
    let e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    hair.k_near_tt = 0.1898967 - 0.08643149 * m4_tt - 0.002696553 * b + 0.005765953 * e;
    let t_tt_2 = 0.0175203 + 0.135423 * m4_tt - 0.01264886 * b;
    hair.flat_tt = t_tt_2 * t_tt_2 + 1e-05;
    let t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    let cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    let t_3 = 2.0 * material.beta_m;
    let m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    let m4_trt = 4.0 * (m_trt * m_trt);
    hair.k_near_trt = 0.02921625 - 0.04871376 * m4_trt + 0.05749709 * b;
    let t_trt_2 = -0.5305889 * m4_trt - 0.06532218 - 0.02996834 * b;
    hair.flat_trt = t_trt_2 * t_trt_2 + 1e-05;
    let scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.2341302 * b - 2.015967 + 0.04141125 * e);
    hair.k_u_r = 0.06557516 * b;
    hair.k_q_r = 1.442695 * (0.2864873 * b + 0.0007044975 * e * b);
    hair.k_PP = 1.442695 * (0.009655994 - 0.005598089 * e);
    hair.k_P = 1.442695 * (0.2955985 - 0.1516065 * b + 0.06263572 * e);
    let k_1 = 1.442695 * (0.1987847 * b - 1.751735 - 0.01202274 * e * b);
    let t_r_3 = sin(0.5 * t);
    let less = 2.0 * (t_r_3 * t_r_3);
    let k_tilt = -(scale * less);
    let log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    let over_v_tt = 1.0 / (t_2 * t_2);
    let scale_tt = 1.442695
        * (over_v_tt - 0.01266061 + m4_tt * (0.7357478 - 0.7080006 * m4_tt));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09525483 - 0.07392126 * m4_tt);
    hair.k_uqq = 1.442695 * (0.1672895 * b - 0.06787759);
    hair.k_uuq = 1.442695
        * (b * (5.053173 - 3.034929 * b) - 2.261511 + 0.005937182 * (e * e));
    hair.k_uuuq = 1.442695 * (b * (2.623162 - 1.65389 * b) - 1.007015);
    hair.k_uuu = 1.442695 * (b * (2.468572 - 1.532028 * b) - 1.368222);
    let t_r_4 = min(material.sigma_a, vec3f(1.15));
    hair.k_qq_tt = 1.442695
        * (0.07302233 * m4_tt - 0.2480104 + 0.1626114 * b + 0.01287741 * e
        - 0.07603005 * t_r_4);
    hair.k_q_tt = 1.442695
        * (0.6892119 * t_r_4 - 1.402726
        + b * (1.562918 - 0.6080267 * b - 0.2658404 * t_r_4)
        + e * (0.299966 - 0.1877722 * b - 0.01640367 * e - 0.1462554 * t_r_4));
    hair.k_uq_tt = 1.442695
        * (0.345335 * t_r_4 - 3.024413
        + b * (4.105486 - 1.995177 * b - 0.2787096 * t_r_4)
        + e * (0.3347321 - 0.1954609 * b - 0.09956372 * t_r_4));
    hair.k_uu_tt = 1.442695
        * (-0.327527 * t_r_4 - 3.289857
        + b * (5.106349 - 2.986997 * b + 0.5798886 * t_r_4)
        + e * (0.06144632 + 0.02388018 * t_r_4));
    hair.k_u_tt = 1.442695
        * (e * (0.4721097 - 0.2582631 * b - 0.05603804 * e) - 4.695156
        + b * (4.387474 - 2.148474 * b + 0.5383347 * t_r_4));
    let t_tt_3 = sin(0.5 * t_tt);
    let less_tt = 2.0 * (t_tt_3 * t_tt_3);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    let peak = 0.3989423 / t_2;
    let t_tt_4 = material.sigma_a - t_r_4;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3074922 - 0.2343048 * b - 0.04978354 * e) - 3.46551
        - 1.907139 * t_r_4 + b * (1.48034 + b * (0.005319625 * t_r_4 - 0.6283764))
        - 2.0 * t_tt_4));
    let over_v_trt = 1.0 / (t_3 * t_3);
    let scale_trt = 1.442695 * (over_v_trt - 0.3743852 + 0.4574269 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    let r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.9857127 * r - 0.3883192);
    hair.k_q_trt = 1.442695
        * (0.1360207 + 0.6536078 * m4_trt - 1.631869 * r - 1.33938 * b + 0.2563495 * e);
    hair.k_uq_trt = 1.442695 * (6.478298 + 2.423838 * r - 4.564036 * b);
    hair.k_uu_trt = 1.442695 * (0.2391993 * r - 1.349573 + 0.7996727 * b);
    hair.k_u_trt = 1.442695
        * (5.072728 + r * (4.405513 - 1.2596 * r) - 3.006191 * b - 0.3315543 * e);
    let t_trt_3 = sin(0.5 * t_trt);
    let less_trt = 2.0 * (t_trt_3 * t_trt_3);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    let peak_trt = 0.3989423 / t_3;
    let t_trt_4 = -4.0 * t_tt_4;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.8305642 * m4_trt - 2.914498 + r * (0.8811018 - 0.8986692 * r)
        - 0.566035 * b + 0.1464745 * e - 4.858502 * t_r_4 + t_trt_4));
    let scale_trt_2 = 1.442695 * (over_v_trt + 0.24209 - 0.5963209 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.847829 * r - 0.4949604);
    hair.k_q_trt_2 = 1.442695
        * (1.681255 + 0.08534752 * r + e * (0.04750688 + 0.8460283 * r));
    hair.k_uq_trt_2 = 1.442695 * (2.780898 + r * (0.03902148 - 105.4546 * r));
    hair.k_uu_trt_2 = 1.442695
        * (r * (158.1485 - 480.6664 * r) - 13.37134 - 0.9171986 * e);
    hair.k_u_trt_2 = 1.442695
        * (r * (16.8626 + 65.98657 * r) - 0.9403649 + e * (28.84603 * r - 5.032767));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.306987 * t_r_4 - 4.391015 + r * (2.073527 - 0.3210815 * t_r_4)
        + t_trt_4));
    return hair;
}

// Reflected: T = cos phi + kT and P = Y (cos phi + kP) are about 2 cos^2(phi/2) and 8
// cos^2(phi/2) cos^2 theta_d; the largest of the lines is that of I0 in M. One
// exponential for F, N and M.
fn hair_R(hair: HairConstants, sin_i: f32, sin_o: f32, cos_i: f32, cos_o: f32,
    cos_phi: f32) -> f32 {
    let cc = cos_i * cos_o;
    let sc = sin_i * cos_o;
    let q = cc + sin_i * sin_o;
    let both = sin_i + sin_o;
    let apart = cos_i - cos_o;
    let together = cos_i + cos_o;
    let square_both = both * both;
    let X = square_both + apart * apart;
    let Y = square_both + together * together;
    let turned = sc + sin_o * cos_i;
    let a = cc + hair.tan_tilt_r * sc;
    let square = X - hair.tan_tilt_r_2 * turned - 4.0 * max(-a, 0.0);
    let T_2 = cos_phi + hair.kT;
    let P = Y * (cos_phi + hair.kP);
    let t = abs(a);
    let square_size = T_2
        * max(max(0.9742816 + hair.slope_r * t, hair.slope_r_2 * t - 1.807717),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.121269636 * P);
    return T_2 * inverseSqrt(square_size)
        * exp2(hair.k_1 + hair.k_square_r * square + hair.k_x * sqrt(max(P, 0.0))
        + hair.k_u_r * cos_phi + hair.k_q_r * q + P * (hair.k_P + hair.k_PP * P));
}

// Through the fiber: a factor of M and F at grazing, and one exponential for each
// color, a polynomial in cos phi and q less square/(2 v) of M.
fn hair_TT(hair: HairConstants, sin_i: f32, sin_o: f32, cos_i: f32, cos_o: f32,
    cos_phi: f32) -> vec3f {
    let cc = cos_i * cos_o;
    let sc = sin_i * cos_o;
    let q = cc + sin_i * sin_o;
    let both = sin_i + sin_o;
    let apart = cos_i - cos_o;
    let together = cos_i + cos_o;
    let square_both = both * both;
    let X = square_both + apart * apart;
    let Y = square_both + together * together;
    let turned = sc + sin_o * cos_i;
    let a = cc + hair.tan_tilt_tt * sc;
    let square = X - hair.tan_tilt_tt_2 * turned - 4.0 * max(-a, 0.0);
    let near = Y + hair.k_near_tt;
    let square_rise = near * near * (abs(a) + hair.flat_tt);
    let rise = Y * inverseSqrt(square_rise);
    let q2 = q * q;
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
fn hair_TRT(hair: HairConstants, sin_i: f32, sin_o: f32, cos_i: f32, cos_o: f32,
    cos_phi: f32) -> vec3f {
    let cc = cos_i * cos_o;
    let sc = sin_i * cos_o;
    let q = cc + sin_i * sin_o;
    let both = sin_i + sin_o;
    let apart = cos_i - cos_o;
    let together = cos_i + cos_o;
    let square_both = both * both;
    let X = square_both + apart * apart;
    let Y = square_both + together * together;
    let turned = sc + sin_o * cos_i;
    let a = cc + hair.tan_tilt_trt * sc;
    let square = X - hair.tan_tilt_trt_2 * turned - 4.0 * max(-a, 0.0);
    let near = Y + hair.k_near_trt;
    let square_rise = near * near * (abs(a) + hair.flat_trt);
    let rise = Y * inverseSqrt(square_rise);
    let u = cos_phi - 1.0;
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
fn hair_bsdf_hoisted(hair: HairConstants, L: vec3f, V: vec3f, T: vec3f) -> vec3f {
    let sin_i = dot(T, L);
    let sin_o = dot(T, V);
    let cos_io = dot(L, V);
    let square_i = max(1.0 - sin_i * sin_i, 1e-12);
    let over_i = inverseSqrt(square_i);
    let cos_i = square_i * over_i;
    let square_o = max(1.0 - sin_o * sin_o, 1e-12);
    let over_o = inverseSqrt(square_o);
    let cos_o = square_o * over_o;
    let along = sin_i * sin_o;
    let cos_phi = clamp((cos_io - along) * over_i * over_o, -1.0, 1.0);
    return hair_R(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_TT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_TRT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi);
}

// L towards the light, V towards the eye, T along the fiber: unit.
fn hair_bsdf(material: HairMaterial, L: vec3f, V: vec3f, T: vec3f) -> vec3f {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
