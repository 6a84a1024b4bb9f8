# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's nodes compute, made of the operations of `operations.py`. No bpy.

As Cycles has it (intern/cycles/kernel/svm); arguments are in the order of the node's inputs, words are the entries of its menus.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import pi, tau

from .expression import Constant, Coordinate, Expression, apply, curve
from .operations import OPERATIONS

ONE, ZERO = Constant(1.0), Constant(0.0)
TABLE_TOLERANCE = 2e-5  # of the values of curves and color ramps
SMALLEST_INDEX = 1e-5  # of refraction

# Entries of Math and Vector Math that are not the operation's name in lower case
RENAMED = {
    "SMOOTH_MIN": "smooth_minimum",
    "SMOOTH_MAX": "smooth_maximum",
    "CEIL": "ceiling",
    "TRUNC": "truncate",
    "FRACT": "fraction",
    "PINGPONG": "ping_pong",
    "ARCTAN2": "arctangent2",
    "SINH": "hyperbolic_sine",
    "COSH": "hyperbolic_cosine",
    "TANH": "hyperbolic_tangent",
    "CROSS_PRODUCT": "cross",
    "DOT_PRODUCT": "dot",
    "FACEFORWARD": "face_forward",
    "SCALE": "multiply",
}


def math(entry: str, values: Sequence[Expression], is_clamped: bool = False, label: str = "") -> Expression:
    """Return the Math or Vector Math node. Raises KeyError for an entry that is not known."""
    if entry == "MULTIPLY_ADD":
        first, second, third = values
        value = apply("add", apply("multiply", first, second, label=label), third, label=label)
    else:
        operation = RENAMED.get(entry, entry.lower())
        if operation not in OPERATIONS:
            raise KeyError(entry)
        value = apply(operation, *values, label=label)
    return saturate(value, label) if is_clamped else value


def saturate(value: Expression, label: str = "") -> Expression:
    """Return the value kept within 0 and 1."""
    return apply("clamp", value, 0.0, 1.0, label=label)


def clamp(entry: str, value: Expression, low: Expression, high: Expression, label: str = "") -> Expression:
    """Return the Clamp node."""
    if entry == "RANGE":  # in which the limits may be exchanged
        low, high = apply("minimum", low, high, label=label), apply("maximum", low, high, label=label)
    return apply("clamp", value, low, high, label=label)


def map_range(entry: str, is_clamped: bool, values: Sequence[Expression], label: str = "") -> Expression:
    """Return the Map Range node of the value, both ends of the range it comes from and of that it goes to, and if STEPPED steps."""
    value, from_low, from_high, to_low, to_high, *steps = values
    if entry == "SMOOTHSTEP":
        part = apply("smooth_step", from_low, from_high, value, label=label)
    elif entry == "SMOOTHERSTEP":
        part = apply("smoother_step", from_low, from_high, value, label=label)
    else:
        width = apply("subtract", from_high, from_low, label=label)
        part = apply("divide", apply("subtract", value, from_low, label=label), width, label=label)
        if entry == "STEPPED":
            count = apply("maximum", steps[0], 0.0, label=label)
            part = apply("floor", apply("multiply", part, apply("add", count, 1.0, label=label), label=label), label=label)
            part = apply("divide", part, count, label=label)
    span = apply("subtract", to_high, to_low, label=label)
    result = apply("add", apply("multiply", part, span, label=label), to_low, label=label)
    if value.kind == "number":  # 0 where the range is empty, in the scalar node alone
        sides = (apply(name, from_low, from_high, label=label) for name in ("less_than", "greater_than"))
        result = apply("multiply", result, apply("add", *sides, label=label), label=label)
    if is_clamped and (value.kind == "number" or entry in ("LINEAR", "STEPPED")):
        result = clamp("RANGE", result, to_low, to_high, label)
    return result


def mapping(
    entry: str, vector: Expression, location: Expression, rotation: Expression, scale: Expression, label: str = ""
) -> Expression:
    """Return the Mapping node; rotation holds angles around x, y and z in radians."""
    if entry == "TEXTURE":
        moved = apply("subtract", vector, location, label=label)
        return apply("divide", apply("rotate_back", moved, rotation, label=label), scale, label=label)
    if entry == "NORMAL":
        turned = apply("rotate", apply("divide", vector, scale, label=label), rotation, label=label)
        return apply("normalize", turned, label=label)
    turned = apply("rotate", apply("multiply", vector, scale, label=label), rotation, label=label)
    return apply("add", turned, location, label=label) if entry == "POINT" else turned


def equirectangular(direction: Expression) -> Expression:
    """Return where an environment map has a direction of any length: around from -X over -Y, and up, both from 0 to 1."""
    x, y, z = (apply(axis, direction) for axis in "xyz")
    level = apply("length", apply("combine", x, y, 0.0))
    around = apply("multiply", apply("arctangent2", y, x), -1.0 / tau)
    upwards = apply("multiply", apply("arctangent2", z, level), 1.0 / pi)
    return apply("combine", apply("add", around, 0.5), apply("add", upwards, 0.5), 0.0)


def mirror_ball(direction: Expression) -> Expression:
    """Return where a picture of a mirror ball, seen from -Y, shows a direction of any length."""
    unit = apply("normalize", direction)
    x, y, z = (apply(axis, unit) for axis in "xyz")
    width = apply("sqrt", apply("maximum", apply("multiply", apply("add", y, -1.0), -0.5), 0.0))
    place = apply("divide", apply("combine", x, 0.0, z), apply("multiply", width, 4.0))
    u, v = (apply("add", apply(axis, place), 0.5) for axis in "xz")
    return apply("combine", u, v, 0.0)


def vector_rotate(
    entry: str,
    is_inverted: bool,
    vector: Expression,
    center: Expression,
    turn: Expression,
    axis: Expression | None = None,
    label: str = "",
) -> Expression:
    """Return the Vector Rotate node: `turn` holds the angles around x, y and z for EULER_XYZ, else an angle."""
    arm = apply("subtract", vector, center, label=label)
    if entry == "EULER_XYZ":
        arm = apply("rotate_back" if is_inverted else "rotate", arm, turn, label=label)
    else:
        angle = apply("multiply", turn, -1.0, label=label) if is_inverted else turn
        if entry == "AXIS_ANGLE":
            arm = apply("rotate_about", arm, axis or ZERO, angle, label=label)
        else:
            angles = [angle if name == entry[0] else ZERO for name in "XYZ"]
            arm = apply("rotate", arm, apply("combine", *angles, label=label), label=label)
    return apply("add", arm, center, label=label)


def mix(factor: Expression, first: Expression, second: Expression, is_factor_clamped: bool, label: str = "") -> Expression:
    """Return the Mix node for numbers and vectors."""
    return apply("mix", first, second, saturate(factor, label) if is_factor_clamped else factor, label=label)


def blend(
    entry: str,
    factor: Expression,
    a: Expression,
    b: Expression,
    is_factor_clamped: bool,
    is_result_clamped: bool,
    label: str = "",
) -> Expression:
    """Return the Mix node for colors with a blending mode."""

    def op(operation: str, *arguments: Expression | float) -> Expression:
        return apply(operation, *arguments, label=label)

    def inverse(color: Expression) -> Expression:
        return op("subtract", 1.0, color)

    def screen() -> Expression:
        return inverse(op("multiply", inverse(a), inverse(b)))

    t = saturate(factor, label) if is_factor_clamped else factor
    direct = {
        "OVERLAY": "overlay",
        "DIVIDE": "color_divide",
        "DODGE": "dodge",
        "BURN": "burn",
        "HUE": "mix_hue",
        "SATURATION": "mix_saturation",
        "VALUE": "mix_value",
        "COLOR": "mix_color",
    }
    if entry in direct:
        result = op(direct[entry], a, b, t)
    else:
        match entry:
            case "MIX":
                full = b
            case "ADD":
                full = op("add", a, b)
            case "MULTIPLY":
                full = op("multiply", a, b)
            case "SUBTRACT":
                full = op("subtract", a, b)
            case "DIFFERENCE":
                full = op("absolute", op("subtract", a, b))
            case "DARKEN":
                full = op("minimum", a, b)
            case "LIGHTEN":
                full = op("maximum", a, b)
            case "SCREEN":
                full = screen()
            case "SOFT_LIGHT":
                full = op("multiply", a, op("add", op("multiply", inverse(a), b), screen()))
            case "LINEAR_LIGHT":
                full = op("add", a, op("add", op("multiply", b, 2.0), -1.0))
            case "EXCLUSION":
                full = op("subtract", op("add", a, b), op("multiply", op("multiply", a, b), 2.0))
            case _:
                raise KeyError(entry)
        result = op("mix", a, full, t)
        if entry == "EXCLUSION":
            result = op("maximum", result, 0.0)
    return saturate(result, label) if is_result_clamped else result


def separate_color(entry: str, color: Expression, index: int, label: str = "") -> Expression:
    """Return an output of the Separate Color node."""
    converted = color if entry == "RGB" else apply(f"rgb_to_{entry.lower()}", color, label=label)
    return apply("xyz"[index], converted, label=label)


def combine_color(entry: str, components: Sequence[Expression], label: str = "") -> Expression:
    """Return the Combine Color node."""
    combined = apply("combine", *components, label=label)
    return combined if entry == "RGB" else apply(f"{entry.lower()}_to_rgb", combined, label=label)


def brightness_contrast(color: Expression, brightness: Expression, contrast: Expression, label: str = "") -> Expression:
    """Return the Brightness/Contrast node."""
    slope = apply("add", contrast, 1.0, label=label)
    offset = apply("subtract", brightness, apply("multiply", contrast, 0.5, label=label), label=label)
    return apply("maximum", apply("add", apply("multiply", color, slope, label=label), offset, label=label), 0.0, label=label)


def hue_saturation(
    hue: Expression, saturation: Expression, value: Expression, factor: Expression, color: Expression, label: str = ""
) -> Expression:
    """Return the Hue/Saturation/Value node."""
    hsv = apply("rgb_to_hsv", color, label=label)
    h, s, v = (apply(name, hsv, label=label) for name in "xyz")
    turned = apply("fraction", apply("add", apply("add", h, hue, label=label), 0.5, label=label), label=label)
    scaled = saturate(apply("multiply", s, saturation, label=label), label)
    changed = apply("combine", turned, scaled, apply("multiply", v, value, label=label), label=label)
    mixed = apply("mix", color, apply("hsv_to_rgb", changed, label=label), factor, label=label)
    return apply("maximum", mixed, 0.0, label=label)


def invert(factor: Expression, color: Expression, label: str = "") -> Expression:
    """Return the Invert Color node."""
    return apply("mix", color, apply("subtract", 1.0, color, label=label), factor, label=label)


def fresnel(index: Expression, normal: Expression, label: str = "") -> Expression:
    """Return the Fresnel node; on the back light comes from inside the medium."""
    index = apply("maximum", index, SMALLEST_INDEX, label=label)
    inverse = apply("divide", 1.0, index, label=label)
    return _fresnel(index, inverse, normal, label)


def layer_weight_fresnel(weight: Expression, normal: Expression, label: str = "") -> Expression:
    """Return the output Fresnel of the Layer Weight node."""
    inverse = apply("maximum", apply("subtract", 1.0, weight, label=label), SMALLEST_INDEX, label=label)
    return _fresnel(apply("divide", 1.0, inverse, label=label), inverse, normal, label)


def _fresnel(index: Expression, inverse: Expression, normal: Expression, label: str) -> Expression:
    relative = apply("mix", index, inverse, Coordinate("backfacing"), label=label)
    return apply("fresnel", apply("dot", Coordinate("incoming"), normal, label=label), relative, label=label)


def facing(weight: Expression, normal: Expression, label: str = "") -> Expression:
    """Return the output Facing of the Layer Weight node."""
    cosine = apply("absolute", apply("dot", Coordinate("incoming"), normal, label=label), label=label)
    weight = apply("clamp", weight, 0.0, 1.0 - 1e-5, label=label)
    low = apply("multiply", weight, 2.0, label=label)
    high = apply("divide", 0.5, apply("subtract", 1.0, weight, label=label), label=label)
    exponent = apply("mix", high, low, apply("less_than", weight, 0.5, label=label), label=label)
    bent = cosine if exponent == ONE else apply("power", cosine, exponent, label=label)
    return apply("subtract", 1.0, bent, label=label)


def normal_dot(direction: Expression, vector: Expression, label: str = "") -> Expression:
    """Return the output Dot of the Normal node."""
    return apply("dot", apply("normalize", vector, label=label), apply("normalize", direction), label=label)


def table(
    values: Sequence[float],
    argument: Expression,
    low: float = 0.0,
    high: float = 1.0,
    is_stepped: bool = False,
    is_extended: bool = False,
    label: str = "",
) -> Expression:
    """Return a function given by its values at even distances from `low` to `high`, with the fewest points that keep it."""
    last = len(values) - 1
    points = [(low + (high - low) * i / last, value) for i, value in enumerate(values)]
    if is_stepped:
        kept = [points[0], *(point for before, point in pairwise(points) if point[1] != before[1])]
    elif is_extended and any(abs(y - x) > TABLE_TOLERANCE for x, y in points):  # its ends give the slopes outside
        kept = [points[0], *_fewest(points[1:-1]), points[-1]]
    elif is_extended:
        kept = [(low, low), (high, high)]
    else:
        kept = _fewest(points)
    return curve(tuple(kept), argument, is_stepped, is_extended, label)


def _fewest(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return those of `points` whose connecting lines pass all others within TABLE_TOLERANCE, each line as long as it can be."""
    kept, start = [points[0]], 0
    while start < len(points) - 1:
        x0, y0 = points[start]
        lowest, highest, end = float("-inf"), float("inf"), start + 1
        for i in range(start + 1, len(points)):
            x, y = points[i]
            slope, margin = (y - y0) / (x - x0), TABLE_TOLERANCE / (x - x0)
            if lowest <= slope <= highest:
                end = i
            lowest, highest = max(lowest, slope - margin), min(highest, slope + margin)
            if lowest > highest:
                break
        kept.append(points[end])
        start = end
    return kept
