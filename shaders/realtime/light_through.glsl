// SPDX-License-Identifier: GPL-3.0-or-later
// Light that comes through the medium, as through ears, and light that enters the surface nearby where the camera does not see it: behind
// an edge, or beside the picture. Each light's shadow map shows all that it shines on (C. Dachsbacher and M. Stamminger, "Translucent
// Shadow Maps", 2003): TAPS points of it around the way to the light, as dense as the light is that comes through a slab that is as thick
// as the medium is there.
// Include geometry.glsl, burley.glsl, lights.glsl, packed_normal.glsl, slab_profile.glsl and light_irradiance.glsl before it.

#define TAPS 6
#define LEAST_COSINE 0.05 // in the place of those of a grazing view or light

// Light that leaves at a point: irradiance times weight [W/m^2], and the weights alone. `through` the medium, all of slab_profile.glsl,
// and from `around` by Burley's profile, as far as the camera does not see it; less of it, the more the surface there faces away.
struct Entering {
    vec3 through;
    vec3 around;
    vec3 through_weight;
    vec3 around_weight;
};

// Returns whether the camera sees a point of the object that has the `number`, so that the gather pass has its light already.
bool is_seen(vec3 point, float number)
{
    vec4 clip = gather.projection * vec4(point, 1.0);
    vec2 ndc = clip.xy / clip.w;
    if (clip.w <= 0.0 || any(greaterThan(abs(ndc), vec2(1.0)))) {
        return false;
    }
    float depth = dot(gather.depth, vec4(point, 1.0));
    float pixel = max(gather.size.z, gather.size.w) * (gather.offset.z != 0.0 ? depth : 1.0);
    ivec2 corner = ivec2(floor((ndc * 0.5 + 0.5) * gather.size.xy - 0.5)), high = ivec2(gather.size.xy) - 1;
    float farthest = -1e30; // of the surface where the point may be
    for (int k = 0; k < 4; k++) {
        ivec2 place = clamp(corner + ivec2(k & 1, k >> 1), ivec2(0), high);
        if (texelFetch(entering_map, place, 0).w == number) {
            farthest = max(farthest, texelFetch(distance_map, place, 0).w);
        }
    }
    return depth <= farthest + 0.25 * pixel; // a quarter, for the surface's curvature within a pixel
}

// Returns the row of `shadow_tiles` of the tile of a light that holds a point, -1 without one.
int tile_at(Light light, vec3 point, out mat4 matrix)
{
    int first = int(light.x_axis.w), count = abs(int(light.y_axis.w)); // below 0 of a light without shadows
    for (int row = first; row < first + count; row++) {
        matrix = mat4(texelFetch(shadow_tiles, ivec2(0, row), 0), texelFetch(shadow_tiles, ivec2(1, row), 0),
            texelFetch(shadow_tiles, ivec2(2, row), 0), texelFetch(shadow_tiles, ivec2(3, row), 0));
        vec4 clip = matrix * vec4(point, 1.0);
        if (clip.w > 0.0 && all(lessThanEqual(abs(clip.xyz), vec3(clip.w)))) {
            return row;
        }
    }
    return -1;
}

// The nearest surface to a light on its way to a point.
struct Lit {
    bool is_own; // of the object that has the number asked for
    vec3 position;
    vec3 normal;
    float spread; // how much wider the light's rays are where the point is than at the surface, as areas
};

// matrix, tile: of a row of `shadow_tiles`; l: towards the light.
Lit lit_towards(Light light, mat4 matrix, vec4 tile, vec3 point, vec3 l, float number)
{
    mat4 rows = transpose(matrix);
    vec4 clip = matrix * vec4(point, 1.0);
    vec2 texels = (clip.xy / clip.w * 0.5 + 0.5) * tile.z;
    Lit lit;
    if (any(lessThan(texels, vec2(0.0))) || any(greaterThanEqual(texels, vec2(tile.z)))) {
        lit.is_own = false;
        return lit;
    }
    ivec2 texel = ivec2(floor(texels));
    vec2 found = texelFetch(shadow_map, ivec2(tile.xy) + texel, 0).xy;
    // The map has the depth of the texel's center: the point is moved there, across the direction in which the tile looks.
    vec2 shift = (vec2(texel) + 0.5 - texels) * (2.0 * clip.w / tile.z);
    bool is_sun = rows[3].xyz == vec3(0.0);
    vec3 right = rows[0].xyz, up = rows[1].xyz;
    if (!is_sun) {
        right -= rows[3].xyz * dot(right, rows[3].xyz);
        up -= rows[3].xyz * dot(up, rows[3].xyz);
    }
    point += right * (shift.x / dot(right, right)) + up * (shift.y / dot(up, up));
    float mark = floor(found.y / 4096.0);
    lit.is_own = found.x < 1e29 && mark == mod(number, 4096.0);
    lit.normal = unpacked_normal(found.y - 4096.0 * mark, 64.0);
    if (is_sun) {
        lit.position = point + l * ((clip.z - found.x) / length(rows[2].xyz));
        lit.spread = 1.0;
    } else {
        float fraction = found.x / clip.w;
        lit.position = mix(light.position.xyz, point, fraction);
        lit.spread = fraction * fraction;
    }
    return lit;
}

// Returns what the lights send to a point. ambient: the irradiance of the world [W/m^2], which counts wherever a light shines: that of
// the lights by which this is most. n: the normal; d: Burley's; turn, within_step: 0 to 1, the pattern's.
Entering entering_light(vec3 point, vec3 n, float number, vec3 d, SlabProfile profile, vec3 ambient, float turn, float within_step)
{
    Entering all = Entering(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    for (int index = 0; index < lights.count.x; index++) {
        Light light = lights.light[index];
        mat4 matrix;
        int row = tile_at(light, point, matrix);
        if (row < 0) {
            continue;
        }
        vec4 tile = texelFetch(shadow_tiles, ivec2(4, row), 0);
        vec3 l;
        light_irradiance(light, point, l);
        vec3 right = normalize(abs(l.z) < 0.7 ? cross(l, vec3(0.0, 0.0, 1.0)) : cross(l, vec3(1.0, 0.0, 0.0)));
        vec3 up = cross(l, right);
        // How thick the medium is, or what lets little light through, so that what is lit beside a deep shadow is met, too
        Lit nearest = lit_towards(light, matrix, tile, point, l, number);
        float thickness = nearest.is_own ? max(dot(nearest.position - point, l), 0.0) : 0.0;
        vec3 rate = min(profile.slow, profile.fast), depth = min(vec3(thickness), 3.0 / rate);
        Entering one = Entering(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
        for (int k = 0; k < TAPS; k++) {
            // A third of the points each is as dense as the light of one channel: s from `depth` on, an exponential over 2 pi s
            float fraction = (float(k / 3) + within_step) / float(TAPS / 3);
            float reach = depth[k % 3] - log(max(1.0 - fraction, 1e-4)) / rate[k % 3];
            float radius = sqrt(max(reach * reach - depth[k % 3] * depth[k % 3], 0.0));
            float angle = 6.28318530717959 * (turn + 0.618033988749895 * float(k));
            Lit lit = lit_towards(light, matrix, tile, point + radius * (cos(angle) * right + sin(angle) * up), l, number);
            if (!lit.is_own) {
                continue;
            }
            vec3 reaches = sqrt(depth * depth + radius * radius);
            vec3 density = rate * exp(rate * (depth - reaches)) / (6.28318530717959 * max(reaches, 1e-9));
            float weight = 3.0 / (density.r + density.g + density.b);
            vec3 between = lit.position - point;
            float s = max(length(between), 1e-9);
            float cosine = clamp(-dot(between, n) / s, 0.0, 1.0), lit_cosine = clamp(dot(between, lit.normal) / s, 0.0, 1.0);
            vec3 through = weight * slab_density(profile, s, cosine, lit_cosine);
            // The screen's weights of what faces as the point does add up to 1, through the medium or not
            bool seen = is_seen(lit.position, number);
            through *= seen ? 0.5 - 0.5 * dot(n, lit.normal) : 1.0;
            vec3 around = seen ? vec3(0.0) : burley_profile(s, d) * (weight * (0.5 + 0.5 * dot(n, lit.normal)));
            vec3 to_light;
            vec3 irradiance = light_irradiance(light, lit.position, to_light) * lit.spread; // across the light's way
            float area = 1.0 / max(dot(lit.normal, to_light), LEAST_COSINE); // of the surface, over that across
            one.through += irradiance * through;
            one.around += irradiance * around;
            one.through_weight += through * (area * lit.spread);
            one.around_weight += around * (area * lit.spread);
        }
        all.through += one.through / float(TAPS);
        all.around += one.around / float(TAPS);
        all.through_weight = max(all.through_weight, one.through_weight / float(TAPS));
        all.around_weight = max(all.around_weight, one.around_weight / float(TAPS));
    }
    all.through += ambient * all.through_weight;
    all.around += ambient * all.around_weight;
    return all;
}
