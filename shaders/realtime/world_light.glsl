// SPDX-License-Identifier: GPL-3.0-or-later
// The light of a world that varies, from the maps that addon/realtime/world_maps.py has. Of `world_tiles`, the first is its mean weighted
// by the cosine to a direction, the second itself, smoothed, the others what GGX of alpha 4 / s, 8 / s, ... 1 reflects of it, s being the
// size of the first of them. hemispheres.glsl comes before it.

const int DIRECTIONS = 16, FACETS = 4;

// Returns the irradiance of a surface, over pi [W/(m^2 sr)]; n: its unit normal.
vec3 world_around(vec3 n)
{
    return hemispheres_lookup(world_map, world_tiles.tile[0], n);
}

// Returns the radiance, averaged over some 10 degrees, from a unit direction.
vec3 world_smooth(vec3 direction)
{
    return hemispheres_lookup(world_map, world_tiles.tile[1], direction);
}

// Returns the number of the level that GGX of `alpha` has reflected, seen along the normal.
float world_level(float alpha)
{
    return clamp(log2(max(alpha, 1e-6) * world_tiles.tile[2].z / 4.0), 0.0, world_tiles.tile[0].w);
}

// Returns about the radiance that GGX of `alpha` has reflected, over its albedo, as one that is seen along the normal reflects it. What is
// reflected moves from the mirror's direction to the normal as S. Lagarde and C. de Rousiers, "Moving Frostbite to PBR" (2014), say.
vec3 world_reflected_once(vec3 n, vec3 v, float alpha)
{
    float smoothness = 1.0 - alpha;
    vec3 l = normalize(mix(n, reflect(-v, n), smoothness * (sqrt(smoothness) + alpha)));
    float level = world_level(alpha);
    int low = int(level), high = min(low + 1, int(world_tiles.tile[0].w));
    return mix(hemispheres_lookup(world_map, world_tiles.tile[2 + low], l), hemispheres_lookup(world_map, world_tiles.tile[2 + high], l),
        level - float(low));
}

// Returns the radiance that GGX of `alpha` has reflected, over its albedo; n, v: unit normal and direction to the viewer. The first sample
// of a picture takes it from the maps as it is seen along the normal; each other has FACETS directions, as dense as what microfacets that
// are seen reflect (J. Dupuy and A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023), and around each the world as
// blurred as the directions of all samples so far are far apart, or half of it (J. Krivanek and M. Colbert, "Real-time Shading with
// Filtered Importance Sampling", 2008).
vec3 world_reflected(vec3 n, vec3 v, float alpha)
{
    if (view.world.w == 0.0) {
        return world_reflected_once(n, v, alpha);
    }
    float mu = clamp(dot(n, v), 1e-4, 1.0), count = float(FACETS) * 2.0 * (view.world.w + 1.0);
    vec3 x = v - n * dot(n, v);
    float square = dot(x, x);
    x = square > 1e-12 ? x * inversesqrt(square) : normalize(abs(n.x) < 0.5 ? cross(n, vec3(1.0, 0.0, 0.0)) : cross(n, vec3(0.0, 1.0, 0.0)));
    vec3 y = cross(n, x);
    float narrow = max(alpha * sqrt(1.0 - 1.0 / count), 1e-4), narrow2 = narrow * narrow; // the blur adds the rest
    float sine2 = 1.0 - mu * mu, r_o = sqrt(mu * mu + narrow2 * sine2);
    vec3 stretched = vec3(narrow * sqrt(sine2), 0.0, mu) / r_o;
    // The pattern does not turn with the plane of n and v, or it would be a fan where that does: as an axis beside v is carried to n.
    vec3 beside = normalize(abs(v.z) < 0.9 ? cross(v, vec3(0.0, 0.0, 1.0)) : cross(v, vec3(1.0, 0.0, 0.0)));
    vec2 turn = vec2(dot(n, beside), dot(n, cross(v, beside)));
    turn = square > 1e-12 ? -turn * inversesqrt(square) : vec2(1.0, 0.0);
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int k = 0; k < FACETS; k++) {
        float angle = 6.28318530717959 * fract(float(k) * 0.618033988749895 + view.world.w * 0.569840290998053);
        float within_step = fract(0.5 + view.world.w * 0.754877666246693);
        float height = 1.0 - (float(k) + within_step) / float(FACETS) * (1.0 + stretched.z);
        float radius = sqrt(max(1.0 - height * height, 0.0));
        vec2 cap = radius * vec2(cos(angle), sin(angle));
        vec3 h = vec3(dot(cap, turn), cap.y * turn.x - cap.x * turn.y, height) + stretched;
        h = normalize(vec3(narrow * h.xy, h.z));
        vec3 l = 2.0 * (h.x * sqrt(sine2) + h.z * mu) * h - vec3(sqrt(sine2), 0.0, mu);
        if (l.z <= 0.0) {
            continue;
        }
        float below = 1.0 - h.z * h.z * (1.0 - narrow2);
        float density = narrow2 / (3.14159265358979 * below * below) / (2.0 * (mu + r_o)); // of the directions l [1/sr]
        float weight = l.z * (mu + r_o) / (l.z * r_o + mu * sqrt(l.z * l.z + narrow2 * (1.0 - l.z * l.z))); // G2 / G1
        float level = world_level(inversesqrt(4.0 * 3.14159265358979 * count * density));
        sum += weight * hemispheres_lookup(world_map, world_tiles.tile[2 + int(level + 0.5)], l.x * x + l.y * y + l.z * n);
        weights += weight;
    }
    return weights > 0.0 ? sum / weights : world_reflected_once(n, v, alpha);
}

// Returns one of DIRECTIONS directions on a spiral, as dense as the cosine to n; from sample to sample of the picture they move. The
// first axis is that in which v leans, so that all pixels see the same directions.
vec3 world_direction(int k, vec3 n, vec3 v)
{
    vec3 x = v - n * dot(n, v);
    float square = dot(x, x);
    x = square > 1e-12 ? x * inversesqrt(square) : normalize(abs(n.x) < 0.5 ? cross(n, vec3(1.0, 0.0, 0.0)) : cross(n, vec3(0.0, 1.0, 0.0)));
    float height = (float(k) + fract(0.5 + view.world.w * 0.618033988749895)) / float(DIRECTIONS);
    float angle = 6.28318530717959 * fract(float(k) * 0.618033988749895 + view.world.w * 0.569840290998053);
    return sqrt(height) * (cos(angle) * x + sin(angle) * cross(n, x)) + sqrt(1.0 - height) * n;
}
