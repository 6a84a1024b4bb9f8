// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh in the world. The cofactors of a matrix turn normals as its inverse transpose does, and are there for any matrix; its scale
// is taken out before, as their squares are no numbers of 32 bits otherwise where that is 1e-10 or 1e10.

void main()
{
    vec4 world = object_matrix * vec4(position, 1.0);
    vec3 x = object_matrix[0].xyz, y = object_matrix[1].xyz, z = object_matrix[2].xyz;
    vec3 largest = max(max(abs(x), abs(y)), abs(z));
    float size = max(max(largest.x, max(largest.y, largest.z)), 1e-30);
    x /= size;
    y /= size;
    z /= size;
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
