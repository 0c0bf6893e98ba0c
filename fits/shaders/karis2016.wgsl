// Hair of Karis 2016, as published: R + TT + TRT of a fiber.
// Form: a Gaussian in sin theta times one exponential in cos phi per lobe.
// It knows eta only in F and beta_n nowhere: eta' is fitted for eta = 1.55.
// Domain: none is given; C in (0, 1], roughness to 1; shift is .035 there.
// Constants: those published. Source: Karis 2016, Physically based hair
// shading in Unreal.
//
// L points towards the light, V towards the eye, T along the fiber: unit vectors.
// hair_bsdf returns what one light adds per unit of its irradiance across L, per
// steradian: S cos(theta). Do not multiply by the cosine of an inclination again.
// R + TT + TRT is off by 0.4376 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.6757; 0.3997 on fibers that
// nothing was fitted to, at most 0.5544. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.5645, 0.05831
// above max(1, exact) at the most.
// hair_bsdf_hoisted takes 15 special operations (exp, rsqrt, ...) and 98
// others in the code of a GPU, sm_86, a fused multiply-add as one; 15 and
// 136 in SPIR-V, nothing fused.
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
    shift_across: f32,
    shift_along: f32,
    f1: f32,
    f0: f32,
    tilt_tt: f32,
    tilt_trt: f32,
    narrow_r: f32,
    peak_r: f32,
    narrow_tt: f32,
    log_color: vec3f,
    peak_tt: f32,
    narrow_trt: f32,
    peak_trt: f32,
}

fn hair_constants(material: HairMaterial) -> HairConstants {
    var hair: HairConstants;
    let alpha = material.alpha;
    let sin_alpha = sin(alpha);
    hair.shift_across = 2.0 * sin_alpha * cos(alpha);
    hair.shift_along = 2.0 * (sin_alpha * sin_alpha);
    let root = (material.eta - 1.0) / (material.eta + 1.0);
    hair.f0 = root * root;
    hair.f1 = 1.0 - hair.f0;
    hair.tilt_tt = -material.alpha;
    hair.tilt_trt = -4.0 * material.alpha;
    let beta = 1.4142135 * material.beta_m;
    let narrow = -0.5 / (beta * beta);
    hair.narrow_r = 1.442695 * narrow;
    let peak = 0.3989423 / beta;
    hair.peak_r = 0.25 * peak;
    let beta_tt = 0.5 * material.beta_m;
    let narrow_tt = -0.5 / (beta_tt * beta_tt);
    hair.narrow_tt = 1.442695 * narrow_tt;
    let log_color = -4.0 * material.sigma_a;
    hair.log_color = 1.442695 * log_color;
    hair.peak_tt = 0.3989423 / beta_tt;
    let beta_trt = 2.0 * material.beta_m;
    let narrow_trt = -0.5 / (beta_trt * beta_trt);
    hair.narrow_trt = 1.442695 * narrow_trt;
    hair.peak_trt = 0.3989423 / beta_trt;
    return hair;
}

// Reflected. d'Eon et al. 2014: a Gaussian in sin theta, squeezed by cos(phi/2) and
// centered where a mirror of the scales' tilt throws the light; Schlick's F.
fn hair_R(hair: HairConstants, sin_i: f32, sin_o: f32, cos_io: f32, cos_o: f32,
    over_half_phi: f32, cos_half_phi: f32) -> f32 {
    let shift = hair.shift_across * cos_o * cos_half_phi + hair.shift_along * sin_o;
    let cos_half = sqrt(max(0.5 + 0.5 * cos_io, 0.0));
    let x = 1.0 - cos_half;
    let x2 = x * x;
    let F = hair.f0 + hair.f1 * (x2 * x2 * x);
    let off = (sin_i + sin_o - shift) * over_half_phi;
    return hair.peak_r * F * exp2(hair.narrow_r * (off * off));
}

// Through the fiber. (1 - F)^2 C^(cos gamma_t/(2 cos theta_d)) D(phi) at one offset h
// for each phi, a = 1/eta'; a Gaussian in sin theta. The exponents of all three are
// one.
fn hair_TT(hair: HairConstants, sin_i: f32, sin_o: f32, cos_phi: f32,
    cos_half_phi: f32, over_d: f32, cos_d: f32) -> vec3f {
    let a = cos_d / (1.19 + 0.36 * (cos_d * cos_d));
    let h = (1.0 + a * (0.6 - 0.8 * cos_phi)) * cos_half_phi;
    let x = 1.0 - cos_d * sqrt(max(1.0 - h * h, 0.0));
    let x2 = x * x;
    let F = hair.f0 + hair.f1 * (x2 * x2 * x);
    let sin_inside = h * a;
    let passed = 1.0 - F;
    let off = sin_i + sin_o - hair.tilt_tt;
    let passes = 0.5 * sqrt(max(1.0 - sin_inside * sin_inside, 0.0)) * over_d;
    return hair.peak_tt * (passed * passed)
        * exp2(-5.265837 * cos_phi - 5.741926 + hair.narrow_tt * (off * off)
        + passes * hair.log_color);
}

// Reflected inside. (1 - F)^2 F C^(0.8/cos theta_d) D(phi) at the offset h = sqrt(3)/2;
// a Gaussian in sin theta. The exponents of all three are one.
fn hair_TRT(hair: HairConstants, sin_i: f32, sin_o: f32, cos_phi: f32, over_d: f32,
    cos_d: f32) -> vec3f {
    let x = 1.0 - 0.5 * cos_d;
    let x2 = x * x;
    let F = hair.f0 + hair.f1 * (x2 * x2 * x);
    let passed = 1.0 - F;
    let off = sin_i + sin_o - hair.tilt_trt;
    let passes = 0.8 * over_d;
    return hair.peak_trt * (passed * passed) * F
        * exp2(24.525816 * cos_phi - 24.208424 + hair.narrow_trt * (off * off)
        + passes * hair.log_color);
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
    let square_half_phi = max(0.5 + 0.5 * cos_phi, 1e-12);
    let over_half_phi = inverseSqrt(square_half_phi);
    let cos_half_phi = square_half_phi * over_half_phi;
    let square_d = max(0.5 + 0.5 * (along + cos_i * cos_o), 1e-12);
    let over_d = inverseSqrt(square_d);
    let cos_d = square_d * over_d;
    return hair_R(hair, sin_i, sin_o, cos_io, cos_o, over_half_phi, cos_half_phi)
        + hair_TT(hair, sin_i, sin_o, cos_phi, cos_half_phi, over_d, cos_d)
        + hair_TRT(hair, sin_i, sin_o, cos_phi, over_d, cos_d);
}

// L towards the light, V towards the eye, T along the fiber: unit.
fn hair_bsdf(material: HairMaterial, L: vec3f, V: vec3f, T: vec3f) -> vec3f {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
