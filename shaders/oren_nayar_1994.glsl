// SPDX-License-Identifier: GPL-3.0-or-later
// The full Oren-Nayar model. M. Oren and S. Nayar, "Generalization of Lambert's Reflectance Model" (SIGGRAPH 1994), equations (27)
// to (29), with alpha and beta the larger and smaller of the angles from N, phi the azimuth from light to viewer, s2 = sigma^2:
//     L_1 = (rho / pi) E0 cos(theta_i) [ C1 + C2 cos(phi) tan(beta) + C3 (1 - |cos(phi)|) tan((alpha + beta) / 2) ]
//     L_2 = 0.17 (rho^2 / pi) E0 cos(theta_i) s2 / (s2 + 0.13) [ 1 - cos(phi) (2 beta / pi)^2 ],   L_r = L_1 + L_2
//     C1 = A = 1 - 0.5 s2 / (s2 + 0.33),   B = 0.45 s2 / (s2 + 0.09),   C3 = 0.125 s2 / (s2 + 0.09) (4 alpha beta / pi^2)^2
//     C2 = B sin(alpha) where cos(phi) >= 0, else B (sin(alpha) - (2 beta / pi)^3)
// For sigma above 0.66 and light and viewer low on opposite sides the sum falls below 0; here it stops at 0.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include geometry.glsl and oren_nayar.glsl before it.

// Returns (A, B, 0.17 s2 / (s2 + 0.13)), which depend on sigma alone: work them out once per material.
// sigma: the standard deviation of the facets' slope angle [radians], clamped to 0 ... 100, NaN gives 0.
vec3 oren_nayar_1994_coefficients(float sigma)
{
    float s = diffuse_range(sigma, 100.0);
    return vec3(oren_nayar_coefficients(s), 0.17 * s * s / (s * s + 0.13));
}

struct OrenNayar1994Surface {
    DiffuseView view;
    vec3 rho;
    vec3 abc;
    float above_o; // 1 - 2 theta_r / pi
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0. abc: from oren_nayar_1994_coefficients.
OrenNayar1994Surface oren_nayar_1994_surface(vec3 n, vec3 v, vec3 albedo, vec3 abc)
{
    DiffuseView view = diffuse_view(n, v);
    return OrenNayar1994Surface(view, diffuse_albedo(albedo), abc, 0.636619772367581 * diffuse_asin(view.mu_o));
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 oren_nayar_1994_radiance(OrenNayar1994Surface surface, vec3 l)
{
    DiffuseGeometry g = diffuse_geometry(surface.view, l);
    if (!(g.mu_i > 0.0)) {
        return vec3(0.0);
    }
    float mu_o = surface.view.mu_o;
    float low = min(g.mu_i, mu_o);
    float sin_alpha = max(g.sin_i, surface.view.sin_o);
    float sin_beta = min(g.sin_i, surface.view.sin_o);
    // cos(phi) is undefined where beta is 0; there all it multiplies is 0 too.
    float cos_phi = sin_beta > 0.0 ? clamp(g.s / (g.sin_i * surface.view.sin_o), -1.0, 1.0) : 0.0;
    float above_i = 0.636619772367581 * diffuse_asin(g.mu_i);
    float above = max(above_i, surface.above_o); // 1 - 2 beta / pi
    float b = 1.0 - above;
    float a = 1.0 - min(above_i, surface.above_o);
    float shape = 1.0; // C2 / (B sin(alpha))
    if (cos_phi < 0.0) {
        // sin(alpha) - b^3 as the difference of what both lack to 1, since both are near 1 where tan(beta) is large
        shape = (above * (3.0 - above * (3.0 - above)) - low * low / (1.0 + sin_alpha)) / sin_alpha;
    }
    float ramp = g.mu_i < mu_o ? g.mu_i / mu_o : 1.0; // cos(theta_i) sin(alpha) tan(beta) cos(phi) = s ramp
    float diagonal = (sin_alpha + sin_beta) / (g.mu_i + mu_o); // tan((alpha + beta) / 2)
    vec3 abc = surface.abc;
    float single = abc.x * g.mu_i + abc.y * shape * g.s * ramp
        + abc.y / 3.6 * (a * a * b * b) * (1.0 - abs(cos_phi)) * diagonal * g.mu_i; // 0.125 = 0.45 / 3.6
    float interreflection = abc.z * g.mu_i * (1.0 - cos_phi * b * b);
    return surface.rho * (max(vec3(0.0), single + surface.rho * interreflection) / 3.14159265358979);
}
