// SPDX-License-Identifier: GPL-3.0-or-later
// The sphere as two squares of a texture, which hold the upper and the lower hemisphere in stereographic projection. Unlike an octahedron
// it has no edges where bilinear filtering would show a ridge. A tile is vec4(x, y, size, ...): the corner of the first square and the
// size of both in texels. Around each is a border of one texel, and the second is on the right of the first.

// Returns the unit direction of a texel of a tile or of its borders.
vec3 hemispheres_texel(ivec2 texel, vec4 tile)
{
    ivec2 place = texel - ivec2(tile.xy);
    bool is_below = place.x > int(tile.z);
    place.x -= is_below ? int(tile.z) + 2 : 0;
    vec2 p = (vec2(place) + 0.5) * (2.0 / tile.z) - 1.0;
    float square = dot(p, p);
    return vec3(2.0 * p, is_below ? square - 1.0 : 1.0 - square) / (1.0 + square);
}

// Returns what a tile holds in a direction, a unit vector.
vec3 hemispheres_lookup(sampler2D map, vec4 tile, vec3 direction)
{
    vec2 p = direction.xy / (1.0 + abs(direction.z));
    vec2 texels = tile.xy + (p * 0.5 + 0.5) * tile.z;
    texels.x += direction.z < 0.0 ? tile.z + 2.0 : 0.0;
    return textureLod(map, texels / vec2(textureSize(map, 0)), 0.0).rgb;
}
