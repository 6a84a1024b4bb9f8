// SPDX-License-Identifier: GPL-3.0-or-later
// What parallel rays meet: addon/realtime/ray_bundles.py. A map is a row of squares, one for each layer of surfaces, from the farthest, at the
// left, to the nearest. `bundle_map` has rgb: their radiance against the rays [W/(m^2 sr)]; `bundle_depths` has r: their depth, more by
// TRANSPARENT_DEPTH of what some samples see through, negative where their back is met, 0 where there is none. a of the one and g of
// the other: by how much the depth on the surface's plane grows over the square's width and height.
// Of `bundles`, matrix[k] takes a point to the clip space of map k; towards[k]: the unit vector along its rays, w: the width of a
// texel [m]; sky[k]: the radiance of the sky there, w: the irradiance of a plane that faces a ray of radiance 1 [W/m^2]; low.w: the
// number of maps, of which the first high.w are for points within the box from low to high [m], the others for the rest; use.x: the
// texels of a square's side.

const float NEAR_TEXELS = 2.0; // from a surface

// Returns the first of the maps for a point, and the one after the last.
ivec2 bundles_at(vec3 position)
{
    bool is_within = all(greaterThanEqual(position, bundles.low.xyz)) && all(lessThanEqual(position, bundles.high.xyz));
    return ivec2(is_within ? vec2(0.0, bundles.high.w) : vec2(bundles.high.w, bundles.low.w));
}

// Returns what the ray of map k meets first that leaves a surface of unit normal n: rgb: its radiance, w: 1; 0 where it meets nothing.
// The ray leaves the surface's front or, if not `is_front`, its back.
vec4 met_by_ray(int k, vec3 position, vec3 n, bool is_front)
{
    vec4 towards = bundles.towards[k];
    float cosine = dot(n, towards.xyz);
    if (cosine <= 0.0) {
        return vec4(0.0);
    }
    // off the surface a little, which is not quite the plane that a texel has of it
    vec3 start = position + n * (0.25 * towards.w);
    vec3 point = (bundles.matrix[k] * vec4(start, 1.0)).xyz * 0.5 + 0.5;
    if (any(lessThan(point.xy, vec2(0.0))) || any(greaterThanEqual(point.xy, vec2(1.0)))) {
#ifdef LAYER
        return vec4(0.0, 0.0, 0.0, 1.0); // so that no sky shines into what is closed
#else
        return vec4(0.0);
#endif
    }
    int size = int(bundles.use.x);
    mat4 matrix = bundles.matrix[k];
    // the map's width in units of its depth
    float depth_of_width = 0.5 * length(vec3(matrix[0].z, matrix[1].z, matrix[2].z)) * towards.w * bundles.use.x;
    ivec2 row = ivec2(0, size * k), texel = ivec2(point.xy * bundles.use.x);
    // The nearest texel or, where it has no surface, one of the other three around the point: no sky shines through edges of walls.
    // What is far from detail would be too dark by that, as its texels are wide.
    ivec2 beside = texel + ivec2(greaterThan(fract(point.xy * bundles.use.x), vec2(0.5))) * 2 - 1;
    beside = clamp(beside, ivec2(0), ivec2(size - 1));
    int corners = k < int(bundles.high.w) ? 4 : 1, width = textureSize(bundle_map, 0).x;
    for (int corner = 0; corner < corners; corner++) {
        ivec2 place = ivec2((corner & 1) == 0 ? texel.x : beside.x, (corner & 2) == 0 ? texel.y : beside.y);
        vec2 from_middle = point.xy - (vec2(place) + 0.5) / bundles.use.x;
        for (int x = width - size; x >= 0; x -= size) {
            vec2 surface = texelFetch(bundle_depths, row + place + ivec2(x, 0), 0).rg;
            bool is_transparent = abs(surface.r) >= TRANSPARENT_DEPTH; // a texel beside it that sees through is no gap
            float away = abs(surface.r) - (is_transparent ? TRANSPARENT_DEPTH : 0.0) - max(point.z, 0.0);
            if (away <= 0.0 || (is_transparent && corner > 0)) {
                continue;
            }
            vec4 light = texelFetch(bundle_map, row + place + ivec2(x, 0), 0);
            vec2 slope = vec2(light.a, surface.g);
            if (away + dot(from_middle, slope) <= 0.0) {
                continue; // the texel is in front of the point, but the plane is not
            }
            // Beside an edge of something solid a texel may show the face around the corner, from within. The ray passes by that.
            if (is_front == (surface.r < 0.0) && away < NEAR_TEXELS * length(vec3(depth_of_width, slope)) / bundles.use.x) {
                float before = x + size < width ? texelFetch(bundle_depths, row + place + ivec2(x + size, 0), 0).r : surface.r;
                if (x + size == width || (before != 0.0 && is_front == (before > 0.0))) {
                    continue;
                }
            }
            return vec4(light.rgb, 1.0);
        }
    }
    return vec4(0.0);
}
