// SPDX-License-Identifier: GPL-3.0-or-later
// The depth alone is kept, of what is opaque.

in vec2 uv;

uniform bool has_image;
uniform sampler2D image;

void main()
{
    if (has_image && texture(image, uv).a < 0.5) {
        discard;
    }
}
