// SPDX-License-Identifier: GPL-3.0-or-later
// The samples' sum so far as the picture.

void main()
{
    result = texelFetch(sum_map, ivec2(gl_FragCoord.xy), 0) * weight;
}
