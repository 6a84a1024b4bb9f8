// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Sky Texture as Cycles has it (kernel/svm/sky.h): a lookup in the map of half a sky, and the sun.
//     rotation: of the sun [rad]   sun: elevation of its center, angular diameter, elevation of the ground [rad]
//     low, high: XYZ of the sun at its lowest and highest points

float sky_elevation(vec3 direction)
{
    float z = clamp(direction.z, -1.0, 1.0);
    return atan(z, sqrt((1.0 - z) * (1.0 + z)));
}

// Returns a texel of a row, of which the second half is the mirror of the first.
vec3 sky_texel(sampler2D map, ivec2 texel)
{
    ivec2 size = textureSize(map, 0);
    return texelFetch(map, ivec2(min(texel.x, 2 * size.x - 1 - texel.x), clamp(texel.y, 0, size.y - 1)), 0).xyz;
}

vec3 sky_xyz(sampler2D map, vec3 direction, float rotation)
{
    float elevation = sky_elevation(direction);
    float azimuth = direction.x == 0.0 && direction.y == 0.0 ? 0.0 : atan(direction.y, direction.x); // else undefined at the axis
    vec2 place = vec2(fract(-(azimuth + rotation) / 6.28318530717959 - 0.25), 0.5);
    place.y += 0.5 * sign(elevation) * sqrt(abs(elevation) / 1.5707963267949);
    ivec2 size = textureSize(map, 0) * ivec2(2, 1);
    vec2 texels = place * vec2(size) - 0.5;
    ivec2 low = ivec2(floor(texels)), high = min(low + 1, size - 1);
    vec2 rest = texels - vec2(low);
    low.x = max(low.x, 0);
    vec3 below = mix(sky_texel(map, low), sky_texel(map, ivec2(high.x, low.y)), rest.x);
    vec3 above = mix(sky_texel(map, ivec2(low.x, high.y)), sky_texel(map, high), rest.x);
    return mix(below, above, rest.y);
}

vec3 sun_xyz(vec3 direction, float rotation, vec3 sun, vec3 low, vec3 high)
{
    vec3 center = vec3(cos(sun.x) * vec2(sin(rotation), cos(rotation)), sin(sun.x));
    float angle = 2.0 * atan(length(direction - center), length(direction + center)), elevation = sky_elevation(direction);
    float edge = 2.0 * angle / sun.y;
    if (edge >= 1.0 || elevation <= sun.z) {
        return vec3(0.0);
    }
    return mix(low, high, (elevation - sun.x) / sun.y + 0.5) * (1.0 - 0.6 * (1.0 - sqrt(1.0 - edge * edge)));
}

// Returns linear Rec. 709, as far as it is positive.
vec3 rgb_of_xyz(vec3 xyz)
{
    return max(vec3(dot(xyz, vec3(3.24096994, -1.53738318, -0.49861076)), dot(xyz, vec3(-0.96924364, 1.8759675, 0.04155506)),
                   dot(xyz, vec3(0.05563008, -0.20397696, 1.05697151))),
        0.0);
}
