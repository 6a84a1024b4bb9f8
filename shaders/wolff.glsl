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

// Returns the radiance reflected towards v per irradiance E0 on a plane that faces the light [1/sr].
// n, l, v: unit normal, direction to the light and to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0. nn: from wolff_coefficients.
vec3 wolff_radiance(vec3 n, vec3 l, vec3 v, vec3 albedo, vec2 nn)
{
    DiffuseGeometry g = diffuse_geometry(n, l, v);
    if (!(g.mu_i > 0.0)) {
        return vec3(0.0);
    }
    float through = wolff_transmittance(g.mu_i, nn) * wolff_transmittance(g.mu_o, nn);
    return diffuse_albedo(albedo) * (g.mu_i * through / 3.14159265358979);
}
