// SPDX-License-Identifier: GPL-3.0-or-later
// EON, OpenPBR's energy-preserving Oren-Nayar. J. Portsmouth, P. Kutz, S. Hill, "EON: A Practical Energy-Preserving Rough Diffuse
// BRDF" (JCGT 14(1), 2025). Fujii's model plus what is reflected more than once, with E its directional albedo at rho = 1:
//     L_r = L_Fujii + (rho_ms / pi) E0 (N.L) (1 - E(N.L)) (1 - E(N.V)) / (1 - <E>),   rho_ms = rho^2 <E> / (1 - rho (1 - <E>))
//     1 - E(mu) = A r (K1 - G(mu) / pi),   1 - <E> = A r (K1 - K2),   K1 = 1/2 - 2 / (3 pi),   K2 = 2/3 - 28 / (15 pi)
//     G(mu) = S (theta - S mu) + (2/3) ((S / mu) (1 - S^3) - S),   S = sin(theta),   mu = cos(theta)
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include geometry.glsl and fujii.glsl before it.

// Returns (A, r, 1 - <E>), which depend on the roughness alone: work them out once per material.
// roughness: r, 0 (Lambert) to 1, clamped, NaN gives 0.
vec3 eon_coefficients(float roughness)
{
    vec2 ar = fujii_coefficients(roughness);
    return vec3(ar, ar.x * ar.y * 0.215305196753882); // K1 - K2
}

// Returns (K1 - G(mu) / pi) / (K1 - K2), which is (1 - E(mu)) / (1 - <E>) at every roughness, for mu = cos(theta), S = sin(theta).
// It vanishes with mu: pi / 2 - theta and 1 - S = mu^2 / (1 + S) keep that exact.
float eon_deficit(float mu, float S)
{
    float left = 0.904129660127230 * mu * mu / (1.0 + S); // (pi / 2 - 2/3) (1 - S)
    float right = S * (diffuse_asin(mu) + S * mu - 0.666666666666667 * mu * (1.0 + S + S * S) / (1.0 + S));
    return (left + right) / 0.676401224401702; // pi (K1 - K2)
}

struct EonSurface {
    FujiiSurface single_scattering;
    vec3 multiple_scattering; // rho_ms (1 - E(N.V)) / pi
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho, 0 to 1, clamped, NaN gives 0. arl: from eon_coefficients.
EonSurface eon_surface(vec3 n, vec3 v, vec3 albedo, vec3 arl)
{
    FujiiSurface single_scattering = fujii_surface(n, v, albedo, arl.xy);
    vec3 rho = diffuse_albedo(albedo);
    float deficit = arl.z * eon_deficit(single_scattering.view.mu_o, single_scattering.view.sin_o);
    return EonSurface(single_scattering, rho * rho * ((1.0 - arl.z) * deficit / 3.14159265358979) / (1.0 - rho * arl.z));
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 eon_radiance(EonSurface surface, vec3 l)
{
    DiffuseGeometry g = diffuse_geometry(surface.single_scattering.view, l);
    return surface.single_scattering.color * fujii_lobe(surface.single_scattering, g)
        + surface.multiple_scattering * (g.mu_i * eon_deficit(g.mu_i, g.sin_i));
}
