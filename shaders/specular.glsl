// SPDX-License-Identifier: GPL-3.0-or-later
// Standard specular: a normalized Blinn-Phong highlight over a Lambert base. GLSL 3.30 and ES 3.00; functions only, no bindings.

// Returns the radiance reflected towards v per irradiance E0 on a plane that faces the light [1/sr]:
//     (N.L) [ rho / pi + k_s (n + 8) / (8 pi) (N.H)^n ],   H halfway between L and V
// n, l, v: unit normal, direction to the light and to the viewer. albedo: rho of the base, 0 to 1, clamped.
// specular: k_s, 0 to 1, clamped. exponent: n, 0 to 10000, clamped. Light or viewer behind the surface: 0.
vec3 specular_radiance(vec3 n, vec3 l, vec3 v, vec3 albedo, float specular, float exponent)
{
    float n_dot_l = dot(n, l);
    if (!(n_dot_l > 0.0) || !(dot(n, v) > 0.0)) {
        return vec3(0.0);
    }
    float n_dot_h = clamp(dot(n, normalize(l + v)), 1e-30, 1.0); // above 0: pow(0, 0) is undefined in GLSL
    float power = clamp(exponent, 0.0, 10000.0);
    float highlight = clamp(specular, 0.0, 1.0) * (power + 8.0) * pow(n_dot_h, power) / 8.0;
    return (clamp(albedo, 0.0, 1.0) + highlight) * (n_dot_l / 3.14159265358979);
}
