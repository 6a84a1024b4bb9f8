// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's ideal diffuse reflector. GLSL 3.30 and ES 3.00; functions only, no bindings.

// Returns the radiance reflected towards v per irradiance E0 on a plane that faces the light [1/sr]: (rho / pi) (N.L).
// n, l, v: unit normal, direction to the light and to the viewer. albedo: rho, 0 to 1, clamped. Light or viewer behind: 0.
vec3 lambert_radiance(vec3 n, vec3 l, vec3 v, vec3 albedo)
{
    float n_dot_l = dot(n, l);
    if (!(n_dot_l > 0.0) || !(dot(n, v) > 0.0)) {
        return vec3(0.0);
    }
    return clamp(albedo, 0.0, 1.0) * (n_dot_l / 3.14159265358979);
}
