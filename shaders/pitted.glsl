// SPDX-License-Identifier: GPL-3.0-or-later
// A surface of nothing but hemispherical pits with Lambertian walls, all interreflection included. J. Koenderink, A. van Doorn,
// K. Dana, S. Nayar, "Bidirectional Reflection Distribution Function of Thoroughly Pitted Surfaces" (IJCV 31, 1999):
//     L_r = rho E0 I / (pi^2 N.V) + rho^2 E0 (N.L) / (pi (4 - 2 rho))
// I is the integral of (m.L)(m.V) over the wall's normals m that light and viewer reach: the spherical triangle m.N > 0, m.L' > 0,
// m.V' > 0 with L' = 2 (N.L) L - N, V' = 2 (N.V) V - N. With Omega its solid angle, B and C the angles at L' and V' of the triangle
// N, L', V', and gamma its side L'V', the integral is (J. Arvo, "Applications of Irradiance Tensors", SIGGRAPH 1995)
//     3 I = (L.V) Omega + mu_o S_i (1 + cos(phi)) + (L'.V) S_i (1 + cos(B))
//           + (mu_o / mu_i) (mu_o S_o + sin(gamma) / 2) (1 + cos(C)),   S = sin(theta)
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings. Include geometry.glsl before it.

struct PittedSurface {
    DiffuseView view;
    vec3 n;
    vec3 v;
    vec2 o;     // N.V
    vec3 single_scattering; // rho / (3 pi^2)
    vec3 interreflection;   // rho^2 / (pi (4 - 2 rho))
};

// Returns what is the same for all lights. n, v: unit normal and direction to the viewer; geometry.glsl says what becomes of others.
// albedo: rho of the walls, 0 to 1, clamped, NaN gives 0; the surface as a whole reflects rho / (2 - rho).
PittedSurface pitted_surface(vec3 n, vec3 v, vec3 albedo)
{
    DiffuseView view = diffuse_view(n, v);
    vec3 rho = diffuse_albedo(albedo);
    vec3 interreflection = rho * rho / (3.14159265358979 * (4.0 - 2.0 * rho));
    return PittedSurface(view, n, v, diffuse_dot(n, v), rho / 29.6088132032681, interreflection);
}

// Returns 3 I / min(mu_i, mu_o), finite up to the horizon; q: N.(L x V) = sin(theta_i) sin(theta_o) sin(phi).
// Light and viewer can change places, so the higher one takes L's. Every difference that would cancel near the horizon or near
// L = V is written as a sum of terms of one sign, by way of sin^2(x) - sin^2(y) = sin(x - y) sin(x + y).
float pitted_single_scattering(DiffuseView view, DiffuseGeometry g, float q)
{
    bool light_high = g.mu_i > view.mu_o;
    float high = light_high ? g.mu_i : view.mu_o;
    float low = light_high ? view.mu_o : g.mu_i;
    float s_high = light_high ? g.sin_i : view.sin_o;
    float s_low = light_high ? view.sin_o : g.sin_i;

    // both (1 + cos(phi)) and both (1 - cos(phi)); q tells small angles that cos(phi) cannot. L or V at N has no phi: any will do.
    float both = s_high * s_low;
    float radius = length(vec2(g.s, q));
    float cos_phi = radius > 0.0 ? g.s / radius : 0.0;
    float lacking = radius > 0.0 ? both * (abs(q) / radius) * (abs(q) / (radius + abs(g.s))) : both; // both (1 - |cos(phi)|)
    float full = both * (1.0 + abs(cos_phi));
    float plus = cos_phi >= 0.0 ? full : lacking;
    float minus = cos_phi >= 0.0 ? lacking : full;

    // gamma / 2; the sum of theta_i and theta_o; their difference; sigma = sum + gamma / 2, half the triangle's perimeter
    float sin_sum = s_high * low + high * s_low;
    float cos_sum = high * low - both;
    float sin_difference = max(s_low * high - s_high * low, 0.0);
    float cos_difference = high * low + both;
    float sin_half = sqrt(sin_difference * sin_difference + 2.0 * high * low * minus);
    float cos_half = sqrt(cos_sum * cos_sum + 2.0 * high * low * plus);
    float sin_sigma;
    float ratio; // sin(sigma) / cos(gamma / 2), 0 to 2
    if (cos_sum > 0.0) {
        ratio = sin_sum + cos_sum / cos_half * sin_half;
        sin_sigma = ratio * cos_half;
    } else {
        float divisor = sin_sum * cos_half - cos_sum * sin_half; // sin(sigma - gamma)
        sin_sigma = divisor > 0.0 ? 2.0 * high * low * plus / divisor : 0.0;
        ratio = cos_half > 0.0 ? min(sin_sigma / cos_half, 2.0) : 0.0;
    }
    float cos_sigma = cos_sum * cos_half - sin_sum * sin_half;

    float omega; // 2 (pi - sigma)
    if (sin_sigma < 0.7) {
        float angle = diffuse_asin(sin_sigma);
        omega = cos_sigma < 0.0 ? 2.0 * angle : 6.28318530717959 - 2.0 * angle;
    } else {
        float angle = diffuse_asin(abs(cos_sigma));
        omega = 3.14159265358979 + (cos_sigma < 0.0 ? -2.0 : 2.0) * angle;
    }

    // Where L' = V', B and C are undefined, but B + C = pi, and only the sum counts.
    float c = high * low + both * cos_phi;
    float across = (2.0 * high * c - low) / low * s_high; // (L'.V) S_i (1 + cos(B)) / low
    float one_plus_cos_c = 1.0;
    if (sin_half > 0.0) {
        float spread = sin_half * cos_difference + cos_half * sin_difference; // sin(gamma / 2 + theta_low - theta_high)
        across = (2.0 * high * c - low) / spread * (ratio / sin_half) * minus;
        one_plus_cos_c = s_low > 0.0 ? min(ratio / low * (spread / sin_half) / (2.0 * s_low), 2.0) : 1.0;
    }
    float along = (low * s_low + sin_half * cos_half) / high * one_plus_cos_c;
    return max(0.0, c * omega / low + s_high * (1.0 + cos_phi) + across + along);
}

// Returns the radiance towards v per irradiance E0 on a plane that faces the light [1/sr]; l: unit direction to the light.
vec3 pitted_radiance(PittedSurface surface, vec3 l)
{
    DiffuseGeometry g = diffuse_geometry(surface.view, l);
    if (!(g.mu_i > 0.0)) {
        return vec3(0.0);
    }
    vec3 n = surface.n;
    vec3 v = surface.v;
    vec2 i = diffuse_height(surface.view, l);
    vec2 o = surface.o;
    float mu_o = surface.view.mu_o;
    // Near N phi takes more digits of s than geometry.glsl has: L.V - low high = (L.V - low) + low (1 - high), which keeps them
    // where high is near 1 and loses none elsewhere.
    bool light_high = g.mu_i > mu_o;
    vec2 left = diffuse_dot(l, v) - (light_high ? o : i);
    float s = (left.x + (light_high ? mu_o * ((1.0 - i.x) - i.y) : g.mu_i * ((1.0 - o.x) - o.y))) + left.y;
    float most = g.sin_i * surface.view.sin_o;
    g.s = clamp(s, -most, most);
    // N.(L x V) stays the same when N is taken off L or V, and next to N that leaves it all its digits.
    float q = dot(n, cross(g.mu_i > 0.5 ? l - n : l, mu_o > 0.5 ? v - n : v));
    float single = pitted_single_scattering(surface.view, g, clamp(q, -1.0, 1.0)) * min(g.mu_i / mu_o, 1.0);
    return surface.single_scattering * single + surface.interreflection * g.mu_i;
}
