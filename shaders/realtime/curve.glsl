// SPDX-License-Identifier: GPL-3.0-or-later
// A piecewise linear function of a number, through points (x, y) of growing x.

// Returns point `index` of those that begin at number `start` of material.values.
vec2 curve_point(int start, int index)
{
    int x = start + 2 * index, y = x + 1;
    return vec2(material.values[x >> 2][x & 3], material.values[y >> 2][y & 3]);
}

// Returns the value at x of the curve through `count` points, with `is_stepped` constant from each point to the next. Outside the
// points it is constant or, with `is_extended`, straight.
float curve_value(int start, int count, float x, bool is_stepped, bool is_extended)
{
    int low = 0, high = count - 1; // the last point at or left of x is at low
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (x < curve_point(start, middle).x) {
            high = middle;
        } else {
            low = middle;
        }
    }
    vec2 left = curve_point(start, low), right = curve_point(start, high);
    if (is_stepped || count == 1) {
        return x >= right.x ? right.y : left.y;
    }
    float inside = is_extended ? x : clamp(x, left.x, right.x);
    return left.y + (right.y - left.y) * (inside - left.x) / (right.x - left.x);
}
