// SPDX-License-Identifier: GPL-3.0-or-later
// A tile with its border of an octahedral map: the means over blocks of its texels. Include octahedral.glsl before it.

void main()
{
    ivec2 texel = octahedral_wrapped(ivec2(gl_FragCoord.xy) - ivec2(tile.xy), int(tile.z));
    int size = textureSize(radiance_map, 0).x, block = size / int(tile.z);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < block * block; k++) {
        ivec2 part = block * texel + ivec2(k % block, k / block);
        float solid_angle;
        octahedral_texel(part, size, solid_angle);
        sum += vec4(texelFetch(radiance_map, part, 0).rgb, 1.0) * solid_angle;
    }
    result = sum / sum.a;
}
