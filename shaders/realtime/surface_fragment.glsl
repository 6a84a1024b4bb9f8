// SPDX-License-Identifier: GPL-3.0-or-later
// One pixel of a surface under all lights. addon/realtime/program.py defines before it
//     SURFACE, RADIANCE, ALBEDO(mu)   the material's model: a statement before the loop over lights, its radiance for one, its ambient
//     LIGHT_TYPE(light)               a light's type
// and, where the scene or the material needs them,
//     SUN, POINT, SPOT, AREA          the types' numbers
//     SHADOWS, AMBIENT, COAT, COLOR_ATTRIBUTE, COLOR_IMAGE, NORMAL_MAP
//     SUBSURFACE                      the material scatters light below its surface
//     SUBSURFACE_IN_SCENE             some material does, so that all write the outputs that subsurface_gather.glsl reads

#ifdef SHADOWS
// Returns the fraction of a light that reaches the point: percentage-closer filtering of the 3x3 texels around it.
float light_visibility(int k, vec3 position, vec3 n)
{
    vec4 tile = shadows.tile[k];
    if (tile.z == 0.0) { // this light casts no shadows
        return 1.0;
    }
    // Moved off the surface by as much as its plane rises towards the light within the filter, so that it does not shadow itself.
    float cosine = dot(n, lights.light[k].axis.xyz);
    float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
    float texel = shadows.texel[k].x * (shadows.matrix[k] * vec4(position, 1.0)).w;
    vec4 clip = shadows.matrix[k] * vec4(position + n * (texel * (0.5 + 2.5 * sine)), 1.0);
    vec3 point = clip.xyz / clip.w;
    if (clip.w <= 0.0 || any(greaterThan(abs(point), vec3(1.0)))) {
        return 1.0;
    }
    float depth = point.z; // as in shadow_fragment.glsl
#ifdef SPOT
    depth = LIGHT_TYPE(lights.light[k]) == SPOT ? clip.w : depth;
#endif
    vec2 texels = (point.xy * 0.5 + 0.5) * tile.z - 0.5;
    ivec2 corner = ivec2(floor(texels));
    vec2 rest = texels - vec2(corner);
    ivec2 low = ivec2(tile.xy), high = ivec2(tile.xy + tile.z) - 1;
    float visibility = 0.0;
    for (int x = -1; x <= 2; x++) {
        for (int y = -1; y <= 2; y++) {
            // a box of 3x3 texels around the point weighs the four by four that it touches
            vec2 weight = vec2(x == -1 ? 1.0 - rest.x : x == 2 ? rest.x : 1.0, y == -1 ? 1.0 - rest.y : y == 2 ? rest.y : 1.0);
            float nearest = texelFetch(shadow_map, clamp(low + corner + ivec2(x, y), low, high), 0).x;
            visibility += weight.x * weight.y * (depth <= nearest ? 1.0 : 0.0);
        }
    }
    return visibility / 9.0;
}
#endif

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

#ifdef NORMAL_MAP
// Returns the normal map's normal in the world. It is relative to the object's interpolated normal n, tangent t and w (n x t), which
// keep the lengths that interpolation gives them, as MikkTSpace requires.
vec3 mapped_normal()
{
    vec3 tangent_space = texture(normal_image, vertex_normal_uv).xyz * 2.0 - 1.0;
    vec2 strength = vec2(material.color.w, material.coat.w);
    tangent_space = vec3(tangent_space.xy * strength, mix(1.0, tangent_space.z, clamp(strength.x, 0.0, 1.0)));
    vec3 bitangent = object_tangent.w * cross(object_normal, object_tangent.xyz);
    vec3 mapped = transform_normal(
        tangent_space.x * object_tangent.xyz + tangent_space.y * bitangent + tangent_space.z * object_normal);
    return object_tangent.w != 0.0 && dot(mapped, mapped) > 0.0 ? mapped : world_normal; // w is 0 where there is no UV map
}
#endif

// Returns the unit normal of the visible side.
vec3 visible_normal(vec3 normal)
{
    return gl_FrontFacing == (orientation > 0.0) ? normalize(normal) : -normalize(normal);
}

void main()
{
    vec3 v = view.camera.w == 0.0 ? view.camera.xyz : normalize(view.camera.xyz - world_position);
    vec3 unmapped = visible_normal(world_normal), n = unmapped;
#ifdef NORMAL_MAP
    n = visible_normal(mapped_normal());
#endif
    float n_dot_v = dot(n, v);
    if (n_dot_v < 1e-4) { // an interpolated normal may face away from the viewer, who then is moved to its horizon
        v = normalize(v + n * (1e-4 - n_dot_v));
    }
    vec3 albedo = material.color.rgb;
#ifdef COLOR_ATTRIBUTE
    albedo *= vertex_color.rgb;
#endif
#ifdef COLOR_IMAGE
    albedo *= texture(color_image, vertex_uv).rgb;
#endif
    SURFACE
    vec3 radiance = vec3(0.0);
#ifdef COAT
    CoatSurface coat_layer = coat_surface(n, v, material.coat.y);
    vec3 coat_radiance = vec3(0.0);
#endif
#ifdef SUBSURFACE
    vec3 entering = vec3(0.0); // irradiance of the surface [W/m^2]
#endif
    for (int k = 0; k < lights.count.x; k++) {
        vec3 l;
        vec3 irradiance = light_irradiance(lights.light[k], world_position, l);
#ifdef SHADOWS
        irradiance *= light_visibility(k, world_position, unmapped);
#endif
#ifdef NORMAL_MAP
        irradiance *= step(0.0, dot(unmapped, l)); // no light comes through the surface
#endif
        radiance += irradiance * (RADIANCE);
#ifdef COAT
        coat_radiance += irradiance * coat_highlight(coat_layer, l);
#endif
#ifdef SUBSURFACE
        entering += irradiance * max(dot(n, l), 0.0);
#endif
    }
#if defined(AMBIENT) || defined(COAT)
    float mu = clamp(dot(n, v), 0.0, 1.0);
#endif
#ifdef AMBIENT
    radiance += view.world.rgb * (ALBEDO(mu));
#ifdef COAT
    coat_radiance += view.world.rgb;
#endif
#ifdef SUBSURFACE
    entering += 3.14159265358979 * view.world.rgb;
#endif
#endif
#ifdef COAT
    float coat = material.coat.x * coat_fresnel(mu, material.coat.y, material.coat.z);
#else
    const float coat = 0.0;
#endif
#ifdef SUBSURFACE
    float weight = material.scattering.w * (1.0 - coat); // the fraction of the light that scatters below the surface
    radiance *= 1.0 - material.scattering.w;
    out_entering = vec4(entering, float(object_number));
    float depth = view.camera.w == 0.0 ? -dot(view.camera.xyz, world_position) : 1.0 / gl_FragCoord.w;
    out_distance = vec4(burley_d(albedo, material.scattering.rgb), depth); // depth [m] along the camera's axis
    out_tint = vec4(albedo * (weight / 3.14159265358979), 1.0);
#elif defined(SUBSURFACE_IN_SCENE)
    out_entering = out_distance = out_tint = vec4(0.0);
#endif
    radiance *= 1.0 - coat;
#ifdef COAT
    radiance += coat * coat_radiance;
#endif
    out_radiance = vec4(radiance, 1.0);
}
