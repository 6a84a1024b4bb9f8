// SPDX-License-Identifier: GPL-3.0-or-later
// The table of how much sunlight arrives, at four wavelengths: x is the cosine of the sun to the zenith, -1 to 1; y is the height, from
// the ground to the end of the air. Each from the first to the last texel.
// sky_air.glsl goes before it.

void main()
{
    vec2 place = floor(gl_FragCoord.xy) / vec2(TRANSMITTANCE_SIZE - 1);
    float cosine = 2.0 * place.x - 1.0, height = ATMOSPHERE_HEIGHT * place.y;
    float stride = way_out(height, cosine) / float(TRANSMITTANCE_STEPS);
    vec4 depth = vec4(0.0);
    for (int k = 0; k < TRANSMITTANCE_STEPS; k++) {
        depth += stride * air_at(height_after((float(k) + 0.5) * stride, height, cosine), densities).extinction;
    }
    result = exp(-depth);
}
