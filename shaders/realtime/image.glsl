// SPDX-License-Identifier: GPL-3.0-or-later
// Image textures as Cycles samples them: color is filtered multiplied by its alpha, and bytes of sRGB before they are decoded.
//     extension: 0 repeat, 1 extend, 2 clip, 3 mirror
//     storage: sum of 1 where the driver decodes bytes of sRGB, and 2 where it holds color that is not multiplied by its alpha

vec3 srgb_encoded(vec3 color)
{
    vec3 high = 1.055 * pow(max(color, 0.0), vec3(1.0 / 2.4)) - 0.055;
    return mix(color * 12.92, high, greaterThan(color, vec3(0.0031308)));
}

vec3 srgb_decoded(vec3 color)
{
    vec3 high = pow((max(color, 0.0) + 0.055) / 1.055, vec3(2.4));
    return mix(color / 12.92, high, greaterThan(color, vec3(0.04045)));
}

// Returns the texel of a row or column of `size` texels that stands for `texel`, any number; -1 for none.
int image_wrapped(int texel, int size, int extension)
{
    if (extension == 1) {
        return clamp(texel, 0, size - 1);
    }
    if (extension == 2) {
        return texel >= 0 && texel < size ? texel : -1;
    }
    int period = extension == 3 ? 2 * size : size;
    int rest = texel - period * int(floor(float(texel) / float(period)));
    rest = clamp(rest, 0, period - 1);
    return rest < size ? rest : period - 1 - rest;
}

// Returns a texel as it is filtered.
vec4 image_texel(sampler2D image, ivec2 texel, ivec2 size, int extension, int storage)
{
    ivec2 wrapped = ivec2(image_wrapped(texel.x, size.x, extension), image_wrapped(texel.y, size.y, extension));
    if (wrapped.x < 0 || wrapped.y < 0) {
        return vec4(0.0);
    }
    vec4 color = texelFetch(image, wrapped, 0);
    if ((storage & 1) != 0) {
        color.rgb = srgb_encoded(color.rgb);
    }
    if ((storage & 2) != 0) {
        color.rgb *= color.a;
    }
    return color;
}

// Returns the texel that a place is in, as its corner and the place in it; places too far away to tell texels apart are 0.
ivec2 image_corner(vec2 texels, out vec2 rest)
{
    vec2 near = mix(texels, vec2(0.0), greaterThan(abs(texels), vec2(1e9)));
    vec2 corner = floor(near);
    rest = near - corner;
    return ivec2(corner);
}

vec4 image_closest(sampler2D image, vec2 uv, int extension, int storage)
{
    ivec2 size = textureSize(image, 0);
    vec2 rest;
    return image_texel(image, image_corner(uv * vec2(size), rest), size, extension, storage);
}

vec4 image_linear(sampler2D image, vec2 uv, int extension, int storage)
{
    ivec2 size = textureSize(image, 0);
    vec2 rest;
    ivec2 low = image_corner(uv * vec2(size) - 0.5, rest);
    vec4 bottom = mix(image_texel(image, low, size, extension, storage),
        image_texel(image, low + ivec2(1, 0), size, extension, storage), rest.x);
    vec4 top = mix(image_texel(image, low + ivec2(0, 1), size, extension, storage),
        image_texel(image, low + ivec2(1, 1), size, extension, storage), rest.x);
    return mix(bottom, top, rest.y);
}

// Weighs four texels in each direction by the uniform cubic B-spline.
vec4 image_cubic(sampler2D image, vec2 uv, int extension, int storage)
{
    ivec2 size = textureSize(image, 0);
    vec2 t;
    ivec2 low = image_corner(uv * vec2(size) - 0.5, t) - 1;
    vec2 weights[4];
    weights[0] = (1.0 - t) * (1.0 - t) * (1.0 - t) / 6.0;
    weights[1] = (4.0 + t * t * (3.0 * t - 6.0)) / 6.0;
    weights[2] = (1.0 + t * (3.0 + t * (3.0 - 3.0 * t))) / 6.0;
    weights[3] = t * t * t / 6.0;
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; y++) {
        for (int x = 0; x < 4; x++) {
            sum += weights[x].x * weights[y].y * image_texel(image, low + ivec2(x, y), size, extension, storage);
        }
    }
    return sum;
}

// Returns the linear color of a filtered texel: with `is_unassociated` without its alpha, decoded where `is_encoded`.
vec3 image_color(vec4 texel, bool is_unassociated, bool is_encoded)
{
    vec3 color = is_unassociated && texel.a > 0.0 && texel.a != 1.0 ? texel.rgb / texel.a : texel.rgb;
    return is_encoded ? srgb_decoded(color) : color;
}
