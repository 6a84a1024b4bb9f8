// SPDX-License-Identifier: GPL-3.0-or-later
// Reflection of rough specular surfaces: the GGX distribution of microfacets with height-correlated masking and shadowing.
//     L_r = E0 F D G2 / (4 N.V)
// B. Walter and others, "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007); E. Heitz, "Understanding the
// Masking-Shadowing Function in Microfacet-Based BRDFs" (JCGT 3(2), 2014). Fresnel's factor F, at the cosine V.H, is apart:
//     dielectric: between its color at normal incidence and white, as the real one is (Cycles' generalized Schlick)
//     metal: F82 (N. Kutz, N. Hasan, D. Edmondson, "Novel Aspects of the Adobe Standard Material", 2023)
// What single scattering loses comes back in the same shape, as in Cycles: C. Kulla, A. Conty, "Revisiting Physically Based Shading
// at Imageworks" (2017), with the directional albedo E(N.V) of D G2 and its mean.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

// Returns alpha along the tangent and across it, at least 1e-3: a smoother surface would show nothing of a light without size.
// roughness and anisotropy: 0 to 1, clamped, NaN gives 0.
vec2 ggx_alpha(float roughness, float anisotropy)
{
    float r = diffuse_range(roughness, 1.0);
    float aspect = sqrt(1.0 - 0.9 * diffuse_range(anisotropy, 1.0));
    return max(vec2(1e-3), r * r * vec2(1.0 / aspect, aspect));
}

struct GgxLobe {
    vec3 n;
    vec3 v;
    vec3 x;     // unit tangent
    vec3 y;     // n x tangent
    vec2 alpha; // along x and y
    float mu_o; // N.V
    float r_o;  // N.V (1 + 2 Lambda(V))
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; tangent: any vector that is not along n,
// 0 where alpha is the same along it and across; alpha: from ggx_alpha.
GgxLobe ggx_lobe(vec3 n, vec3 v, vec3 tangent, vec2 alpha)
{
    float mu_o = clamp(dot(n, v), 1e-4, 1.0);
    vec3 y = cross(n, tangent);
    float square = dot(y, y);
    y = square > 1e-20 ? y * inversesqrt(square) : vec3(0.0);
    vec3 x = cross(y, n);
    vec2 along = alpha.x == alpha.y ? vec2(alpha.x * sqrt(max(0.0, 1.0 - mu_o * mu_o)), 0.0) : alpha * vec2(dot(x, v), dot(y, v));
    return GgxLobe(n, v, x, y, alpha, mu_o, sqrt(mu_o * mu_o + dot(along, along)));
}

// Returns D G2 / (4 N.V), the radiance towards v per irradiance E0 on a plane that faces the light without F [1/sr].
// l: unit direction to the light; cosine: V.H, of F.
float ggx_radiance(GgxLobe lobe, vec3 l, out float cosine)
{
    float mu_i = dot(lobe.n, l);
    vec3 h = l + lobe.v;
    float h_dot_h = dot(h, h);
    cosine = 1.0;
    if (!(mu_i > 0.0) || !(h_dot_h > 1e-20)) {
        return 0.0;
    }
    h *= inversesqrt(h_dot_h);
    cosine = min(dot(lobe.v, h), 1.0);
    float spread, r_i;
    if (lobe.alpha.x == lobe.alpha.y) {
        float alpha2 = lobe.alpha.x * lobe.alpha.x;
        vec3 across = cross(lobe.n, h); // sin^2 of the angle between N and H, which 1 - (N.H)^2 would lose
        float sin2 = min(dot(across, across), 1.0);
        spread = 1.0 - sin2 + sin2 / alpha2;
        r_i = sqrt(alpha2 + (1.0 - alpha2) * mu_i * mu_i);
    } else {
        vec3 scaled = vec3(vec2(dot(lobe.x, h), dot(lobe.y, h)) / lobe.alpha, dot(lobe.n, h));
        spread = dot(scaled, scaled);
        vec2 along = lobe.alpha * vec2(dot(lobe.x, l), dot(lobe.y, l));
        r_i = sqrt(mu_i * mu_i + dot(along, along));
    }
    return mu_i / (6.28318530717959 * lobe.alpha.x * lobe.alpha.y * spread * spread * (lobe.mu_o * r_i + mu_i * lobe.r_o));
}

// Returns the reflectance of a dielectric of relative index ior, unpolarized, at a cosine of 0 to 1; 1 at total reflection.
float ggx_dielectric(float cosine, float ior)
{
    float g2 = ior * ior - 1.0 + cosine * cosine;
    if (!(g2 > 0.0)) {
        return 1.0;
    }
    float g = sqrt(g2);
    float a = (g - cosine) / (g + cosine), b = (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

// Returns the reflectance at normal incidence of a dielectric of relative index ior.
float ggx_f0(float ior)
{
    float root = (ior - 1.0) / (ior + 1.0);
    return root * root;
}

// Returns the index, 1 or more, whose reflectance at normal incidence is f0, at most 0.99.
float ggx_ior(float f0)
{
    float root = sqrt(diffuse_range(f0, 0.99));
    return (1.0 + root) / (1.0 - root);
}

// Returns how far a dielectric is at a cosine from its reflectance at normal incidence, 0, to 1, total reflection.
float ggx_grazing(float cosine, float ior)
{
    float f0 = ggx_f0(ior);
    return clamp((ggx_dielectric(cosine, ior) - f0) / max(1.0 - f0, 1e-6), 0.0, 1.0);
}

// Returns the mean over the hemisphere, weighted by the cosine, of a dielectric's reflectance (Kulla and Conty).
float ggx_dielectric_mean(float ior)
{
    return ior < 1.0 ? 0.997118 + ior * (0.1014 - ior * (0.965241 + ior * 0.130607)) : (ior - 1.0) / (4.08567 + 1.00071 * ior);
}

// Returns what F82 takes from Schlick's reflectance per cosine (1 - cosine)^6; tint: the factor on it at a cosine of 1 / 7.
vec3 ggx_f82_dip(vec3 f0, vec3 tint)
{
    const float f = 6.0 / 7.0, f5 = f * f * f * f * f;
    return mix(f0, vec3(1.0), f5) * (7.0 / (f5 * f)) * (1.0 - tint);
}

// Returns the reflectance of a metal at a cosine; dip: from ggx_f82_dip.
vec3 ggx_f82(float cosine, vec3 f0, vec3 dip)
{
    float s = clamp(1.0 - cosine, 0.0, 1.0);
    float s2 = s * s, s5 = s2 * s2 * s;
    return clamp(mix(f0, vec3(1.0), s5) - dip * (cosine * s5 * s), 0.0, 1.0);
}

// Returns the mean of ggx_f82 over the hemisphere, weighted by the cosine.
vec3 ggx_f82_mean(vec3 f0, vec3 dip)
{
    return clamp(mix(f0, vec3(1.0), 1.0 / 21.0) - dip / 126.0, 0.0, 1.0);
}

// Returns the factor on single scattering that gives back what bounces between microfacets.
// mean_fresnel: of F; albedo, mean_albedo: E(N.V), and its mean weighted by the cosine.
vec3 ggx_multiple(vec3 mean_fresnel, float albedo, float mean_albedo)
{
    vec3 again = mean_fresnel * mean_albedo / (1.0 - mean_fresnel * (1.0 - mean_albedo));
    return 1.0 + again * ((1.0 - albedo) / albedo);
}
