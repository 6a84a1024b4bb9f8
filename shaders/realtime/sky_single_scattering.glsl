// SPDX-License-Identifier: GPL-3.0-or-later
// The sky of single scattering in XYZ, in meters, half of it as in sky_multiple_scattering.glsl. Each pixel is the sky at its lower left
// corner, as Blender has it, and below the horizon what is there, which fades. The constants are those of addon/material/sky.py.

#define PI 3.14159265358979

// Returns the densities of molecules, aerosols and ozone at four heights, as sums with `weights`.
vec3 weighted_densities(vec4 heights, vec4 weights)
{
    return densities * vec3(dot(weights, exp(-heights / RAYLEIGH_HEIGHT)), dot(weights, exp(-heights / MIE_HEIGHT)),
                           dot(weights, max(1.0 - abs(heights - 25e3) / 15e3, 0.0)));
}

// Returns how far it is to the end of the air from a height, in a direction of that cosine to the zenith.
float way_out(float height, float cosine)
{
    float along = (SINGLE_EARTH_RADIUS + height) * cosine, beneath = SINGLE_ATMOSPHERE_HEIGHT - height;
    return sqrt(along * along + beneath * (2.0 * SINGLE_EARTH_RADIUS + SINGLE_ATMOSPHERE_HEIGHT + height)) - along;
}

// Returns the heights after four ways along such a direction, without the digits that radii lose.
vec4 heights_after(vec4 way, float height, float cosine)
{
    float radius = SINGLE_EARTH_RADIUS + height;
    vec4 rise = way * (way + 2.0 * radius * cosine);
    return height + rise / (sqrt(radius * radius + rise) + radius);
}

// Returns how much of each there is on the way to a sun of that cosine to the zenith.
vec3 depths_to_sun(float height, float cosine)
{
    float way = way_out(height, cosine);
    return way * (weighted_densities(heights_after(way * FIRST_NODES, height, cosine), FIRST_WEIGHTS)
        + weighted_densities(heights_after(way * LAST_NODES, height, cosine), LAST_WEIGHTS));
}

// Returns whether the Earth hides a sun of that cosine to the zenith from a height.
bool is_hidden(float height, float cosine)
{
    float along = (SINGLE_EARTH_RADIUS + height) * cosine;
    return cosine < 0.0 && along * along >= height * (2.0 * SINGLE_EARTH_RADIUS + height);
}

void main()
{
    vec2 corner = floor(gl_FragCoord.xy) / vec2(SKY_SIZE);
    float root = 2.0 * corner.y - 1.0, elevation = 0.5 * PI * root * root, azimuth = 2.0 * PI * corner.x - PI;
    float darker = root < 0.0 ? max(1.0 - 2.5 * sin(elevation), 0.0) : 1.0; // its cube
    elevation = root < 0.0 ? 0.0 : elevation;
    vec3 view = vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
    vec3 sun = vec3(cos(sun_elevation), 0.0, sin(sun_elevation));
    float start = clamp(altitude * 1000.0, 1.0, 59999.0), stride = way_out(start, view.z) / float(SINGLE_STEPS);
    float cosine = dot(view, sun), spread = 1.0 + MIE_ANISOTROPY * MIE_ANISOTROPY - 2.0 * MIE_ANISOTROPY * cosine;
    float rayleigh = 3.0 / (16.0 * PI) * (1.0 + cosine * cosine);
    float mie = 3.0 * (1.0 - MIE_ANISOTROPY * MIE_ANISOTROPY) * (1.0 + cosine * cosine)
        / (8.0 * PI * (2.0 + MIE_ANISOTROPY * MIE_ANISOTROPY) * spread * sqrt(spread));
    vec3 passed = vec3(0.0);
    result = vec4(0.0, 0.0, 0.0, 1.0);
    for (int k = 0; k < SINGLE_STEPS; k++) {
        float way = (float(k) + 0.5) * stride, height = heights_after(vec4(way), start, view.z).x;
        float up = ((SINGLE_EARTH_RADIUS + start) * sun.z + way * cosine) / (SINGLE_EARTH_RADIUS + height);
        vec3 here = stride * weighted_densities(vec4(height), vec4(1.0, 0.0, 0.0, 0.0));
        passed += here;
        if (is_hidden(height, up)) {
            continue;
        }
        vec3 depths = passed + depths_to_sun(height, up);
        for (int w = 0; w < BANDS; w++) {
            vec4 band = spectrum.band[w]; // XYZ of the sun's light, absorption by ozone
            float molecular = RAYLEIGH_SCATTERING / pow(1.0 + float(w) / 19.0, 4.0);
            float scattered = rayleigh * molecular * here.x + mie * MIE_SCATTERING * here.y;
            result.xyz += exp(-dot(depths, vec3(molecular, MIE_EXTINCTION, band.w))) * scattered * band.xyz;
        }
    }
    result.xyz *= darker * darker * darker;
}
