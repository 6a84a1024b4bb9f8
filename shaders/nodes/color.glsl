// SPDX-License-Identifier: GPL-3.0-or-later
// Operations on colors of Blender's nodes, as in addon/material/operations.py. What is defined for numbers is there for vec3, too,
// channel by channel. Include math.glsl before it.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

// Returns a^exponent where a is positive, else a.
float gamma(float a, float exponent)
{
    return exponent == 0.0 ? 1.0 : a > 0.0 ? pow(a, exponent) : a;
}

vec3 gamma(vec3 a, vec3 exponent)
{
    return vec3(gamma(a.x, exponent.x), gamma(a.y, exponent.y), gamma(a.z, exponent.z));
}

// Returns the blend mode Overlay of a and b by the factor t.
float overlay(float a, float b, float t)
{
    return a < 0.5 ? a * (1.0 - t + 2.0 * t * b) : 1.0 - (1.0 - t + 2.0 * t * (1.0 - b)) * (1.0 - a);
}

vec3 overlay(vec3 a, vec3 b, vec3 t)
{
    return vec3(overlay(a.x, b.x, t.x), overlay(a.y, b.y, t.y), overlay(a.z, b.z, t.z));
}

// Returns the blend mode Divide.
float color_divide(float a, float b, float t)
{
    return b != 0.0 ? (1.0 - t) * a + t * a / b : a;
}

vec3 color_divide(vec3 a, vec3 b, vec3 t)
{
    return vec3(color_divide(a.x, b.x, t.x), color_divide(a.y, b.y, t.y), color_divide(a.z, b.z, t.z));
}

// Returns the blend mode Color Dodge.
float dodge(float a, float b, float t)
{
    float rest = 1.0 - t * b;
    return a == 0.0 ? 0.0 : rest > 0.0 ? min(a / rest, 1.0) : 1.0;
}

vec3 dodge(vec3 a, vec3 b, vec3 t)
{
    return vec3(dodge(a.x, b.x, t.x), dodge(a.y, b.y, t.y), dodge(a.z, b.z, t.z));
}

// Returns the blend mode Color Burn.
float burn(float a, float b, float t)
{
    float rest = 1.0 - t + t * b;
    return rest > 0.0 ? clamp(1.0 - (1.0 - a) / rest, 0.0, 1.0) : 0.0;
}

vec3 burn(vec3 a, vec3 b, vec3 t)
{
    return vec3(burn(a.x, b.x, t.x), burn(a.y, b.y, t.y), burn(a.z, b.z, t.z));
}

// Returns the hue of a color, 0 to 1, 0 where it is gray.
float hue(vec3 color)
{
    float high = max(max(color.x, color.y), color.z), low = min(min(color.x, color.y), color.z);
    float sixths = color.x == high ? safe_divide(color.y - color.z, high - low) :
                   color.y == high ? safe_divide(color.z - color.x, high - low) + 2.0 :
                                     safe_divide(color.x - color.y, high - low) + 4.0;
    return fract(sixths / 6.0);
}

// Returns hue, saturation and value.
vec3 rgb_to_hsv(vec3 color)
{
    float high = max(max(color.x, color.y), color.z), low = min(min(color.x, color.y), color.z);
    float saturation = safe_divide(high - low, high);
    return vec3(saturation != 0.0 ? hue(color) : 0.0, saturation, high);
}

// Returns the color of hue, saturation and value; hues outside [0, 1] are all in the last sixth.
vec3 hsv_to_rgb(vec3 hsv)
{
    float sixth = hsv.x == 1.0 ? 0.0 : floor(hsv.x * 6.0);
    float part = fract(hsv.x * 6.0);
    float p = hsv.z * (1.0 - hsv.y), q = hsv.z * (1.0 - hsv.y * part), t = hsv.z * (1.0 - hsv.y * (1.0 - part));
    return sixth == 0.0 ? vec3(hsv.z, t, p) :
           sixth == 1.0 ? vec3(q, hsv.z, p) :
           sixth == 2.0 ? vec3(p, hsv.z, t) :
           sixth == 3.0 ? vec3(p, q, hsv.z) :
           sixth == 4.0 ? vec3(t, p, hsv.z) :
                          vec3(hsv.z, p, q);
}

// Returns hue, saturation and lightness.
vec3 rgb_to_hsl(vec3 color)
{
    float high = max(max(color.x, color.y), color.z), low = min(min(color.x, color.y), color.z);
    float lightness = min((high + low) / 2.0, 1.0);
    return vec3(hue(color), safe_divide(high - low, lightness > 0.5 ? 2.0 - high - low : high + low), lightness);
}

// Returns the color of hue, which does not repeat, saturation and lightness.
vec3 hsl_to_rgb(vec3 hsl)
{
    vec3 distances = abs(hsl.x * 6.0 - vec3(3.0, 2.0, 4.0));
    vec3 ramps = clamp(vec3(distances.x - 1.0, 2.0 - distances.y, 2.0 - distances.z), 0.0, 1.0);
    return (ramps - 0.5) * (1.0 - abs(2.0 * hsl.z - 1.0)) * hsl.y + hsl.z;
}

// Returns the blend mode Hue.
vec3 mix_hue(vec3 a, vec3 b, float t)
{
    vec3 first = rgb_to_hsv(a), second = rgb_to_hsv(b);
    return second.y == 0.0 ? a : mix(a, hsv_to_rgb(vec3(second.x, first.yz)), t);
}

// Returns the blend mode Saturation.
vec3 mix_saturation(vec3 a, vec3 b, float t)
{
    vec3 first = rgb_to_hsv(a), second = rgb_to_hsv(b);
    return first.y == 0.0 ? a : hsv_to_rgb(vec3(first.x, mix(first.y, second.y, t), first.z));
}

// Returns the blend mode Value.
vec3 mix_value(vec3 a, vec3 b, float t)
{
    vec3 first = rgb_to_hsv(a);
    return hsv_to_rgb(vec3(first.xy, mix(first.z, rgb_to_hsv(b).z, t)));
}

// Returns the blend mode Color.
vec3 mix_color(vec3 a, vec3 b, float t)
{
    vec3 first = rgb_to_hsv(a), second = rgb_to_hsv(b);
    return second.y == 0.0 ? a : mix(a, hsv_to_rgb(vec3(second.xy, first.z)), t);
}
