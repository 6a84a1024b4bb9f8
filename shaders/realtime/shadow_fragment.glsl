// SPDX-License-Identifier: GPL-3.0-or-later
// The distance of a surface from a light. For a spot it is the distance along its axis [m], as depths in its clip space crowd near 1;
// for a sun, whose depths are even, it is the depth in clip space. With MARKED, beside it the object and the normal, for
// light_through.glsl.

void main()
{
    bool is_spot = vec3(matrix[0].w, matrix[1].w, matrix[2].w) != vec3(0.0);
    result = vec4(is_spot ? 1.0 / gl_FragCoord.w : gl_FragCoord.z * 2.0 - 1.0, 0.0, 0.0, 1.0);
#ifdef MARKED
    result.y = surface_mark();
#endif
}
