// SPDX-License-Identifier: GPL-3.0-or-later
// Returns a normal of the object in the world, of some length. The cofactors of a matrix turn normals as its inverse transpose does,
// and are there for any matrix; its scale is taken out before, as their squares are no numbers of 32 bits otherwise where that is
// 1e-10 or 1e10.
vec3 turned(vec3 normal)
{
    vec3 x = object_matrix[0].xyz, y = object_matrix[1].xyz, z = object_matrix[2].xyz;
    vec3 largest = max(max(abs(x), abs(y)), abs(z));
    float size = max(max(largest.x, max(largest.y, largest.z)), 1e-30);
    x /= size;
    y /= size;
    z /= size;
    return orientation * (mat3(cross(y, z), cross(z, x), cross(x, y)) * normal);
}
