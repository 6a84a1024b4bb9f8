// SPDX-License-Identifier: GPL-3.0-or-later
// The irradiance of any light of the scene: one branch for each type that it has.

// Returns E0 of a light [W/m^2], without shadows; l: the unit vector towards it.
vec3 light_irradiance(Light light, vec3 position, out vec3 l)
{
#ifdef SUN
    if (LIGHT_TYPE(light) == SUN) {
        return sun_irradiance(light, l);
    }
#endif
#ifdef POINT
    if (LIGHT_TYPE(light) == POINT) {
        return point_irradiance(light, position, l);
    }
#endif
#ifdef SPOT
    if (LIGHT_TYPE(light) == SPOT) {
        return spot_irradiance(light, position, l);
    }
#endif
#ifdef AREA
    if (LIGHT_TYPE(light) == AREA) {
        return area_irradiance(light, position, l);
    }
#endif
    l = vec3(0.0);
    return vec3(0.0);
}
