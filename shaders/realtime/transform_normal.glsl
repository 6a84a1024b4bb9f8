// SPDX-License-Identifier: GPL-3.0-or-later
// Returns an object's normal in the world, of any length. The cofactors of a matrix transform normals as its inverse transpose does,
// and exist for any matrix. Its scale is divided out first, as cofactors of a scale of 1e-10 or 1e10 do not fit into 32 bits.
vec3 transform_normal(vec3 normal)
{
    mat4 matrix = object_matrix_of(object_index);
    vec3 x = matrix[0].xyz, y = matrix[1].xyz, z = matrix[2].xyz;
    vec3 largest = max(max(abs(x), abs(y)), abs(z));
    float size = max(max(largest.x, max(largest.y, largest.z)), 1e-30);
    x /= size;
    y /= size;
    z /= size;
    return orientation * (mat3(cross(y, z), cross(z, x), cross(x, y)) * normal);
}
