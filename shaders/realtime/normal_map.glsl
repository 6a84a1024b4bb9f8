// SPDX-License-Identifier: GPL-3.0-or-later
// Normals from colors, as unit vectors in the world on the visible side. shaded_point.glsl comes before it.
// color: a normal as (n + 1) / 2. strength: by how much it counts, at least 0. sign: -1 where axes point the other way, else 1.

// tangent: xyz the object's interpolated tangent, w the sign of the bitangent, 0 where there is no UV map. The normal is relative to
// them and to the object's interpolated normal, with the lengths that interpolation gives them, as MikkTSpace requires.
vec3 tangent_space_normal(vec3 color, float strength, float sign, vec4 tangent)
{
    vec3 given = (color * 2.0 - 1.0) * vec3(1.0, sign, 1.0);
    vec3 scaled = vec3(given.xy * max(strength, 0.0), mix(1.0, given.z, clamp(strength, 0.0, 1.0)));
    vec3 bitangent = tangent.w * cross(object_normal, tangent.xyz);
    vec3 mapped = transform_normal(scaled.x * tangent.xyz + scaled.y * bitangent + scaled.z * object_normal);
    return tangent.w != 0.0 && dot(mapped, mapped) > 0.0 ? visible_normal(mapped) : surface_normal();
}

vec3 mixed_normal(vec3 mapped, float strength)
{
    vec3 n = surface_normal();
    return safe_normal(n + (safe_normal(is_front() ? mapped : -mapped) - n) * max(strength, 0.0));
}

vec3 object_space_normal(vec3 color, float strength, float sign)
{
    return mixed_normal(transform_normal((color * 2.0 - 1.0) * vec3(1.0, sign, sign)), strength);
}

vec3 world_space_normal(vec3 color, float strength, float sign)
{
    return mixed_normal((color * 2.0 - 1.0) * vec3(1.0, sign, sign), strength);
}
