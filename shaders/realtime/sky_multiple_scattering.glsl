// SPDX-License-Identifier: GPL-3.0-or-later
// The sky of multiple scattering in XYZ, half of it, as the other is its mirror. x is the azimuth, from away from the sun to towards it;
// y the elevation, straight down to straight up, whose square root is even: 0.5 is the horizon. Each pixel is the sky at its center.
// sky_air.glsl goes before it.

#define PI 3.14159265358979

// Returns the transmittance to a sun of that cosine to the zenith from a height, as a part of the air's.
vec4 to_sun(float cosine, float height)
{
    vec2 place = clamp(vec2(0.5 * cosine + 0.5, height), 0.0, 1.0) * vec2(TRANSMITTANCE_SIZE - 1);
    ivec2 low = ivec2(place), high = min(low + 1, TRANSMITTANCE_SIZE - 1);
    vec2 rest = place - vec2(low);
    vec4 below = mix(texelFetch(transmittance, low, 0), texelFetch(transmittance, ivec2(high.x, low.y), 0), rest.x);
    vec4 above = mix(texelFetch(transmittance, ivec2(low.x, high.y), 0), texelFetch(transmittance, high, 0), rest.x);
    return mix(below, above, rest.y);
}

// Returns what arrives from everywhere but the sun, of its irradiance: a fit of what the air has scattered before, and
// light of the ground. part: the height as a part of the air's; radius: the distance from the center of the Earth.
vec4 scattered_before(float cosine, float part, float radius)
{
    float horizon = EARTH_RADIUS / radius;
    float ground = 0.5 * (1.0 - sqrt(max(1.0 - horizon * horizon, 0.0))); // its part of all directions
    vec4 lit = to_sun(cosine, 0.0) * to_sun(1.0, 0.0) / max(to_sun(1.0, part), 1e-30);
    vec4 air = 0.02 * vec4(0.217, 0.347, 0.594, 1.0) / (1.0 + 5.0 * exp(-17.92 * cosine));
    return air + ground * GROUND_ALBEDO / PI * cosine * lit;
}

void main()
{
    vec2 place = gl_FragCoord.xy / vec2(SKY_SIZE);
    float root = 2.0 * place.y - 1.0, elevation = 0.5 * PI * root * abs(root), azimuth = 2.0 * PI * place.x;
    vec3 view = vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
    vec3 sun = vec3(-cos(sun_elevation), 0.0, sin(sun_elevation));
    float start = clamp(altitude, 0.001, 99.999), radius = EARTH_RADIUS + start, along = radius * view.z;
    float to_ground = start * (2.0 * EARTH_RADIUS + start), inside = along * along - to_ground;
    bool is_ground = along < 0.0 && inside >= 0.0;
    float stride = (is_ground ? to_ground / (sqrt(inside) - along) : way_out(start, view.z)) / float(SCATTERING_STEPS);
    float cosine = dot(view, sun), spread = 1.0 + AEROSOL_ANISOTROPY * AEROSOL_ANISOTROPY - 2.0 * AEROSOL_ANISOTROPY * cosine;
    float molecular_phase = 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
    float aerosol_phase = (1.0 - AEROSOL_ANISOTROPY * AEROSOL_ANISOTROPY) / (4.0 * PI * spread * sqrt(spread));
    vec4 arriving = vec4(0.0), transmitted = vec4(1.0);
    for (int k = 0; k < SCATTERING_STEPS; k++) {
        float way = (float(k) + 0.5) * stride, height = height_after(way, start, view.z), from_center = EARTH_RADIUS + height;
        float up = (radius * sun.z + way * cosine) / from_center; // cosine of the sun to the zenith
        float part = height / ATMOSPHERE_HEIGHT;
        Air air = air_at(height, densities);
        vec4 direct = to_sun(up, part), before = scattered_before(up, part, from_center);
        vec4 source = air.molecular * (molecular_phase * direct + before) + air.aerosol * (aerosol_phase * direct + before);
        vec4 through = exp(-stride * air.extinction);
        // S. Hillaire, "Physically Based Sky, Atmosphere and Cloud Rendering in Frostbite" (2016): the integral over an even step
        arriving += transmitted * source * (1.0 - through) / max(air.extinction, 1e-7);
        transmitted *= through;
    }
    arriving *= SUN_IRRADIANCE;
    result = vec4(dot(arriving, X_OF_SPECTRUM), dot(arriving, Y_OF_SPECTRUM), dot(arriving, Z_OF_SPECTRUM), 1.0);
}
