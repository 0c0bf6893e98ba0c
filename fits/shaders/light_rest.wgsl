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
    offset: f32,
    kF: f32,
    tan_tilt_tt: f32,
    tan_tilt_tt_2: f32,
    k_near_tt: f32,
    flat_tt: f32,
    tan_tilt_trt: f32,
    tan_tilt_trt_2: f32,
    k_near_trt: f32,
    flat_trt: f32,
    q1: f32,
    q0: f32,
    c: f32,
    o: f32,
    k_square_r: f32,
    k_PP: f32,
    k_P: f32,
    k_1: f32,
    k_square_tt: f32,
    k_qq: f32,
    k_uq_tt: f32,
    k_uuq: f32,
    k_uuu: f32,
    k_uu: f32,
    k_u_tt: f32,
    k_q_tt: vec3f,
    k_tilt_tt: f32,
    K_tt: vec3f,
    k_square_trt: f32,
    k_q_trt: f32,
    k_uq_trt: f32,
    k_u_trt: f32,
    k_tilt_trt: f32,
    K_trt: vec3f,
    K1: vec3f,
    K0: vec3f,
    narrow: f32,
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
    let t_r = 0.1682948 + 0.208484 * b;
    let beta_n = n + 0.2021096;
    let beta_n2 = beta_n * beta_n;
    hair.kT = 1.00001 + t_r * t_r * beta_n2;
    hair.kP = 1.00001 + 0.34764042 * beta_n2;
    let m = clamp(material.beta_m, 0.09, 0.49);
    let m4 = 4.0 * (m * m);
    let width = min(material.beta_m, 0.8);
    let over_v = max(1.0 / (width * width) - 0.08293843, 1e-05);
    let t_r_2 = cos_tilt * over_v;
    hair.slope_r = (1.612684 - 0.2314041 * m4) * t_r_2;
    hair.slope_r_2 = (3.715234 + m4 * (0.0549443 * m4 - 0.8994488)) * t_r_2;
    hair.offset = 0.7220926 * m4 - 0.7205815;
    let t_r_3 = 3.80106 - 0.1816369 * b;
    hair.kF = t_r_3 * t_r_3;
    let t_tt = clamp(-material.alpha, -1.2, 1.2);
    let cos_tilt_tt = cos(t_tt);
    hair.tan_tilt_tt = sin(t_tt) / cos_tilt_tt;
    hair.tan_tilt_tt_2 = 2.0 * hair.tan_tilt_tt;
    let t_2 = 0.5 * material.beta_m;
    let m_tt = clamp(2.0 * t_2, 0.09, 0.49);
    let m4_tt = 4.0 * (m_tt * m_tt);
    let e = 10.0 * (clamp(material.eta, 1.45, 1.65) - 1.55);
    let t_tt_2 = 0.519575 - 0.1254077 * m4_tt - 0.04739175 * b - 0.002757437 * e;
    hair.k_near_tt = t_tt_2 * t_tt_2 + 1e-05;
    let t_tt_3 = 0.01253917 + 0.1139801 * m4_tt + 0.001269197 * b;
    hair.flat_tt = t_tt_3 * t_tt_3 + 1e-05;
    let t_trt = clamp(-4.0 * material.alpha, -1.2, 1.2);
    let cos_tilt_trt = cos(t_trt);
    hair.tan_tilt_trt = sin(t_trt) / cos_tilt_trt;
    hair.tan_tilt_trt_2 = 2.0 * hair.tan_tilt_trt;
    let t_3 = 2.0 * material.beta_m;
    let m_trt = clamp(0.5 * t_3, 0.09, 0.49);
    let m4_trt = 4.0 * (m_trt * m_trt);
    let t_trt_2 = 0.2500525 - 0.06417479 * m4_trt - 0.215042 * b;
    hair.k_near_trt = t_trt_2 * t_trt_2 + 1e-05;
    let t_trt_3 = 0.071232 + 0.6605182 * m4_trt - 0.009133246 * b;
    hair.flat_trt = t_trt_3 * t_trt_3 + 1e-05;
    let z = 10.0 * ((material.eta - 1.0) / (material.eta + 1.0) - 0.21568628);
    hair.q1 = exp2(1.1893578 * z - 0.48315856);
    hair.q0 = exp2(1.1795474 * z - 5.221113);
    let beta = t_3;
    let v = beta * beta;
    let u = v / (v + 0.3);
    hair.c = exp2(1.442695 * (-0.04524 * u - 1.832) * u + 2.6514962) / v;
    hair.o = exp2(1.442695 * (-1.501 * u + 1.514) * u - 0.25247163);
    let scale = 1.442695 * over_v;
    hair.k_square_r = -0.5 * scale * cos_tilt;
    hair.k_PP = 1.442695 * (0.02675776 - 0.007209218 * b - 0.01207695 * e);
    hair.k_P = 1.442695 * (0.05198296 * b - 0.292333 + 0.1161786 * e);
    let k_1 = 1.442695
        * (m4 * (0.06874559 - 0.05857935 * m4) - 2.102622 - 0.05883912 * (b * b));
    let t_r_4 = sin(0.5 * t);
    let less = 2.0 * (t_r_4 * t_r_4);
    let k_tilt = -(scale * less);
    let log_peak = 1.442695 * log(over_v);
    hair.k_1 = k_1 + k_tilt + log_peak;
    let width_tt = min(t_2, 0.4);
    let over_v_tt = 1.0 / (width_tt * width_tt);
    let scale_tt = 1.442695
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
    let t_r_5 = min(material.sigma_a, vec3f(1.15));
    hair.k_q_tt = 1.442695
        * (0.3556778 * t_r_5 - 1.303915
        + b * (1.150996 - 0.2995638 * b + 0.002739143 * t_r_5)
        + e * (0.2324941 - 0.1206498 * b - 0.02616528 * t_r_5));
    let t_tt_4 = sin(0.5 * t_tt);
    let less_tt = 2.0 * (t_tt_4 * t_tt_4);
    hair.k_tilt_tt = -(scale_tt * less_tt);
    let peak = 0.3989423 / width_tt;
    let t_tt_5 = material.sigma_a - t_r_5;
    hair.K_tt = peak
        * exp2(1.442695
        * (e * (0.2517921 - 0.2064123 * b - 0.02052502 * e) - 3.336103
        - 2.183416 * t_r_5 + b * (1.100374 - 0.3003412 * b - 0.0006769631 * t_r_5)
        - 2.0 * t_tt_5));
    let width_trt = min(t_3, 1.6);
    let over_v_trt = 1.0 / (width_trt * width_trt);
    let scale_trt = 1.442695 * (over_v_trt - 0.2931307 + 0.1010013 * m4_trt);
    hair.k_square_trt = -0.5 * scale_trt * cos_tilt_trt;
    let r = 1.0 / (1.0 + 20.0 * n2);
    hair.k_q_trt = 1.442695
        * (0.05853233 - 0.1512033 * m4_trt + 0.2223634 * r + 0.1332661 * e);
    hair.k_uq_trt = 1.442695 * (r * (17.0374 - 3.845232 * r) - 0.9611902);
    hair.k_u_trt = 1.442695 * (0.5995087 + r * (14.27247 - 2.464647 * r));
    let t_trt_4 = sin(0.5 * t_trt);
    let less_trt = 2.0 * (t_trt_4 * t_trt_4);
    hair.k_tilt_trt = -(scale_trt * less_trt);
    let peak_trt = 0.3989423 / width_trt;
    hair.K_trt = peak_trt
        * exp2(1.442695
        * (0.6122684 * m4_trt - 2.710374 + 0.413128 * r - 0.3894705 * b
        + 0.1122846 * e - 4.088261 * t_r_5 - 4.0 * t_tt_5));
    let t_rest = tanh(1.0 / v);
    let level = 0.07957747 * (1.0 + t_rest) * exp2(1.1606481 * z - 4.408876)
        / (t_rest * v);
    let less_rest = level
        / (1.0 + exp2(0.030412013 * z + 1.7413329) * material.sigma_a);
    hair.K1 = material.sigma_a * less_rest
        * exp2(-0.5610641 * z + 0.9406372 - 9.029644 * material.sigma_a);
    hair.K0 = less_rest
        * exp2(-1.442695 * exp2(-0.30585134 * z + 2.8940463) * material.sigma_a);
    let narrow = -0.5 / v;
    hair.narrow = 1.442695 * narrow;
    return hair;
}

// Reflected: T = cos phi + kT and P = Y (cos phi + kP) are about 2 cos^2(phi/2) and 8
// cos^2(phi/2) cos^2 theta_d; the largest of the lines is that of I0 in M. One
// exponential for F, N and M.
fn hair_R(hair: HairConstants, sin_i: f32, sin_o: f32, cos_i: f32, cos_o: f32,
    cos_phi: f32) -> f32 {
    let cc = cos_i * cos_o;
    let sc = sin_i * cos_o;
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
        * max(0.616815 + hair.slope_r * t, hair.offset + hair.slope_r_2 * t)
        * (1.0 + hair.kF * P);
    return T_2 * inverseSqrt(square_size)
        * exp2(hair.k_1 + hair.k_square_r * square + P * (hair.k_P + hair.k_PP * P));
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
    return rise * hair.K_tt
        * exp2(hair.k_tilt_tt + hair.k_square_tt * square + hair.k_qq * (q * q)
        + cos_phi
        * (hair.k_u_tt + hair.k_uq_tt * q
        + cos_phi * (hair.k_uu + hair.k_uuq * q + hair.k_uuu * cos_phi))
        + q * hair.k_q_tt);
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
        * exp2(hair.k_tilt_trt + hair.k_square_trt * square + hair.k_q_trt * q
        + u * (hair.k_u_trt + hair.k_uq_trt * q)) * hair.K_trt;
}

// All lobes above TRT, uniform in azimuth: exp(-X/(2 v)) Y rsqrt(Y (q0 + q1 Y + Y^2)^2
// (o + c/v cos theta_i cos theta_o)) (K0 + K1 Y), X = 2 - 2 cos(theta_i + theta_o), Y =
// 4 cos^2 theta_d.
fn hair_rest(hair: HairConstants, sin_i: f32, sin_o: f32, cos_i: f32,
    cos_o: f32) -> vec3f {
    let both = sin_i + sin_o;
    let apart = cos_i - cos_o;
    let together = cos_i + cos_o;
    let square_both = both * both;
    let X = square_both + apart * apart;
    let Y = square_both + together * together;
    let quadratic = hair.q0 + Y * (hair.q1 + Y);
    let across = cos_i * cos_o;
    let square = Y * (hair.o + hair.c * across) * (quadratic * quadratic);
    return Y * inverseSqrt(square) * exp2(hair.narrow * X) * (hair.K0 + Y * hair.K1);
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
        + hair_TRT(hair, sin_i, sin_o, cos_i, cos_o, cos_phi)
        + hair_rest(hair, sin_i, sin_o, cos_i, cos_o);
}

// L towards the light, V towards the eye, T along the fiber: unit.
fn hair_bsdf(material: HairMaterial, L: vec3f, V: vec3f, T: vec3f) -> vec3f {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
