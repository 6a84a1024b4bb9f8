// SPDX-License-Identifier: GPL-3.0-or-later
// Subsurface scattering: light that enters a surface and leaves it nearby. The irradiance around each pixel is weighted by Burley's
// profile of its distance in space, at SAMPLES points on a disk that faces the camera, a third of them drawn by the profile of each
// channel. The weights are divided by their sum, so that no light is lost where the disk leaves the object or the picture.
// With SHADOWS, light that comes through the medium or enters where the camera does not see it counts, too: light_through.glsl.
// Include geometry.glsl and burley.glsl before it.

#define SAMPLES 48

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    result = texelFetch(radiance_map, pixel, 0);
    vec4 entering = texelFetch(entering_map, pixel, 0); // rgb: irradiance [W/m^2], w: the object's number
    vec3 tint = texelFetch(tint_map, pixel, 0).rgb;
    if (entering.w == 0.0 || tint == vec3(0.0)) {
        return;
    }
    vec4 here = texelFetch(distance_map, pixel, 0); // rgb: d, w: depth [m]
    vec3 d = here.rgb;
    bool is_perspective = gather.offset.z != 0.0;
    vec2 pixels = 1.0 / (gather.size.zw * (is_perspective ? here.w : 1.0)); // that cover a meter at this depth
    vec3 sum = vec3(0.0), weights = vec3(0.0);
    // The pattern turns from pixel to pixel (J. Jimenez's interleaved gradient noise, 2014) and from sample to sample of the picture.
    float turn = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    float within_step = fract(31.0 * turn + gather.offset.y); // else distance and azimuth would be correlated
    turn += gather.offset.x;
    for (int k = 0; k < SAMPLES; k++) {
        float radius = burley_radius((float(k / 3) + within_step) / float(SAMPLES / 3), d[k % 3]);
        float angle = 6.28318530717959 * (turn + 0.618033988749895 * float(k));
        ivec2 other = pixel + ivec2(round(clamp(radius * pixels, -1e6, 1e6) * vec2(cos(angle), sin(angle))));
        if (any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, ivec2(gather.size.xy)))) {
            continue;
        }
        vec4 light = texelFetch(entering_map, other, 0);
        if (light.w != entering.w) { // another object
            continue;
        }
        float distance_3d = length(vec2(radius, texelFetch(distance_map, other, 0).w - here.w));
        vec3 density = burley_profile(radius, d);
        vec3 weight = burley_profile(distance_3d, d) * (3.0 / (density.r + density.g + density.b));
        sum += weight * light.rgb;
        weights += weight;
    }
    vec3 mean = vec3(weights.r > 0.0 ? sum.r / weights.r : entering.r, weights.g > 0.0 ? sum.g / weights.g : entering.g,
        weights.b > 0.0 ? sum.b / weights.b : entering.b);
#ifdef SHADOWS
    vec4 medium = texelFetch(medium_map, pixel, 0); // rgb: color, w: the normal
    vec3 n = unpacked_normal(medium.w, 4096.0);
    vec2 ndc = gl_FragCoord.xy / gather.size.xy * 2.0 - 1.0;
    vec3 ray = gather.from_pixel[0].xyz * ndc.x + gather.from_pixel[1].xyz * ndc.y;
    vec3 point = gather.from_pixel[3].xyz + ray * (is_perspective ? here.w : 1.0) + gather.from_pixel[2].xyz * here.w;
    SlabProfile profile = slab_profile(medium.rgb, d / burley_d(medium.rgb, vec3(1.0)));
    Entering more = entering_light(point, n, entering.w, d, profile, gather.ambient.rgb, turn, within_step);
    // The area of the surface that the disk covers, where it goes on as it is here
    vec3 v = is_perspective ? normalize(gather.eye.xyz - point) : gather.eye.xyz;
    vec3 seen_weight = max(weights / (float(SAMPLES) * max(dot(n, v), LEAST_COSINE)), 1e-6);
    mean = (mean * seen_weight + more.around) / (seen_weight + more.around_weight);
    mean += more.through / max(medium.rgb, 1e-9); // which are not of the color that is reflected
#endif
    result.rgb += tint * mean;
}
