// SPDX-License-Identifier: GPL-3.0-or-later
// What Blender's lamps send to a point, in Blender's units and without shadows. Every lamp shines from its center; its size counts
// where its power depends on it (addon/realtime/lamps.py).
//     sun: E0 = strength      point: E0 = P / (4 pi r^2)      spot: as a point, times its cone      area: E0 = P cos(theta) / (pi r^2)
// P [W], r [m], E0 the irradiance [W/m^2] on a plane that faces the lamp, theta the angle from the direction an area lamp faces.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

struct Lamp {
    vec4 place;    // xyz: position [m], w: its kind, which the functions below do not ask for
    vec4 axis;     // xyz: unit vector against the direction it shines in; w, a spot's: cosine of half its cone
    vec4 strength; // rgb: E0 of a sun, P of the others; w, a spot's: the part of the cosine over which its cone fades
};

vec3 sun_irradiance(Lamp lamp, out vec3 l)
{
    l = lamp.axis.xyz;
    return lamp.strength.rgb;
}

vec3 point_irradiance(Lamp lamp, vec3 position, out vec3 l)
{
    vec3 away = lamp.place.xyz - position;
    float square = max(dot(away, away), 1e-12);
    l = away * inversesqrt(square);
    return lamp.strength.rgb / (12.5663706143592 * square);
}

vec3 spot_irradiance(Lamp lamp, vec3 position, out vec3 l)
{
    vec3 whole = point_irradiance(lamp, position, l);
    float t = clamp((dot(l, lamp.axis.xyz) - lamp.axis.w) / max(lamp.strength.w, 1e-6), 0.0, 1.0);
    return whole * (t * t * (3.0 - 2.0 * t));
}

vec3 area_irradiance(Lamp lamp, vec3 position, out vec3 l)
{
    vec3 whole = point_irradiance(lamp, position, l);
    return whole * (4.0 * max(dot(l, lamp.axis.xyz), 0.0));
}
