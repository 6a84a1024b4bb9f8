# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's texture nodes as operations: for each node and each choice of its menus the reference and the GLSL. No bpy.

The values are those of Cycles 5.2 (its kernel/svm).
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal, NamedTuple

from . import brick, checker, gradient, magic, noise, voronoi, wave, white_noise

type Menu = Mapping[str, str | int]


class Output(NamedTuple):
    """An output of a texture, by a name that no other has. Its functions take what the menus say and then the arguments.

    glsl: the call, with {} for all of them; empty if the GLSL function is `name`.
    """

    name: str
    kind: Literal["number", "triple"]
    python: Callable[..., Any]
    glsl: str = ""


class Texture(NamedTuple):
    """A texture node.

    stem: the GLSL functions are in shaders/nodes/STEM.glsl.
    menus: properties of the node that choose the operation; for each of their values, as text, what the functions take: a number,
    or a word, of which GLSL takes the index.
    arguments: identifiers of the node's sockets in the functions' order, of which some are disabled under some choices, and after
    them names of its properties that are numbers.
    outputs: by socket identifier.
    """

    stem: str
    menus: Mapping[str, Menu]
    arguments: tuple[str, ...]
    outputs: Mapping[str, Output]


def _words(*words: str) -> Menu:
    return {word: word for word in words}


DIMENSIONS: Menu = {"1D": 1, "2D": 2, "3D": 3, "4D": 4}
SWITCH: Menu = {"False": False, "True": True}
NOISE_TYPES = _words("MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "FBM", "HETERO_TERRAIN")

TEXTURES: dict[str, Texture] = {
    "ShaderNodeTexNoise": Texture(
        "noise",
        {"noise_dimensions": DIMENSIONS, "noise_type": NOISE_TYPES, "normalize": SWITCH},
        ("Vector", "W", "Scale", "Detail", "Roughness", "Lacunarity", "Offset", "Gain", "Distortion"),
        {"Fac": Output("noise_value", "number", noise.noise_value), "Color": Output("noise_color", "triple", noise.noise_color)},
    ),
    "ShaderNodeTexWhiteNoise": Texture(
        "white_noise",
        {"noise_dimensions": DIMENSIONS},
        ("Vector", "W"),
        {
            "Value": Output("white_noise_value", "number", white_noise.white_noise_value),
            "Color": Output("white_noise_color", "triple", white_noise.white_noise_color),
        },
    ),
    "ShaderNodeTexChecker": Texture(
        "checker",
        {},
        ("Vector", "Color1", "Color2", "Scale"),
        {
            "Color": Output("checker_color", "triple", checker.checker_color),
            "Fac": Output("checker_fac", "number", checker.checker_fac),
        },
    ),
    "ShaderNodeTexGradient": Texture(
        "gradient",
        {"gradient_type": _words(*gradient.TYPES)},
        ("Vector",),
        {
            "Color": Output("gradient_color", "triple", gradient.gradient_color),
            "Fac": Output("gradient_fac", "number", gradient.gradient_fac),
        },
    ),
    "ShaderNodeTexMagic": Texture(
        "magic",
        {"turbulence_depth": {str(depth): depth for depth in range(11)}},
        ("Vector", "Scale", "Distortion"),
        {"Color": Output("magic_color", "triple", magic.magic_color), "Fac": Output("magic_fac", "number", magic.magic_fac)},
    ),
    "ShaderNodeTexWave": Texture(
        "wave",
        {
            "wave_type": _words("BANDS", "RINGS"),
            "bands_direction": _words("X", "Y", "Z", "DIAGONAL"),
            "rings_direction": _words("X", "Y", "Z", "SPHERICAL"),
            "wave_profile": _words("SIN", "SAW", "TRI"),
        },
        ("Vector", "Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset"),
        {"Color": Output("wave_color", "triple", wave.wave_color), "Fac": Output("wave_fac", "number", wave.wave_fac)},
    ),
    "ShaderNodeTexVoronoi": Texture(
        "voronoi",
        {
            "voronoi_dimensions": DIMENSIONS,
            "feature": _words(*voronoi.FEATURES),
            "distance": _words(*voronoi.METRICS),
            "normalize": SWITCH,
        },
        ("Vector", "W", "Scale", "Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent", "Randomness"),
        {
            "Distance": Output("voronoi_distance", "number", voronoi.voronoi_distance, "voronoi({}).distance"),
            "Color": Output("voronoi_color", "triple", voronoi.voronoi_color, "voronoi({}).color"),
            "Position": Output("voronoi_position", "triple", voronoi.voronoi_position, "voronoi({}).position"),
            "W": Output("voronoi_w", "number", voronoi.voronoi_w, "voronoi({}).w"),
            "Radius": Output("voronoi_radius", "number", voronoi.voronoi_radius, "voronoi({}).radius"),
        },
    ),
    "ShaderNodeTexBrick": Texture(
        "brick",
        {},
        (
            *("Vector", "Color1", "Color2", "Mortar", "Scale", "Mortar Size", "Mortar Smooth", "Bias", "Brick Width", "Row Height"),
            *("offset", "offset_frequency", "squash", "squash_frequency"),
        ),
        {"Color": Output("brick_color", "triple", brick.brick_color), "Fac": Output("brick_fac", "number", brick.brick_fac)},
    ),
}
"""By the type of the node (bl_idname)."""

FUNCTIONS = {output.name: (texture, output) for texture in TEXTURES.values() for output in texture.outputs.values()}


def operation_name(texture: Texture, choices: Mapping[str, object], output: str) -> str:
    """Return the name of the operation that gives `output`, where `choices` has the values of the node's menus."""
    return f"{texture.outputs[output].name}({', '.join(str(choices[menu]) for menu in texture.menus)})"


class TextureOperation(NamedTuple):
    """An operation as the table of operations has them."""

    kind: Literal["number", "triple"]
    python: Callable[..., Any]
    glsl: str
    stem: str


def operation(name: str) -> TextureOperation:
    """Return the operation of that name, as `operation_name` makes them; KeyError where there is none."""
    function, _, choices = name.removesuffix(")").partition("(")
    if function not in FUNCTIONS:
        raise KeyError(name)
    texture, output = FUNCTIONS[function]
    chosen = choices.split(", ") if choices else []
    if len(chosen) != len(texture.menus):
        raise KeyError(name)
    values, literals = [], []
    for menu, choice in zip(texture.menus.values(), chosen, strict=True):
        values.append(menu[choice])
        literals.append(str(list(menu).index(choice) if isinstance(menu[choice], str) else menu[choice]).lower())
    literals += [f"{{{index}}}" for index in range(len(texture.arguments))]
    call = (output.glsl or f"{function}({{}})").format(", ".join(literals))
    return TextureOperation(output.kind, partial(_defined, output, *values), call, texture.stem)


def _defined(output: Output, *arguments: object) -> object:
    """Return what the reference gives; 0 where that is not defined: infinite coordinates, an exponent of 0."""
    try:
        return output.python(*arguments)
    except (ArithmeticError, ValueError):
        return 0.0 if output.kind == "number" else (0.0, 0.0, 0.0)
