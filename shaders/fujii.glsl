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

struct FujiiSurface {
    DiffuseView view;
    vec3 color; // rho A / pi
    float r;
    float r_over_mu; // r / (N.V)
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0. ar: from fujii_coefficients.
FujiiSurface fujii_surface(vec3 n, vec3 v, vec3 albedo, vec2 ar)
{
    DiffuseView view = diffuse_view(n, v);
    return FujiiSurface(view, diffuse_albedo(albedo) * (ar.x / 3.14159265358979), ar.y, ar.y / max(view.mu_o, 1e-18));
}

// Returns L_r / (rho A E0 / pi); g: from diffuse_geometry.
float fujii_lobe(FujiiSurface surface, DiffuseGeometry g)
{
    // r (N.L) / t, which stays finite where t vanishes
    float r_ramp = g.s > 0.0 ? min(surface.r, surface.r_over_mu * g.mu_i) : surface.r * g.mu_i;
    return max(0.0, g.mu_i + g.s * r_ramp);
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 fujii_radiance(FujiiSurface surface, vec3 l)
{
    return surface.color * fujii_lobe(surface, diffuse_geometry(surface.view, l));
}
