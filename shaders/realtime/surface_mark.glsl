// SPDX-License-Identifier: GPL-3.0-or-later
// Which object a shadow map shows, and its normal, in one float.
// Include objects.glsl and packed_normal.glsl before it.

// Returns the object's number modulo 4096, times 4096, and the normal towards the light in 64 steps along each axis.
float surface_mark()
{
    vec3 n = cross(dFdx(world_position), dFdy(world_position));
    float size = length(n);
    n = size > 0.0 ? n / size : vec3(0.0, 0.0, 1.0);
    return float(object_number_of(object_index) & 4095) * 4096.0 + packed_normal(n, 64.0);
}
