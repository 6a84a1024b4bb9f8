// SPDX-License-Identifier: GPL-3.0-or-later
// One sample of the picture over its background; blending adds it to the sum.

void main()
{
    vec4 sample_radiance = texelFetch(radiance_map, ivec2(gl_FragCoord.xy), 0);
    result = sample_radiance + (1.0 - sample_radiance.w) * background;
}
