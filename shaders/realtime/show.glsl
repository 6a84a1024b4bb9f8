// SPDX-License-Identifier: GPL-3.0-or-later
// The samples' sum so far as the picture, its corner at `corner` of the window.

void main()
{
    result = texelFetch(sum_map, ivec2(gl_FragCoord.xy) - ivec2(corner), 0) * weight;
}
