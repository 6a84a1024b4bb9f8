// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex of a character as the light sees it.

layout(location = 0) in vec3 quantized_place;
layout(location = 3) in vec2 quantized_uv;

uniform vec3 low, size;
uniform vec2 uv_bounds;
uniform mat4 to_light;

out vec2 uv;

void main()
{
    uv = mix(uv_bounds.xx, uv_bounds.yy, quantized_uv);
    gl_Position = to_light * vec4(low + size * quantized_place, 1.0);
}
