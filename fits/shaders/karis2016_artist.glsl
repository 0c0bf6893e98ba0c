// Hair of Karis 2016, as published: R + TT + TRT and scattering, by what an
// artist sets. eta = 1.55.
// Form: a Gaussian in sin theta times one exponential in cos phi per lobe.
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
// hair_bsdf_hoisted takes 15 special operations (exp, rsqrt, ...) and 102
// others in the code of a GPU, sm_86, a fused multiply-add as one; 15 and
// 144 in SPIR-V, nothing fused.
//
// Emitted by fits/shaders.py.

struct HairMaterial {
    vec3 base_color;  // linear, in [0, 1]
    float specular;  // factor of R
    float roughness;  // in (0, 1]; its square is the width of R
    float scatter;  // factor of the scattering
    float shift;  // tilt of TT in radians; R -2 times, TRT 4 times
    float shadow;  // light that reaches the hair, in [0, 1]
};

// What depends on the material alone.
struct HairConstants {
    float shift_across;
    float shift_along;
    float tilt_tt;
    float tilt_trt;
    float narrow_r;
    float peak_r;
    float narrow_tt;
    vec3 log_color;
    float peak_tt;
    float narrow_trt;
    float peak_trt;
    vec3 tint;
};

HairConstants hair_constants(HairMaterial material) {
    HairConstants hair;
    float alpha = -material.shift;
    float sin_alpha = sin(alpha);
    hair.shift_across = 2.0 * sin_alpha * cos(alpha);
    hair.shift_along = 2.0 * (sin_alpha * sin_alpha);
    hair.tilt_tt = material.shift;
    hair.tilt_trt = 4.0 * material.shift;
    float roughness2 = material.roughness * material.roughness;
    float beta = 1.4142135 * roughness2;
    float narrow = -0.5 / (beta * beta);
    hair.narrow_r = 1.442695 * narrow;
    float peak = 0.3989423 / beta;
    hair.peak_r = 0.25 * material.specular * peak;
    float beta_tt = 0.5 * roughness2;
    float narrow_tt = -0.5 / (beta_tt * beta_tt);
    hair.narrow_tt = 1.442695 * narrow_tt;
    vec3 color = max(material.base_color, vec3(1e-30));
    vec3 log_color = log(color);
    hair.log_color = 1.442695 * log_color;
    hair.peak_tt = 0.3989423 / beta_tt;
    float beta_trt = 2.0 * roughness2;
    float narrow_trt = -0.5 / (beta_trt * beta_trt);
    hair.narrow_trt = 1.442695 * narrow_trt;
    hair.peak_trt = 0.3989423 / beta_trt;
    float luma = dot(color, vec3(0.2126, 0.7152, 0.0722));
    vec3 tint = 0.07957747 * sqrt(color)
        * pow(1.0 / luma * color, vec3(1.0 - material.shadow));
    hair.tint = material.scatter * tint;
    return hair;
}

// Reflected. d'Eon et al. 2014: a Gaussian in sin theta, squeezed by cos(phi/2) and
// centered where a mirror of the scales' tilt throws the light; Schlick's F.
float hair_R(HairConstants hair, float sin_i, float sin_o, float cos_io, float cos_o,
    float over_half_phi, float cos_half_phi) {
    float shift = hair.shift_across * cos_o * cos_half_phi + hair.shift_along * sin_o;
    float cos_half = sqrt(max(0.5 + 0.5 * cos_io, 0.0));
    float x = 1.0 - cos_half;
    float x2 = x * x;
    float F = 0.046520565 + 0.9534794 * (x2 * x2 * x);
    float off = (sin_i + sin_o - shift) * over_half_phi;
    return hair.peak_r * F * exp2(hair.narrow_r * (off * off));
}

// Through the fiber. (1 - F)^2 C^(cos gamma_t/(2 cos theta_d)) D(phi) at one offset h
// for each phi, a = 1/eta'; a Gaussian in sin theta. The exponents of all three are
// one.
vec3 hair_TT(HairConstants hair, float sin_i, float sin_o, float cos_phi,
    float cos_half_phi, float over_d, float cos_d) {
    float a = cos_d / (1.19 + 0.36 * (cos_d * cos_d));
    float h = (1.0 + a * (0.6 - 0.8 * cos_phi)) * cos_half_phi;
    float x = 1.0 - cos_d * sqrt(max(1.0 - h * h, 0.0));
    float x2 = x * x;
    float F = 0.046520565 + 0.9534794 * (x2 * x2 * x);
    float sin_inside = h * a;
    float passed = 1.0 - F;
    float off = sin_i + sin_o - hair.tilt_tt;
    float passes = 0.5 * sqrt(max(1.0 - sin_inside * sin_inside, 0.0)) * over_d;
    return hair.peak_tt * (passed * passed)
        * exp2(-5.265837 * cos_phi - 5.741926 + hair.narrow_tt * (off * off)
        + passes * hair.log_color);
}

// Reflected inside. (1 - F)^2 F C^(0.8/cos theta_d) D(phi) at the offset h = sqrt(3)/2;
// a Gaussian in sin theta. The exponents of all three are one.
vec3 hair_TRT(HairConstants hair, float sin_i, float sin_o, float cos_phi,
    float over_d, float cos_d) {
    float x = 1.0 - 0.5 * cos_d;
    float x2 = x * x;
    float F = 0.046520565 + 0.9534794 * (x2 * x2 * x);
    float passed = 1.0 - F;
    float off = sin_i + sin_o - hair.tilt_trt;
    float passes = 0.8 * over_d;
    return hair.peak_trt * (passed * passed) * F
        * exp2(24.525816 * cos_phi - 24.208424 + hair.narrow_trt * (off * off)
        + passes * hair.log_color);
}

// What other hairs have scattered: sqrt(C) (n . L + 1)/(4 pi) (C/luma)^(1 - shadow), n
// the part of V across the fiber.
vec3 hair_scattering(HairConstants hair, float cos_i, float cos_phi) {
    return (1.0 + cos_i * cos_phi) * hair.tint;
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
    float square_half_phi = max(0.5 + 0.5 * cos_phi, 1e-12);
    float over_half_phi = inversesqrt(square_half_phi);
    float cos_half_phi = square_half_phi * over_half_phi;
    float square_d = max(0.5 + 0.5 * (along + cos_i * cos_o), 1e-12);
    float over_d = inversesqrt(square_d);
    float cos_d = square_d * over_d;
    return hair_R(hair, sin_i, sin_o, cos_io, cos_o, over_half_phi, cos_half_phi)
        + hair_TT(hair, sin_i, sin_o, cos_phi, cos_half_phi, over_d, cos_d)
        + hair_TRT(hair, sin_i, sin_o, cos_phi, over_d, cos_d)
        + hair_scattering(hair, cos_i, cos_phi);
}

// L towards the light, V towards the eye, T along the fiber: unit.
vec3 hair_bsdf(HairMaterial material, vec3 L, vec3 V, vec3 T) {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
