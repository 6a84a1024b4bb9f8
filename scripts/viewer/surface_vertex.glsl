// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex of a character, turned around the pivot, in front of a camera with a shifted lens. Axes: x right, y up, z to the viewer.

layout(location = 0) in vec3 quantized_place;
layout(location = 1) in vec2 octahedral;
layout(location = 2) in vec3 color;
layout(location = 3) in vec2 quantized_uv;

uniform vec3 low, size; // of the character's bounds [m]
uniform vec2 uv_bounds;
uniform mat3 turn;
uniform vec3 pivot;      // [m], in the character's own axes
uniform vec2 scale;      // of x and y, per m at the pivot, the picture being 2 wide and high
uniform vec2 shift;      // of the lens, in the picture
uniform float far, reach; // from the camera to the pivot, and from there to what is nearest and farthest [m]

out vec3 own_place, own_normal, place, normal, paint;
out vec2 uv;

vec3 direction(vec2 square)
{
    vec2 e = 2.0 * square - 1.0;
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    vec2 side = vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return normalize(n.z < 0.0 ? vec3((1.0 - abs(n.yx)) * side, n.z) : n);
}

void main()
{
    own_place = low + size * quantized_place;
    own_normal = direction(octahedral);
    place = turn * (own_place - pivot);
    normal = turn * own_normal;
    paint = color;
    uv = mix(uv_bounds.xx, uv_bounds.yy, quantized_uv);
    float depth = far - place.z;
    gl_Position = vec4(place.xy * scale * far + shift * depth, (far * depth - (far - reach) * (far + reach)) / reach, depth);
}
