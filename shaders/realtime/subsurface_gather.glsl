// SPDX-License-Identifier: GPL-3.0-or-later
// Subsurface scattering: light that enters a surface and leaves it nearby. The irradiance around each pixel is weighted by Burley's
// profile of its distance in space, at SAMPLES points on a disk that faces the camera, a third of them drawn by the profile of each
// channel. The weights are divided by their sum, so that no light is lost where the disk leaves the object or the picture.
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
    result.rgb += tint * mean;
}
