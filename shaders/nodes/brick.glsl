// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Brick Texture, as in addon/material/textures/brick.py.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

// Returns a number from 0 to 1 for an integer.
float brick_random(uint n)
{
    n = (n + 1013u) & 0x7FFFFFFFu;
    n = (n >> 13) ^ n;
    return float((n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7FFFFFFFu) / 2147483648.0;
}

// Returns the tint of the brick, 0 to 1 from its first color to the second, and the share of mortar.
vec2 brick_tint_and_mortar(vec3 vector, float scale, float mortar_size, float mortar_smooth, float bias, float width, float height,
                           float offset, float offset_frequency, float squash, float squash_frequency)
{
    vec2 p = vector.xy * scale;
    int row = int(floor(p.y / height));
    if (int(offset_frequency) != 0 && int(squash_frequency) != 0) {
        width *= abs(row) % int(squash_frequency) == 0 ? squash : 1.0;
        p.x += abs(row) % int(offset_frequency) == 0 ? width * offset : 0.0;
    }
    int number = int(floor(p.x / width));
    p -= vec2(width, height) * vec2(float(number), float(row));
    float tint = clamp(brick_random((uint(row) << 16) + (uint(number) & 0xFFFFu)) + bias, 0.0, 1.0);
    float to_edge = min(min(p.x, p.y), min(width - p.x, height - p.y));
    if (to_edge >= mortar_size) {
        return vec2(tint, 0.0);
    }
    if (mortar_smooth == 0.0) {
        return vec2(tint, 1.0);
    }
    float t = clamp((1.0 - to_edge / mortar_size) / mortar_smooth, 0.0, 1.0);
    return vec2(tint, (3.0 - 2.0 * t) * t * t);
}

// Returns the output Color.
vec3 brick_color(vec3 vector, vec3 color1, vec3 color2, vec3 mortar, float scale, float mortar_size, float mortar_smooth, float bias,
                 float width, float height, float offset, float offset_frequency, float squash, float squash_frequency)
{
    vec2 at = brick_tint_and_mortar(vector, scale, mortar_size, mortar_smooth, bias, width, height, offset, offset_frequency,
                                    squash, squash_frequency);
    return mix(mix(color1, color2, at.x), mortar, at.y);
}

// Returns the output Fac: 1 in the mortar, 0 in bricks.
float brick_fac(vec3 vector, vec3 color1, vec3 color2, vec3 mortar, float scale, float mortar_size, float mortar_smooth, float bias,
                float width, float height, float offset, float offset_frequency, float squash, float squash_frequency)
{
    return brick_tint_and_mortar(vector, scale, mortar_size, mortar_smooth, bias, width, height, offset, offset_frequency, squash,
                                 squash_frequency).y;
}
