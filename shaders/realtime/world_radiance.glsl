// SPDX-License-Identifier: GPL-3.0-or-later
// The world's radiance, the mean over each texel of an octahedral map, and of that what is above `threshold`, which makes suns.
// `subsamples` is the number of steps across a texel; where they meet something brighter than `bright`, `fine` ones are taken instead,
// so that no small sun is missed or gets more or less of the light than it has.

vec3 radiance_at(vec2 place)
{
    vec3 direction = normalize(octahedral_direction(place * (2.0 / size) - 1.0));
    vec3 radiance = material_inputs(Point(direction, direction)).radiance;
    return mix(vec3(0.0), min(radiance, 1e10), greaterThan(radiance, vec3(0.0))); // 0 for NaN, too
}

void main()
{
    vec2 corner = floor(gl_FragCoord.xy);
    vec3 sum = vec3(0.0);
    float brightest = 0.0;
    for (int y = 0; y <= subsamples; y++) { // with both edges, so that nothing is between two texels
        for (int x = 0; x <= subsamples; x++) {
            vec3 radiance = radiance_at(corner + vec2(x, y) / float(subsamples));
            float weight = (x == 0 || x == subsamples ? 0.5 : 1.0) * (y == 0 || y == subsamples ? 0.5 : 1.0);
            sum += weight * radiance;
            brightest = max(brightest, max(radiance.r, max(radiance.g, radiance.b)));
        }
    }
    out_radiance = vec4(sum / float(subsamples * subsamples), 1.0);
    out_excess = out_moment = vec4(0.0);
    if (brightest <= bright) {
        return;
    }
    sum = vec3(0.0);
    for (int k = 0; k < fine * fine; k++) {
        vec2 place = corner + (vec2(k % fine, k / fine) + 0.5) / float(fine);
        vec3 radiance = radiance_at(place);
        sum += radiance;
        float largest = max(radiance.r, max(radiance.g, radiance.b));
        if (threshold > 0.0 && largest > threshold) {
            vec3 excess = radiance * (1.0 - threshold / largest);
            float luminance = dot(excess, vec3(LUMINANCE));
            out_excess.rgb += excess;
            out_moment += luminance * vec4(normalize(octahedral_direction(place * (2.0 / size) - 1.0)), 1.0);
        }
    }
    float weight = 1.0 / float(fine * fine);
    out_radiance.rgb = sum * weight;
    out_excess *= weight;
    out_moment *= weight;
}
