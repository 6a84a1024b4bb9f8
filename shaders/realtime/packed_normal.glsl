// SPDX-License-Identifier: GPL-3.0-or-later
// Unit vectors in one float: Z. Cigolle and others, "A Survey of Efficient Representations for Independent Unit Vectors" (2014).

// Returns a whole number below steps * steps, which a float holds exactly up to 4096 steps.
float packed_normal(vec3 n, float steps)
{
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z)); // the octahedron, its lower half folded outwards
    p = n.z < 0.0 ? (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0) : p;
    vec2 cell = floor((p * 0.5 + 0.5) * (steps - 1.0) + 0.5);
    return cell.x + steps * cell.y;
}

vec3 unpacked_normal(float number, float steps)
{
    float row = floor(number / steps);
    vec2 p = vec2(number - steps * row, row) / (steps - 1.0) * 2.0 - 1.0;
    float z = 1.0 - abs(p.x) - abs(p.y);
    p = z < 0.0 ? (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0) : p;
    return normalize(vec3(p, z));
}
