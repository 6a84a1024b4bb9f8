// SPDX-License-Identifier: GPL-3.0-or-later
// The picture so far: the samples' sum times `weight`, one over their number, with at least the radiance `least` [W/(m^2 sr)].
// Its lower left pixel is at `corner`.

void main()
{
    vec4 mean = texelFetch(sum_map, ivec2(gl_FragCoord.xy - corner), 0) * weight;
    result = vec4(max(mean.rgb, least), mean.a);
}
