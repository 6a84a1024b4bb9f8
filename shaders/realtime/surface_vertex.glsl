// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh's vertices, transformed to the world and to clip space. PASS_ATTRIBUTES, of addon/realtime/program.py, passes on what
// else varies over the mesh.

void main()
{
    object_index = first_object + gl_InstanceID;
    mat4 matrix = object_matrix_of(object_index);
    orientation = orientation_of(matrix);
    vec4 world = matrix * vec4(position, 1.0);
    world_position = world.xyz;
    world_normal = transform_normal(normal);
    object_position = position;
    object_normal = normal;
    PASS_ATTRIBUTES
    gl_Position = view.projection * world;
}
