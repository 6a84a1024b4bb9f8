// SPDX-License-Identifier: GPL-3.0-or-later
// Directional albedos of GGX, integrated once: x is the roughness, 0 to 1 over SIZE texels; y is N.V, 0 to 1 over SIZE texels, and
// that for LAYERS values of z = sqrt((ior - 1) / (ior + 1)), 0 to 1. Of light from everywhere,
//     x: mean of ggx_grazing over what is reflected once   y: albedo of single scattering without Fresnel's factor
//     z, w: means of Schlick's (1 - V.H)^5 and of V.H (1 - V.H)^6 over what is reflected once
// One more row has in x the mean of that albedo over the hemisphere, weighted by the cosine.
// Include ggx.glsl before it.

#define SIZE 32
#define LAYERS 16
#define AZIMUTHS 12
#define HEIGHTS 24

vec4 albedos(float roughness, float mu, float ior)
{
    float alpha = roughness * roughness;
    vec3 v = vec3(sqrt(1.0 - mu * mu), 0.0, mu);
    vec3 stretched = normalize(vec3(alpha * v.xy, v.z));
    float r_o = sqrt(mu * mu + alpha * alpha * v.x * v.x);
    vec4 sum = vec4(0.0);
    for (int row = 0; row < HEIGHTS; row++) {
        for (int column = 0; column < AZIMUTHS; column++) {
            // Visible normals of GGX are those of a hemisphere, stretched: J. Dupuy and A. Benyoub, "Sampling Visible GGX Normals with
            // Spherical Caps" (2023). One half of all azimuths is the mirror of the other.
            float phi = 3.14159265358979 * (float(column) + 0.5) / float(AZIMUTHS);
            float height = 1.0 - (float(row) + 0.5) / float(HEIGHTS) * (1.0 + stretched.z);
            float radius = sqrt(max(1.0 - height * height, 0.0));
            vec3 cap = vec3(radius * cos(phi), radius * sin(phi), height) + stretched;
            vec3 h = normalize(vec3(alpha * cap.xy, cap.z));
            float cosine = clamp(dot(v, h), 0.0, 1.0);
            vec3 l = 2.0 * cosine * h - v;
            if (l.z > 0.0) {
                float r_i = sqrt(l.z * l.z + alpha * alpha * (1.0 - l.z * l.z));
                float weight = l.z * (mu + r_o) / (l.z * r_o + mu * r_i); // G2 / G1
                float s = 1.0 - cosine, s5 = s * s * s * s * s;
                sum += weight * vec4(ggx_grazing(cosine, ior), 1.0, s5, cosine * s5 * s);
            }
        }
    }
    float single = max(sum.y, 1e-6);
    return vec4(sum.x / single, single / float(AZIMUTHS * HEIGHTS), sum.zw / single);
}

void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    float roughness = max(float(texel.x) / float(SIZE - 1), 1e-4);
    int layer = texel.y / SIZE;
    if (layer == LAYERS) {
        result = vec4(0.0);
        for (int k = 0; k < SIZE; k++) {
            float mu = (float(k) + 0.5) / float(SIZE);
            result.x += 2.0 * mu * albedos(roughness, mu, 1.5).y / float(SIZE);
        }
        return;
    }
    float z = max(float(layer) / float(LAYERS - 1), 1e-4);
    result = albedos(roughness, max(float(texel.y % SIZE) / float(SIZE - 1), 1e-4), ggx_ior(z * z * z * z));
}
