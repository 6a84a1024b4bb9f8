# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures as arithmetic, for targets that do not have them. No bpy.

MaterialX' fractal2d and fractal3d (1.39) are fractal Brownian motion of whole octaves, neither normalized nor distorted: here the
operations noise_value(2D, FBM, False) and noise_value(3D, FBM, False). All other noise of these dimensions is made of them.
"""

from collections.abc import Callable, Sequence
from functools import partial
from math import pi, tau

from .expression import Apply, Constant, Expression, apply, number
from .textures.magic import TURNS
from .textures.noise import away

type Formula = Callable[..., Expression]
type Operator = Callable[..., Expression]
ZERO, ONE = Constant(0.0), Constant(1.0)


class NoFormula(Exception):
    """A texture that is not made of other operations."""


def as_arithmetic(texture: Apply) -> Expression | None:
    """Return an expression of other operations that is equal but for rounding at the borders of cells; None where there is none.

    That is so of Voronoi, White Noise and Brick Texture, of noise in one or four dimensions or of a detail that varies, and of
    what fractal2d and fractal3d are.
    """
    function, _, menus = texture.operation.removesuffix(")").partition("(")
    if function not in FORMULAS or is_fractal(texture):
        return None
    try:
        return FORMULAS[function](partial(apply, label=texture.label), menus.split(", "), *texture.arguments)
    except NoFormula:
        return None


def is_fractal(texture: Apply) -> bool:
    """Return whether MaterialX' fractal2d or fractal3d is the `texture`, of a scale of 1."""
    if texture.operation not in ("noise_value(2D, FBM, False)", "noise_value(3D, FBM, False)"):
        return False
    _, _, scale, detail, *_, distortion = texture.arguments
    return scale == ONE and distortion == ZERO and isinstance(detail, Constant) and detail.value in range(16)


def _checker_fac(
    op: Operator, _menus: Sequence[str], vector: Expression, _1: Expression, _2: Expression, scale: Expression
) -> Expression:
    cell = op("floor", _off_borders(op, op("multiply", vector, scale)))
    return op("floored_modulo", op("dot", cell, (1.0, 1.0, 1.0)), 2.0)


def _checker_color(op: Operator, menus: Sequence[str], *given: Expression) -> Expression:
    _, color1, color2, _ = given
    return op("mix", color2, color1, _checker_fac(op, menus, *given))


def _gradient_fac(op: Operator, menus: Sequence[str], vector: Expression) -> Expression:
    x, y = op("x", vector), op("y", vector)
    inside = op("subtract", 0.999999, op("length", vector))
    match menus[0]:
        case "LINEAR" | "QUADRATIC":
            value = x
        case "EASING":
            return op("smooth_step", 0.0, 1.0, x)
        case "DIAGONAL":
            value = op("multiply", op("add", x, y), 0.5)
        case "RADIAL":
            return op("add", op("divide", op("arctangent2", y, x), tau), 0.5)
        case _:
            value = inside
    value = op("clamp", value, 0.0, 1.0)
    return op("multiply", value, value) if menus[0].startswith("QUADRATIC") else value


def _magic_color(op: Operator, menus: Sequence[str], vector: Expression, scale: Expression, distortion: Expression) -> Expression:
    p = op("multiply", op("multiply", vector, scale), 5.0)

    def wave(function: str, sign: float, of: Expression, signs: Sequence[float]) -> Expression:
        return op("multiply", op(function, op("dot", of, tuple(map(float, signs)))), float(sign))

    color = op("combine", wave("sine", 1, p, (1, 1, 1)), wave("cosine", 1, p, (-1, 1, -1)), wave("cosine", -1, p, (-1, -1, 1)))
    depth = int(menus[0])
    if depth:
        color = op("multiply", color, distortion)
    for at, signs, function, sign in TURNS[:depth]:
        parts = [op(name, color) for name in "xyz"]
        parts[at] = op("multiply", wave("sine" if function.__name__ == "sin" else "cosine", sign, color, signs), distortion)
        color = op("combine", *parts)
    if distortion != ZERO:
        color = op("divide", color, op("multiply", distortion, 2.0))
    return op("subtract", (0.5, 0.5, 0.5), color)


def _wave_fac(
    op: Operator,
    menus: Sequence[str],
    vector: Expression,
    scale: Expression,
    distortion: Expression,
    detail: Expression,
    detail_scale: Expression,
    detail_roughness: Expression,
    phase_offset: Expression,
) -> Expression:
    kind, bands, rings, profile = menus
    p = _off_borders(op, op("multiply", vector, scale))
    if kind == "RINGS":
        phase = op("length", op("multiply", p, tuple(float(axis != rings) for axis in "XYZ")))
    elif bands == "DIAGONAL":
        phase = op("dot", p, (0.5, 0.5, 0.5))
    else:
        phase = op(bands.lower(), p)
    phase = op("add", op("multiply", phase, 20.0), phase_offset)
    if distortion != ZERO:
        noise = _fbm(op, "3D", op("multiply", p, detail_scale), detail, detail_roughness, Constant(2.0), is_normalized=True)
        phase = op("add", phase, op("multiply", distortion, op("subtract", op("multiply", noise, 2.0), 1.0)))
    if profile == "SIN":
        return op("add", op("multiply", op("sine", op("subtract", phase, pi / 2.0)), 0.5), 0.5)
    turns = op("divide", phase, tau)
    if profile == "SAW":
        return op("fraction", turns)
    return op("multiply", op("absolute", op("subtract", turns, op("round", turns))), 2.0)


def _noise_value(op: Operator, menus: Sequence[str], vector: Expression, _w: Expression, *given: Expression) -> Expression:
    return _fractal(op, menus, _distorted(op, menus[0], vector, *given), *given)


def _noise_color(op: Operator, menus: Sequence[str], vector: Expression, _w: Expression, *given: Expression) -> Expression:
    p, seed = _distorted(op, menus[0], vector, *given), int(menus[0][0])
    places = (p, _elsewhere(op, menus[0], p, seed), _elsewhere(op, menus[0], p, seed + 1))
    return op("combine", *(_fractal(op, menus, place, *given) for place in places))


def _distorted(op: Operator, dimensions: str, vector: Expression, scale: Expression, *given: Expression) -> Expression:
    if dimensions not in ("2D", "3D"):
        raise NoFormula
    p, distortion = op("multiply", vector, scale), given[-1]
    if distortion == ZERO:
        return p
    noise = [_octave(op, dimensions, _elsewhere(op, dimensions, p, axis)) for axis in range(int(dimensions[0]))]
    return op("add", p, op("multiply", op("combine", *(*noise, 0.0)[:3]), distortion))


def _elsewhere(op: Operator, dimensions: str, p: Expression, seed: int) -> Expression:
    return op("add", p, (*away(int(dimensions[0]), seed), 0.0)[:3])


def _octave(op: Operator, dimensions: str, p: Expression) -> Expression:
    return _sum(op, dimensions, p, 0, ONE, ONE)


def _sum(op: Operator, dimensions: str, p: Expression, detail: int, roughness: Expression, lacunarity: Expression) -> Expression:
    """Return what fractal2d or fractal3d is."""
    return op(f"noise_value({dimensions}, FBM, False)", p, 0.0, 1.0, float(detail), roughness, lacunarity, 0.0, 0.0, 0.0)


def _depth(detail: Expression) -> float:
    """Return a detail that is a constant, within the range of its socket."""
    if not isinstance(detail, Constant):
        raise NoFormula
    return min(max(number(detail.value), 0.0), 15.0)


def _fbm(
    op: Operator,
    dimensions: str,
    p: Expression,
    detail: Expression,
    roughness: Expression,
    lacunarity: Expression,
    is_normalized: bool,
) -> Expression:
    depth = _depth(detail)

    def level(whole: int) -> Expression:
        value = _sum(op, dimensions, p, whole, roughness, lacunarity)
        if not is_normalized:
            return value
        total: Expression = ONE
        for _ in range(whole):
            total = op("add", op("multiply", total, roughness), 1.0)
        return op("add", op("multiply", op("divide", value, total), 0.5), 0.5)

    whole = int(depth)
    return level(whole) if depth == whole else op("mix", level(whole), level(whole + 1), depth - whole)


def _fractal(
    op: Operator,
    menus: Sequence[str],
    p: Expression,
    _scale: Expression,
    detail: Expression,
    roughness: Expression,
    lacunarity: Expression,
    offset: Expression,
    gain: Expression,
    _distortion: Expression,
) -> Expression:
    """Return the sum of octaves, as addon/material/textures/fractal_noise.py has it."""
    dimensions, kind, normalize = menus
    roughness = op("maximum", roughness, 0.0)
    if kind == "FBM":
        return _fbm(op, dimensions, p, detail, roughness, lacunarity, normalize == "True")
    depth = _depth(detail)
    value: Expression = ONE if kind == "MULTIFRACTAL" else ZERO
    power, weight = ONE, ONE
    octaves = int(depth) + 1 + (depth != int(depth) and kind != "RIDGED_MULTIFRACTAL")
    for octave in range(octaves):
        noise = _octave(op, dimensions, p)
        share = min(depth + 1.0 - octave, 1.0)
        if kind == "MULTIFRACTAL":
            value = op("multiply", value, op("add", op("multiply", op("multiply", noise, power), share), 1.0))
        elif kind == "RIDGED_MULTIFRACTAL":
            ridge = op("subtract", offset, op("absolute", noise))
            signal = op("multiply", op("multiply", ridge, ridge), weight)
            value = op("add", value, op("multiply", signal, power))
            weight = op("clamp", op("multiply", signal, gain), 0.0, 1.0)
        elif kind == "HYBRID_MULTIFRACTAL":
            weight = op("multiply", op("minimum", weight, 1.0), op("greater_than", weight, 0.001))
            signal = op("multiply", op("add", noise, offset), power)
            value = op("add", value, op("multiply", op("multiply", weight, signal), share))
            weight = op("multiply", op("multiply", weight, gain), signal)
        else:
            height = op("add", noise, offset)
            step = op("multiply", op("multiply", op("multiply", height, power), value), share) if octave else height
            value = op("add", value, step)
        power, p = op("multiply", power, roughness), op("multiply", p, lacunarity)
    return value


def _off_borders(op: Operator, p: Expression) -> Expression:
    return op("multiply", op("add", p, (1e-6, 1e-6, 1e-6)), 0.999999)


def _gray(fac: Formula) -> Formula:
    def color(op: Operator, *given: Sequence[str] | Expression) -> Expression:
        value = fac(op, *given)
        return op("combine", value, value, value)

    return color


FORMULAS: dict[str, Formula] = {
    "checker_fac": _checker_fac,
    "checker_color": _checker_color,
    "gradient_fac": _gradient_fac,
    "gradient_color": _gray(_gradient_fac),
    "magic_color": _magic_color,
    "magic_fac": lambda op, *given: op("average", _magic_color(op, *given)),
    "wave_fac": _wave_fac,
    "wave_color": _gray(_wave_fac),
    "noise_value": _noise_value,
    "noise_color": _noise_color,
}
"""By the name of the texture's function in its operation."""
