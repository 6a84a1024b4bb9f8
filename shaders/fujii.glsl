// SPDX-License-Identifier: GPL-3.0-or-later
// Y. Fujii, "A tiny improvement of Oren-Nayar reflectance model" (2015), single scattering only:
//     L_r = (rho / pi) E0 (N.L) A (1 + r s / t),   s = L.V - (N.L)(N.V),   t = max(N.L, N.V) where s > 0, else 1
//     A = 1 / (1 + K1 r),   K1 = 1/2 - 2 / (3 pi)
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

// Returns (A, r), which depend on the roughness alone: work them out once per material.
// roughness: r, 0 (Lambert) to 1, clamped, NaN gives 0.
vec2 fujii_coefficients(float roughness)
{
    float r = diffuse_range(roughness, 1.0);
    return vec2(1.0 / (1.0 + 0.287793409210806 * r), r);
}

// Returns the part of the radiance [1] that (rho / pi) E0 multiplies; ar: from fujii_coefficients.
float fujii_lobe(DiffuseGeometry g, vec2 ar)
{
    // (N.L) / t is at most 1 and stays finite where t vanishes.
    float ramp = g.s > 0.0 ? (g.mu_i < g.mu_o ? g.mu_i / g.mu_o : 1.0) : g.mu_i;
    return ar.x * max(0.0, g.mu_i + ar.y * g.s * ramp);
}

// Returns the radiance reflected towards v per irradiance E0 on a plane that faces the light [1/sr].
// n, l, v: unit normal, direction to the light and to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0. ar: from fujii_coefficients.
vec3 fujii_radiance(vec3 n, vec3 l, vec3 v, vec3 albedo, vec2 ar)
{
    return diffuse_albedo(albedo) * (fujii_lobe(diffuse_geometry(n, l, v), ar) / 3.14159265358979);
}
