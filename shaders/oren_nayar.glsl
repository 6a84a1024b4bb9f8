// SPDX-License-Identifier: GPL-3.0-or-later
// Oren-Nayar, equation (1) of Kim and Lee, "Surface Model and Scattering Analysis for Realistic Game Character" (2021):
//     L_r = (rho / pi) E0 [ A (N.L) + B max(0, s) min(1, (N.L) / (N.E)) ],   s = E.L - (N.E)(N.L)
//     A = 1 - 0.5 sigma^2 / (sigma^2 + 0.33),   B = 0.45 sigma^2 / (sigma^2 + 0.09)
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

// Returns (A, B), which depend on sigma alone: work them out once per material.
// sigma: the standard deviation of the facets' slope angle [radians], clamped to 0 ... 100, NaN gives 0.
vec2 oren_nayar_coefficients(float sigma)
{
    float s = diffuse_range(sigma, 100.0);
    float s2 = s * s;
    return vec2(1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09));
}

struct OrenNayarSurface {
    DiffuseView view;
    vec3 color; // rho / pi
    vec2 ab;
    float b_over_mu; // B / (N.E)
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer (the paper's E); geometry.glsl says what
// becomes of others. albedo: rho, 0 to 1, clamped, NaN gives 0. ab: from oren_nayar_coefficients.
OrenNayarSurface oren_nayar_surface(vec3 n, vec3 v, vec3 albedo, vec2 ab)
{
    DiffuseView view = diffuse_view(n, v);
    return OrenNayarSurface(view, diffuse_albedo(albedo) / 3.14159265358979, ab, ab.y / max(view.mu_o, 1e-18));
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 oren_nayar_radiance(OrenNayarSurface surface, vec3 l)
{
    DiffuseGeometry g = diffuse_geometry(surface.view, l);
    float b_ramp = min(surface.ab.y, surface.b_over_mu * g.mu_i);
    return surface.color * (surface.ab.x * g.mu_i + max(0.0, g.s) * b_ramp);
}
