// SPDX-License-Identifier: GPL-3.0-or-later
// Light that enters a surface and leaves it nearby: the irradiance around each pixel, weighed by Burley's profile at its distance in
// space, from SAMPLES points drawn by that profile on a disk that faces the camera. Their weights are divided by their sum, so that
// no light is lost where the disk leaves the object or the picture.

#define SAMPLES 48

// Returns the place [m] of a pixel's surface; depth as in the depth buffer.
vec3 place_of(ivec2 pixel, float depth)
{
    vec4 clip = vec4((vec2(pixel) + 0.5) * gather.size.zw * 2.0 - 1.0, depth * 2.0 - 1.0, 1.0);
    vec4 place = gather.unprojection * clip;
    return place.xyz / place.w;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    result = texelFetch(radiance_map, pixel, 0);
    vec4 entering = texelFetch(entering_map, pixel, 0);
    vec4 tint = texelFetch(tint_map, pixel, 0);
    if (entering.w == 0.0 || tint.rgb == vec3(0.0)) {
        return;
    }
    vec3 d = texelFetch(distance_map, pixel, 0).rgb;
    float widest = max(d.r, max(d.g, d.b));
    vec3 here = place_of(pixel, texelFetch(depth_map, pixel, 0).x);
    // pixels that a meter covers at this place, across the picture
    float pixels = 1.0 / max(length(place_of(pixel + ivec2(1, 0), texelFetch(depth_map, pixel, 0).x) - here), 1e-30);
    vec3 sum = vec3(0.0), weights = vec3(0.0);
    // Turned from pixel to pixel (J. Jimenez's interleaved gradient noise, 2014) and from sample to sample of the picture.
    float turn = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))) + gather.turn.x);
    for (int k = 0; k < SAMPLES; k++) {
        float radius = burley_radius((float(k) + fract(turn + gather.turn.y)) / float(SAMPLES), widest);
        float angle = 6.28318530717959 * (turn + 0.618033988749895 * float(k));
        ivec2 other = pixel + ivec2(round(radius * pixels * vec2(cos(angle), sin(angle))));
        if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, ivec2(gather.size.xy)))) {
            continue;
        }
        vec4 light = texelFetch(entering_map, other, 0);
        if (light.w != entering.w) { // another object
            continue;
        }
        float apart = length(place_of(other, texelFetch(depth_map, other, 0).x) - here);
        vec3 weight = burley_profile(max(apart, radius), d) / burley_profile(radius, vec3(widest)).x;
        sum += weight * light.rgb;
        weights += weight;
    }
    vec3 around = vec3(weights.r > 0.0 ? sum.r / weights.r : entering.r, weights.g > 0.0 ? sum.g / weights.g : entering.g,
        weights.b > 0.0 ? sum.b / weights.b : entering.b);
    result.rgb += tint.rgb * around;
}
