// Hair of Karis 2016, as published: R + TT + TRT of a fiber.
// Form: a Gaussian in sin theta times one exponential in cos phi per lobe.
// It knows eta only in F and beta_n nowhere: eta' is fitted for eta = 1.55.
// Domain: none is given; C in (0, 1], roughness to 1; shift is .035 there.
// Constants: those published. Source: Karis 2016, Physically based hair
// shading in Unreal.
// With the rest, all lobes above TRT as one. Constants of the rest: fits/tail.py
// in fiberjax, for eta 1.4 to 1.7, beta_m 0.05 to 0.55, sigma_a 0 to 1.2.
//
// L points towards the light, V towards the eye, T along the fiber: unit vectors.
// hair_bsdf returns what one light adds per unit of its irradiance across L, per
// steradian: S cos(theta). Do not multiply by the cosine of an inclination again.
// R + TT + TRT is off by 0.4376 of S, relative L2 over both directions, mean over
// four colors and beta = .09, .25, .49, at most 0.6757; 0.3997 on fibers that
// nothing was fitted to, at most 0.5544. Furnace, the same beta and beta_n .05,
// eta 1.55, tilts to 2.5 degrees: albedo off by at most 0.5645, 0.05831
// above max(1, exact) at the most.
// The rest itself is off by 0.06291 in L2, mean over fibers that nothing was
// fitted to, at most 0.1361; its albedo by at most 0.01166 to 89 degrees.
// hair_bsdf_hoisted takes 17 special operations (exp, rsqrt, ...) and 119
// others in the code of a GPU, sm_86, a fused multiply-add as one; 17 and
// 169 in SPIR-V, nothing fused.
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
    float shift_across;
    float shift_along;
    float f1;
    float f0;
    float tilt_tt;
    float tilt_trt;
    float q1;
    float q0;
    float c;
    float o;
    float narrow_r;
    float peak_r;
    float narrow_tt;
    float3 log_color;
    float peak_tt;
    float narrow_trt;
    float peak_trt;
    float3 K1;
    float3 K0;
    float narrow_rest;
};

HairConstants hair_constants(HairMaterial material) {
    HairConstants hair;
    float alpha = material.alpha;
    float sin_alpha = sin(alpha);
    hair.shift_across = 2.0 * sin_alpha * cos(alpha);
    hair.shift_along = 2.0 * (sin_alpha * sin_alpha);
    float t = (material.eta - 1.0) / (material.eta + 1.0);
    float root = t;
    hair.f0 = root * root;
    hair.f1 = 1.0 - hair.f0;
    hair.tilt_tt = -material.alpha;
    hair.tilt_trt = -4.0 * material.alpha;
    float z = 10.0 * (t - 0.21568628);
    hair.q1 = exp2(1.1893578 * z - 0.48315856);
    hair.q0 = exp2(1.1795474 * z - 5.221113);
    float beta = 2.0 * material.beta_m;
    float beta2 = beta * beta;
    float v = beta2;
    float u = v / (v + 0.3);
    hair.c = exp2(1.442695 * (-0.04524 * u - 1.832) * u + 2.6514962) / v;
    hair.o = exp2(1.442695 * (-1.501 * u + 1.514) * u - 0.25247163);
    float beta_r = 1.4142135 * material.beta_m;
    float narrow = -0.5 / (beta_r * beta_r);
    hair.narrow_r = 1.442695 * narrow;
    float peak = 0.3989423 / beta_r;
    hair.peak_r = 0.25 * peak;
    float beta_tt = 0.5 * material.beta_m;
    float narrow_tt = -0.5 / (beta_tt * beta_tt);
    hair.narrow_tt = 1.442695 * narrow_tt;
    float3 log_color = -4.0 * material.sigma_a;
    hair.log_color = 1.442695 * log_color;
    hair.peak_tt = 0.3989423 / beta_tt;
    float narrow_trt = -0.5 / beta2;
    hair.narrow_trt = 1.442695 * narrow_trt;
    hair.peak_trt = 0.3989423 / beta;
    float t_rest = tanh(1.0 / v);
    float level = 0.07957747 * (1.0 + t_rest) * exp2(1.1606481 * z - 4.408876)
        / (t_rest * v);
    float3 less = level / (1.0 + exp2(0.030412013 * z + 1.7413329) * material.sigma_a);
    hair.K1 = material.sigma_a * less
        * exp2(-0.5610641 * z + 0.9406372 - 9.029644 * material.sigma_a);
    hair.K0 = less
        * exp2(-1.442695 * exp2(-0.30585134 * z + 2.8940463) * material.sigma_a);
    float narrow_rest = -0.5 / v;
    hair.narrow_rest = 1.442695 * narrow_rest;
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
    float F = hair.f0 + hair.f1 * (x2 * x2 * x);
    float off = (sin_i + sin_o - shift) * over_half_phi;
    return hair.peak_r * F * exp2(hair.narrow_r * (off * off));
}

// Through the fiber. (1 - F)^2 C^(cos gamma_t/(2 cos theta_d)) D(phi) at one offset h
// for each phi, a = 1/eta'; a Gaussian in sin theta. The exponents of all three are
// one.
float3 hair_TT(HairConstants hair, float sin_i, float sin_o, float cos_phi,
    float cos_half_phi, float over_d, float cos_d) {
    float a = cos_d / (1.19 + 0.36 * (cos_d * cos_d));
    float h = (1.0 + a * (0.6 - 0.8 * cos_phi)) * cos_half_phi;
    float x = 1.0 - cos_d * sqrt(max(1.0 - h * h, 0.0));
    float x2 = x * x;
    float F = hair.f0 + hair.f1 * (x2 * x2 * x);
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
float3 hair_TRT(HairConstants hair, float sin_i, float sin_o, float cos_phi,
    float over_d, float cos_d) {
    float x = 1.0 - 0.5 * cos_d;
    float x2 = x * x;
    float F = hair.f0 + hair.f1 * (x2 * x2 * x);
    float passed = 1.0 - F;
    float off = sin_i + sin_o - hair.tilt_trt;
    float passes = 0.8 * over_d;
    return hair.peak_trt * (passed * passed) * F
        * exp2(24.525816 * cos_phi - 24.208424 + hair.narrow_trt * (off * off)
        + passes * hair.log_color);
}

// All lobes above TRT, uniform in azimuth: exp(-X/(2 v)) Y rsqrt(Y (q0 + q1 Y + Y^2)^2
// (o + c/v cos theta_i cos theta_o)) (K0 + K1 Y), X = 2 - 2 cos(theta_i + theta_o), Y =
// 4 cos^2 theta_d.
float3 hair_rest(HairConstants hair, float sin_i, float sin_o, float cos_i,
    float cos_o) {
    float both = sin_i + sin_o;
    float apart = cos_i - cos_o;
    float together = cos_i + cos_o;
    float square_both = both * both;
    float X = square_both + apart * apart;
    float Y = square_both + together * together;
    float quadratic = hair.q0 + Y * (hair.q1 + Y);
    float across = cos_i * cos_o;
    float square = Y * (hair.o + hair.c * across) * (quadratic * quadratic);
    return Y * rsqrt(square) * exp2(hair.narrow_rest * X) * (hair.K0 + Y * hair.K1);
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
    float square_half_phi = max(0.5 + 0.5 * cos_phi, 1e-12);
    float over_half_phi = rsqrt(square_half_phi);
    float cos_half_phi = square_half_phi * over_half_phi;
    float square_d = max(0.5 + 0.5 * (along + cos_i * cos_o), 1e-12);
    float over_d = rsqrt(square_d);
    float cos_d = square_d * over_d;
    return hair_R(hair, sin_i, sin_o, cos_io, cos_o, over_half_phi, cos_half_phi)
        + hair_TT(hair, sin_i, sin_o, cos_phi, cos_half_phi, over_d, cos_d)
        + hair_TRT(hair, sin_i, sin_o, cos_phi, over_d, cos_d)
        + hair_rest(hair, sin_i, sin_o, cos_i, cos_o);
}

// L towards the light, V towards the eye, T along the fiber: unit.
float3 hair_bsdf(HairMaterial material, float3 L, float3 V, float3 T) {
    return hair_bsdf_hoisted(hair_constants(material), L, V, T);
}
