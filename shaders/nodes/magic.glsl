// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Magic Texture, as in addon/material/textures/magic.py.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

// Returns the output Color. depth: turns of the pattern, 0 to 10.
vec3 magic_color(int depth, vec3 vector, float scale, float distortion)
{
    vec3 p = vector * scale;
    p = 5.0 * (p - 6.28318530717959 * trunc(p / 6.28318530717959));
    vec3 c = vec3(sin(p.x + p.y + p.z), cos(-p.x + p.y - p.z), -cos(-p.x - p.y + p.z));
    if (depth > 0) {
        c *= distortion;
        c.y = distortion * -cos(c.x - c.y + c.z);
    }
    if (depth > 1) c.x = distortion * cos(c.x - c.y - c.z);
    if (depth > 2) c.z = distortion * sin(-c.x - c.y - c.z);
    if (depth > 3) c.x = distortion * -cos(-c.x + c.y - c.z);
    if (depth > 4) c.y = distortion * -sin(-c.x + c.y + c.z);
    if (depth > 5) c.y = distortion * -cos(-c.x + c.y + c.z);
    if (depth > 6) c.x = distortion * cos(c.x + c.y + c.z);
    if (depth > 7) c.z = distortion * sin(c.x + c.y - c.z);
    if (depth > 8) c.x = distortion * -cos(-c.x - c.y + c.z);
    if (depth > 9) c.y = distortion * -sin(c.x - c.y + c.z);
    return 0.5 - (distortion != 0.0 ? c / (2.0 * distortion) : c);
}

// Returns the output Fac: the mean of Color.
float magic_fac(int depth, vec3 vector, float scale, float distortion)
{
    vec3 color = magic_color(depth, vector, scale, distortion);
    return (color.x + color.y + color.z) / 3.0;
}
