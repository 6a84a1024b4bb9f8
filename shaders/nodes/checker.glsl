// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Checker Texture, as in addon/material/textures/checker.py.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

// Returns the output Fac: 1 in every other cube, which has Color1, else 0.
float checker_fac(vec3 vector, vec3 color1, vec3 color2, float scale)
{
    vec3 cell = floor((vector * scale + 0.000001) * 0.999999);
    ivec3 parity = ivec3(cell) & 1;
    return float((parity.x + parity.y + parity.z) & 1);
}

// Returns the output Color.
vec3 checker_color(vec3 vector, vec3 color1, vec3 color2, float scale)
{
    return checker_fac(vector, color1, color2, scale) != 0.0 ? color1 : color2;
}
