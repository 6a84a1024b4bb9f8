// SPDX-License-Identifier: GPL-3.0-or-later
// The world where no surface is, as the camera sees it: `right`, `up` and `forward` make the direction of a place of the picture.

void main()
{
    vec2 place = gl_FragCoord.xy * pixel.xy - 1.0;
    vec3 direction = normalize(forward.xyz + place.x * right.xyz + place.y * up.xyz);
    vec3 radiance = material_inputs(Point(direction, direction)).radiance;
    out_radiance = vec4(mix(vec3(0.0), radiance, greaterThan(abs(radiance), vec3(0.0))), 1.0); // 0 for NaN
#ifdef SUBSURFACE_IN_SCENE
    out_entering = out_distance = out_tint = vec4(0.0);
#endif
}
