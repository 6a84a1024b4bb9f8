// SPDX-License-Identifier: GPL-3.0-or-later
// The sphere on a square by way of an octahedron, as E. Praun and H. Hoppe, "Spherical Parametrization and Remeshing" (2003), have it,
// and tiles of a texture that hold it. A tile is vec4(x, y, size, ...), its corner and size in texels; around it lies a border of one
// texel with what is beyond the square's edges.

// Returns the place of a direction of any length, -1 to 1.
vec2 octahedral_place(vec3 direction)
{
    vec2 p = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
    return direction.z < 0.0 ? folded : p;
}

// Returns the direction of a place, of the length that it has on the octahedron |x| + |y| + |z| = 1.
vec3 octahedral_direction(vec2 place)
{
    float z = 1.0 - abs(place.x) - abs(place.y);
    vec2 folded = (1.0 - abs(place.yx)) * vec2(place.x < 0.0 ? -1.0 : 1.0, place.y < 0.0 ? -1.0 : 1.0);
    return vec3(z < 0.0 ? folded : place, z);
}

// Returns the direction of the center of a texel of `size` x `size`; `solid_angle` is the texel's [sr].
vec3 octahedral_texel(ivec2 texel, int size, out float solid_angle)
{
    vec3 direction = octahedral_direction((vec2(texel) + 0.5) * (2.0 / float(size)) - 1.0);
    float nearer = inversesqrt(dot(direction, direction));
    solid_angle = 4.0 / float(size * size) * nearer * nearer * nearer;
    return direction * nearer;
}

// Returns the texel of `size` x `size` that one of the border around them stands for, others as they are.
ivec2 octahedral_wrapped(ivec2 texel, int size)
{
    if (texel.x < 0 || texel.x >= size) {
        texel = ivec2(clamp(texel.x, 0, size - 1), size - 1 - texel.y);
    }
    if (texel.y < 0 || texel.y >= size) {
        texel = ivec2(size - 1 - texel.x, clamp(texel.y, 0, size - 1));
    }
    return texel;
}

// Returns what a tile holds in a direction.
vec3 octahedral_lookup(sampler2D map, vec4 tile, vec3 direction)
{
    vec2 texels = tile.xy + (octahedral_place(direction) * 0.5 + 0.5) * tile.z;
    return textureLod(map, texels / vec2(textureSize(map, 0)), 0.0).rgb;
}
