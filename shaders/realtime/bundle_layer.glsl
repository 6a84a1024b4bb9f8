// SPDX-License-Identifier: GPL-3.0-or-later
// Depth peeling (C. Everitt, "Interactive Order-Independent Transparency", 2001): each layer of a ray bundle has what is nearest
// behind the layer before it, as seen against the rays. `farther_map` has the depths of that layer, one square to the left; layer.x
// is the layer, layer.y the texels of a square's side.

const float SAME_DEPTH = 2e-6; // what is nearer to each other than this fraction of the map's depth is one surface
const float LARGEST = 6e4; // radiance that the map's 16 bits hold

bool is_peeled()
{
    ivec2 texel = ivec2(gl_FragCoord.xy) - ivec2(layer.y, 0);
    return layer.x > 0 && gl_FragCoord.z >= texelFetch(farther_map, texel, 0).r - SAME_DEPTH;
}
