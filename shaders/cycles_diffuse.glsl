// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's own Diffuse BSDF as Cycles renders it (Blender 5.2, kernel/closure/bsdf_oren_nayar.h): EON but for one factor, as its
// multiple scattering carries rho^3 where EON has rho^2. It loses energy for 0 < rho < 1; at rho = 1 the two are the same.
//     L_r = L_Fujii + rho L_ms,   L_ms the second summand of eon.glsl
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include geometry.glsl, fujii.glsl and eon.glsl before it.

// Returns what depends on the roughness alone: work it out once per material.
// roughness: the node's Roughness, 0 (Lambert) to 1, clamped, NaN gives 0.
vec3 cycles_diffuse_coefficients(float roughness)
{
    return eon_coefficients(roughness);
}

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, the node's Color, 0 to 1, clamped, NaN gives 0. arl: from cycles_diffuse_coefficients.
EonSurface cycles_diffuse_surface(vec3 n, vec3 v, vec3 albedo, vec3 arl)
{
    EonSurface surface = eon_surface(n, v, albedo, arl);
    surface.multiple_scattering *= diffuse_albedo(albedo);
    return surface;
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 cycles_diffuse_radiance(EonSurface surface, vec3 l)
{
    return eon_radiance(surface, l);
}
