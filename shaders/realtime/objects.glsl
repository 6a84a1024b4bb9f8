// SPDX-License-Identifier: GPL-3.0-or-later
// Where objects are. A draw call draws a mesh for several objects, `object_index` of which count from `first_object`. The texture
// `objects` has four texels for each: the columns of its matrix to the world, with its number in the place of the last 1.

ivec2 object_texel(int index)
{
    return ivec2(4 * (index & 255), index >> 8); // rows of 256 objects
}

mat4 object_matrix_of(int index)
{
    ivec2 texel = object_texel(index);
    vec3 place = texelFetch(objects, texel + ivec2(3, 0), 0).xyz;
    return mat4(texelFetch(objects, texel, 0), texelFetch(objects, texel + ivec2(1, 0), 0),
        texelFetch(objects, texel + ivec2(2, 0), 0), vec4(place, 1.0));
}

// Returns -1 for a matrix that mirrors, else 1.
float orientation_of(mat4 matrix)
{
    mat3 axes = mat3(matrix);
    vec3 largest = max(max(abs(axes[0]), abs(axes[1])), abs(axes[2]));
    axes /= max(max(largest.x, max(largest.y, largest.z)), 1e-30); // else the product may not fit into 32 bits
    return dot(axes[0], cross(axes[1], axes[2])) < 0.0 ? -1.0 : 1.0;
}

// Returns the number of an object, which is above 0 and differs between objects.
int object_number_of(int index)
{
    return int(texelFetch(objects, object_texel(index) + ivec2(3, 0), 0).w);
}
