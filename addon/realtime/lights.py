# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps of a scene as the realtime engine draws them: what shaders/lights.glsl takes, in Blender's units."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Matrix, Vector

from . import blocks

RIGHT = math.radians(89.99)  # half of a spread that spares nothing
WIDEST = 1e15  # its tangent

type Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Lamp:
    """A lamp. `towards`: unit vector against the direction it shines in; `strength`: W/m^2 of a sun, W of the others, by channel.

    `edge` and `fade`: of a spot the cosine of half its cone, and the part of the cosine over which it fades; of an area the tangent
    of half its spread, and the gain of what is left of it. `across` and `up` take a direction to a spot's own axes, where `towards`
    is the third: longer than 1 where its cone is narrower than high.
    """

    kind: str
    place: Triple
    towards: Triple
    strength: Triple
    edge: float
    fade: float
    across: Triple
    up: Triple
    casts: bool

    def packed(self) -> bytes:
        """Return the struct Lamp of shaders/lights.glsl."""
        return blocks.lamp(self.kind, self.place, self.towards, self.strength, self.edge, self.fade, self.across, self.up)


def lamp_of(light: bpy.types.Object, matrix: Matrix) -> Lamp:
    """Return a light object, or an instance of one, that stands at `matrix`."""
    data = light.data
    gain = data.energy * 2.0**data.exposure * _gain(data, matrix)
    tint = data.temperature_color if data.use_temperature else (1.0, 1.0, 1.0)
    red, green, blue = (color * warm * gain for color, warm in zip(data.color, tint, strict=True))
    edge = fade = 0.0
    towards = (matrix.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
    across = up = Vector()
    if data.type == "SPOT":
        edge = math.cos(data.spot_size / 2.0)
        fade = (1.0 - edge) * data.spot_blend
        across, up, towards = matrix.to_3x3().inverted_safe()  # its rows
        across, up, towards = (row / max(towards.length, 1e-30) for row in (across, up, towards))
    elif data.type == "AREA":
        half = min(data.spread, math.pi) / 2.0
        edge = math.tan(half) if half < RIGHT else WIDEST
        fade = 1.0 / max(edge - half, 1e-30)
    casts = data.use_shadow and data.type in {"SUN", "SPOT"}
    return Lamp(
        data.type, tuple(matrix.translation), tuple(towards), (red, green, blue), edge, fade, tuple(across), tuple(up), casts
    )


def _gain(data: bpy.types.Light, matrix: Matrix) -> float:
    """Return what multiplies the power of a lamp: where that is not normalized, its area, as Cycles and EEVEE have it."""
    match data.type:
        case "AREA":
            scale = matrix.to_scale()
            height = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
            area = abs(data.size * scale.x * height * scale.y) * (math.pi / 4.0 if data.shape in {"DISK", "ELLIPSE"} else 1.0)
            if area == 0.0:  # shines nowhere
                return 0.0
        case "SUN":
            area = math.pi * math.sin(min(data.angle, math.pi) / 2.0) ** 2 or 1.0
        case _:  # POINT, SPOT
            area = 4.0 * math.pi * data.shadow_soft_size**2 or 4.0
    return 1.0 if data.normalize else area


def packed(lamps: Sequence[Lamp]) -> bytes:
    """Return the struct Lamps of program.py, with as many of `lamps` as it holds."""
    return blocks.lamps([lamp.packed() for lamp in lamps])
