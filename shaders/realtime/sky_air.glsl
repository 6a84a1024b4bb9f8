// SPDX-License-Identifier: GPL-3.0-or-later
// The air of multiple scattering, as in addon/material/sky.py, whose constants are declared before it; kilometers, four wavelengths.

struct Air {
    vec4 molecular; // scattered by molecules [1/km]
    vec4 aerosol; // scattered by aerosols [1/km]
    vec4 extinction; // scattered and absorbed [1/km]
};

// Returns the air at a height above the ground. parts: densities of molecules, aerosols and ozone, 1 where they are usual.
Air air_at(float height, vec3 parts)
{
    float logarithm = log(max(height, 1e-4)), away = logarithm - OZONE_LOG_HEIGHT;
    float aerosol = parts.y * (exp(-height / AEROSOL_HEIGHT) + AEROSOL_BACKGROUND);
    float ozone = parts.z * exp(-OZONE_SHARPNESS * away * away - logarithm);
    Air air;
    air.molecular = MOLECULAR_SCATTERING * parts.x * exp(-MOLECULAR_DECAY * pow(max(height, 1e-6), MOLECULAR_EXPONENT));
    air.aerosol = AEROSOL_SCATTERING * aerosol;
    air.extinction = air.molecular + air.aerosol + AEROSOL_ABSORPTION * aerosol + OZONE_ABSORPTION * ozone;
    return air;
}

// Returns how far it is to the end of the air from a height, in a direction of that cosine to the zenith.
float way_out(float height, float cosine)
{
    float radius = EARTH_RADIUS + height, along = radius * cosine;
    return sqrt(along * along + (ATMOSPHERE_HEIGHT - height) * (2.0 * EARTH_RADIUS + ATMOSPHERE_HEIGHT + height)) - along;
}

// Returns the height after a way along such a direction, 0 below the ground; without the digits that radii lose.
float height_after(float way, float height, float cosine)
{
    float radius = EARTH_RADIUS + height, rise = way * (way + 2.0 * radius * cosine);
    return max(height + rise / (sqrt(radius * radius + rise) + radius), 0.0);
}
