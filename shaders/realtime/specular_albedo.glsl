// SPDX-License-Identifier: GPL-3.0-or-later
// What a rough specular surface reflects of light from everywhere, from the table that specular_table.glsl integrates.
// ggx.glsl comes before it.

const int TABLE_SIZE = 32, TABLE_LAYERS = 16;

vec4 specular_table_layer(float roughness, float mu, int layer)
{
    vec2 place = clamp(vec2(roughness, mu), 0.0, 1.0) * float(TABLE_SIZE - 1);
    vec2 corner = min(floor(place), float(TABLE_SIZE - 2)), rest = place - corner;
    ivec2 low = ivec2(corner) + ivec2(0, TABLE_SIZE * layer);
    return mix(mix(texelFetch(specular_table, low, 0), texelFetch(specular_table, low + ivec2(1, 0), 0), rest.x),
        mix(texelFetch(specular_table, low + ivec2(0, 1), 0), texelFetch(specular_table, low + ivec2(1, 1), 0), rest.x), rest.y);
}

// Returns the entry of the table: see specular_table.glsl. roughness: the root of alpha, the geometric mean where it has two.
vec4 specular_albedo(float roughness, float mu, float ior)
{
    float layer = sqrt(min(abs((ior - 1.0) / (ior + 1.0)), 1.0)) * float(TABLE_LAYERS - 1);
    int low = min(int(layer), TABLE_LAYERS - 2);
    return mix(specular_table_layer(roughness, mu, low), specular_table_layer(roughness, mu, low + 1), layer - float(low));
}

// Returns the mean over the hemisphere of the albedo of single scattering, weighted by the cosine.
float specular_mean_albedo(float roughness)
{
    float place = clamp(roughness, 0.0, 1.0) * float(TABLE_SIZE - 1);
    int low = min(int(place), TABLE_SIZE - 2), row = TABLE_SIZE * TABLE_LAYERS;
    return mix(texelFetch(specular_table, ivec2(low, row), 0).x, texelFetch(specular_table, ivec2(low + 1, row), 0).x,
        place - float(low));
}
