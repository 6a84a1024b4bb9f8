# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of operations on numbers and triples that input nodes are made of: their reference and their GLSL. No bpy.

Python is the reference: the value that Cycles computes (intern/cycles/kernel/svm/math_util.h, color_util.h and node_*.h), zero
where a result is not defined. USD composes operations of MaterialX's standard nodes; glTF holds none but products.
"""

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from ..models.color import LUMINANCE
from . import textures

type Triple = tuple[float, float, float]
type Value = float | Triple
type Kind = Literal["number", "triple"]


class Operation(NamedTuple):
    """One operation.

    kind: of the result; empty where the operation works by components, on numbers and triples in any mixture.
    python: of numbers where kind is empty, else of what the operation takes.
    glsl: with {0}, {1} for the arguments; functions are those of shaders/nodes/STEM.glsl.
    """

    kind: Kind | Literal[""]
    python: Callable[..., Any]
    glsl: str
    stem: str = ""


def broadcast(function: Callable[..., float], *values: Value) -> Value:
    """Return `function` by components; a number counts for each component."""
    if not any(isinstance(value, tuple) for value in values):
        return function(*values)
    first, second, third = (function(*(value[i] if isinstance(value, tuple) else value for value in values)) for i in range(3))
    return first, second, third


FLT_EPSILON = 1.1920929e-7
LARGEST = 3.4028235e38  # of a 32-bit float; Python raises where Cycles has infinity


def _bounded(function: Callable[[float], float]) -> Callable[[float], float]:
    """Return a growing `function` as one that gives the largest 32-bit float where its value is beyond."""

    def value(a: float) -> float:
        try:
            return min(max(function(a), -LARGEST), LARGEST)
        except OverflowError:
            return math.copysign(LARGEST, a)

    return value


def divide(a: float, b: float) -> float:
    """Return a / b, 0 where b is 0."""
    return a / b if b != 0.0 else 0.0


def power(a: float, b: float) -> float:
    """Return a^b, 0 where it is not a real number."""
    if a < 0.0 and b != int(b):
        return 0.0
    try:
        return math.pow(a, b)
    except OverflowError:
        return LARGEST
    except ValueError:  # 0 to a negative power
        return 0.0


def gamma(a: float, exponent: float) -> float:
    """Return a^exponent where a is positive, else a; 1 where the exponent is 0."""
    if exponent == 0.0:
        return 1.0
    return power(a, exponent) if a > 0.0 else a


def logarithm(a: float, b: float) -> float:
    """Return the logarithm of a to base b, 0 where it is not defined."""
    return divide(math.log(a), math.log(b)) if a > 0.0 and b > 0.0 else 0.0


def modulo(a: float, b: float) -> float:
    """Return the rest of a / b with the sign of a, 0 where b is 0."""
    return math.fmod(a, b) if b != 0.0 else 0.0


def floored_modulo(a: float, b: float) -> float:
    """Return the rest of a / b with the sign of b, 0 where b is 0."""
    return a - math.floor(a / b) * b if b != 0.0 else 0.0


def wrap(value: float, high: float, low: float) -> float:
    """Return `value` repeated in [low, high)."""
    span = high - low
    return value - span * math.floor((value - low) / span) if span != 0.0 else low


def ping_pong(a: float, b: float) -> float:
    """Return `a` reflected back and forth between 0 and b."""
    return abs((a - b) / (b * 2.0) % 1.0 * b * 2.0 - b) if b != 0.0 else 0.0


def smooth_minimum(a: float, b: float, k: float) -> float:
    """Return the minimum of a and b, rounded within a distance k."""
    if k == 0.0:
        return min(a, b)
    h = max(k - abs(a - b), 0.0) / k
    return min(a, b) - h * h * h * k / 6.0


def sign(a: float) -> float:
    """Return -1, 0 or 1."""
    return float((a > 0.0) - (a < 0.0))


def smooth_step(a: float, b: float, x: float) -> float:
    """Return Hermite's cubic step of x from a to b."""
    t = min(max(divide(x - a, b - a), 0.0), 1.0)
    return (3.0 - 2.0 * t) * t * t


def smoother_step(a: float, b: float, x: float) -> float:
    """Return Perlin's step of order 5 of x from a to b."""
    t = min(max(divide(x - a, b - a), 0.0), 1.0)
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0)


def overlay(a: float, b: float, t: float) -> float:
    """Return the blend mode Overlay of a and b by the factor t."""
    return a * (1.0 - t + 2.0 * t * b) if a < 0.5 else 1.0 - (1.0 - t + 2.0 * t * (1.0 - b)) * (1.0 - a)


def color_divide(a: float, b: float, t: float) -> float:
    """Return the blend mode Divide."""
    return (1.0 - t) * a + t * a / b if b != 0.0 else a


def dodge(a: float, b: float, t: float) -> float:
    """Return the blend mode Color Dodge."""
    if a == 0.0:
        return 0.0
    rest = 1.0 - t * b
    return min(a / rest, 1.0) if rest > 0.0 else 1.0


def burn(a: float, b: float, t: float) -> float:
    """Return the blend mode Color Burn."""
    rest = 1.0 - t + t * b
    return min(max(1.0 - (1.0 - a) / rest, 0.0), 1.0) if rest > 0.0 else 0.0


def _hue(color: Triple) -> float:
    """Return the hue of a color, 0 to 1, 0 where it is gray."""
    (red, green, blue), high, low = color, max(color), min(color)
    if high == low:
        return 0.0
    around = (green - blue, 0.0) if red == high else (blue - red, 2.0) if green == high else (red - green, 4.0)
    return (around[0] / (high - low) + around[1]) / 6.0 % 1.0


def rgb_to_hsv(color: Triple) -> Triple:
    """Return hue, saturation and value of a color."""
    high, low = max(color), min(color)
    saturation = (high - low) / high if high != 0.0 else 0.0
    return _hue(color) if saturation != 0.0 else 0.0, saturation, high


def hsv_to_rgb(hsv: Triple) -> Triple:
    """Return the color of a hue, a saturation and a value; hues outside [0, 1] are all in the last sixth."""
    hue, saturation, value = hsv
    sixth = math.floor(hue * 6.0) if hue != 1.0 else 0
    rest = hue * 6.0 - math.floor(hue * 6.0)
    p, q, t = (value * (1.0 - saturation * part) for part in (1.0, rest, 1.0 - rest))
    choices = ((value, t, p), (q, value, p), (p, value, t), (p, q, value), (t, p, value), (value, p, q))
    return choices[sixth if 0 <= sixth < 5 else 5]


def rgb_to_hsl(color: Triple) -> Triple:
    """Return hue, saturation and lightness of a color."""
    high, low = max(color), min(color)
    lightness, span = min(1.0, (high + low) / 2.0), high - low
    if span == 0.0:
        return 0.0, 0.0, lightness
    return _hue(color), divide(span, 2.0 - high - low if lightness > 0.5 else high + low), lightness


def hsl_to_rgb(hsl: Triple) -> Triple:
    """Return the color of a hue, which does not repeat, a saturation and a lightness."""
    hue, saturation, lightness = hsl
    chroma = (1.0 - abs(2.0 * lightness - 1.0)) * saturation
    ramps = (abs(hue * 6.0 - 3.0) - 1.0, 2.0 - abs(hue * 6.0 - 2.0), 2.0 - abs(hue * 6.0 - 4.0))
    red, green, blue = ((min(max(ramp, 0.0), 1.0) - 0.5) * chroma + lightness for ramp in ramps)
    return red, green, blue


def mix_hsv(parts: str) -> Callable[[Triple, Triple, float], Triple]:
    """Return the blend mode that takes from the second color those of h, s and v that are in `parts`."""

    def mixed(a: Triple, b: Triple, t: float) -> Triple:
        first, second = rgb_to_hsv(a), rgb_to_hsv(b)
        if ("h" in parts and second[1] == 0.0) or (parts == "s" and first[1] == 0.0):
            return a
        if parts in "sv":
            h, s, v = (x + t * (y - x) if name in parts else x for name, x, y in zip("hsv", first, second, strict=True))
            return hsv_to_rgb((h, s, v))
        h, s, v = (y if name in parts else x for name, x, y in zip("hsv", first, second, strict=True))
        red, green, blue = (x + t * (y - x) for x, y in zip(a, hsv_to_rgb((h, s, v)), strict=True))
        return red, green, blue

    return mixed


def dot(a: Triple, b: Triple) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Triple, b: Triple) -> Triple:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def normalize(a: Triple) -> Triple:
    """Return the unit vector along a, 0 where a is."""
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length != 0.0 else (0.0, 0.0, 0.0)


def scale(a: Triple, factor: float) -> Triple:
    """Return a times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def project(a: Triple, b: Triple) -> Triple:
    """Return the part of a along b."""
    return scale(b, divide(dot(a, b), dot(b, b)))


def reflect(a: Triple, b: Triple) -> Triple:
    """Return a reflected at the plane whose normal is along b."""
    n = normalize(b)
    x, y, z = (c - 2.0 * dot(n, a) * d for c, d in zip(a, n, strict=True))
    return x, y, z


def refract(a: Triple, b: Triple, eta: float) -> Triple:
    """Return a refracted at the plane whose normal is along b, by the ratio eta of indices; 0 at total reflection."""
    n = normalize(b)
    cosine = dot(n, a)
    k = 1.0 - eta * eta * (1.0 - cosine * cosine)
    if k < 0.0:
        return 0.0, 0.0, 0.0
    x, y, z = (eta * c - (eta * cosine + math.sqrt(k)) * d for c, d in zip(a, n, strict=True))
    return x, y, z


def fresnel(cosine: float, ior: float) -> float:
    """Return the reflectance of a dielectric of relative index `ior` at an angle of that cosine, unpolarized."""
    c = abs(cosine)
    g = ior * ior - 1.0 + c * c
    if g <= 0.0:
        return 1.0
    g = math.sqrt(g)
    a, b = (g - c) / (g + c), divide(c * (g + c) - 1.0, c * (g - c) + 1.0)
    return 0.5 * a * a * (1.0 + b * b)


def _rotated(vector: Triple, angles: Triple) -> Triple:
    """Return `vector` turned around x, then y, then z by angles in radians."""
    x, y, z = vector
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(angle), math.cos(angle)) for angle in angles)
    y, z = cx * y - sx * z, sx * y + cx * z
    x, z = cy * x + sy * z, -sy * x + cy * z
    return cz * x - sz * y, sz * x + cz * y, z


def _rotated_back(vector: Triple, angles: Triple) -> Triple:
    """Return the inverse of `_rotated`."""
    x, y, z = vector
    (sx, cx), (sy, cy), (sz, cz) = ((-math.sin(angle), math.cos(angle)) for angle in angles)
    x, y = cz * x - sz * y, sz * x + cz * y
    x, z = cy * x + sy * z, -sy * x + cy * z
    return x, cx * y - sx * z, sx * y + cx * z


def _rotated_about(vector: Triple, axis: Triple, angle: float) -> Triple:
    """Return `vector` turned around an axis by an angle in radians, by Rodrigues' formula; as it is where there is no axis."""
    n = normalize(axis)
    if not any(n):
        return vector
    sine, cosine = math.sin(angle), math.cos(angle)
    along, across = dot(n, vector) * (1.0 - cosine), cross(n, vector)
    x, y, z = (v * cosine + c * sine + a * along for v, c, a in zip(vector, across, n, strict=True))
    return x, y, z


MATH = "math"  # shaders/nodes/math.glsl
COLORS = "color"  # shaders/nodes/color.glsl


class Operations(dict[str, Operation]):
    """Operations by name. Those of textures, as many as their menus allow, are made when they are first asked for."""

    def __missing__(self, name: str) -> Operation:
        self[name] = Operation(*textures.operation(name))
        return self[name]


OPERATIONS = Operations()
OPERATIONS |= {
    # by components
    "add": Operation("", lambda a, b: a + b, "({0} + {1})"),
    "subtract": Operation("", lambda a, b: a - b, "({0} - {1})"),
    "multiply": Operation("", lambda a, b: a * b, "({0} * {1})"),
    "divide": Operation("", divide, "safe_divide({0}, {1})", MATH),
    "power": Operation("", power, "safe_power({0}, {1})", MATH),
    "gamma": Operation("", gamma, "gamma({0}, {1})", COLORS),
    "logarithm": Operation("", logarithm, "safe_logarithm({0}, {1})", MATH),
    "sqrt": Operation("", lambda a: math.sqrt(max(a, 0.0)), "sqrt(max({0}, 0.0))"),
    "inverse_sqrt": Operation("", lambda a: 1.0 / math.sqrt(a) if a > 0.0 else 0.0, "safe_inverse_sqrt({0})", MATH),
    "absolute": Operation("", abs, "abs({0})"),
    "exponent": Operation("", _bounded(math.exp), "exp({0})"),
    "minimum": Operation("", min, "min({0}, {1})"),
    "maximum": Operation("", max, "max({0}, {1})"),
    "less_than": Operation("", lambda a, b: float(a < b), "less_than({0}, {1})", MATH),
    "greater_than": Operation("", lambda a, b: float(a > b), "greater_than({0}, {1})", MATH),
    "sign": Operation("", sign, "sign({0})"),
    "compare": Operation("", lambda a, b, c: float(abs(a - b) <= max(c, FLT_EPSILON)), "compare({0}, {1}, {2})", MATH),
    "smooth_minimum": Operation("", smooth_minimum, "smooth_minimum({0}, {1}, {2})", MATH),
    "smooth_maximum": Operation("", lambda a, b, c: -smooth_minimum(-a, -b, c), "(-smooth_minimum(-({0}), -({1}), {2}))", MATH),
    "round": Operation("", lambda a: float(math.floor(a + 0.5)), "floor(({0}) + 0.5)"),
    "floor": Operation("", lambda a: float(math.floor(a)), "floor({0})"),
    "ceiling": Operation("", lambda a: float(math.ceil(a)), "ceil({0})"),
    "truncate": Operation("", lambda a: float(math.trunc(a)), "trunc({0})"),
    "fraction": Operation("", lambda a: a - math.floor(a), "fract({0})"),
    "modulo": Operation("", modulo, "safe_modulo({0}, {1})", MATH),
    "floored_modulo": Operation("", floored_modulo, "floored_modulo({0}, {1})", MATH),
    "wrap": Operation("", wrap, "wrap({0}, {1}, {2})", MATH),
    "snap": Operation("", lambda a, b: math.floor(divide(a, b)) * b, "(floor(safe_divide({0}, {1})) * {1})", MATH),
    "ping_pong": Operation("", ping_pong, "ping_pong({0}, {1})", MATH),
    "sine": Operation("", math.sin, "sin({0})"),
    "cosine": Operation("", math.cos, "cos({0})"),
    "tangent": Operation("", math.tan, "tan({0})"),
    "arcsine": Operation("", lambda a: math.asin(min(max(a, -1.0), 1.0)), "arcsine({0})", MATH),
    "arccosine": Operation("", lambda a: math.acos(min(max(a, -1.0), 1.0)), "arccosine({0})", MATH),
    "arctangent": Operation("", math.atan, "atan({0})"),
    "arctangent2": Operation("", math.atan2, "safe_arctangent2({0}, {1})", MATH),
    "hyperbolic_sine": Operation("", _bounded(math.sinh), "sinh({0})"),
    "hyperbolic_cosine": Operation("", lambda a: _bounded(math.cosh)(abs(a)), "cosh({0})"),
    "hyperbolic_tangent": Operation("", math.tanh, "tanh({0})"),
    "radians": Operation("", math.radians, "radians({0})"),
    "degrees": Operation("", math.degrees, "degrees({0})"),
    "clamp": Operation("", lambda a, low, high: min(max(a, low), high), "min(max({0}, {1}), {2})"),
    "mix": Operation("", lambda a, b, t: a + (b - a) * t, "mix({0}, {1}, {2})"),
    "smooth_step": Operation("", smooth_step, "smooth_step({0}, {1}, {2})", MATH),
    "smoother_step": Operation("", smoother_step, "smoother_step({0}, {1}, {2})", MATH),
    "overlay": Operation("", overlay, "overlay({0}, {1}, {2})", COLORS),
    "color_divide": Operation("", color_divide, "color_divide({0}, {1}, {2})", COLORS),
    "dodge": Operation("", dodge, "dodge({0}, {1}, {2})", COLORS),
    "burn": Operation("", burn, "burn({0}, {1}, {2})", COLORS),
    # triples to numbers and back
    "combine": Operation("triple", lambda x, y, z: (x, y, z), "vec3({0}, {1}, {2})"),
    "x": Operation("number", lambda a: a[0], "({0}).x"),
    "y": Operation("number", lambda a: a[1], "({0}).y"),
    "z": Operation("number", lambda a: a[2], "({0}).z"),
    "luminance": Operation("number", lambda a: dot(a, LUMINANCE), f"dot({{0}}, vec3{LUMINANCE})"),
    "average": Operation("number", lambda a: (a[0] + a[1] + a[2]) / 3.0, "dot({0}, vec3(1.0 / 3.0))"),
    "dot": Operation("number", dot, "dot({0}, {1})"),
    "length": Operation("number", lambda a: math.sqrt(dot(a, a)), "length({0})"),
    "distance": Operation("number", math.dist, "distance({0}, {1})"),
    # vectors
    "cross": Operation("triple", cross, "cross({0}, {1})"),
    "normalize": Operation("triple", normalize, "safe_normalize({0})", MATH),
    "project": Operation("triple", project, "project({0}, {1})", MATH),
    "reflect": Operation("triple", reflect, "reflect({0}, safe_normalize({1}))", MATH),
    "refract": Operation("triple", refract, "refract({0}, safe_normalize({1}), {2})", MATH),
    "face_forward": Operation(
        "triple", lambda a, b, c: a if dot(b, c) < 0.0 else scale(a, -1.0), "(dot({1}, {2}) < 0.0 ? ({0}) : -({0}))"
    ),
    "rotate": Operation("triple", _rotated, "rotated({0}, {1})", MATH),
    "rotate_back": Operation("triple", _rotated_back, "rotated_back({0}, {1})", MATH),
    "rotate_about": Operation("triple", _rotated_about, "rotated_about({0}, {1}, {2})", MATH),
    # colors
    "rgb_to_hsv": Operation("triple", rgb_to_hsv, "rgb_to_hsv({0})", COLORS),
    "hsv_to_rgb": Operation("triple", hsv_to_rgb, "hsv_to_rgb({0})", COLORS),
    "rgb_to_hsl": Operation("triple", rgb_to_hsl, "rgb_to_hsl({0})", COLORS),
    "hsl_to_rgb": Operation("triple", hsl_to_rgb, "hsl_to_rgb({0})", COLORS),
    "mix_hue": Operation("triple", mix_hsv("h"), "mix_hue({0}, {1}, {2})", COLORS),
    "mix_saturation": Operation("triple", mix_hsv("s"), "mix_saturation({0}, {1}, {2})", COLORS),
    "mix_value": Operation("triple", mix_hsv("v"), "mix_value({0}, {1}, {2})", COLORS),
    "mix_color": Operation("triple", mix_hsv("hs"), "mix_color({0}, {1}, {2})", COLORS),
    # light
    "fresnel": Operation("number", fresnel, "fresnel({0}, {1})", MATH),
}
