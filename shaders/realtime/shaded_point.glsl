// SPDX-License-Identifier: GPL-3.0-or-later
// The shaded point as the nodes Geometry and Texture Coordinate give it. transform_normal.glsl comes before it.

// Returns whether the front of the face is seen.
bool is_front()
{
#ifdef STRIP
    return true; // it faces the viewer
#else
    return gl_FrontFacing == (orientation > 0.0);
#endif
}

// Returns the unit normal of the visible side; `normal` is that of the front, of any length.
vec3 visible_normal(vec3 normal)
{
    return is_front() ? normalize(normal) : -normalize(normal);
}

// Returns the interpolated unit normal of the visible side in the world.
vec3 surface_normal()
{
    return visible_normal(world_normal);
}

// Returns the unit vector along a normal, the interpolated one where it is 0.
vec3 safe_normal(vec3 normal)
{
    float square = dot(normal, normal);
    return square > 0.0 && square < 1e30 ? normal * inversesqrt(square) : surface_normal();
}

// Returns the unit vector towards the viewer.
vec3 incoming_at(vec3 position)
{
    return view.camera.w == 0.0 ? view.camera.xyz : normalize(view.camera.xyz - position);
}

// Returns the unit normal of the face itself on the visible side.
vec3 true_normal()
{
    vec3 normal = normalize(cross(dFdx(world_position), dFdy(world_position)));
    return dot(normal, incoming_at(world_position)) < 0.0 ? -normal : normal;
}

// Returns the interpolated unit normal of the visible side in the object's space.
vec3 normal_of_object()
{
    return normalize(surface_normal() * mat3(object_matrix_of(object_index)));
}

// Returns the tangent around the object's z axis, from `generated` coordinates.
vec3 tangent_of_generated(vec3 generated)
{
    vec3 around = transform_normal(vec3(0.5 - generated.y, generated.x - 0.5, 0.0));
    vec3 n = surface_normal();
    return cross(n, normalize(cross(around, n)));
}
