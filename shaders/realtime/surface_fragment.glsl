// SPDX-License-Identifier: GPL-3.0-or-later
// One pixel of a surface under all lamps. SURFACE, RADIANCE and ALBEDO(mu) are the material's model, the first of it what all lamps
// have in common; KIND(lamp) is a lamp's kind. Whatever else is defined, the scene and the material need: SUN, POINT, SPOT, AREA
// (the kind's number), SHADOWS, AMBIENT, COAT, SCATTERS, COLOR_ATTRIBUTE, COLOR_IMAGE, NORMAL_MAP; SCATTERING where any material
// of the scene scatters, as all then write what that needs.

#ifdef SHADOWS
// Returns the share of a lamp's light that reaches the point: of the 3x3 texels around it, those that see nothing nearer.
float light_share(int k, vec3 position, vec3 n)
{
    vec4 tile = shadows.tile[k];
    if (tile.z == 0.0) { // this lamp casts none
        return 1.0;
    }
    // Off the surface by as much as its plane comes nearer to the lamp within the texels asked, so that it does not shade itself.
    float along = dot(n, lamps.lamp[k].axis.xyz);
    float slope = sqrt(max(0.0, 1.0 - along * along));
    float texel = shadows.texel[k].x * (shadows.matrix[k] * vec4(position, 1.0)).w;
    vec4 place = shadows.matrix[k] * vec4(position + n * (texel * (0.5 + 2.5 * slope)), 1.0);
    vec3 at = place.xyz / place.w;
    if (place.w <= 0.0 || any(greaterThan(abs(at), vec3(1.0)))) {
        return 1.0;
    }
    float far = at.z; // as shadow_fragment.glsl has it
#ifdef SPOT
    far = KIND(lamps.lamp[k]) == SPOT ? place.w : far;
#endif
    vec2 texels = (at.xy * 0.5 + 0.5) * tile.z - 0.5;
    ivec2 corner = ivec2(floor(texels));
    vec2 part = texels - vec2(corner);
    ivec2 low = ivec2(tile.xy), high = ivec2(tile.xy + tile.z) - 1;
    float share = 0.0;
    for (int x = -1; x <= 2; x++) {
        for (int y = -1; y <= 2; y++) {
            // a box of 3x3 texels around the point weighs the four by four that it touches
            vec2 weight = vec2(x == -1 ? 1.0 - part.x : x == 2 ? part.x : 1.0, y == -1 ? 1.0 - part.y : y == 2 ? part.y : 1.0);
            float nearest = texelFetch(shadow_map, clamp(low + corner + ivec2(x, y), low, high), 0).x;
            share += weight.x * weight.y * (far <= nearest ? 1.0 : 0.0);
        }
    }
    return share / 9.0;
}
#endif

vec3 lamp_irradiance(Lamp lamp, vec3 position, out vec3 l)
{
#ifdef SUN
    if (KIND(lamp) == SUN) {
        return sun_irradiance(lamp, l);
    }
#endif
#ifdef POINT
    if (KIND(lamp) == POINT) {
        return point_irradiance(lamp, position, l);
    }
#endif
#ifdef SPOT
    if (KIND(lamp) == SPOT) {
        return spot_irradiance(lamp, position, l);
    }
#endif
#ifdef AREA
    if (KIND(lamp) == AREA) {
        return area_irradiance(lamp, position, l);
    }
#endif
    l = vec3(0.0);
    return vec3(0.0);
}

#ifdef NORMAL_MAP
// Returns the world's normal that the map says, in the frame of the object's interpolated normal n, tangent t and w (n x t), which
// are left as long as they come out, as MikkTSpace asks for.
vec3 mapped_normal()
{
    vec3 at = texture(relief_image, vertex_relief_uv).xyz * 2.0 - 1.0;
    vec2 strength = vec2(material.color.w, material.coat.w);
    at = vec3(at.xy * strength, mix(1.0, at.z, clamp(strength.x, 0.0, 1.0)));
    vec3 bitangent = object_tangent.w * cross(object_normal, object_tangent.xyz);
    vec3 mapped = turned(at.x * object_tangent.xyz + at.y * bitangent + at.z * object_normal);
    return object_tangent.w != 0.0 && dot(mapped, mapped) > 0.0 ? mapped : world_normal; // 0 where there is no UV map
}
#endif

// Returns a unit normal of the side that is seen.
vec3 seen_normal(vec3 normal)
{
    return gl_FrontFacing == (orientation > 0.0) ? normalize(normal) : -normalize(normal);
}

void main()
{
    vec3 v = view.camera.w == 0.0 ? view.camera.xyz : normalize(view.camera.xyz - world_position);
    vec3 plain = seen_normal(world_normal), n = plain;
#ifdef NORMAL_MAP
    n = seen_normal(mapped_normal());
#endif
    float below = dot(n, v);
    if (below < 1e-4) { // a normal within a face may look away from the viewer, who then is taken to be at its horizon
        v = normalize(v + n * (1e-4 - below));
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
    CoatSurface coated = coat_surface(n, v, material.coat.y);
    vec3 mirrored = vec3(0.0);
#endif
#ifdef SCATTERS
    vec3 entering = vec3(0.0); // irradiance of the surface [W/m^2]
#endif
    for (int k = 0; k < lamps.count.x; k++) {
        vec3 l;
        vec3 irradiance = lamp_irradiance(lamps.lamp[k], world_position, l);
#ifdef SHADOWS
        irradiance *= light_share(k, world_position, plain);
#endif
#ifdef NORMAL_MAP
        irradiance *= step(0.0, dot(plain, l)); // nothing comes through the surface
#endif
        radiance += irradiance * (RADIANCE);
#ifdef COAT
        mirrored += irradiance * coat_highlight(coated, l);
#endif
#ifdef SCATTERS
        entering += irradiance * max(dot(n, l), 0.0);
#endif
    }
#if defined(AMBIENT) || defined(COAT)
    float mu = clamp(dot(n, v), 0.0, 1.0);
#endif
#ifdef AMBIENT
    radiance += view.world.rgb * (ALBEDO(mu));
#ifdef COAT
    mirrored += view.world.rgb;
#endif
#ifdef SCATTERS
    entering += 3.14159265358979 * view.world.rgb;
#endif
#endif
#ifdef COAT
    float coat = material.coat.x * coat_fresnel(mu, material.coat.y, material.coat.z);
#else
    const float coat = 0.0;
#endif
#ifdef SCATTERS
    float share = material.scattering.w * (1.0 - coat); // of the light, scattered below the surface
    radiance *= 1.0 - material.scattering.w;
    out_entering = vec4(entering, float(object_number));
    float depth = view.camera.w == 0.0 ? -dot(view.camera.xyz, world_position) : 1.0 / gl_FragCoord.w;
    out_distance = vec4(burley_d(albedo, material.scattering.rgb), depth); // depth [m] along the camera's axis
    out_tint = vec4(albedo * (share / 3.14159265358979), 1.0);
#elif defined(SCATTERING)
    out_entering = out_distance = out_tint = vec4(0.0);
#endif
    radiance *= 1.0 - coat;
#ifdef COAT
    radiance += coat * mirrored;
#endif
    out_radiance = vec4(radiance, 1.0);
}
