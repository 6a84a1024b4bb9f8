// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Wave Texture, as in addon/material/textures/wave.py.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include hashing.glsl, fractal_noise.glsl before it.

// Returns the output Fac, 0 to 1. type: bands, rings. bands: their direction x, y, z, diagonal. rings: x, y, z, spherical.
// profile: sine, saw, triangle. phase_offset: radians. detail: clamped to 0 to 15.
float wave_fac(int type, int bands, int rings, int profile, vec3 vector, float scale, float distortion, float detail,
               float detail_scale, float detail_roughness, float phase_offset)
{
    vec3 p = (vector * scale + 0.000001) * 0.999999, across = p;
    float phase;
    if (type == 0) {
        phase = bands < 3 ? p[bands] * 20.0 : (p.x + p.y + p.z) * 10.0;
    } else {
        if (rings < 3) {
            across[rings] = 0.0;
        }
        phase = length(across) * 20.0;
    }
    phase += phase_offset;
    if (distortion != 0.0) {
        float noise = noise_fbm(3, true, vec4(p * detail_scale, 0.0), clamp(detail, 0.0, 15.0), detail_roughness, 2.0);
        phase += distortion * (noise * 2.0 - 1.0);
    }
    if (profile == 0) {
        return 0.5 + 0.5 * sin(phase - 1.5707963267949);
    }
    float turns = phase / 6.28318530717959;
    return profile == 1 ? turns - floor(turns) : 2.0 * abs(turns - floor(turns + 0.5));
}

// Returns the output Color, a gray.
vec3 wave_color(int type, int bands, int rings, int profile, vec3 vector, float scale, float distortion, float detail,
                float detail_scale, float detail_roughness, float phase_offset)
{
    return vec3(wave_fac(type, bands, rings, profile, vector, scale, distortion, detail, detail_scale, detail_roughness,
                         phase_offset));
}
