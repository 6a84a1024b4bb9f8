// SPDX-License-Identifier: GPL-3.0-or-later
// One pixel of a surface under all lights. addon/realtime/program.py defines before it
//     SHADED_POINT, material_inputs        the shaded point, and the struct of the material's parameters there
//     SURFACE, RADIANCE, ALBEDO(mu)   the material's model: a statement before the loop over lights, its radiance for one, its ambient
//     LIGHT_TYPE(light)               a light's type
// and, where the scene or the material needs them,
//     SUN, POINT, SPOT, AREA    the types' numbers
//     SHADOWS, AMBIENT
//     WORLD_MAP                       the world varies; BASE_RADIANCE and BASE_ALBEDO(mu) are the model's without a highlight
//     SHAPED                          the model is not Lambert's
//     METAL, TRANSMISSION, SUBSURFACE, SPECULAR, HIGHLIGHT, COAT, FUZZ, EMISSION, OPACITY   parts of the surface
//     NORMAL, COAT_NORMAL, ANISOTROPY which have this
//     AVERAGED_COAT                   the coat is that of coat.glsl
//     MULTIPLE_SCATTERING             metal and specular keep the light that single scattering loses
//     CULLED                          the back is not drawn
//     HOLDOUT                         a hole in the picture is drawn in the place of the surface
//     SPECULAR_TABLE                  a layer reads the table of specular albedos
//     DATA                            what is written of the surface in place of its light, in a pass
//     THRESHOLD                       the least opacity of a surface in such a pass
//     BOUNCE                          maps of ray bundles say what other surfaces reflect, and where they hide the sky
//     LAYER                           a layer of a ray bundle is drawn: what the surface sends to other surfaces
//     SUBSURFACE_IN_SCENE             some material scatters light below its surface, so that all write the outputs that
//                                     subsurface_gather.glsl reads, with SHADOWS one more
// The layers are those of Cycles' Principled BSDF (intern/cycles/kernel/svm/closure.h): sheen over coat over emission over metal over
// glass over specular over subsurface scattering and the model.

#ifdef SHADOWS
const float GRAZING = 0.02; // the cosine from which on the plane of a surface is not followed all the way

// Returns 1 for each texel around the corner `between` four of the shadow map that has nothing before `depth`, else 0.
vec4 is_lit(vec2 between, float depth)
{
    return step(depth, textureGather(shadow_map, between / vec2(textureSize(shadow_map, 0))));
}

// Returns by how much the depth in a tile grows on the plane of a point of that depth and of normal n, for a step in clip space.
float depth_slope(mat4 matrix, vec3 axis, vec3 n, vec3 l, float depth, vec2 to_step)
{
    mat4 rows = transpose(matrix);
    vec3 right = rows[0].xyz - axis * dot(rows[0].xyz, axis), up = rows[1].xyz - axis * dot(rows[1].xyz, axis);
    float rise = dot(n, right) / dot(right, right) * to_step.x + dot(n, up) / dot(up, up) * to_step.y;
    float facing = max(dot(n, l), GRAZING);
    return axis == vec3(0.0) ? rise / facing * length(rows[2].xyz) : rise * depth / facing * -dot(l, axis);
}

// Returns the fraction of a light that reaches the point, l: towards the light. Where all samples have the same map, percentage-closer
// filtering of the 3x3 texels around it; else the nearest texel, as samples have maps that are moved by parts of a texel.
// The texture `shadow_tiles` has six texels for each tile: the columns of its matrix; x, y, size and texel; whether it is filtered, and
// by how much depths are off.
float light_visibility(Light light, vec3 position, vec3 n, vec3 l)
{
    if (dot(n, l) <= 0.0) {
        return 0.0; // the surface's own shadow
    }
    int first = int(light.x_axis.w), count = int(light.y_axis.w);
    for (int row = first; row < first + count; row++) {
        mat4 matrix = mat4(texelFetch(shadow_tiles, ivec2(0, row), 0), texelFetch(shadow_tiles, ivec2(1, row), 0),
            texelFetch(shadow_tiles, ivec2(2, row), 0), texelFetch(shadow_tiles, ivec2(3, row), 0));
        vec4 tile = texelFetch(shadow_tiles, ivec2(4, row), 0), more = texelFetch(shadow_tiles, ivec2(5, row), 0);
#ifdef LAYER
        const bool is_filtered = false; // needs no smooth edges
#else
        bool is_filtered = more.x != 0.0;
#endif
        vec3 axis = vec3(matrix[0].w, matrix[1].w, matrix[2].w); // along which the tile looks, 0 for a sun's
        // Moved off the surface by as much as its plane rises along the axis within the filter, so that it does not shadow itself; where a
        // single texel is compared, its plane is followed to the texel's middle, and what is left is that surfaces are no planes.
        float cosine = dot(n, axis == vec3(0.0) ? l : axis);
        float texel = tile.w * (matrix * vec4(position, 1.0)).w, sine = sqrt(max(0.0, 1.0 - cosine * cosine));
        float lift = texel * (is_filtered ? 0.5 + 2.5 * sine : 0.25 + 0.25 * sine) + more.y;
        vec4 clip = matrix * vec4(position + n * lift, 1.0);
        vec3 point = clip.xyz / clip.w;
        if (clip.w <= 0.0 || any(greaterThan(abs(point), vec3(1.0)))) {
            continue;
        }
        float depth = axis == vec3(0.0) ? point.z : clip.w; // as in shadow_fragment.glsl
        vec2 texels = (point.xy * 0.5 + 0.5) * tile.z - 0.5;
        if (!is_filtered) {
            vec2 nearest = clamp(floor(texels + 0.5), vec2(0.0), vec2(tile.z - 1.0)), to_middle = (nearest - texels) * 2.0 / tile.z;
            depth += depth_slope(matrix, axis, n, l, clip.w, to_middle);
            return step(depth, texelFetch(shadow_map, ivec2(tile.xy + nearest), 0).x);
        }
        vec2 corner = clamp(floor(texels), vec2(1.0), vec2(tile.z - 3.0)), rest = clamp(texels - corner, 0.0, 1.0);
        vec2 middle = tile.xy + corner; // between the first two texels in either direction
        // A box of 3x3 texels around the point weighs the four by four that it touches; a gather's four have (0, 1), (1, 1), (1, 0), (0, 0).
        vec4 weight = vec4(1.0 - rest, rest);
        float visibility = dot(is_lit(middle, depth), vec4(weight.x, 1.0, weight.y, weight.x * weight.y));
        visibility += dot(is_lit(middle + vec2(2.0, 0.0), depth), vec4(1.0, weight.z, weight.z * weight.y, weight.y));
        visibility += dot(is_lit(middle + vec2(0.0, 2.0), depth), vec4(weight.x * weight.w, weight.w, 1.0, weight.x));
        visibility += dot(is_lit(middle + 2.0, depth), vec4(weight.w, weight.z * weight.w, weight.z, 1.0));
        return visibility / 9.0;
    }
    return 1.0; // nothing that casts shadows is there
}
#endif

#if defined(METAL) || defined(SPECULAR) || defined(TRANSMISSION)
// Returns the tangent in which the roughness is largest.
vec3 specular_tangent(MaterialInputs inputs, vec3 n)
{
#ifdef ANISOTROPY
    vec3 tangent = inputs.tangent;
    float turn = 6.28318530717959 * inputs.specular_rotation;
    return tangent * cos(turn) + cross(n, tangent) * sin(turn) + n * (dot(n, tangent) * (1.0 - cos(turn)));
#else
    return vec3(0.0);
#endif
}
#endif

float largest(vec3 color)
{
    return max(color.r, max(color.g, color.b));
}

void main()
{
#ifdef LAYER
    vec2 slope = vec2(dFdx(gl_FragCoord.z), dFdy(gl_FragCoord.z));
    if (is_peeled()) {
        discard;
    }
#endif
    vec3 unmapped = surface_normal(), n = unmapped;
    MaterialInputs inputs = material_inputs(SHADED_POINT);
#if defined(CULLED) && !defined(LAYER)
    if (!is_front()) {
        discard;
    }
#endif
#ifdef NORMAL
    n = safe_normal(inputs.normal);
#endif
    vec3 v = incoming_at(world_position);
    float n_dot_v = dot(n, v);
    if (n_dot_v < 1e-4) { // a bent normal may face away from the viewer, who then is moved to its horizon
        v = normalize(v + n * (1e-4 - n_dot_v));
    }
    float mu = clamp(dot(n, v), 0.0, 1.0);
    vec3 albedo = max(inputs.base_color, 0.0);
    vec3 weight = vec3(1.0); // of the light to and from the layers below
    vec3 radiance = vec3(0.0);
#ifdef FUZZ
#ifdef COAT_NORMAL
    vec3 fuzz_normal = normalize(mix(n, safe_normal(inputs.coat_normal), clamp(inputs.coat_weight, 0.0, 1.0)));
#elif defined(COAT)
    vec3 fuzz_normal = normalize(mix(n, unmapped, clamp(inputs.coat_weight, 0.0, 1.0)));
#else
    vec3 fuzz_normal = n;
#endif
    SheenLobe fuzz_lobe = sheen_lobe(fuzz_normal, v, inputs.fuzz_roughness);
    vec3 fuzz = max(inputs.fuzz_weight, 0.0) * max(inputs.fuzz_color, 0.0) * fuzz_lobe.albedo;
    weight *= 1.0 - min(largest(fuzz), 1.0);
#endif
#ifdef COAT
#ifdef COAT_NORMAL
    vec3 coat_normal = safe_normal(inputs.coat_normal);
#else
    vec3 coat_normal = unmapped;
#endif
    float coat_roughness = clamp(inputs.coat_roughness, 0.0, 1.0), coat_ior = max(inputs.coat_ior, 1.0);
    float coat_mu = clamp(dot(coat_normal, v), 0.0, 1.0);
    vec3 coat = weight * max(inputs.coat_weight, 0.0);
#ifdef AVERAGED_COAT
    CoatSurface coat_lobe = coat_surface(coat_normal, v, coat_roughness);
    float coat_albedo = coat_fresnel(coat_mu, coat_roughness, coat_ior);
#else
    GgxLobe coat_lobe = ggx_lobe(coat_normal, v, vec3(0.0), ggx_alpha(coat_roughness, 0.0));
    vec4 coat_table = specular_albedo(coat_roughness, coat_mu, coat_ior);
    float coat_albedo = mix(ggx_f0(coat_ior), 1.0, coat_table.x);
#endif
    weight *= 1.0 - clamp(inputs.coat_weight * coat_albedo, 0.0, 1.0);
    float coat_path = 1.0 / sqrt(1.0 - (1.0 - coat_mu * coat_mu) / (coat_ior * coat_ior) + 1e-6);
    weight *= mix(vec3(1.0), pow(max(inputs.coat_color, 1e-6), vec3(coat_path)), inputs.coat_weight);
#endif
#ifdef EMISSION
    radiance += weight * inputs.emission_color * inputs.emission_strength;
#endif
#if defined(METAL) || defined(SPECULAR) || defined(TRANSMISSION)
    float roughness = clamp(inputs.specular_roughness, 0.0, 1.0);
#ifdef ANISOTROPY
    vec2 alpha = ggx_alpha(roughness, inputs.specular_anisotropy);
#else
    vec2 alpha = ggx_alpha(roughness, 0.0);
#endif
    GgxLobe lobe = ggx_lobe(n, v, specular_tangent(inputs, n), alpha);
#ifdef MULTIPLE_SCATTERING
    float mean_albedo = specular_mean_albedo(roughness);
#endif
#endif
#ifdef METAL
    float metallic = clamp(inputs.metallic, 0.0, 1.0);
    vec3 f0 = min(albedo, 1.0), dip = ggx_f82_dip(f0, clamp(inputs.specular_color, 0.0, 1.0));
    vec3 metal = weight * metallic;
    vec4 metal_table = specular_albedo(roughness, mu, 1.0);
#ifdef MULTIPLE_SCATTERING
    metal *= ggx_multiple(ggx_f82_mean(f0, dip), metal_table.y, mean_albedo);
#endif
    weight *= 1.0 - metallic;
#endif
    float see_through = 0.0;
#ifdef TRANSMISSION
    // What a glass lets through comes straight from behind; the color is the mean of the channels' chances.
    float glass = clamp(inputs.transmission_weight, 0.0, 1.0);
    float glass_ior = max(inputs.specular_ior, 1e-5);
    vec4 glass_table = specular_albedo(roughness, mu, glass_ior);
    vec3 glass_f0 = ggx_f0(glass_ior) * max(inputs.specular_color, 0.0);
    vec3 glass_weight = weight * glass;
    see_through = dot(glass_weight * (1.0 - mix(glass_f0, vec3(1.0), glass_table.x)) * sqrt(min(albedo, 1.0)), vec3(1.0 / 3.0));
    weight *= 1.0 - glass;
#endif
#ifdef OPACITY
    float opacity = clamp(inputs.opacity, 0.0, 1.0);
#else
    const float opacity = 1.0;
#endif
#if defined(OPACITY) || defined(TRANSMISSION)
#ifdef THRESHOLD
    if (opacity < THRESHOLD) {
        discard;
    }
#else
    if (is_seen_through(opacity * (1.0 - see_through))) {
        discard;
    }
#endif
    float shown = 1.0 / max(1.0 - see_through, 1e-3); // what is shown stands for the samples that see through the glass, too
    radiance *= shown;
#else
    const float shown = 1.0;
#endif
#ifdef HOLDOUT
#ifdef SUBSURFACE_IN_SCENE
    out_entering = out_distance = out_tint = vec4(0.0);
#ifdef SHADOWS
    out_medium = vec4(0.0);
#endif
#endif
    out_radiance = vec4(0.0, 0.0, 0.0, -1.0); // as accumulate.glsl reads it
    return;
#endif
#ifdef SPECULAR
    float ior = max(inputs.specular_ior, 1e-5);
    float eta = ggx_ior(ggx_f0(ior) * max(inputs.specular_weight, 0.0));
    eta = ior < 1.0 ? 1.0 / eta : eta;
    vec3 specular_f0 = ggx_f0(eta) * max(inputs.specular_color, 0.0);
    vec4 specular_entry = specular_albedo(roughness, mu, eta);
    vec3 specular = eta == 1.0 ? vec3(0.0) : weight;
    vec3 specular_part = specular * mix(specular_f0, vec3(1.0), specular_entry.x); // what it takes from the layers below
#ifdef MULTIPLE_SCATTERING
    float specular_mean = clamp((ggx_dielectric_mean(eta) - ggx_f0(eta)) / max(1.0 - ggx_f0(eta), 1e-6), 0.0, 1.0);
    vec3 again = ggx_multiple(mix(specular_f0, vec3(1.0), specular_mean), specular_entry.y, mean_albedo);
    specular *= again;
    specular_part *= again * specular_entry.y;
#endif
    weight *= 1.0 - clamp(largest(specular_part / max(weight, 1e-6)), 0.0, 1.0);
#endif
#ifdef DATA
    out_radiance = vec4(DATA, 1.0);
#else
    SURFACE
    vec3 diffuse = vec3(0.0), glossy = vec3(0.0);
#ifdef SUBSURFACE
    vec3 entering = vec3(0.0); // irradiance of the surface [W/m^2]
#endif
    for (int k = 0; k < lights.count.x; k++) {
        vec3 l;
        vec3 irradiance = light_irradiance(lights.light[k], world_position, l);
#ifdef SHADOWS
        irradiance *= light_visibility(lights.light[k], world_position, unmapped, l);
#endif
#if defined(NORMAL) || defined(COAT_NORMAL)
        irradiance *= step(0.0, dot(unmapped, l)); // no light comes through the surface
#endif
        diffuse += irradiance * (RADIANCE);
#ifdef SPECULAR_TABLE
        float cosine;
#endif
#if defined(METAL) || defined(SPECULAR) || defined(TRANSMISSION)
        float reflected = ggx_radiance(lobe, l, cosine);
#ifdef METAL
        glossy += irradiance * reflected * metal * ggx_f82(cosine, f0, dip);
#endif
#ifdef TRANSMISSION
        glossy += irradiance * reflected * glass_weight * mix(glass_f0, vec3(1.0), ggx_grazing(cosine, glass_ior));
#endif
#ifdef SPECULAR
        glossy += irradiance * reflected * specular * mix(specular_f0, vec3(1.0), ggx_grazing(cosine, eta));
#endif
#endif
#ifdef AVERAGED_COAT
        glossy += irradiance * coat * (coat_albedo * coat_highlight(coat_lobe, l));
#elif defined(COAT)
        float coated = ggx_radiance(coat_lobe, l, cosine);
        glossy += irradiance * coated * coat * ggx_dielectric(cosine, coat_ior);
#endif
#ifdef FUZZ
        glossy += irradiance * fuzz * sheen_radiance(fuzz_lobe, l);
#endif
#ifdef SUBSURFACE
        entering += irradiance * max(dot(n, l), 0.0);
#endif
    }
#ifdef BOUNCE
    vec3 bounced = vec3(0.0); // what rays that meet other surfaces change of the ambient term
#ifdef LAYER
    vec3 open = vec3(0.0); // what the directions make of a sky that nothing hides
#endif
    vec4 met_around = vec4(0.0); // rgb: mean of the radiance they meet, w: fraction of them, weighted by the cosine
    ivec2 maps = bundles_at(world_position);
    for (int k = maps.x; k < maps.y; k++) {
        vec3 l = bundles.towards[k].xyz;
        vec4 met = bundles.sky[k].w * met_by_ray(k, world_position, unmapped, is_front());
#ifdef LAYER
        met.rgb = vec3(0.0); // light bounces once
        open += bundles.sky[k].w * bundles.sky[k].rgb * (BASE_RADIANCE);
#endif
        vec3 irradiance = met.rgb - met.w * bundles.sky[k].rgb;
        bounced += irradiance * (BASE_RADIANCE);
        met_around += met * (max(dot(n, l), 0.0) / 3.14159265358979);
#ifdef SUBSURFACE
        entering += irradiance * max(dot(n, l), 0.0);
#endif
    }
#define SURROUNDED(sky) ((sky) * (1.0 - met_around.w) + met_around.rgb)
#else
#define SURROUNDED(sky) (sky)
#endif
#ifdef AMBIENT
#ifdef WORLD_MAP
#define REFLECTED(n, v, alpha) SURROUNDED(world_reflected(n, v, alpha))
    vec3 around = world_around(n), base_albedo = BASE_ALBEDO(mu);
    diffuse += around * base_albedo;
#if defined(SHAPED) || defined(FUZZ)
    // What the model, and fibers, make of the sky beside its mean: their reflection from directions as dense as the cosine.
    vec3 shaped = vec3(0.0), fuzzy = vec3(0.0);
    float fibers = 0.0;
    for (int k = 0; k < DIRECTIONS; k++) {
        vec3 l = world_direction(k, n, v);
        vec3 difference = world_smooth(l) - around;
        float cosine = max(dot(n, l), 1e-6);
#ifdef SHAPED
        shaped += difference * (3.14159265358979 * (BASE_RADIANCE) / cosine - base_albedo);
#endif
#ifdef FUZZ
        float fiber = sheen_radiance(fuzz_lobe, l) / cosine;
        fuzzy += difference * fiber;
        fibers += fiber;
#endif
    }
    diffuse = max(diffuse + shaped / float(DIRECTIONS), 0.0);
#endif
#ifdef HIGHLIGHT
    diffuse += (ALBEDO(mu) - base_albedo) * world_reflected(n, v, sqrt(2.0 / (max(inputs.highlight_exponent, 0.0) + 2.0)));
#endif
#else
#define REFLECTED(n, v, alpha) SURROUNDED(view.world.rgb)
    vec3 around = view.world.rgb;
    diffuse += around * (ALBEDO(mu));
#endif
#if defined(METAL) || defined(SPECULAR) || defined(TRANSMISSION)
    vec3 reflected_world = REFLECTED(n, v, sqrt(alpha.x * alpha.y));
#endif
#ifdef METAL
    vec3 metal_mean = mix(f0, vec3(1.0), metal_table.z) - dip * metal_table.w;
    glossy += reflected_world * metal * metal_table.y * metal_mean;
#endif
#ifdef TRANSMISSION
    glossy += reflected_world * glass_weight * glass_table.y * mix(glass_f0, vec3(1.0), glass_table.x);
#endif
#ifdef SPECULAR
    glossy += reflected_world * specular * specular_entry.y * mix(specular_f0, vec3(1.0), specular_entry.x);
#endif
#ifdef AVERAGED_COAT
    glossy += REFLECTED(coat_normal, v, coat_roughness * coat_roughness) * coat * coat_albedo;
#elif defined(COAT)
    glossy += REFLECTED(coat_normal, v, coat_roughness * coat_roughness) * coat * coat_table.y * coat_albedo;
#endif
#ifdef FUZZ
#ifdef WORLD_MAP
    glossy += SURROUNDED(max(around + fuzzy / max(fibers, 1e-6), 0.0)) * fuzz;
#else
    glossy += SURROUNDED(around) * fuzz;
#endif
#endif
#ifdef SUBSURFACE
    entering += 3.14159265358979 * around;
#endif
#endif
#ifdef BOUNCE
#ifdef LAYER
    bounced *= min(around * (BASE_ALBEDO(mu)) / max(open, 1e-6), 1e3); // few directions are not to hide more than there is
#endif
    diffuse += bounced;
#ifdef HIGHLIGHT
    diffuse += (ALBEDO(mu) - BASE_ALBEDO(mu)) * (met_around.rgb - met_around.w * around);
#endif
#endif
    weight *= shown;
#ifdef SUBSURFACE
    float scattered = clamp(inputs.subsurface_weight, 0.0, 1.0); // the fraction of the light that scatters below the surface
    diffuse *= 1.0 - scattered;
#ifdef LAYER
    diffuse += entering * albedo * (scattered / 3.14159265358979); // as if it did not spread
#else
    out_entering = vec4(entering, float(object_number_of(object_index)));
    float depth = view.camera.w == 0.0 ? -dot(view.camera.xyz, world_position) : 1.0 / gl_FragCoord.w;
    out_distance = vec4(burley_d(albedo, inputs.subsurface_radius), depth); // depth [m] along the camera's axis
    out_tint = vec4(albedo * weight * (scattered / 3.14159265358979), 1.0);
#ifdef SHADOWS
    out_medium = vec4(albedo, packed_normal(unmapped, 4096.0));
#endif
#endif
#elif defined(SUBSURFACE_IN_SCENE)
    out_entering = out_distance = out_tint = vec4(0.0);
#ifdef SHADOWS
    out_medium = vec4(0.0);
#endif
#endif
#ifdef LAYER
    out_radiance = vec4(min(radiance + weight * diffuse, LARGEST), slope.x * float(layer.y));
#if defined(OPACITY) || defined(TRANSMISSION)
    float depth = gl_FragCoord.z + TRANSPARENT_DEPTH;
#else
    float depth = gl_FragCoord.z;
#endif
    out_depth = vec4(is_front() ? depth : -depth, slope.y * float(layer.y), 0.0, 0.0);
#else
    out_radiance = vec4(radiance + weight * diffuse + shown * glossy, 1.0);
#endif
#endif
}
