// SPDX-License-Identifier: GPL-3.0-or-later
// How far the nearest surface is along the view's axis [m], from its depth d in clip space: (x + y d) / (z + w d) of `distances`.
// Without a surface 1e10, as in the pass of Blender's engines.

void main()
{
    float depth = texelFetch(depth_map, ivec2(gl_FragCoord.xy), 0).r;
    float d = 2.0 * depth - 1.0;
    result = vec4(depth < 1.0 ? (distances.x + distances.y * d) / (distances.z + distances.w * d) : 1e10);
}
