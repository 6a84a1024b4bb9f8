// SPDX-License-Identifier: GPL-3.0-or-later
// What parallel rays meet: addon/realtime/ray_bundles.py. A map is a row of squares, one for each layer of surfaces, from the farthest, at the
// left, to the nearest: rgb: their radiance against the rays [W/(m^2 sr)], a: depth, more by TRANSPARENT_DEPTH
// of what some samples see through, -1 where there is none.
// Of `bundles`, matrix[k] takes a point to the clip space of map k; towards[k]: the unit vector along its rays, w: the width of a
// texel [m]; sky[k]: the radiance of the sky there, w: the irradiance of a plane that faces a ray of radiance 1 [W/m^2]; low.w: the
// number of maps, of which the first high.w are for points within the box from low to high [m], the others for the rest; use.x: the
// texels of a square's side.

// Returns the first of the maps for a point, and the one after the last.
ivec2 bundles_at(vec3 position)
{
    bool is_within = all(greaterThanEqual(position, bundles.low.xyz)) && all(lessThanEqual(position, bundles.high.xyz));
    return ivec2(is_within ? vec2(0.0, bundles.high.w) : vec2(bundles.high.w, bundles.low.w));
}

// Returns what the ray of map k meets first that leaves a surface of unit normal n: rgb: its radiance, w: 1; 0 where it meets nothing.
vec4 met_by_ray(int k, vec3 position, vec3 n)
{
    vec4 towards = bundles.towards[k];
    float cosine = dot(n, towards.xyz);
    if (cosine <= 0.0) {
        return vec4(0.0);
    }
    // off the surface by as much as its plane rises along the rays within the texels that are read, so that it does not meet itself
    vec3 start = position + n * (towards.w * (0.25 + 1.45 * sqrt(max(0.0, 1.0 - cosine * cosine))));
    vec3 point = (bundles.matrix[k] * vec4(start, 1.0)).xyz * 0.5 + 0.5;
    if (any(lessThan(point.xy, vec2(0.0))) || any(greaterThanEqual(point.xy, vec2(1.0)))) {
#ifdef LAYER
        return vec4(0.0, 0.0, 0.0, 1.0); // so that no sky shines into what is closed
#else
        return vec4(0.0);
#endif
    }
    int size = int(bundles.use.x);
    ivec2 row = ivec2(0, size * k), texel = ivec2(point.xy * bundles.use.x);
    // the nearest texel or, where it has no surface, one of the other three around the point: no sky shines through edges of walls
    ivec2 beside = texel + ivec2(greaterThan(fract(point.xy * bundles.use.x), vec2(0.5))) * 2 - 1;
    beside = clamp(beside, ivec2(0), ivec2(size - 1));
    for (int corner = 0; corner < 4; corner++) {
        ivec2 place = row + ivec2((corner & 1) == 0 ? texel.x : beside.x, (corner & 2) == 0 ? texel.y : beside.y);
        for (int x = textureSize(bundle_map, 0).x - size; x >= 0; x -= size) {
            vec4 surface = texelFetch(bundle_map, place + ivec2(x, 0), 0);
            bool is_transparent = surface.w >= TRANSPARENT_DEPTH; // a texel beside it that sees through is no gap
            if (is_transparent && corner > 0) {
                continue;
            }
            if (surface.w - (is_transparent ? TRANSPARENT_DEPTH : 0.0) > point.z) {
                return vec4(surface.rgb, 1.0);
            }
        }
    }
    return vec4(0.0);
}
