// SPDX-License-Identifier: GPL-3.0-or-later
// One sample of the picture over its background; blending adds it to the sum. Holdouts, whose alpha is below 0, leave nothing there.

void main()
{
    vec4 sample_radiance = texelFetch(radiance_map, ivec2(gl_FragCoord.xy), 0);
    result = sample_radiance.w < 0.0 ? vec4(0.0) : sample_radiance + (1.0 - sample_radiance.w) * background;
}
