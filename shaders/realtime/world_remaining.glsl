// SPDX-License-Identifier: GPL-3.0-or-later
// The world's radiance without its suns: `caps` are the directions of those, and the cosine of how far around them they reach. What
// is of a block of texels counts as in its center, as for those who found the suns. Include octahedral.glsl before it.

void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    result = texelFetch(radiance_map, texel, 0);
    float solid_angle;
    vec3 direction = octahedral_texel(texel / block, textureSize(radiance_map, 0).x / block, solid_angle);
    for (int k = 0; k < SUNS; k++) {
        if (dot(direction, caps.cap[k].xyz) >= caps.cap[k].w) {
            result.rgb = max(result.rgb - texelFetch(excess_map, texel, 0).rgb, 0.0);
            return;
        }
    }
}
