// SPDX-License-Identifier: GPL-3.0-or-later
// Curves as strips that face the viewer. The texture `strip_points` has a texel for each control point: its position and radius.

struct Strip
{
    vec3 local; // its middle in the object's space
    vec3 center; // and in the world
    vec3 across; // unit vector along the strip's width
    vec3 facing; // unit vector to the viewer, square to the curve
    float radius;
};

vec4 control_point(int index)
{
    return texelFetch(strip_points, ivec2(index & 1023, index >> 10), 0);
}

// Returns the place of a vertex on its curve, which the four numbers of addon/realtime/strips.py tell; E. Catmull and R. Rom, "A
// Class of Local Interpolating Splines" (1974). slope: its derivative.
vec4 curve_point(vec4 vertex, out vec4 slope)
{
    int index = int(vertex.x), ends = int(vertex.w);
    float t = vertex.y;
    vec4 b = control_point(index), c = control_point(index + 1);
    vec4 a = (ends & 1) != 0 ? b : control_point(index - 1);
    vec4 d = (ends & 2) != 0 ? c : control_point(index + 2);
    vec4 first = 0.5 * (c - a), second = a - 2.5 * b + 2.0 * c - 0.5 * d, third = 1.5 * (b - c) + 0.5 * (d - a);
    slope = first + t * (2.0 * second + 3.0 * t * third);
    return b + t * (first + t * (second + t * third));
}

// Returns the strip at a vertex in the world, for an object of that matrix. eye: where it is seen from [m] or, where the last number
// is 0, the unit vector towards there.
Strip strip_at(vec4 vertex, mat4 matrix, vec4 eye)
{
    vec4 slope;
    vec4 point = curve_point(vertex, slope);
    vec3 center = (matrix * vec4(point.xyz, 1.0)).xyz;
    vec3 tangent = mat3(matrix) * slope.xyz;
    vec3 towards = eye.w == 0.0 ? eye.xyz : eye.xyz - center;
    vec3 across = cross(tangent, towards);
    across /= max(length(across), 1e-30);
    float scale = pow(abs(determinant(mat3(matrix))), 1.0 / 3.0);
    return Strip(point.xyz, center, across, normalize(cross(across, tangent) + 1e-30 * towards), scale * max(point.w, 0.0));
}
