// SPDX-License-Identifier: GPL-3.0-or-later
// Normalized diffusion: how far from where it entered light leaves a medium; two exponentials that integrate to 1 over the plane.
// P. Christensen and B. Burley, "Approximate Reflectance Profiles for Efficient Subsurface Scattering" (Pixar 2015), equation (3):
//     R(r) = (e^(-r / d) + e^(-r / (3 d))) / (8 pi d r)
// The fraction within r, 1 - e^(-x) / 4 - (3/4) e^(-x / 3) with x = r / d, has an inverse in closed form (E. Golubev, "Sampling
// Burley's Normalized Diffusion Profiles", 2019): y = e^(-x / 3) solves y^3 + 3 y = 4 (1 - fraction).
// Lengths in any unit, the same for all; d is clamped to 1e-9 ... 1e9, NaN gives 1e-9.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

// Returns d within its range.
float burley_distance(float d)
{
    return max(1e-9, diffuse_range(d, 1e9));
}

// Returns R(r) [1/length^2], which is also the probability density per area of a sample at a distance from burley_radius and any
// azimuth. It grows as 1 / r without end: r below 1e-9 d, and NaN, count as that.
float burley_density(float r, float d)
{
    float length_d = burley_distance(d);
    float x = max(1e-9, diffuse_range(r / length_d, 1e9));
    float third = exp(-x / 3.0);
    return third * (1.0 + third * third) / (25.1327412287183 * x * length_d * length_d); // 8 pi
}

// Returns R(r) [1/length^2] of each channel.
vec3 burley_profile(float r, vec3 d)
{
    return vec3(burley_density(r, d.x), burley_density(r, d.y), burley_density(r, d.z));
}

// Returns the r within which the fraction xi of the light leaves, at most 49 d; xi: 0 to 1, clamped, NaN gives 0.
// Near xi = 0, where y is near 1, one step of Newton's method gives 1 - y all its digits.
float burley_radius(float xi, float d)
{
    float fraction = diffuse_range(xi, 0.99999994);
    float rest = 1.0 - fraction;
    float root = 2.0 * rest + sqrt(1.0 + 4.0 * rest * rest);
    float power = pow(root, 0.666666666666667);
    float y = 4.0 * rest / (1.0 + power + 1.0 / power);
    if (fraction > 0.5) {
        return -3.0 * burley_distance(d) * log(y);
    }
    float gap = fraction < 1e-3 ? fraction / 1.5 : 1.0 - y;
    gap -= (gap * (6.0 + gap * (gap - 3.0)) - 4.0 * fraction) / (6.0 + gap * (3.0 * gap - 6.0));
    float z = gap / (2.0 - gap); // -log(1 - gap) = 2 atanh(z)
    float z2 = z * z;
    float series = 1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 / 9.0)));
    return 6.0 * burley_distance(d) * max(0.0, z * series);
}

// Returns the d of each channel with which the edge of a shadow is as wide as on the medium, from 25 to 75 % of the light:
// mean free path times w(color), over 1.633, the width with d = 1; w as random walks have it (addon/closures/subsurface_fit.py).
// color: what the medium reflects, 0 to 1, clamped, NaN gives 0. mean_free_path: 1 / sigma_t', such that d is clamped.
vec3 burley_d(vec3 color, vec3 mean_free_path)
{
    vec3 rho = diffuse_albedo(color);
    vec3 width = (0.28634 + rho * (1.0129 - 0.48255 * rho)) / (1.0 - 0.66528 * rho);
    vec3 d = mean_free_path * width / 1.633035806;
    return vec3(burley_distance(d.x), burley_distance(d.y), burley_distance(d.z));
}
