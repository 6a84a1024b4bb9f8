// SPDX-License-Identifier: GPL-3.0-or-later
// What all the models need first: the angles between N, L and V, and inputs kept within their ranges. Include it before them.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
//
//     mu_i = N.L,   mu_o = N.V,   s = L.V - mu_i mu_o = sin(theta_i) sin(theta_o) cos(phi)
//
// s, and a cosine near 0 or near 1, are what is left when numbers near 1 cancel, so a plain 32-bit dot() is off by 1e-4 of a
// cosine of 1e-3. diffuse_dot has twice the digits.

struct DiffuseGeometry {
    float mu_i;  // N.L, 0 to 1; 0 where there is nothing to see
    float mu_o;  // N.V, 0 to 1
    float sin_i; // of the angle between N and L
    float sin_o; // of the angle between N and V
    float s;     // sin_i sin_o cos(phi), within +-sin_i sin_o
};

// Returns x within 0 ... high; NaN gives 0. min, max and clamp may return anything for NaN, a comparison is false.
float diffuse_range(float x, float high)
{
    return x > 0.0 ? min(x, high) : 0.0;
}

// Returns each channel of the albedo rho within 0 ... 1; NaN gives 0.
vec3 diffuse_albedo(vec3 albedo)
{
    return vec3(diffuse_range(albedo.x, 1.0), diffuse_range(albedo.y, 1.0), diffuse_range(albedo.z, 1.0));
}

// Returns a.b as the unevaluated sum x + y, for vectors of about unit length within 1e-10 of the exact value.
// The components' leading 11 bits are multiplied and added without any rounding: x is a multiple of 2^-22, at most 4.
vec2 diffuse_dot(vec3 a, vec3 b)
{
    vec3 a_lead = floor(a * 2048.0 + 0.5) / 2048.0;
    vec3 b_lead = floor(b * 2048.0 + 0.5) / 2048.0;
    return vec2(dot(a_lead, b_lead), dot(a_lead, b - b_lead) + dot(a - a_lead, b));
}

// Returns the geometry of unit vectors: normal, direction to the light and to the viewer.
// Others are taken as they are, and cosines above 1 as 1. mu_i and mu_o are 0, and so is the radiance, where light or viewer are
// behind the surface or nearer to its plane than 1e-18, or a vector is 0, NaN, infinite or longer than about 1e9.
DiffuseGeometry diffuse_geometry(vec3 n, vec3 l, vec3 v)
{
    vec2 i = diffuse_dot(n, l);
    vec2 o = diffuse_dot(n, v);
    float length_sum = dot(abs(n) + abs(l) + abs(v), vec3(1.0));
    if (!(length_sum < 1e9) || !(i.x + i.y > 1e-18) || !(o.x + o.y > 1e-18)) {
        return DiffuseGeometry(0.0, 0.0, 0.0, 0.0, 0.0);
    }
    float below_i = (1.0 - i.x) - i.y; // 1 - mu_i, exact where mu_i itself has no bits left
    float below_o = (1.0 - o.x) - o.y;
    if (below_i < 0.0) {
        i = vec2(1.0, 0.0);
        below_i = 0.0;
    }
    if (below_o < 0.0) {
        o = vec2(1.0, 0.0);
        below_o = 0.0;
    }
    float mu_i = i.x + i.y;
    float mu_o = o.x + o.y;
    float sin_i = sqrt(below_i * (1.0 + mu_i));
    float sin_o = sqrt(below_o * (1.0 + mu_o));
    // s = L.V - low high = (L.V - low) + low (1 - high), which keeps its digits where high is near 1 and loses none elsewhere
    bool light_high = below_i < below_o;
    vec2 left = diffuse_dot(l, v) - (light_high ? o : i);
    float s = (left.x + (light_high ? mu_o * below_i : mu_i * below_o)) + left.y;
    float most = sin_i * sin_o;
    return DiffuseGeometry(mu_i, mu_o, sin_i, sin_o, clamp(s, -most, most));
}

// Returns asin(x) [radians] for x in 0 ... 1 within 3e-7 of its value; Mesa's built-in one is off by up to 4e-4.
// S. Moshier's asinf, Cephes Mathematical Library.
float diffuse_asin(float x)
{
    float square = x > 0.5 ? 0.5 * (1.0 - x) : x * x;
    float root = x > 0.5 ? sqrt(square) : x;
    float series = (((0.042163199048 * square + 0.024181311049) * square + 0.045470025998) * square + 0.074953002686) * square;
    float angle = root + root * square * (series + 0.16666752422);
    return x > 0.5 ? 1.57079632679490 - 2.0 * angle : angle;
}
