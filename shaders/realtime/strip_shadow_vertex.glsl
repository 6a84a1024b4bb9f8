// SPDX-License-Identifier: GPL-3.0-or-later
// A vertex of a curve's strip that faces a light.

void main()
{
    Strip here = strip_at(strip, object_matrix_of(first_object + gl_InstanceID), eye);
    gl_Position = matrix * vec4(here.center + strip.z * here.radius * here.across, 1.0);
}
