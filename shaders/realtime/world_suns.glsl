// SPDX-License-Identifier: GPL-3.0-or-later
// Sums of what is above the threshold over blocks of texels of an octahedral map: the irradiance of each on a plane that faces it
// [W/m^2], and its luminance with the directions it comes from. The fourth number of the first is the luminance of all that shines there.
// Include octahedral.glsl before it.

void main()
{
    int size = textureSize(excess_map, 0).x;
    ivec2 low = ivec2(gl_FragCoord.xy) * block;
    out_power = out_moment = vec4(0.0);
    for (int k = 0; k < block * block; k++) {
        ivec2 texel = low + ivec2(k % block, k / block);
        float solid_angle;
        octahedral_texel(texel, size, solid_angle);
        float luminance = dot(texelFetch(radiance_map, texel, 0).rgb, vec3(LUMINANCE));
        out_power += vec4(texelFetch(excess_map, texel, 0).rgb, luminance) * solid_angle;
        out_moment += texelFetch(moment_map, texel, 0) * solid_angle;
    }
}
