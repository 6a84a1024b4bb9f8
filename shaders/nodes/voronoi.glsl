// SPDX-License-Identifier: GPL-3.0-or-later
// Blender's Voronoi Texture, as in addon/material/textures/voronoi.py: S. Worley (1996), I. Quilez (2012, 2014).
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.
// Include hashing.glsl before it.

// All outputs of the node; those that a feature does not have are 0. w: of the position, too.
struct Voronoi {
    float distance;
    vec3 color;
    vec3 position;
    float w;
    float radius;
};

// The menus and parameters. feature: F1, F2, smooth F1, distance to edge, n-sphere radius. metric: Euclidean, Manhattan, Chebychev,
// Minkowski.
struct VoronoiNode {
    int dimensions;
    int feature;
    int metric;
    float smoothness;
    float exponent;
    float randomness;
    ivec4 axes; // 1 for each that the texture has, else 0
};

// What the nearest points give.
struct VoronoiPoint {
    float distance;
    vec3 color;
    vec4 position;
};

// Returns the point of the cell at offset from cell, seen from the corner of cell.
vec4 voronoi_point(VoronoiNode node, ivec4 cell, ivec4 offset)
{
    vec4 shares = node.dimensions == 1 ? vec4(hash_random(1, vec4(cell + offset))) : hash_cell(node.dimensions, cell + offset);
    return vec4(offset) + shares * vec4(node.axes) * node.randomness;
}

vec3 voronoi_color(VoronoiNode node, ivec4 cell)
{
    if (node.dimensions == 1) {
        vec4 key = vec4(float(cell.x), 0.0, 0.0, 0.0);
        return vec3(hash_random(1, key), hash_random(2, key + vec4(0.0, 1.0, 0.0, 0.0)), hash_random(2, key + vec4(0.0, 2.0, 0.0, 0.0)));
    }
    return hash_cell(max(node.dimensions, 3), cell).xyz;
}

float voronoi_length(VoronoiNode node, vec4 sides)
{
    sides = abs(sides);
    if (node.metric == 0 || node.dimensions == 1) {
        return length(sides);
    }
    if (node.metric == 1) {
        return dot(sides, vec4(1.0));
    }
    if (node.metric == 2) {
        return max(max(sides.x, sides.y), max(sides.z, sides.w));
    }
    return pow(dot(pow(sides, vec4(node.exponent)), vec4(node.axes)), 1.0 / node.exponent);
}

VoronoiPoint voronoi_nearest(VoronoiNode node, vec4 p)
{
    ivec4 cell = ivec4(floor(p)), first_offset = ivec4(0), second_offset = ivec4(0), o;
    vec4 local = p - floor(p), first_point = vec4(0.0), second_point = vec4(0.0);
    float first = 1e38, second = 1e38;
    for (o.w = -node.axes.w; o.w <= node.axes.w; o.w++)
        for (o.z = -node.axes.z; o.z <= node.axes.z; o.z++)
            for (o.y = -node.axes.y; o.y <= node.axes.y; o.y++)
                for (o.x = -1; o.x <= 1; o.x++) {
                    vec4 point = voronoi_point(node, cell, o);
                    float away = voronoi_length(node, point - local);
                    if (away < first) {
                        second = first;
                        second_offset = first_offset;
                        second_point = first_point;
                        first = away;
                        first_offset = o;
                        first_point = point;
                    } else if (away < second) {
                        second = away;
                        second_offset = o;
                        second_point = point;
                    }
                }
    return node.feature == 1 ? VoronoiPoint(second, voronoi_color(node, cell + second_offset), second_point + vec4(cell))
                             : VoronoiPoint(first, voronoi_color(node, cell + first_offset), first_point + vec4(cell));
}

VoronoiPoint voronoi_smooth(VoronoiNode node, vec4 p)
{
    ivec4 cell = ivec4(floor(p)), reach = 2 * node.axes, o;
    vec4 local = p - floor(p);
    VoronoiPoint found = VoronoiPoint(-1.0, vec3(0.0), vec4(0.0));
    bool is_first = true;
    for (o.w = -reach.w; o.w <= reach.w; o.w++)
        for (o.z = -reach.z; o.z <= reach.z; o.z++)
            for (o.y = -reach.y; o.y <= reach.y; o.y++)
                for (o.x = -2; o.x <= 2; o.x++) {
                    vec4 point = voronoi_point(node, cell, o);
                    float away = voronoi_length(node, point - local);
                    float h = is_first ? 1.0 : smoothstep(0.0, 1.0, 0.5 + 0.5 * (found.distance - away) / node.smoothness);
                    is_first = false;
                    float correction = node.smoothness * h * (1.0 - h);
                    found.distance = mix(found.distance, away, h) - correction;
                    correction /= 1.0 + 3.0 * node.smoothness;
                    found.color = mix(found.color, voronoi_color(node, cell + o), h) - correction;
                    found.position = mix(found.position, point, h) - correction * vec4(node.axes);
                }
    found.position += vec4(cell);
    return found;
}

// Returns the Euclidean distance to the plane halfway between the nearest point and another.
float voronoi_edge_distance(VoronoiNode node, vec4 p)
{
    ivec4 cell = ivec4(floor(p)), o;
    vec4 local = p - floor(p), nearest = vec4(1e18);
    if (node.dimensions == 1) { // the planes on both sides of the cell's own point
        float own = voronoi_point(node, cell, ivec4(0)).x;
        vec2 sides = vec2(voronoi_point(node, cell, ivec4(-1, 0, 0, 0)).x, voronoi_point(node, cell, ivec4(1, 0, 0, 0)).x);
        sides = abs(0.5 * (own + sides) - local.x);
        return min(sides.x, sides.y);
    }
    for (o.w = -node.axes.w; o.w <= node.axes.w; o.w++)
        for (o.z = -node.axes.z; o.z <= node.axes.z; o.z++)
            for (o.y = -1; o.y <= 1; o.y++)
                for (o.x = -1; o.x <= 1; o.x++) {
                    vec4 point = voronoi_point(node, cell, o) - local;
                    nearest = dot(point, point) < dot(nearest, nearest) ? point : nearest;
                }
    float least = 1e38;
    for (o.w = -node.axes.w; o.w <= node.axes.w; o.w++)
        for (o.z = -node.axes.z; o.z <= node.axes.z; o.z++)
            for (o.y = -1; o.y <= 1; o.y++)
                for (o.x = -1; o.x <= 1; o.x++) {
                    vec4 point = voronoi_point(node, cell, o) - local, across = point - nearest;
                    if (dot(across, across) > 0.0001) {
                        least = min(least, dot(0.5 * (nearest + point), normalize(across)));
                    }
                }
    return least;
}

// Returns half the distance from the nearest point to the point nearest to that.
float voronoi_sphere_radius(VoronoiNode node, vec4 p)
{
    ivec4 cell = ivec4(floor(p)), nearest_offset = ivec4(0), o;
    vec4 local = p - floor(p), nearest = vec4(1e18);
    for (o.w = -node.axes.w; o.w <= node.axes.w; o.w++)
        for (o.z = -node.axes.z; o.z <= node.axes.z; o.z++)
            for (o.y = -node.axes.y; o.y <= node.axes.y; o.y++)
                for (o.x = -1; o.x <= 1; o.x++) {
                    vec4 point = voronoi_point(node, cell, o);
                    if (distance(point, local) < distance(nearest, local)) {
                        nearest = point;
                        nearest_offset = o;
                    }
                }
    float least = 1e38;
    for (o.w = -node.axes.w; o.w <= node.axes.w; o.w++)
        for (o.z = -node.axes.z; o.z <= node.axes.z; o.z++)
            for (o.y = -node.axes.y; o.y <= node.axes.y; o.y++)
                for (o.x = -1; o.x <= 1; o.x++) {
                    if (o != ivec4(0)) {
                        least = min(least, distance(voronoi_point(node, cell, nearest_offset + o), nearest));
                    }
                }
    return 0.5 * least;
}

// Returns all outputs. detail: octaves beside the first, 0 to 15; a fraction gives the last that share.
Voronoi voronoi(int dimensions, int feature, int metric, bool normalized, vec3 vector, float w, float scale, float detail,
                float roughness, float lacunarity, float smoothness, float exponent, float randomness)
{
    ivec4 axes = ivec4(1, dimensions > 1 ? 1 : 0, dimensions > 2 ? 1 : 0, dimensions > 3 ? 1 : 0);
    VoronoiNode node = VoronoiNode(
        dimensions, feature, metric, clamp(0.5 * smoothness, 0.0, 0.5), exponent, clamp(randomness, 0.0, 1.0), axes);
    roughness = clamp(roughness, 0.0, 1.0);
    detail = roughness == 0.0 ? 0.0 : clamp(detail, 0.0, 15.0);
    vec4 p = texture_coordinates(dimensions, vector, w) * scale;
    Voronoi result = Voronoi(0.0, vec3(0.0), vec3(0.0), 0.0, 0.0);
    if (feature == 4) {
        result.radius = voronoi_sphere_radius(node, p);
        return result;
    }
    float fineness = 1.0, height = 1.0, farthest = 0.5 + 0.5 * node.randomness;
    if (feature == 3) {
        float least = detail == 0.0 ? voronoi_edge_distance(node, p) : 8.0, total = farthest;
        for (float octave = 0.0; octave < detail + 1.0 && detail > 0.0; octave++) {
            float share = min(1.0, detail + 1.0 - octave);
            total = mix(total, farthest / fineness, height * share);
            float mixed = mix(least, min(least, voronoi_edge_distance(node, p * fineness) / fineness), height);
            least = mix(least, min(least, mixed), share);
            fineness *= lacunarity;
            height *= roughness;
        }
        result.distance = normalized ? least / total : least;
        return result;
    }
    VoronoiPoint sum = VoronoiPoint(0.0, vec3(0.0), vec4(0.0));
    float total = 0.0;
    for (float octave = 0.0; octave < detail + 1.0; octave++) {
        VoronoiPoint found;
        if (feature == 2 && node.smoothness > 0.0) {
            found = voronoi_smooth(node, p * fineness);
        } else {
            found = voronoi_nearest(node, p * fineness);
        }
        float part = height * min(1.0, detail + 1.0 - octave);
        total += part;
        sum.distance += found.distance * part;
        sum.color += found.color * part;
        sum.position = mix(sum.position, found.position / fineness, part);
        fineness *= lacunarity;
        height *= roughness;
    }
    if (normalized) {
        farthest = voronoi_length(node, farthest * vec4(axes)) * (feature == 1 ? 2.0 : 1.0);
        sum.distance /= total * farthest;
        sum.color /= total;
    }
    sum.position = scale != 0.0 ? sum.position / scale : vec4(0.0);
    return Voronoi(sum.distance, sum.color, dimensions > 1 ? sum.position.xyz : vec3(0.0),
                   dimensions == 1 ? sum.position.x : sum.position.w, 0.0);
}
