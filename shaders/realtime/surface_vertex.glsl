// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh's vertices, transformed to the world and to clip space.

void main()
{
    vec4 world = object_matrix * vec4(position, 1.0);
    world_position = world.xyz;
    world_normal = transform_normal(normal);
#ifdef COLOR_ATTRIBUTE
    vertex_color = color;
#endif
#ifdef COLOR_IMAGE
    vertex_uv = uv;
#endif
#ifdef NORMAL_MAP
    vertex_normal_uv = normal_uv;
    object_normal = normal;
    object_tangent = tangent;
#endif
    gl_Position = view.projection * world;
}
