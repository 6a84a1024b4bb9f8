// SPDX-License-Identifier: GPL-3.0-or-later
// Standard specular: a normalized Blinn-Phong highlight over a Lambert base, as games used to shade.
//     L_r = E0 (N.L) [ rho / pi + k_s (n + 8) / (8 pi) (N.H)^n ],   H halfway between L and V
// J. Blinn, "Models of Light Reflection for Computer Synthesized Pictures" (1977).
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

struct BlinnPhongSurface {
    DiffuseView view;
    vec3 v;
    vec3 color;      // rho / pi
    float highlight; // k_s (n + 8) / (8 pi)
    float half_n;
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho of the base, 0 to 1, clamped. specular: k_s, 0 to 1, clamped. exponent: n, 0 to 10000, clamped. NaN gives 0.
BlinnPhongSurface blinn_phong_surface(vec3 n, vec3 v, vec3 albedo, float specular, float exponent)
{
    float power = diffuse_range(exponent, 10000.0);
    float highlight = diffuse_range(specular, 1.0) * (power + 8.0) / 25.1327412287183; // 8 pi
    return BlinnPhongSurface(diffuse_view(n, v), v, diffuse_albedo(albedo) / 3.14159265358979, highlight, 0.5 * power);
}

// Returns log((N.H)^2), at most 0. A power of 10000 raises the error of N.H ten thousandfold, so near 1 it comes from what N.H
// lacks to 1: (N.H)^2 - H.H for any length of H, the leading parts without rounding.
float blinn_phong_log(BlinnPhongSurface surface, vec3 l)
{
    vec3 h = l + surface.v;
    float longest = max(max(abs(h.x), abs(h.y)), abs(h.z));
    h *= 0.5 / uintBitsToFloat(floatBitsToUint(longest) & 0x7f800000u); // by a power of 2, so that no digit is lost
    vec2 across = diffuse_height(surface.view, h);
    vec2 along = diffuse_dot(h, h);
    float lead = floor(across.x * 2048.0 + 0.5) / 2048.0;
    float rest = (across.x - lead) + across.y;
    float lacking = (lead * lead - along.x) + (rest * (2.0 * lead + rest) - along.y);
    float x = min(lacking / (along.x + along.y), 0.0); // (N.H)^2 - 1 for a unit H
    float z = x / (2.0 + x); // log(1 + x) = 2 atanh(z)
    float series = 2.0 * z * (1.0 + z * z * (1.0 / 3.0 + z * z * (1.0 / 5.0 + z * z / 7.0)));
    return x > -0.2 ? series : log(max(1.0 + x, 1e-30));
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 blinn_phong_radiance(BlinnPhongSurface surface, vec3 l)
{
    DiffuseGeometry g = diffuse_geometry(surface.view, l);
    if (!(g.mu_i > 0.0)) {
        return vec3(0.0);
    }
    return (surface.color + surface.highlight * exp(surface.half_n * blinn_phong_log(surface, l))) * g.mu_i;
}
