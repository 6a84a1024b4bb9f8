// SPDX-License-Identifier: GPL-3.0-or-later
// Directional albedo of the rough diffuse models: the radiance reflected towards N.V = mu of light of radiance 1 from everywhere,
// the integral of f_r (N.L) over L. Multiplied by the sky's radiance it is the ambient term, exact where the sky is even.
// They are exact but for Oren-Nayar 1994, Wolff and Blinn-Phong's highlight, which state their errors; scripts/fit/albedo.py finds
// their numbers, scripts/fit/lobes.py those of Wolff.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include geometry.glsl, fujii.glsl, eon.glsl and wolff.glsl before it.
// In all of them mu: N.V, 0 to 1, clamped, NaN gives 0. rho: the albedo, 0 to 1, clamped, NaN gives 0.

// Returns 1 - E(mu) of Fujii's model over A r (K1 - K2).
float albedo_deficit(float mu)
{
    float m = diffuse_range(mu, 1.0);
    return eon_deficit(m, sqrt((1.0 - m) * (1.0 + m)));
}

// Returns the albedo of oren_nayar.glsl: rho (A + B T), where T is G(mu) / pi of eon.glsl without its part for s < 0,
// -2 sin(theta) / (3 pi). ab: from oren_nayar_coefficients.
vec3 oren_nayar_albedo(float mu, vec3 rho, vec2 ab)
{
    float m = diffuse_range(mu, 1.0);
    float t = 0.287793409210806 - 0.215305196753882 * albedo_deficit(m) + 0.212206590789194 * sqrt((1.0 - m) * (1.0 + m));
    return diffuse_albedo(rho) * (ab.x + ab.y * max(0.0, t));
}

// Returns the albedo of fujii.glsl, rho E(mu); ar: from fujii_coefficients.
vec3 fujii_albedo(float mu, vec3 rho, vec2 ar)
{
    return diffuse_albedo(rho) * (1.0 - ar.x * ar.y * 0.215305196753882 * albedo_deficit(mu));
}

// Returns the albedo of eon.glsl, rho E(mu) + rho_ms (1 - E(mu)); arl: from eon_coefficients.
vec3 eon_albedo(float mu, vec3 rho, vec3 arl)
{
    vec3 color = diffuse_albedo(rho);
    float deficit = arl.z * albedo_deficit(mu);
    return color * (1.0 - deficit + color * ((1.0 - arl.z) * deficit) / (1.0 - color * arl.z));
}

// Returns the albedo of cycles_diffuse.glsl, rho E(mu) + rho rho_ms (1 - E(mu)); arl: from cycles_diffuse_coefficients.
vec3 cycles_diffuse_albedo(float mu, vec3 rho, vec3 arl)
{
    vec3 color = diffuse_albedo(rho);
    float deficit = arl.z * albedo_deficit(mu);
    return color * (1.0 - deficit + color * color * ((1.0 - arl.z) * deficit) / (1.0 - color * arl.z));
}

// Returns the albedo of oren_nayar_1994.glsl: rho (A + B f(mu) + rho c), with f fitted to 0.0024, so within 0.0011 rho for sigma up
// to 0.66. That the radiance stops at 0 for higher ones is left out, so this is too low: by 0.0027 rho at pi / 2, 0.0055 rho at 100.
// abc: from oren_nayar_1994_coefficients.
vec3 oren_nayar_1994_albedo(float mu, vec3 rho, vec3 abc)
{
    vec3 color = diffuse_albedo(rho);
    float m = diffuse_range(mu, 1.0);
    float f = (1.0 - m) * (0.39632 - 0.18953 * sqrt(m) - 0.16266 * m);
    return color * (abc.x + abc.y * f + color * abc.z);
}

// Returns the albedo of wolff.glsl: rho T(mu) times the mean of T over light from everywhere, a polynomial in (n - 1) / (n + 1)
// that is within 0.2 % of it. nn: from wolff_coefficients.
vec3 wolff_albedo(float mu, vec3 rho, vec2 nn)
{
    float n_plus_1 = sqrt(nn.x) + 1.0;
    float f = nn.y / (n_plus_1 * n_plus_1);
    float average = 1.0 - f * (0.50647 + f * (-0.42269 + f * 1.0386));
    return diffuse_albedo(rho) * (average * wolff_transmittance(max(1e-9, diffuse_range(mu, 1.0)), nn));
}

// Returns the albedo of pitted.glsl, rho / (2 - rho) at every mu; rho: the albedo of the walls.
vec3 pitted_albedo(float mu, vec3 rho)
{
    vec3 color = diffuse_albedo(rho);
    return color / (2.0 - color);
}

// Returns the albedo of blinn_phong.glsl: rho + k_s h(mu, n) with S = sin(theta), t = mu sqrt(n) and
//     h = (n + 8) / ((n + 2) (n + 4)) [n mu^2 + 2 S^2 - (1 - 2 mu^2) 2^(-t^2 / 2) e^(-(1 - mu) (0.87 t + 0.42 t^2))]
// Without the last term that is the integral over all H; the last, a fit, is what L below the surface would add: h is exact at
// mu = 0, at mu = 1 and for n = 0, else within 3.2 % of its value. It can be above 1.
// specular: k_s, 0 to 1, exponent: n, 0 to 10000; clamped, NaN gives 0.
vec3 blinn_phong_albedo(float mu, vec3 rho, float specular, float exponent)
{
    float m = diffuse_range(mu, 1.0);
    float n = diffuse_range(exponent, 10000.0);
    float t = m * sqrt(n);
    float below = (1.0 - 2.0 * m * m) * exp(-t * (0.346573590279973 * t + (1.0 - m) * (0.87 + 0.42 * t)));
    float h = (n + 8.0) / ((n + 2.0) * (n + 4.0)) * (t * t + 2.0 * (1.0 - m) * (1.0 + m) - below);
    return diffuse_albedo(rho) + diffuse_range(specular, 1.0) * h;
}
