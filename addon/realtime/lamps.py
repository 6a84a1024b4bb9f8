# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a scene as the realtime engine draws them: what shaders/lamps.glsl takes, in Blender's units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Matrix, Vector

from . import blocks


@dataclass(frozen=True)
class Lamp:
    """A lamp. `towards`: unit vector against the direction it shines in; `strength`: W/m^2 of a sun, W of the others, by channel;
    `edge` and `fade`: the cosine of half a spot's cone, and the part of the cosine over which it fades.
    """

    kind: str
    place: tuple[float, float, float]
    towards: tuple[float, float, float]
    strength: tuple[float, float, float]
    edge: float
    fade: float
    casts: bool
    matrix: Matrix

    def packed(self) -> bytes:
        """Return the struct Lamp of shaders/lamps.glsl."""
        return blocks.lamp(self.kind, self.place, self.towards, self.strength, self.edge, self.fade)


def lamp_of(light: bpy.types.Object, matrix: Matrix) -> Lamp:
    """Return a light object, or an instance of one, that stands at `matrix`."""
    data = light.data
    gain = data.energy * 2.0**data.exposure * (1.0 if data.normalize else _size(data, matrix))
    tint = data.temperature_color if data.use_temperature else (1.0, 1.0, 1.0)
    red, green, blue = (color * warm * gain for color, warm in zip(data.color, tint, strict=True))
    edge = fade = 0.0
    if data.type == "SPOT":
        edge = math.cos(data.spot_size / 2.0)
        fade = (1.0 - edge) * data.spot_blend
    towards = (matrix.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
    casts = data.use_shadow and data.type in {"SUN", "SPOT"}
    return Lamp(data.type, tuple(matrix.translation), tuple(towards), (red, green, blue), edge, fade, casts, matrix.copy())


def _size(data: bpy.types.Light, matrix: Matrix) -> float:
    """Return what multiplies the power of a lamp whose power is not normalized, so that it is one for each of its units of size."""
    match data.type:
        case "AREA":
            scale = matrix.to_scale()
            height = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
            area = data.size * scale.x * height * scale.y
            return area * (math.pi / 4.0 if data.shape in {"DISK", "ELLIPSE"} else 1.0)
        case "SUN":
            return math.pi * math.sin(min(data.angle, math.pi) / 2.0) ** 2
    return math.pi * data.shadow_soft_size**2


def packed(lamps: Sequence[Lamp]) -> bytes:
    """Return the struct Lamps of program.py, with as many of `lamps` as it holds."""
    return blocks.lamps([lamp.packed() for lamp in lamps])
