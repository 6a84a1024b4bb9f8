# SPDX-License-Identifier: GPL-3.0-or-later
"""The operations of material/operations.py as compositions of MaterialX's standard nodes. What is in none of the tables here,
MaterialX does not have.

`rotate3d` is not used: its sense differs between MaterialX's GLSL and OSL. GLSL computes both sides of a choice, so what would not
be defined on the side that is not chosen is kept from it. The GLSL has constants with six decimals.
"""

import math
from collections.abc import Callable

from .network import COLOR, FLOAT, VECTOR3
from .terms import Term, combined

# Operations by components that have nodes for triples, too


def _clamp(a: Term, low: Term, high: Term) -> Term:
    return a.maximum(low).minimum(high)


def _mix(a: Term, b: Term, t: Term) -> Term:
    kind = next((term.type for term in (a, b, t) if term.type != FLOAT), FLOAT)
    return a.converted(kind).mixed(b.converted(kind), t)


BY_TYPE: dict[str, Callable[..., Term]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "absolute": lambda a: a.node("absval"),
    "minimum": Term.minimum,
    "maximum": Term.maximum,
    "sign": lambda a: a.node("sign"),
    "floor": lambda a: a.node("floor"),
    "ceiling": lambda a: a.node("ceil"),
    "fraction": lambda a: a.node("fract"),
    "round": lambda a: (a + 0.5).node("floor"),
    "truncate": lambda a: _truncated(a),
    "clamp": _clamp,
    "radians": lambda a: a * (math.pi / 180.0),
    "degrees": lambda a: a * (180.0 / math.pi),
    "mix": _mix,
}


# Operations on floats; triples are taken apart


def _divide(a: Term, b: Term) -> Term:
    if b.constant is not None:
        return a / b if b.constant else a.make(0.0)
    return b.equal(0.0, 0.0, a / b)


def _power(a: Term, b: Term) -> Term:
    if b.constant == 0.0:
        return a.make(1.0)
    if b.constant == 2.0:
        return a * a
    raised = a.equal(0.0, 1.0, a.node("absval")).node("power", b)
    if b.constant is None:
        odd = 1.0 - (b.node("absval").node("modulo", 2.0)) * 2.0
        negative = b.equal(b.node("floor"), raised * odd, 0.0)
        return a.equal(0.0, b.equal(0.0, 1.0, 0.0), a.above(0.0, raised, negative))
    if b.constant != math.floor(b.constant):
        return a.above(0.0, raised, 0.0)
    if b.constant % 2.0:
        return raised * a.node("sign")
    return a.equal(0.0, 0.0, raised)


def _gamma(a: Term, exponent: Term) -> Term:
    raised = _positive(a).node("power", exponent)
    return exponent.equal(0.0, 1.0, a.above(0.0, raised, a))


def _positive(a: Term) -> Term:
    """Return a number where it is above 0, else 1."""
    return a.above(0.0, a, 1.0)


def _logarithm(a: Term, b: Term) -> Term:
    quotient = _divide(_positive(a).node("ln"), _positive(b).node("ln"))
    return a.above(0.0, b.above(0.0, quotient, 0.0), 0.0)


def _truncated(a: Term) -> Term:
    return a.node("absval").node("floor") * a.node("sign")


def _modulo(a: Term, b: Term) -> Term:
    return b.equal(0.0, 0.0, a - b * _truncated(_divide(a, b)))


def _floored_modulo(a: Term, b: Term) -> Term:
    return b.equal(0.0, 0.0, a - b * _divide(a, b).node("floor"))


def _wrap(value: Term, high: Term, low: Term) -> Term:
    span = high - low
    return span.equal(0.0, low, value - span * _divide(value - low, span).node("floor"))


def _ping_pong(a: Term, b: Term) -> Term:
    twice = b * 2.0
    return b.equal(0.0, 0.0, (_divide(a - b, twice).node("fract") * twice - b).node("absval"))


def _smooth_minimum(a: Term, b: Term, k: Term) -> Term:
    h = _divide((k - (a - b).node("absval")).maximum(0.0), k)
    return a.minimum(b) - h * h * h * k * (1.0 / 6.0)


def _step(a: Term, b: Term, x: Term) -> Term:
    return _divide(x - a, b - a).clamped()


def _smooth_step(a: Term, b: Term, x: Term) -> Term:
    t = _step(a, b, x)
    return (3.0 - t * 2.0) * t * t


def _smoother_step(a: Term, b: Term, x: Term) -> Term:
    t = _step(a, b, x)
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0)


def _overlay(a: Term, b: Term, t: Term) -> Term:
    low = a * (1.0 - t + t * b * 2.0)
    high = 1.0 - (1.0 - t + t * (1.0 - b) * 2.0) * (1.0 - a)
    return a.make(0.5).above(a, low, high)


def _color_divide(a: Term, b: Term, t: Term) -> Term:
    return b.equal(0.0, a, a * (1.0 - t) + _divide(a * t, b))


def _dodge(a: Term, b: Term, t: Term) -> Term:
    rest = 1.0 - t * b
    return a.equal(0.0, 0.0, rest.above(0.0, _divide(a, rest).minimum(1.0), 1.0))


def _burn(a: Term, b: Term, t: Term) -> Term:
    rest = 1.0 - t + t * b
    return rest.above(0.0, (1.0 - _divide(1.0 - a, rest)).clamped(), 0.0)


def _clipped(a: Term) -> Term:
    return a.maximum(-1.0).minimum(1.0)


def _beside(a: Term) -> Term:
    """Return the cosine of an angle by its sine, or the sine by the cosine."""
    clipped = _clipped(a)
    return ((clipped + 1.0) * (1.0 - clipped)).node("sqrt")


def _exponentials(a: Term) -> tuple[Term, Term]:
    return a.node("exp"), (-a).node("exp")


def _hyperbolic_sine(a: Term) -> Term:
    up, down = _exponentials(a)
    return (up - down) * 0.5


def _hyperbolic_cosine(a: Term) -> Term:
    up, down = _exponentials(a)
    return (up + down) * 0.5


def _hyperbolic_tangent(a: Term) -> Term:
    return 1.0 - 2.0 / ((a * 2.0).minimum(80.0).node("exp") + 1.0)


def _fresnel(cosine: Term, ior: Term) -> Term:
    c = cosine.node("absval")
    squared = ior * ior - 1.0 + c * c
    g = squared.maximum(0.0).node("sqrt")
    a = _divide(g - c, g + c)
    b = _divide(c * (g + c) - 1.0, c * (g - c) + 1.0)
    return squared.above(0.0, a * a * (b * b + 1.0) * 0.5, 1.0)


COMPOSITIONS: dict[str, Callable[..., Term]] = {
    "divide": _divide,
    "power": _power,
    "gamma": _gamma,
    "logarithm": _logarithm,
    "sqrt": lambda a: a.maximum(0.0).node("sqrt"),
    "inverse_sqrt": lambda a: a.above(0.0, 1.0 / _positive(a).node("sqrt"), 0.0),
    "exponent": lambda a: a.node("exp"),
    "less_than": lambda a, b: b.above(a, 1.0, 0.0),
    "greater_than": lambda a, b: a.above(b, 1.0, 0.0),
    "compare": lambda a, b, c: c.maximum(1e-5).at_least((a - b).node("absval"), 1.0, 0.0),
    "smooth_minimum": _smooth_minimum,
    "smooth_maximum": lambda a, b, k: -_smooth_minimum(-a, -b, k),
    "modulo": _modulo,
    "floored_modulo": _floored_modulo,
    "wrap": _wrap,
    "snap": lambda a, b: _divide(a, b).node("floor") * b,
    "ping_pong": _ping_pong,
    "sine": lambda a: a.node("sin"),
    "cosine": lambda a: a.node("cos"),
    "tangent": lambda a: a.node("tan"),
    "arcsine": lambda a: _clipped(a).node("atan2", _beside(a)),  # drivers' own asin and acos are off by 3e-4
    "arccosine": lambda a: _beside(a).node("atan2", _clipped(a)),
    "arctangent": lambda a: a.node("atan2", 1.0),
    "arctangent2": lambda a, b: a.equal(0.0, b.at_least(0.0, 0.0, math.pi), a.node("atan2", b)),
    "hyperbolic_sine": _hyperbolic_sine,
    "hyperbolic_cosine": _hyperbolic_cosine,
    "hyperbolic_tangent": _hyperbolic_tangent,
    "smooth_step": _smooth_step,
    "smoother_step": _smoother_step,
    "overlay": _overlay,
    "color_divide": _color_divide,
    "dodge": _dodge,
    "burn": _burn,
    "fresnel": _fresnel,
}


# Operations on vectors


def _project(a: Term, b: Term) -> Term:
    return b * _divide(a.dot(b), b.dot(b))


def _reflect(a: Term, b: Term) -> Term:
    n = b.unit()
    return a - n * (n.dot(a) * 2.0)


def _refract(a: Term, b: Term, eta: Term) -> Term:
    n = b.unit()
    cosine = n.dot(a)
    k = 1.0 - eta * eta * (1.0 - cosine * cosine)
    bent = a * eta - n * (eta * cosine + k.maximum(0.0).node("sqrt"))
    return a.make(0.0).above(k, 0.0, bent)


def _turned(vector: Term, angles: Term, order: str, sense: float) -> Term:
    """Return a vector turned about the axes in `order` by angles in radians."""
    parts = {axis: vector.component(index) for index, axis in enumerate("xyz")}
    for axis in order:
        angle = angles.component("xyz".index(axis)) * sense
        sine, cosine = angle.node("sin"), angle.node("cos")
        first, second = "xyz".replace(axis, "") if axis != "y" else "zx"
        a, b = parts[first], parts[second]
        parts[first], parts[second] = a * cosine - b * sine, a * sine + b * cosine
    return combined([parts[axis] for axis in "xyz"], VECTOR3)


def _rotate_about(vector: Term, axis: Term, angle: Term) -> Term:
    n = axis.unit()
    sine, cosine = angle.node("sin"), angle.node("cos")
    turned = vector * cosine + n.cross(vector) * sine + n * (n.dot(vector) * (1.0 - cosine))
    return axis.length().above(0.0, turned, vector)


VECTORS: dict[str, Callable[..., Term]] = {
    "dot": Term.dot,
    "cross": Term.cross,
    "length": Term.length,
    "distance": lambda a, b: (a - b).length(),
    "normalize": Term.unit,
    "project": _project,
    "reflect": _reflect,
    "refract": _refract,
    "face_forward": lambda a, b, c: a.make(0.0).above(b.dot(c), a, -a),
    "rotate": lambda vector, angles: _turned(vector, angles, "xyz", 1.0),
    "rotate_back": lambda vector, angles: _turned(vector, angles, "zyx", -1.0),
    "rotate_about": _rotate_about,
}


# Operations on colors


def _to_hsv(color: Term) -> Term:
    return color.add_node("hsv", "ND_rgbtohsv_color3", COLOR, **{"in": color.value})


def _from_hsv(hue: Term, saturation: Term, value: Term) -> Term:
    """Return the color of a hue within [0, 1], a saturation and a value."""
    hsv = combined([hue, saturation, value], COLOR)
    return hsv.add_node("rgb", "ND_hsvtorgb_color3", COLOR, **{"in": hsv.value})


def _from_any_hsv(hsv: Term) -> Term:
    hue, saturation, value = _parts(hsv)
    last = ((hue * 6.0).node("fract") + 5.0) * (1.0 / 6.0)  # Cycles has other hues in the last sixth
    return _from_hsv(hue.above(1.0, last, hue.at_least(0.0, hue, last)), saturation, value)


def _parts(color: Term) -> tuple[Term, Term, Term]:
    return color.component(0), color.component(1), color.component(2)


def _to_hsl(color: Term) -> Term:
    hue, saturation, high = _parts(_to_hsv(color))
    low = high * (1.0 - saturation)
    lightness = ((high + low) * 0.5).minimum(1.0)
    span = high - low
    total = high + low
    around = total.above(1.0, 2.0 - total, total)
    return combined([hue, span.above(0.0, span / around, 0.0), lightness], COLOR)


def _from_hsl(hsl: Term) -> Term:
    hue, saturation, lightness = _parts(hsl)
    chroma = (1.0 - (lightness * 2.0 - 1.0).node("absval")) * saturation
    sixths = hue * 6.0
    ramps = (
        (sixths - 3.0).node("absval") - 1.0,
        2.0 - (sixths - 2.0).node("absval"),
        2.0 - (sixths - 4.0).node("absval"),
    )
    return combined([(ramp.clamped() - 0.5) * chroma + lightness for ramp in ramps], COLOR)


def _mix_hue(a: Term, b: Term, t: Term) -> Term:
    (_, saturation, value), (hue, other, _) = _parts(_to_hsv(a)), _parts(_to_hsv(b))
    return other.equal(0.0, a, a.mixed(_from_hsv(hue, saturation, value), t))


def _mix_saturation(a: Term, b: Term, t: Term) -> Term:
    (hue, saturation, value), (_, other, _) = _parts(_to_hsv(a)), _parts(_to_hsv(b))
    return saturation.equal(0.0, a, _from_hsv(hue, saturation + (other - saturation) * t, value))


def _mix_value(a: Term, b: Term, t: Term) -> Term:
    (hue, saturation, value), (_, _, other) = _parts(_to_hsv(a)), _parts(_to_hsv(b))
    return _from_hsv(hue, saturation, value + (other - value) * t)


def _mix_color(a: Term, b: Term, t: Term) -> Term:
    (_, _, value), (hue, saturation, _) = _parts(_to_hsv(a)), _parts(_to_hsv(b))
    return saturation.equal(0.0, a, a.mixed(_from_hsv(hue, saturation, value), t))


COLORS: dict[str, Callable[..., Term]] = {
    "rgb_to_hsv": _to_hsv,
    "hsv_to_rgb": _from_any_hsv,
    "rgb_to_hsl": _to_hsl,
    "hsl_to_rgb": _from_hsl,
    "mix_hue": _mix_hue,
    "mix_saturation": _mix_saturation,
    "mix_value": _mix_value,
    "mix_color": _mix_color,
}
