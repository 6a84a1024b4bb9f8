// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Noise Texture, as in addon/material/textures/noise.py.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include hashing.glsl, fractal_noise.glsl before it.

// Returns p moved by 100 to 200 along each axis.
vec4 noise_elsewhere(int dimensions, vec4 p, float seed)
{
    for (int axis = 0; axis < dimensions; axis++) {
        float share = hash_random(dimensions == 1 ? 1 : 2, vec4(seed, dimensions == 1 ? 0.0 : float(axis), 0.0, 0.0));
        // rounded once, as a fused multiplication and addition: the last bit shows in fine octaves
        float high = floor(share * 4096.0) / 4096.0;
        float offset = (100.0 + 100.0 * high) + 100.0 * (share - high);
        p[axis] += offset;
    }
    return p;
}

vec4 noise_distorted(int dimensions, vec4 p, float distortion)
{
    vec4 moved = p;
    for (int axis = 0; axis < dimensions && distortion != 0.0; axis++) {
        moved[axis] += noise_signed(dimensions, noise_elsewhere(dimensions, p, float(axis))) * distortion;
    }
    return moved;
}

float noise_fractal(
    int dimensions, int type, bool normalized, vec4 p, float detail, float roughness, float lacunarity, float offset, float gain)
{
    detail = clamp(detail, 0.0, 15.0);
    roughness = max(roughness, 0.0);
    return type == 0   ? noise_multifractal(dimensions, p, detail, roughness, lacunarity)
           : type == 1 ? noise_ridged_multifractal(dimensions, p, detail, roughness, lacunarity, offset, gain)
           : type == 2 ? noise_hybrid_multifractal(dimensions, p, detail, roughness, lacunarity, offset, gain)
           : type == 3 ? noise_fbm(dimensions, normalized, p, detail, roughness, lacunarity)
                       : noise_hetero_terrain(dimensions, p, detail, roughness, lacunarity, offset);
}

// Returns the output Value. dimensions: 1 (reads w) to 4. type: multifractal, ridged, hybrid, fBM, hetero terrain.
float noise_value(int dimensions, int type, bool normalized, vec3 vector, float w, float scale, float detail, float roughness,
                  float lacunarity, float offset, float gain, float distortion)
{
    vec4 p = noise_distorted(dimensions, texture_coordinates(dimensions, vector, w) * scale, distortion);
    return noise_fractal(dimensions, type, normalized, p, detail, roughness, lacunarity, offset, gain);
}

// Returns the output Color.
vec3 noise_color(int dimensions, int type, bool normalized, vec3 vector, float w, float scale, float detail, float roughness,
                 float lacunarity, float offset, float gain, float distortion)
{
    vec4 p = noise_distorted(dimensions, texture_coordinates(dimensions, vector, w) * scale, distortion);
    vec4 second = noise_elsewhere(dimensions, p, float(dimensions)), third = noise_elsewhere(dimensions, p, float(dimensions + 1));
    return vec3(noise_fractal(dimensions, type, normalized, p, detail, roughness, lacunarity, offset, gain),
                noise_fractal(dimensions, type, normalized, second, detail, roughness, lacunarity, offset, gain),
                noise_fractal(dimensions, type, normalized, third, detail, roughness, lacunarity, offset, gain));
}
