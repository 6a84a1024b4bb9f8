// SPDX-License-Identifier: GPL-3.0-or-later
// Diffuse reflection of a smooth dielectric: light refracts in, scatters, refracts out. L. Wolff, "Diffuse-reflectance model for
// smooth dielectric surfaces" (JOSA A 11(11), 1994), with F Fresnel's reflectance of unpolarised light and n the index inside:
//     L_r = (rho / pi) E0 (N.L) [1 - F(theta_i, n)] [1 - F(asin(sin(theta_r) / n), 1 / n)]
// Fresnel's transmittance is the same both ways, so the second bracket is 1 - F(theta_r, n).
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

// Returns (n^2, n^2 - 1), which depend on the material alone: work them out once.
// ior: n, 1 (Lambert) to 3, clamped, NaN gives 1.
vec2 wolff_coefficients(float ior)
{
    float n = max(1.0, diffuse_range(ior, 3.0));
    return vec2(n * n, (n - 1.0) * (n + 1.0));
}

// Returns 1 - F for the cosine mu outside, above 0 to 1: the mean of the transmittances of both polarisations, without the
// difference, which would cancel at grazing angles. nn: from wolff_coefficients.
float wolff_transmittance(float mu, vec2 nn)
{
    float inside = sqrt(nn.y + mu * mu); // n cos(theta_t)
    float across = mu + inside;
    float along = nn.x * mu + inside;
    return 2.0 * mu * inside * (1.0 / (across * across) + nn.x / (along * along));
}

struct WolffSurface {
    DiffuseView view;
    vec3 color; // rho [1 - F(theta_r, n)] / pi
    vec2 nn;
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0. nn: from wolff_coefficients.
WolffSurface wolff_surface(vec3 n, vec3 v, vec3 albedo, vec2 nn)
{
    DiffuseView view = diffuse_view(n, v);
    float leaving = wolff_transmittance(max(view.mu_o, 1e-18), nn);
    return WolffSurface(view, diffuse_albedo(albedo) * (leaving / 3.14159265358979), nn);
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 wolff_radiance(WolffSurface surface, vec3 l)
{
    float mu_i = diffuse_geometry(surface.view, l).mu_i;
    return surface.color * (mu_i * wolff_transmittance(max(mu_i, 1e-18), surface.nn));
}
