// SPDX-License-Identifier: GPL-3.0-or-later
// The distance of a transparent surface from a light, as in shadow_fragment.glsl, where its opacity is above a random threshold.

void main()
{
    MaterialInputs inputs = material_inputs(SHADED_POINT);
    float solid = 1.0 - clamp(inputs.transmission_weight, 0.0, 1.0) * (1.0 - clamp(inputs.metallic, 0.0, 1.0));
    if (is_seen_through(clamp(inputs.opacity, 0.0, 1.0) * solid)) {
        discard;
    }
    result = vec4(view.camera.w != 0.0 ? 1.0 / gl_FragCoord.w : gl_FragCoord.z * 2.0 - 1.0, 0.0, 0.0, 1.0);
#ifdef MARKED
    result.y = surface_mark();
#endif
}
