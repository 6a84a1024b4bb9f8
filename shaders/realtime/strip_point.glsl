// SPDX-License-Identifier: GPL-3.0-or-later
// The point of a round hair that its strip shows: normals turn over its width as a cylinder's, which Cycles' ribbons have, too.

float strip_height()
{
    return sqrt(max(0.0, 1.0 - strip_across.w * strip_across.w));
}

vec3 strip_normal()
{
    return strip_across.w * strip_across.xyz + strip_height() * strip_facing.xyz;
}

// In front of the strip, so that what faces the light is before the strip that casts shadows.
vec3 strip_point()
{
    return strip_position + strip_facing.w * strip_height() * strip_facing.xyz;
}

#define world_normal strip_normal()
#define world_position strip_point()
#define object_normal normal_of_object()
