// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex of a curve's strip, as surface_vertex.glsl has a mesh's.

void main()
{
    object_index = first_object + gl_InstanceID;
    mat4 matrix = object_matrix_of(object_index);
    orientation = orientation_of(matrix);
    Strip here = strip_at(strip, matrix, view.camera);
    object_position = here.local;
    strip_position = here.center + strip.z * here.radius * here.across;
    strip_across = vec4(here.across, strip.z);
    strip_facing = vec4(here.facing, here.radius);
    PASS_ATTRIBUTES
    gl_Position = view.projection * vec4(strip_position, 1.0);
}
