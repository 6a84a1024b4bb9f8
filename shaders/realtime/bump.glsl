// SPDX-License-Identifier: GPL-3.0-or-later
// The normal of a surface that is raised by a height. M. Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU" (2010).
// shaded_point.glsl comes before it.

// Returns the unit normal of a surface of unit normal n. heights: at the point, and `width` pixels to the right and above.
// strength: by how much it counts, at least 0; distance: the length of a height of 1 [m].
vec3 bumped(vec3 n, vec3 heights, float strength, float distance, float width)
{
    vec3 right = dFdx(world_position), up = dFdy(world_position);
    vec3 across_up = cross(up, n), across_right = cross(n, right);
    float area = dot(right, across_up);
    vec3 gradient = (heights.y - heights.x) * across_up + (heights.z - heights.x) * across_right;
    vec3 bent = width * abs(area) * n - distance * sign(area) * gradient;
    float square = dot(bent, bent);
    vec3 raised = square > 0.0 ? bent * inversesqrt(square) : n;
    return normalize(mix(n, raised, max(strength, 0.0)));
}
