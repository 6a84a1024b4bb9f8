// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's ideal diffuse reflector:
//     L_r = (rho / pi) E0 (N.L)
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

// Returns the radiance reflected towards v per irradiance E0 on a plane that faces the light [1/sr].
// n, l, v: unit normal, direction to the light and to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0.
vec3 lambert_radiance(vec3 n, vec3 l, vec3 v, vec3 albedo)
{
    return diffuse_albedo(albedo) * (diffuse_geometry(n, l, v).mu_i / 3.14159265358979);
}
