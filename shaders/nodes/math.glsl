// SPDX-License-Identifier: GPL-3.0-or-later
// Operations on numbers and vectors of Blender's nodes, as in addon/material/operations.py. What is defined for numbers is there for
// vec3, too, component by component. Where a result is not defined it is 0, as in Cycles.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

float safe_divide(float a, float b)
{
    return b != 0.0 ? a / b : 0.0;
}

vec3 safe_divide(vec3 a, vec3 b)
{
    return vec3(safe_divide(a.x, b.x), safe_divide(a.y, b.y), safe_divide(a.z, b.z));
}

// Returns a^b; negative numbers have whole powers alone.
float safe_power(float a, float b)
{
    if (a > 0.0) {
        return pow(a, b);
    }
    if (a == 0.0 || b != floor(b)) {
        return a == 0.0 && b == 0.0 ? 1.0 : 0.0;
    }
    return mod(b, 2.0) == 0.0 ? pow(-a, b) : -pow(-a, b);
}

vec3 safe_power(vec3 a, vec3 b)
{
    return vec3(safe_power(a.x, b.x), safe_power(a.y, b.y), safe_power(a.z, b.z));
}

// Returns the logarithm of a to base b.
float safe_logarithm(float a, float b)
{
    return a > 0.0 && b > 0.0 && b != 1.0 ? log(a) / log(b) : 0.0;
}

vec3 safe_logarithm(vec3 a, vec3 b)
{
    return vec3(safe_logarithm(a.x, b.x), safe_logarithm(a.y, b.y), safe_logarithm(a.z, b.z));
}

float safe_inverse_sqrt(float a)
{
    return a > 0.0 ? inversesqrt(a) : 0.0;
}

vec3 safe_inverse_sqrt(vec3 a)
{
    return vec3(safe_inverse_sqrt(a.x), safe_inverse_sqrt(a.y), safe_inverse_sqrt(a.z));
}

float less_than(float a, float b)
{
    return a < b ? 1.0 : 0.0;
}

vec3 less_than(vec3 a, vec3 b)
{
    return vec3(less_than(a.x, b.x), less_than(a.y, b.y), less_than(a.z, b.z));
}

float greater_than(float a, float b)
{
    return a > b ? 1.0 : 0.0;
}

vec3 greater_than(vec3 a, vec3 b)
{
    return vec3(greater_than(a.x, b.x), greater_than(a.y, b.y), greater_than(a.z, b.z));
}

float compare(float a, float b, float distance)
{
    return abs(a - b) <= max(distance, 1.1920929e-7) ? 1.0 : 0.0;
}

vec3 compare(vec3 a, vec3 b, vec3 distance)
{
    return vec3(compare(a.x, b.x, distance.x), compare(a.y, b.y, distance.y), compare(a.z, b.z, distance.z));
}

// Returns the minimum of a and b, rounded within a distance k.
float smooth_minimum(float a, float b, float k)
{
    float h = k != 0.0 ? max(k - abs(a - b), 0.0) / k : 0.0;
    return min(a, b) - h * h * h * k / 6.0;
}

vec3 smooth_minimum(vec3 a, vec3 b, vec3 k)
{
    return vec3(smooth_minimum(a.x, b.x, k.x), smooth_minimum(a.y, b.y, k.y), smooth_minimum(a.z, b.z, k.z));
}

// Returns the rest of a / b with the sign of a.
float safe_modulo(float a, float b)
{
    return b != 0.0 ? a - b * trunc(a / b) : 0.0;
}

vec3 safe_modulo(vec3 a, vec3 b)
{
    return vec3(safe_modulo(a.x, b.x), safe_modulo(a.y, b.y), safe_modulo(a.z, b.z));
}

// Returns the rest of a / b with the sign of b.
float floored_modulo(float a, float b)
{
    return b != 0.0 ? a - b * floor(a / b) : 0.0;
}

vec3 floored_modulo(vec3 a, vec3 b)
{
    return vec3(floored_modulo(a.x, b.x), floored_modulo(a.y, b.y), floored_modulo(a.z, b.z));
}

// Returns x repeated in [low, high).
float wrap(float x, float high, float low)
{
    float span = high - low;
    return span != 0.0 ? x - span * floor((x - low) / span) : low;
}

vec3 wrap(vec3 x, vec3 high, vec3 low)
{
    return vec3(wrap(x.x, high.x, low.x), wrap(x.y, high.y, low.y), wrap(x.z, high.z, low.z));
}

// Returns a reflected back and forth between 0 and b.
float ping_pong(float a, float b)
{
    return b != 0.0 ? abs(fract((a - b) / (b * 2.0)) * b * 2.0 - b) : 0.0;
}

vec3 ping_pong(vec3 a, vec3 b)
{
    return vec3(ping_pong(a.x, b.x), ping_pong(a.y, b.y), ping_pong(a.z, b.z));
}

// Returns asin(a) [radians]; drivers' own are off by up to 4e-4. S. Moshier's asinf, Cephes Mathematical Library.
float arcsine(float a)
{
    float x = min(abs(a), 1.0);
    float square = x > 0.5 ? 0.5 * (1.0 - x) : x * x;
    float root = x > 0.5 ? sqrt(square) : x;
    float series = (((0.042163199048 * square + 0.024181311049) * square + 0.045470025998) * square + 0.074953002686) * square;
    float angle = root + root * square * (series + 0.16666752422);
    return sign(a) * (x > 0.5 ? 1.57079632679490 - 2.0 * angle : angle);
}

vec3 arcsine(vec3 a)
{
    return vec3(arcsine(a.x), arcsine(a.y), arcsine(a.z));
}

float arccosine(float a)
{
    return a > 0.5 ? 2.0 * arcsine(sqrt(0.5 * max(1.0 - a, 0.0))) : 1.57079632679490 - arcsine(a);
}

vec3 arccosine(vec3 a)
{
    return vec3(arccosine(a.x), arccosine(a.y), arccosine(a.z));
}

float safe_arctangent2(float y, float x)
{
    return x == 0.0 && y == 0.0 ? 0.0 : atan(y, x);
}

vec3 safe_arctangent2(vec3 y, vec3 x)
{
    return vec3(safe_arctangent2(y.x, x.x), safe_arctangent2(y.y, x.y), safe_arctangent2(y.z, x.z));
}

// Returns Hermite's cubic step of x from a to b.
float smooth_step(float a, float b, float x)
{
    float t = clamp(safe_divide(x - a, b - a), 0.0, 1.0);
    return (3.0 - 2.0 * t) * t * t;
}

vec3 smooth_step(vec3 a, vec3 b, vec3 x)
{
    return vec3(smooth_step(a.x, b.x, x.x), smooth_step(a.y, b.y, x.y), smooth_step(a.z, b.z, x.z));
}

// Returns Perlin's step of order 5 of x from a to b.
float smoother_step(float a, float b, float x)
{
    float t = clamp(safe_divide(x - a, b - a), 0.0, 1.0);
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}

vec3 smoother_step(vec3 a, vec3 b, vec3 x)
{
    return vec3(smoother_step(a.x, b.x, x.x), smoother_step(a.y, b.y, x.y), smoother_step(a.z, b.z, x.z));
}

vec3 safe_normalize(vec3 a)
{
    float size = length(a);
    return size != 0.0 ? a / size : vec3(0.0);
}

// Returns the part of a along b.
vec3 project(vec3 a, vec3 b)
{
    return b * safe_divide(dot(a, b), dot(b, b));
}

// Returns a turned around x, then y, then z by angles [radians].
vec3 rotated(vec3 a, vec3 angles)
{
    vec3 s = sin(angles), c = cos(angles);
    a = vec3(a.x, c.x * a.y - s.x * a.z, s.x * a.y + c.x * a.z);
    a = vec3(c.y * a.x + s.y * a.z, a.y, c.y * a.z - s.y * a.x);
    return vec3(c.z * a.x - s.z * a.y, s.z * a.x + c.z * a.y, a.z);
}

// Returns the inverse of rotated().
vec3 rotated_back(vec3 a, vec3 angles)
{
    vec3 s = sin(angles), c = cos(angles);
    a = vec3(c.z * a.x + s.z * a.y, c.z * a.y - s.z * a.x, a.z);
    a = vec3(c.y * a.x - s.y * a.z, a.y, s.y * a.x + c.y * a.z);
    return vec3(a.x, c.x * a.y + s.x * a.z, c.x * a.z - s.x * a.y);
}

// Returns a turned around an axis by an angle [radians], a itself where there is no axis.
vec3 rotated_about(vec3 a, vec3 axis, float angle)
{
    vec3 n = safe_normalize(axis);
    return n == vec3(0.0) ? a : a * cos(angle) + cross(n, a) * sin(angle) + n * (dot(n, a) * (1.0 - cos(angle)));
}

// Returns the reflectance of a dielectric of a relative index of refraction, for light without polarization.
float fresnel(float cosine, float index)
{
    float c = abs(cosine);
    float square = index * index - 1.0 + c * c;
    if (square <= 0.0) {
        return 1.0;
    }
    float g = sqrt(square);
    float a = (g - c) / (g + c);
    float b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}
