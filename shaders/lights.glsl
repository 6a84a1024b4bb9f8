// SPDX-License-Identifier: GPL-3.0-or-later
// The irradiance of Blender's lights at a point, in Blender's units and without shadows. Every light shines from one point; the mean
// over points of it is a light with a size (addon/realtime/lights.py).
//     sun: E0 = strength      point: E0 = P / (4 pi r^2)      spot: as a point, times its cone      area: E0 = P cos(theta) / (pi r^2)
// An area light of a spread below 180 degrees has that times (tan(h) - tan(theta)) / (tan(h) - h), as in Cycles.
// P [W], r [m], E0 the irradiance [W/m^2] on a plane that faces the light, theta the angle from the direction an area light faces.
// GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings.

struct Light {
    vec4 position; // xyz: position [m], w: the type, which the functions below do not use
    vec4 axis;     // xyz: unit vector against the direction it shines in; w: of a spot the cosine of half its cone, of an area
                   // light the tangent of half its spread
    vec4 strength; // rgb: E0 of a sun, P of the others; w: of a spot the part of the cosine over which its cone fades, of an area
                   // light 1 / (tan(h) - h), h half its spread
    vec4 x_axis;   // xyz, with y_axis.xyz: two more axes of a spot, unit vectors unless it is stretched
    vec4 y_axis;   // w of both: the caller's, which the functions below do not use
};

// All functions return E0; l: the unit vector from `position` towards the light.

vec3 sun_irradiance(Light light, out vec3 l)
{
    l = light.axis.xyz;
    return light.strength.rgb;
}

vec3 point_irradiance(Light light, vec3 position, out vec3 l)
{
    vec3 to_light = light.position.xyz - position;
    float square = max(dot(to_light, to_light), 1e-12);
    l = to_light * inversesqrt(square);
    return light.strength.rgb / (12.5663706143592 * square);
}

vec3 spot_irradiance(Light light, vec3 position, out vec3 l)
{
    vec3 unshaped = point_irradiance(light, position, l);
    vec3 local = vec3(dot(l, light.x_axis.xyz), dot(l, light.y_axis.xyz), dot(l, light.axis.xyz));
    float t = clamp((normalize(local).z - light.axis.w) / max(light.strength.w, 1e-6), 0.0, 1.0);
    return unshaped * (t * t * (3.0 - 2.0 * t));
}

vec3 area_irradiance(Light light, vec3 position, out vec3 l)
{
    vec3 unshaped = point_irradiance(light, position, l);
    float cosine = max(dot(l, light.axis.xyz), 1e-9);
    float spread = (light.axis.w - sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine) * light.strength.w;
    return dot(l, light.axis.xyz) > 0.0 ? unshaped * (4.0 * cosine * max(spread, 0.0)) : vec3(0.0);
}
