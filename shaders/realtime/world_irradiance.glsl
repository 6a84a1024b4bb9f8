// SPDX-License-Identifier: GPL-3.0-or-later
// A tile of the mean of the world's radiance weighted by the cosine to a direction, which is the irradiance over pi, summed over all
// texels of the tile `source` of `world_map`. Include octahedral.glsl before it.

void main()
{
    float solid_angle;
    vec3 n = octahedral_texel(octahedral_wrapped(ivec2(gl_FragCoord.xy) - ivec2(tile.xy), int(tile.z)), int(tile.z), solid_angle);
    int size = int(source.z);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < size; y++) {
        for (int x = 0; x < size; x++) {
            float cosine = dot(n, octahedral_texel(ivec2(x, y), size, solid_angle));
            sum += vec4(texelFetch(world_map, ivec2(source.xy) + ivec2(x, y), 0).rgb, 1.0) * (max(cosine, 0.0) * solid_angle);
        }
    }
    result = vec4(sum.rgb / sum.a, 1.0);
}
