// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's White Noise Texture, as in addon/material/textures/white_noise.py: hashes of the coordinates' bits.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include hashing.glsl before it.

// Returns the output Value, 0 to 1. dimensions: 1 (reads w) to 4.
float white_noise_value(int dimensions, vec3 vector, float w)
{
    return hash_random(dimensions, texture_coordinates(dimensions, vector, w));
}

// Returns the output Color; its red is the value.
vec3 white_noise_color(int dimensions, vec3 vector, float w)
{
    vec4 p = texture_coordinates(dimensions, vector, w), second = p.zxwy, third = p.wzyx;
    int keys = 4;
    if (dimensions < 4) {
        second = third = p;
        second[dimensions] = 1.0;
        third[dimensions] = 2.0;
        keys = dimensions + 1;
    }
    return vec3(hash_random(dimensions, p), hash_random(keys, second), hash_random(keys, third));
}
