// SPDX-License-Identifier: GPL-3.0-or-later
// One pixel of a character: its picture, its error, or a number to measure by. The functions of shaders/ come before it.

const int PICTURE = 0, ERROR = 1, RADIANCE = 2, OTHER = 3, NORMAL = 4, VIEW = 5, ALBEDO = 6; // what is drawn
const int SPECULAR = 0, LAMBERT = 1, OREN_NAYAR = 2;

in vec3 own_place, own_normal, place, normal, paint;
in vec2 uv;

uniform int drawn, model;
uniform float sigma;      // [radians], of Oren-Nayar
uniform bool is_eon;      // whether the other model is the EON that glTF carries, or Lambert's
uniform float roughness;  // of that EON
uniform float b_average;  // of the average albedo A + b_average B of Oren-Nayar
uniform vec2 highlight;   // weight and exponent, of standard specular
uniform vec3 light;       // direction to it
uniform float irradiance; // of a plane that faces it [W/m^2]
uniform float sky;        // its radiance [W/(m^2 sr)]
uniform float far;
uniform bool has_image, has_shadows;
uniform sampler2D image;
uniform highp sampler2DShadow nearest; // to the light
uniform mat4 to_light;
uniform vec3 diverging[5], not_measured, luminance_weights;
uniform float knee;

out vec4 result;

// Returns the fraction of the light that nothing is in the way of.
float lit()
{
    vec3 at = (to_light * vec4(own_place + 0.003 * normalize(own_normal), 1.0)).xyz * 0.5 + 0.5;
    vec2 texel = 1.0 / vec2(textureSize(nearest, 0));
    float sum = 0.0;
    for (int k = 0; k < 4; k++) {
        vec2 corner = vec2(k & 1, k >> 1) - 0.5;
        sum += texture(nearest, vec3(at.xy + corner * texel, at.z - 0.001));
    }
    return sum / 4.0;
}

vec3 encoded(vec3 linear) // in sRGB
{
    vec3 x = clamp(linear, 0.0, 1.0);
    return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}

float luminance(vec3 rgb)
{
    return dot(rgb, luminance_weights);
}

// Returns the color of an error on the scale of scripts/studies/pictures.py: linear below the knee, then logarithmic.
vec3 error_color(float error)
{
    float at = 2.0 + 2.0 * sign(error) * min(1.0, log(1.0 + abs(error) / knee) / log(1.0 + 1.0 / knee));
    int index = min(int(at), 3);
    return mix(diverging[index], diverging[index + 1], at - float(index));
}

vec3 radiance(vec3 n, vec3 v, vec3 rho)
{
    if (model == SPECULAR) {
        return blinn_phong_radiance(blinn_phong_surface(n, v, rho, highlight.x, highlight.y), light);
    }
    if (model == LAMBERT) {
        return lambert_radiance(lambert_surface(n, v, rho), light);
    }
    return oren_nayar_radiance(oren_nayar_surface(n, v, rho, oren_nayar_coefficients(sigma)), light);
}

// Returns the radiance by the model that is held against the character's own.
vec3 other_radiance(vec3 n, vec3 v, vec3 rho)
{
    if (!is_eon || model != OREN_NAYAR) {
        return lambert_radiance(lambert_surface(n, v, rho), light);
    }
    vec2 ab = oren_nayar_coefficients(sigma);
    vec3 arl = eon_coefficients(roughness);
    vec3 average = rho * (ab.x + b_average * ab.y);
    return eon_radiance(eon_surface(n, v, average / (1.0 - arl.z + average * arl.z), arl), light); // of the same average albedo
}

// Returns the radiance under a sky of radiance 1.
vec3 ambient(float mu, vec3 rho)
{
    if (model == SPECULAR) {
        return blinn_phong_albedo(mu, rho, highlight.x, highlight.y);
    }
    return model == LAMBERT ? lambert_albedo(mu, rho) : oren_nayar_albedo(mu, rho, oren_nayar_coefficients(sigma));
}

void main()
{
    vec4 texel = has_image ? texture(image, uv) : vec4(paint, 1.0);
    if (texel.a < 0.5) {
        discard;
    }
    vec3 rho = texel.rgb;
    vec3 n = normalize(gl_FrontFacing ? normal : -normal);
    vec3 v = normalize(vec3(0.0, 0.0, far) - place);
    if (drawn == PICTURE) {
        vec3 sum = irradiance * radiance(n, v, rho) * (has_shadows ? lit() : 1.0);
        result = vec4(encoded(sum + sky * ambient(dot(n, v), rho)), 1.0);
        return;
    }
    vec3 other = other_radiance(n, v, rho);
    bool measured = dot(n, light) > 0.0 && dot(n, v) > 0.0;
    if (drawn == ERROR) {
        float error = 3.14159265 * luminance(other - radiance(n, v, rho)) / max(luminance(rho), 1e-6);
        result = vec4(measured ? error_color(error) : not_measured, 1.0);
        return;
    }
    vec3 asked = drawn == RADIANCE ? radiance(n, v, rho) : drawn == OTHER ? other : drawn == NORMAL ? n : drawn == VIEW ? v : rho;
    result = vec4(asked, measured ? 1.0 : 0.0);
}
