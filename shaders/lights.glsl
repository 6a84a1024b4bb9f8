// SPDX-License-Identifier: GPL-3.0-or-later
// What Blender's lamps send to a point, in Blender's units and without shadows. Every lamp shines from its center; its size counts
// where its power depends on it (addon/realtime/lights.py).
//     sun: E0 = strength      point: E0 = P / (4 pi r^2)      spot: as a point, times its cone      area: E0 = P cos(theta) / (pi r^2)
// An area lamp of a spread below 180 degrees has that times (tan(h) - tan(theta)) / (tan(h) - h), as in Cycles.
// P [W], r [m], E0 the irradiance [W/m^2] on a plane that faces the lamp, theta the angle from the direction an area lamp faces.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

struct Lamp {
    vec4 place;    // xyz: position [m], w: its kind, which the functions below do not ask for
    vec4 axis;     // xyz: unit vector against the direction it shines in; w: of a spot the cosine of half its cone, of an area
                   // the tangent of half its spread
    vec4 strength; // rgb: E0 of a sun, P of the others; w: of a spot the part of the cosine over which its cone fades, of an area
                   // 1 / (tan(h) - h), h half its spread
    vec4 across;   // xyz, with up.xyz: two more axes of a spot, unit vectors unless it is stretched
    vec4 up;
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
    vec3 local = vec3(dot(l, lamp.across.xyz), dot(l, lamp.up.xyz), dot(l, lamp.axis.xyz));
    float t = clamp((normalize(local).z - lamp.axis.w) / max(lamp.strength.w, 1e-6), 0.0, 1.0);
    return whole * (t * t * (3.0 - 2.0 * t));
}

vec3 area_irradiance(Lamp lamp, vec3 position, out vec3 l)
{
    vec3 whole = point_irradiance(lamp, position, l);
    float cosine = max(dot(l, lamp.axis.xyz), 1e-9);
    float spread = (lamp.axis.w - sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine) * lamp.strength.w;
    return dot(l, lamp.axis.xyz) > 0.0 ? whole * (4.0 * cosine * max(spread, 0.0)) : vec3(0.0);
}
