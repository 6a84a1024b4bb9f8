// SPDX-License-Identifier: GPL-3.0-or-later
// A tile of the world as rough metal reflects it, seen along the normal: B. Karis, "Real Shading in Unreal Engine 4" (2013). Each of
// `samples` microfacets looks up the map that is as blurred as they are far apart: J. Krivanek and M. Colbert, "Real-time Shading with
// Filtered Importance Sampling" (2008). Include octahedral.glsl and
// hemispheres.glsl before it.

void main()
{
    vec3 n = hemispheres_texel(ivec2(gl_FragCoord.xy), tile);
    vec3 x = normalize(abs(n.z) < 0.9 ? cross(n, vec3(0.0, 0.0, 1.0)) : cross(n, vec3(1.0, 0.0, 0.0))), y = cross(n, x);
    float square = alpha * alpha;
    vec4 sum = vec4(0.0);
    for (int k = 0; k < samples; k++) {
        float u = (float(k) + 0.5) / float(samples), angle = 2.39996322972865 * float(k);
        float cosine2 = (1.0 - u) / (1.0 + (square - 1.0) * u); // of GGX's normals
        float cosine = sqrt(cosine2), sine = sqrt(max(1.0 - cosine2, 0.0));
        vec3 h = sine * (cos(angle) * x + sin(angle) * y) + cosine * n;
        vec3 l = 2.0 * cosine * h - n;
        float weight = 2.0 * cosine2 - 1.0; // N.L
        if (weight <= 0.0) {
            continue;
        }
        float below = cosine2 * (square - 1.0) + 1.0;
        float density = square / (3.14159265358979 * below * below) / 4.0; // of the directions l [1/sr]
        float texels = world_tiles.tile[0].z;
        float level = clamp(0.5 * log2(texels * texels / (4.0 * 3.14159265358979 * float(samples) * density)), 0.0, world_tiles.tile[0].w);
        int low = int(level), high = min(low + 1, int(world_tiles.tile[0].w));
        vec3 radiance = mix(octahedral_lookup(world_map, world_tiles.tile[low], l),
            octahedral_lookup(world_map, world_tiles.tile[high], l), level - float(low));
        sum += vec4(radiance, 1.0) * weight;
    }
    result = vec4(min(sum.rgb / sum.a, 65000.0), 1.0); // the largest that 16 bits hold
}
