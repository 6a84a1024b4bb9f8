// SPDX-License-Identifier: GPL-3.0-or-later
// Perlin noise in one to four dimensions and its fractal sums, as in addon/material/textures/fractal_noise.py: K. Perlin (2002),
// F. K. Musgrave in Ebert et al., "Texturing and modeling" (2003).
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include hashing.glsl before it.

// Returns one of Perlin's gradients, which the low bits of hashed choose, times the vector p from a corner of the cell.
float noise_slope(int dimensions, uint hashed, vec4 p)
{
    if (dimensions == 1) {
        float slope = (1.0 + float(hashed & 7u)) * p.x;
        return (hashed & 8u) != 0u ? -slope : slope;
    }
    vec3 terms = vec3(0.0);
    if (dimensions == 2) {
        terms.xy = (hashed & 7u) < 4u ? vec2(p.x, 2.0 * p.y) : vec2(p.y, 2.0 * p.x);
    } else if (dimensions == 3) {
        uint h = hashed & 15u;
        terms.xy = vec2(h < 8u ? p.x : p.y, h < 4u ? p.y : h == 12u || h == 14u ? p.x : p.z);
    } else {
        uint h = hashed & 31u;
        terms = vec3(h < 24u ? p.x : p.y, h < 16u ? p.y : p.z, h < 8u ? p.z : p.w);
    }
    return ((hashed & 1u) != 0u ? -terms.x : terms.x) + ((hashed & 2u) != 0u ? -terms.y : terms.y) +
           ((hashed & 4u) != 0u ? -terms.z : terms.z);
}

// Returns Perlin noise, about -1 to 1, of the first coordinates of p; the others are 0. It repeats every 100000; far
// out, where 32-bit floats are nearly whole numbers, at which the noise is 0, half a cell is added.
float noise_signed(int dimensions, vec4 p)
{
    p = p - 100000.0 * trunc(p / 100000.0) + 0.5 * step(1000000.0, abs(p));
    vec4 cell = floor(p), local = p - cell;
    vec4 fades = local * local * local * (local * (local * 6.0 - 15.0) + 10.0);
    float total = 0.0;
    for (int index = 0; index < (1 << dimensions); index++) {
        ivec4 corner = (ivec4(index) >> ivec4(0, 1, 2, 3)) & 1;
        vec4 weights = mix(1.0 - fades, fades, vec4(corner));
        uint hashed = hash_keys(dimensions, uvec4(ivec4(cell) + corner));
        total += weights.x * weights.y * weights.z * weights.w * noise_slope(dimensions, hashed, local - vec4(corner));
    }
    return total * (dimensions == 1 ? 0.25 : dimensions == 2 ? 0.6616 : dimensions == 3 ? 0.982 : 0.8344);
}

// The sums. detail: octaves beside the first, 0 to 15; a fraction gives the last that share. roughness: how much lower, lacunarity:
// how much finer each octave is than the one before.

float noise_fbm(int dimensions, bool normalized, vec4 p, float detail, float roughness, float lacunarity)
{
    float total = 0.0, amplitudes = 0.0, amplitude = 1.0, scale = 1.0, level = 0.0;
    for (float octave = 0.0; octave < detail + 1.0; octave++) {
        total += noise_signed(dimensions, scale * p) * amplitude;
        amplitudes += amplitude;
        level = mix(level, normalized ? 0.5 * total / amplitudes + 0.5 : total, min(1.0, detail + 1.0 - octave));
        amplitude *= roughness;
        scale *= lacunarity;
    }
    return level;
}

float noise_multifractal(int dimensions, vec4 p, float detail, float roughness, float lacunarity)
{
    float value = 1.0, power = 1.0;
    for (float octave = 0.0; octave < detail + 1.0; octave++) {
        value *= min(1.0, detail + 1.0 - octave) * power * noise_signed(dimensions, p) + 1.0;
        power *= roughness;
        p *= lacunarity;
    }
    return value;
}

float noise_hybrid_multifractal(int dimensions, vec4 p, float detail, float roughness, float lacunarity, float offset, float gain)
{
    float value = 0.0, power = 1.0, weight = 1.0;
    for (float octave = 0.0; octave < detail + 1.0 && weight > 0.001; octave++) {
        weight = min(weight, 1.0);
        float signal = (noise_signed(dimensions, p) + offset) * power;
        value += min(1.0, detail + 1.0 - octave) * weight * signal;
        weight *= gain * signal;
        power *= roughness;
        p *= lacunarity;
    }
    return value;
}

float noise_ridged_multifractal(int dimensions, vec4 p, float detail, float roughness, float lacunarity, float offset, float gain)
{
    float value = 0.0, power = 1.0, weight = 1.0;
    for (float octave = 0.0; octave <= detail; octave++) {
        float signal = offset - abs(noise_signed(dimensions, p));
        signal *= signal * weight;
        value += signal * power;
        weight = clamp(signal * gain, 0.0, 1.0);
        power *= roughness;
        p *= lacunarity;
    }
    return value;
}

float noise_hetero_terrain(int dimensions, vec4 p, float detail, float roughness, float lacunarity, float offset)
{
    float value = noise_signed(dimensions, p) + offset, power = roughness;
    for (float octave = 1.0; octave < detail + 1.0; octave++) {
        p *= lacunarity;
        value += min(1.0, detail + 1.0 - octave) * (noise_signed(dimensions, p) + offset) * power * value;
        power *= roughness;
    }
    return value;
}
