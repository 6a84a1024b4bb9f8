// SPDX-License-Identifier: GPL-3.0-or-later
// The picture so far: the samples' sum times `weight`, one over their number. Its lower left pixel is at `corner`.

void main()
{
    result = texelFetch(sum_map, ivec2(gl_FragCoord.xy - corner), 0) * weight;
}
