// SPDX-License-Identifier: GPL-3.0-or-later
// A tile of means of the world's radiance around each direction, summed over all texels of the tile `source` of `world_map`: weighted by
// the cosine where `sharpness` is 0, so that they are the irradiance over pi, else by exp(sharpness (cosine - 1)). Include octahedral.glsl
// and hemispheres.glsl before it.

void main()
{
    vec3 n = hemispheres_texel(ivec2(gl_FragCoord.xy), tile);
    int size = int(source.z);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < size; y++) {
        for (int x = 0; x < size; x++) {
            float solid_angle;
            float cosine = dot(n, octahedral_texel(ivec2(x, y), size, solid_angle));
            float weight = sharpness > 0.0 ? exp(sharpness * (cosine - 1.0)) : max(cosine, 0.0);
            sum += vec4(texelFetch(world_map, ivec2(source.xy) + ivec2(x, y), 0).rgb, 1.0) * (weight * solid_angle);
        }
    }
    result = vec4(sum.rgb / sum.a, 1.0);
}
