// SPDX-License-Identifier: GPL-3.0-or-later
// What all models share: the angles between N, L and V, and inputs kept within their ranges. Include it before them.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
//
// Each model has two parts, as no driver is sure to move what is the same for all lights out of the loop over them: MODEL_surface
// computes once for a pixel what depends on N, V and the material, MODEL_radiance the rest for each light:
//     LambertSurface surface = lambert_surface(n, v, albedo);
//     for each light: radiance += irradiance * lambert_radiance(surface, l);
//
//     mu_i = N.L,   mu_o = N.V,   s = L.V - mu_i mu_o = L.(V - mu_o N) = sin(theta_i) sin(theta_o) cos(phi)
//
// A cosine near 0 or near 1 is what is left when numbers near 1 cancel, so a plain 32-bit dot() is off by 1e-4 of a cosine of 1e-3.
// diffuse_dot has twice the digits. V - mu_o N is computed with them, too, so that s may be a plain dot(): its error is 1e-7 sin_o,
// and the models multiply it with what vanishes with N.L, as the rest of the radiance does.

struct DiffuseView {
    vec3 n_lead; // N's leading 11 bits, over 2048
    vec3 n_rest; // the rest of N, over 2048
    vec3 side;   // V - mu_o N
    float mu_o;  // N.V, 0 to 1; 0 where there is nothing to see
    float sin_o; // of the angle between N and V
};

struct DiffuseGeometry {
    float mu_i;  // N.L, 0 to 1; 0 where there is nothing to see
    float sin_i; // of the angle between N and L
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

// Returns what is the same for all lights; n, v: normal and direction to the viewer, unit vectors.
// Others are taken as they are, and cosines above 1 as 1. All of it is 0, and so is the radiance, where the viewer is behind the
// surface or nearer to its plane than 1e-18, or a vector is 0, NaN, infinite or longer than about 1e9.
DiffuseView diffuse_view(vec3 n, vec3 v)
{
    vec2 o = diffuse_dot(n, v);
    if (!(dot(abs(n) + abs(v), vec3(1.0)) < 1e9) || !(o.x + o.y > 1e-18)) {
        return DiffuseView(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0);
    }
    float below = max((1.0 - o.x) - o.y, 0.0); // 1 - mu_o, exact where mu_o itself has no bits left
    float mu_o = min(o.x + o.y, 1.0);
    vec3 lead = floor(n * 2048.0 + 0.5) / 2048.0;
    vec3 side = mu_o > 0.5 ? (v - n) + n * below : v - n * mu_o;
    return DiffuseView(lead / 2048.0, (n - lead) / 2048.0, side, mu_o, sqrt(below * (1.0 + mu_o)));
}

// Returns N.x as diffuse_dot does.
vec2 diffuse_height(DiffuseView view, vec3 x)
{
    vec3 wide = x * 2048.0;
    vec3 lead = floor(wide + 0.5);
    return vec2(dot(view.n_lead, lead), dot(view.n_lead, wide - lead) + dot(view.n_rest, wide));
}

// Returns the geometry of a light; l: the direction to it, a unit vector.
// Others are taken as they are, and a cosine above 1 as 1. All of it is 0, and so is the radiance, where the light is behind the
// surface or nearer to its plane than 1e-18, or l is 0, NaN, infinite or so long that N.L is above 1e18.
DiffuseGeometry diffuse_geometry(DiffuseView view, vec3 l)
{
    vec2 i = diffuse_height(view, l);
    float n_dot_l = i.x + i.y;
    bool lit = n_dot_l > 1e-18 && n_dot_l < 1e18;
    float mu_i = lit ? min(n_dot_l, 1.0) : 0.0;
    float sin_i = sqrt(max((1.0 - i.x) - i.y, 0.0) * (1.0 + mu_i)); // not of mu_i, which has no bits left near 1
    float most = sin_i * view.sin_o;
    return DiffuseGeometry(mu_i, lit ? sin_i : 0.0, lit ? clamp(dot(l, view.side), -most, most) : 0.0);
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
