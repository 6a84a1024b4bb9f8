// SPDX-License-Identifier: GPL-3.0-or-later
// The hashes of Blender's textures, as in addon/material/textures/hashing.py: B. Jenkins' lookup3 (2006) and PCG
// (M. Jarzynski and M. Olano, JCGT 9(3), 2020). In each file here, `dimensions`, types and switches are constants of the material,
// from which the compiler picks what is used.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

uint hash_rotated(uint x, int by)
{
    return (x << by) | (x >> (32 - by));
}

// Returns lookup3's hash of the first one to four keys; the others are 0.
uint hash_keys(int dimensions, uvec4 keys)
{
    uint start = 0xDEADBEEFu + (uint(dimensions) << 2) + 13u;
    uint a = start + keys.x, b = start + keys.y, c = start + keys.z;
    if (dimensions == 4) {
        a = (a - c) ^ hash_rotated(c, 4); c += b;
        b = (b - a) ^ hash_rotated(a, 6); a += c;
        c = (c - b) ^ hash_rotated(b, 8); b += a;
        a = (a - c) ^ hash_rotated(c, 16); c += b;
        b = (b - a) ^ hash_rotated(a, 19); a += c;
        c = (c - b) ^ hash_rotated(b, 4); b += a;
        a += keys.w;
    }
    c = (c ^ b) - hash_rotated(b, 14);
    a = (a ^ c) - hash_rotated(c, 11);
    b = (b ^ a) - hash_rotated(a, 25);
    c = (c ^ b) - hash_rotated(b, 16);
    a = (a ^ c) - hash_rotated(c, 4);
    b = (b ^ a) - hash_rotated(a, 14);
    return (c ^ b) - hash_rotated(b, 24);
}

// Returns a number from 0 to 1 that depends on the bits of the first one to four keys; the others are 0.
float hash_random(int dimensions, vec4 keys)
{
    return float(hash_keys(dimensions, floatBitsToUint(keys))) * (1.0 / 4294967296.0);
}

uvec4 hash_pcg_round(int dimensions, uvec4 v)
{
    v.x += v.y * (dimensions == 2 ? 1664525u : dimensions == 3 ? v.z : v.w);
    v.y += v.x * (dimensions == 2 ? 1664525u : v.z);
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Returns as many numbers from 0 to 1 as the cell has integer coordinates, two to four; the others are of no use.
vec4 hash_cell(int dimensions, ivec4 cell)
{
    uvec4 v = uvec4(cell) * 1664525u + 1013904223u;
    v = hash_pcg_round(dimensions, v);
    v = hash_pcg_round(dimensions, v ^ uvec4(ivec4(v) >> 16)); // of signed integers
    return vec4(v & 0x7FFFFFFFu) * (1.0 / 2147483648.0);
}

// Returns what a texture of so many dimensions reads of its two inputs: w alone, the first of vector, or all four; the others are 0.
vec4 texture_coordinates(int dimensions, vec3 vector, float w)
{
    return dimensions == 1   ? vec4(w, 0.0, 0.0, 0.0)
           : dimensions == 2 ? vec4(vector.xy, 0.0, 0.0)
           : dimensions == 3 ? vec4(vector, 0.0)
                             : vec4(vector, w);
}
