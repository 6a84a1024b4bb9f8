// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Gradient Texture, as in addon/material/textures/gradient.py.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

// Returns the output Fac, 0 to 1. type: linear, quadratic, easing, diagonal, spherical, quadratic sphere, radial.
float gradient_fac(int type, vec3 vector)
{
    float from_x = clamp(vector.x, 0.0, 1.0), inside = clamp(0.999999 - length(vector), 0.0, 1.0);
    float angle = vector.x == 0.0 && vector.y == 0.0 ? 0.0 : atan(vector.y, vector.x); // else undefined at the axis
    return type == 0   ? from_x
           : type == 1 ? from_x * from_x
           : type == 2 ? (3.0 - 2.0 * from_x) * from_x * from_x
           : type == 3 ? clamp(0.5 * (vector.x + vector.y), 0.0, 1.0)
           : type == 4 ? inside
           : type == 5 ? inside * inside
                       : clamp(angle / 6.28318530717959 + 0.5, 0.0, 1.0);
}

// Returns the output Color.
vec3 gradient_color(int type, vec3 vector)
{
    return vec3(gradient_fac(type, vector));
}
