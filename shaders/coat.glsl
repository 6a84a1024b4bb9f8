// SPDX-License-Identifier: GPL-3.0-or-later
// A rough dielectric coat over a base, weight w: a fraction w F of what the viewer sees is the coat's, whatever the light:
//     L_r = (1 - w F) L_base + w F L_coat,   F = coat_fresnel,   L_coat = coat_highlight E0
// L_coat is a GGX microfacet reflection that loses no energy, alpha = roughness^2, H halfway between L and V. B. Walter and others,
// "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007), E. Heitz's height-correlated masking (JCGT 3(2), 2014):
//     L_coat = (E0 / E(N.V)) D G2 / (4 N.V),   D = alpha^2 / (pi [(N.H)^2 (alpha^2 - 1) + 1]^2)
//     G2 = 2 (N.L)(N.V) / [(N.V) R(N.L) + (N.L) R(N.V)],   R(mu) = sqrt(alpha^2 + (1 - alpha^2) mu^2)
// E is the directional albedo of D G2 alone: what bounces between the microfacets is given back in the same shape, as Cycles does
// for Multiscatter GGX. That makes it reciprocal but for the factor 1 / E(N.V).
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl and wolff.glsl before it.

// Returns alpha, at least 1e-3: a smoother coat would show nothing of a light without size.
// roughness: 0 to 1, clamped, NaN gives 0.
float coat_alpha(float roughness)
{
    float r = diffuse_range(roughness, 1.0);
    return max(1e-3, r * r);
}

// Returns F, 0 to 1: Fresnel's reflectance averaged over the microfacets that the viewer sees, within 0.02 at index 1.4; that of a
// smooth surface at the cosine sqrt(A + B mu + C mu^2) (addon/closures/coat.py).
// mu: N.V, 0 to 1, roughness: 0 to 1, ior: 1 to 3; clamped, NaN gives the lowest.
float coat_fresnel(float mu, float roughness, float ior)
{
    float m = diffuse_range(mu, 1.0);
    float r = diffuse_range(roughness, 1.0);
    float alpha = r * r;
    float normal_incidence = 1.0 - alpha / (1.0 + 3.1 * alpha);
    float a = alpha * alpha / (0.2 + alpha * (1.6 + 2.4 * alpha));
    float b = 0.5 * alpha;
    float cosine = sqrt(a + m * (b + m * (normal_incidence - a - b)));
    return diffuse_range(1.0 - wolff_transmittance(max(1e-9, cosine), wolff_coefficients(ior)), 1.0);
}

// Returns E(mu), 0.3 to 1, within 1.6 % of it: a fit by scripts/fit/albedo.py, exact at mu = 0 and where alpha vanishes.
// mu: N.V, 0 to 1.
float coat_single_albedo(float mu, float alpha)
{
    float near = mu * alpha * alpha / ((mu + 0.18 * alpha) * (mu * mu + alpha * (5.9 * alpha - 2.1 * mu)));
    return 1.0 - near * (0.53998 + alpha * (0.34955 + 2.8904 * alpha) + mu * (-0.51646 + alpha * (3.5440 - 2.8879 * alpha)));
}

struct CoatSurface {
    DiffuseView view;
    vec3 n;
    vec3 v;
    float alpha2;
    float r_o;   // R(N.V)
    float scale; // alpha^2 / (2 pi E(N.V))
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// roughness: 0 to 1, clamped, NaN gives 0.
CoatSurface coat_surface(vec3 n, vec3 v, float roughness)
{
    DiffuseView view = diffuse_view(n, v);
    float alpha = coat_alpha(roughness);
    float alpha2 = alpha * alpha;
    float r_o = sqrt(alpha2 + (1.0 - alpha2) * view.mu_o * view.mu_o);
    return CoatSurface(view, n, v, alpha2, r_o, alpha2 / (6.28318530717959 * coat_single_albedo(view.mu_o, alpha)));
}

// Returns the radiance that the coat mirrors towards v per irradiance E0 on a plane that faces the light [1/sr], without F.
// l: unit direction to the light.
float coat_highlight(CoatSurface surface, vec3 l)
{
    float mu_i = diffuse_geometry(surface.view, l).mu_i;
    vec3 h = l + surface.v;
    float h_dot_h = dot(h, h);
    if (!(mu_i > 0.0) || !(h_dot_h > 1e-30)) {
        return 0.0;
    }
    vec3 across = cross(surface.n, h);
    // sin^2 of the angle between N and H, which 1 - (N.H)^2 would lose, and from it (N.H)^2 (alpha^2 - 1) + 1
    float spread = surface.alpha2 + (1.0 - surface.alpha2) * min(dot(across, across) / h_dot_h, 1.0);
    float r_i = sqrt(surface.alpha2 + (1.0 - surface.alpha2) * mu_i * mu_i);
    return surface.scale / (spread * spread) * mu_i / (surface.view.mu_o * r_i + mu_i * surface.r_o);
}
