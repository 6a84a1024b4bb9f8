// SPDX-License-Identifier: GPL-3.0-or-later
// The samples' sum so far as the picture, whose pixels begin at `corner`.

void main()
{
    result = texelFetch(sum_map, ivec2(gl_FragCoord.xy - corner), 0) * weight;
}
