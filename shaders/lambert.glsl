// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's ideal diffuse reflector:
//     L_r = (rho / pi) E0 (N.L)
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

struct LambertSurface {
    DiffuseView view;
    vec3 color; // rho / pi
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0.
LambertSurface lambert_surface(vec3 n, vec3 v, vec3 albedo)
{
    return LambertSurface(diffuse_view(n, v), diffuse_albedo(albedo) / 3.14159265358979);
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 lambert_radiance(LambertSurface surface, vec3 l)
{
    return surface.color * diffuse_geometry(surface.view, l).mu_i;
}

// Returns the directional albedo, rho from every view; mu: N.V, albedo: as above.
vec3 lambert_albedo(float mu, vec3 albedo)
{
    return diffuse_albedo(albedo);
}
