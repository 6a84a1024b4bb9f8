// SPDX-License-Identifier: GPL-3.0-or-later
// Transparency without sorting: each sample of the picture shows a surface or what is behind it, by chance.

// Returns well mixed bits (C. Wellons' search for integer hashes, 2018).
uint hashed(uint x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

// Returns whether this sample sees through a surface of that opacity. A pixel's thresholds on one triangle fill 0 to 1 evenly over
// the samples, in steps that differ between triangles, so that those before and behind each other are independent.
bool is_seen_through(float opacity)
{
    if (opacity >= 1.0) {
        return false;
    }
    uint face = hashed(uint(gl_PrimitiveID) + hashed(2u * uint(object_number_of(object_index)) + (gl_FrontFacing ? 0u : 1u)));
    uvec2 place = uvec2(gl_FragCoord.xy);
#ifdef LAYER
    place.x %= uint(layer.y); // the same in all layers
#endif
    uint pixel = hashed(place.x + hashed(place.y + face));
    float start = float(pixel >> 8) / 16777216.0;
    float step_size = mix(0.3, 0.7, float(face >> 8) / 16777216.0);
    return fract(start + view.world.w * step_size) >= opacity;
}
