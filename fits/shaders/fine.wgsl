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
// R + TT + TRT is off by 0.01274 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.01871; 0.01129 on fibers that
// nothing was fitted to, at most 0.0131. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.02422, 0.004408
// below max(1, exact) at the most.
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
    let t_r = 0.6017584 + 0.07309606 * b;
    let beta_n = n - 0.0153138;
    let beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 1.3429981 * beta_n2;
    let width = min(material.beta_m, 0.8);
    let over_v = max(1.0 / (width * width) - 0.007540583, 1e-05);
    let t_r_2 = cos_tilt * over_v;
    hair.slope_r = 2.186708 * t_r_2;
    hair.slope_r_2 = 5.943374 * t_r_2;
    let m = clamp(material.beta_m, 0.09, 0.49);
    let m4 = 4.0 * (m * m);
    hair.slope_r_3 = (4.372583 - 0.2665544 * (m4 * m4)) * t_r_2;
    hair.offset = 0.1786116 * m4;
    let t_tt = clamp(-material.alpha, -1.2, 1.2);
    let cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    let t_2 = 0.5 * material.beta_m;
    let m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    let m4_tt = 4.0 * (m_tt * m_tt);
    let e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    let t_tt_2 = 0.4382912 - 0.117294 * m4_tt - 0.009070312 * b + 0.004933279 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    let t_tt_3 = -0.1279653 * m4_tt - 0.01864075 + 0.006703448 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    let t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    let cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    let t_3 = 2.0 * material.beta_m;
    let m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    let m4_trt = 4.0 * (m_trt * m_trt);
    let t_trt_2 = 0.1939587 - 0.07401789 * m4_trt - 0.02703052 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    let t_trt_3 = 0.077828 + 0.4417325 * m4_trt - 0.00729938 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    let scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_x = 1.442695 * (0.256034 * b - 2.017676 + 0.03864857 * e);
    hair.k_u_r = 0.06332091 * b;
    hair.k_q_r = 1.442695 * (0.2597434 * b + 0.0007512834 * e * b);
    hair.k_PP = 1.442695 * (0.008412818 - 0.005968049 * e);
    hair.k_P = 1.442695 * (0.3185775 - 0.1497972 * b + 0.0660756 * e);
    let k_1 = 1.442695 * (0.1563079 * b - 1.755694 - 0.0111137 * e * b);
    let t_r_3 = sin(0.5 * t);
    let less = 2.0 * (t_r_3 * t_r_3);
    let k_tilt = -(scale * less);
    let log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    let width_tt = min(t_2, 0.4);
    let over_v_tt = 1.0 / (width_tt * width_tt);
    let scale_tt = 1.442695
        * (over_v_tt - 0.06534987 + m4_tt * (1.310679 - 1.201182 * m4_tt));
    hair.k_square_tt = -0.5 * scale_tt * cos_tilt_tt;
    hair.k_qqq = 1.442695 * (0.09524043 - 0.0642452 * m4_tt);
    hair.k_uqq = 1.442695 * (0.2084884 * b - 0.0957345);
    hair.k_uuq = 1.442695
        * (b * (5.363374 - 3.297061 * b) - 2.257772 + 0.00298675 * (e * e));
    hair.k_uuuq = 1.442695 * (b * (2.663674 - 1.676239 * b) - 0.9926218);
    hair.k_uuu = 1.442695 * (b * (2.51516 - 1.606123 * b) - 1.342992);
    let t_r_4 = min(material.sigma_a, vec3f(1.15));
    hair.k_qq_tt = 1.442695
        * (0.06492387 * m4_tt - 0.2678655 + 0.1934113 * b + 0.01352864 * e
        - 0.07923795 * t_r_4);
    hair.k_q_tt = 1.442695
        * (0.7090942 * t_r_4 - 1.41714
        + b * (1.730483 - 0.7682498 * b - 0.2882335 * t_r_4)
        + e * (0.300334 - 0.1689692 * b - 0.01617636 * e - 0.1629821 * t_r_4));
    hair.k_uq_tt = 1.442695
        * (0.3667718 * t_r_4 - 3.047676
        + b * (4.538025 - 2.393476 * b - 0.3045219 * t_r_4)
        + e * (0.3346942 - 0.1748693 * b - 0.1185562 * t_r_4));
    hair.k_uu_tt = 1.442695
        * (-0.3267265 * t_r_4 - 3.211989
        + b * (5.192021 - 3.15773 * b + 0.5459505 * t_r_4)
        + e * (0.04043003 + 0.02430389 * t_r_4));
    hair.k_u_tt = 1.442695
        * (e * (0.4502206 - 0.2630834 * b - 0.06434709 * e) - 4.606019
        + b * (4.350914 - 2.210998 * b + 0.501876 * t_r_4));
    let t_tt_4 = sin(0.5 * t_tt);
    let less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    let peak = 0.3989423 / width_tt;
    let t_tt_5 = material.sigma_a - t_r_4;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.3035179 - 0.2376098 * b - 0.05597931 * e) - 3.433535
        - 1.906685 * t_r_4 + b * (1.420673 + b * (0.0006708669 * t_r_4 - 0.606049))
        - 2.0 * t_tt_5));
    let width_trt = min(t_3, 1.6);
    let over_v_trt = 1.0 / (width_trt * width_trt);
    let scale_trt = 1.442695 * (over_v_trt - 0.1961854 + 0.5045181 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    let r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_qq_trt = 1.442695 * (-0.4985431 * r - 0.625858);
    hair.k_q_trt = 1.442695
        * (0.6957086 * m4_trt - 0.2058231 - 1.041772 * r - 0.9759425 * b
        + 0.2290829 * e);
    hair.k_uq_trt = 1.442695 * (4.993034 + 5.135995 * r - 3.415897 * b);
    hair.k_uu_trt = 1.442695 * (0.02992862 * r - 1.172227 + 0.5700534 * b);
    hair.k_u_trt = 1.442695
        * (4.42495 + r * (5.261144 - 0.3832038 * r) - 2.507941 * b - 0.2983156 * e);
    let t_trt_4 = sin(0.5 * t_trt);
    let less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    let peak_trt = 0.3989423 / width_trt;
    let t_trt_5 = -4.0 * t_tt_5;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.7978148 * m4_trt - 2.734613 + r * (0.4200682 - 0.5133688 * r)
        - 0.6961393 * b + 0.1343156 * e - 4.857742 * t_r_4 + t_trt_5));
    let scale_trt_2 = 1.442695 * (over_v_trt + 0.1425912 - 0.5628533 * m4_trt);
    hair.k_square_trt_2 = -0.5 * scale_trt_2 * cos_tilt_trt;
    hair.k_qq_trt_2 = 1.442695 * (-1.693087 * r - 0.6009472);
    hair.k_q_trt_2 = 1.442695
        * (1.792829 - 0.06572044 * r + e * (0.07298669 + 0.8157013 * r));
    hair.k_uq_trt_2 = 1.442695 * (3.848412 + r * (-101.454 * r - 7.036817));
    hair.k_uu_trt_2 = 1.442695
        * (r * (77.05823 - 389.5832 * r) - 2.121577 - 1.134145 * e);
    hair.k_u_trt_2 = 1.442695
        * (0.1070641 + r * (9.287317 + 76.6344 * r) + e * (28.79121 * r - 5.040272));
    hair.k_tilt_trt_2 = -(scale_trt_2 * less_trt);
    hair.K_trt_2 = peak_trt
        * exp2(1.442695
        * (-3.355913 * t_r_4 - 4.484998 + r * (2.171451 - 0.2273984 * t_r_4)
        + t_trt_5));
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
        * max(max(0.9634861 + hair.slope_r * t, hair.slope_r_2 * t - 1.688922),
        hair.offset + hair.slope_r_3 * t) * (1.0 + 0.18138851 * P);
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
