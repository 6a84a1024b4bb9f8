// SPDX-License-Identifier: GPL-3.0-or-later
// The light of a world that varies, from the maps that addon/realtime/world_maps.py has. Of `world_tiles`, the first is its mean weighted
// by the cosine to a direction, the second itself, smoothed, the others what GGX of alpha 4 / s, 8 / s, ... 1 reflects of it, s being the
// size of the first of them. hemispheres.glsl comes before it.

const int DIRECTIONS = 16;

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

// Returns the radiance that GGX of `alpha` has reflected, over its albedo; n, v: unit normal and direction to the viewer. What is
// reflected moves from the mirror's direction to the normal as S. Lagarde and C. de Rousiers, "Moving Frostbite to PBR" (2014), say.
vec3 world_reflected(vec3 n, vec3 v, float alpha)
{
    float smoothness = 1.0 - alpha;
    vec3 l = normalize(mix(n, reflect(-v, n), smoothness * (sqrt(smoothness) + alpha)));
    float level = clamp(log2(max(alpha, 1e-6) * world_tiles.tile[2].z / 4.0), 0.0, world_tiles.tile[0].w);
    int low = int(level), high = min(low + 1, int(world_tiles.tile[0].w));
    return mix(hemispheres_lookup(world_map, world_tiles.tile[2 + low], l), hemispheres_lookup(world_map, world_tiles.tile[2 + high], l),
        level - float(low));
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
