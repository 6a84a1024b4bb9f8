// SPDX-License-Identifier: GPL-3.0-or-later
// Sheen: fibers that scatter light several times. T. Zeltner, B. Burley, M. Chiang, "Practical Multiple-Scattering Sheen Using
// Linearly Transformed Cosines" (2022). The fits to its tables are those of MaterialX (mx_microfacet_sheen.glsl).
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

struct SheenLobe {
    vec3 n;
    vec3 x;       // unit vector in the plane of n and v
    vec3 y;
    float a;      // coefficients of the inverse transformation
    float b;
    float albedo; // the fraction of light from everywhere that is reflected towards v
};

// Returns the directional albedo, 0 to 1. mu: N.V, 0 to 1; roughness: 0.01 to 1.
float sheen_albedo(float mu, float roughness)
{
    float y = roughness;
    float width = y * (0.0206607 + 1.58491 * y) / (0.0379424 + y * (1.32227 + y));
    float middle = y * (-0.193854 + y * (-1.14885 + y * (1.7932 - 0.95943 * y * y))) / (0.046391 + y);
    float rest = y * (0.000654023 + (-0.0207818 + 0.119681 * y) * y) / (1.26264 + y * (-1.92021 + y));
    float t = (mu - middle) / width;
    return clamp(exp(-0.5 * t * t) / (width * 2.50662827463) + rest, 0.0, 1.0);
}

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; roughness: 0 to 1, clamped, NaN gives 0.
SheenLobe sheen_lobe(vec3 n, vec3 v, float roughness)
{
    float mu = clamp(dot(n, v), 0.0, 1.0);
    float r = max(0.01, diffuse_range(roughness, 1.0));
    vec3 x = v - n * mu;
    float square = dot(x, x);
    x = square > 1e-12 ? x * inversesqrt(square) : normalize(abs(n.x) < 0.5 ? cross(n, vec3(1.0, 0.0, 0.0)) : cross(n, vec3(0.0, 1.0, 0.0)));
    float a = (2.58126 * mu + 0.813703 * r) * r / (1.0 + 0.310327 * mu * mu + 2.60994 * mu * r);
    float b = sqrt(1.0 - mu) * (r - 1.0) * r * r * r / (0.0000254053 + 1.71228 * mu - 1.71506 * mu * r + 1.34174 * r * r);
    return SheenLobe(n, x, cross(n, x), a, b, sheen_albedo(mu, r));
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light, over the albedo [1/sr]; l: unit direction to it.
float sheen_radiance(SheenLobe lobe, vec3 l)
{
    float z = dot(lobe.n, l);
    if (!(z > 0.0)) {
        return 0.0;
    }
    vec3 w = vec3(lobe.a * dot(lobe.x, l) + lobe.b * z, lobe.a * dot(lobe.y, l), z);
    float scale = lobe.a / dot(w, w);
    return z * scale * scale / 3.14159265358979;
}
