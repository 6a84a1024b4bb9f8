// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh in the world. The cofactors of a matrix turn normals as its inverse transpose does, and are there for any matrix.

void main()
{
    vec4 world = object_matrix * vec4(position, 1.0);
    vec3 x = object_matrix[0].xyz, y = object_matrix[1].xyz, z = object_matrix[2].xyz;
    world_position = world.xyz;
    world_normal = orientation * (mat3(cross(y, z), cross(z, x), cross(x, y)) * normal);
#ifdef COLOR_ATTRIBUTE
    vertex_color = color;
#endif
#ifdef COLOR_IMAGE
    vertex_uv = uv;
#endif
    gl_Position = view.projection * world;
}
