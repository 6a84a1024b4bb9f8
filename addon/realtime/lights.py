# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene as shaders/lights.glsl takes them, in Blender's units."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Matrix, Vector

from .program import LIGHT_TYPES, MAX_LIGHTS

NO_SPREAD = math.radians(89.99)  # half of an area light's spread from which on its spread cuts nothing off
SHADOW_LIGHTS = frozenset({"SUN", "SPOT"})  # types of lights that have shadow maps
LARGEST_TANGENT = 1e15  # in the place of the tangent of 90 degrees

type Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """A light.

    `kind` is Blender's type of light, one of program.LIGHT_TYPES; `position` in m; `axis` the unit vector against the direction it
    shines in; `strength` by channel: W/m^2 of a sun, W of the others.
    `edge`: of a spot the cosine of half its cone, of an area light the tangent of half its spread.
    `fade`: of a spot the part of the cosine over which its cone fades, of an area light the gain of its spread.
    `x_axis` and `y_axis` take a direction to a spot's own axes, `axis` being the third: longer than 1 where its scale narrows
    the cone.
    `casts_shadow`: whether it has a shadow map.
    """

    kind: str
    position: Triple
    axis: Triple
    strength: Triple
    edge: float
    fade: float
    x_axis: Triple
    y_axis: Triple
    casts_shadow: bool

    def to_bytes(self) -> bytes:
        """Return the struct Light of shaders/lights.glsl. Raises ValueError for an unknown `kind`."""
        first, second = (*self.position, LIGHT_TYPES.index(self.kind), *self.axis, self.edge), (*self.strength, self.fade)
        return struct.pack("20f", *first, *second, *self.x_axis, 0.0, *self.y_axis, 0.0)


def read_light(item: bpy.types.Object, matrix: Matrix) -> Light:
    """Return a light object, or an instance of one, placed by `matrix`. Raises ValueError for an unknown type of light."""
    data = item.data
    gain = data.energy * 2.0**data.exposure * _gain(data, matrix)
    tint = data.temperature_color if data.use_temperature else (1.0, 1.0, 1.0)
    red, green, blue = (color * warmth * gain for color, warmth in zip(data.color, tint, strict=True))
    edge = fade = 0.0
    axis = (matrix.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
    x_axis = y_axis = Vector()
    if data.type == "SPOT":
        edge = math.cos(data.spot_size / 2.0)
        fade = (1.0 - edge) * data.spot_blend
        x_axis, y_axis, axis = matrix.to_3x3().inverted_safe()  # its rows
        x_axis, y_axis, axis = (row / max(axis.length, 1e-30) for row in (x_axis, y_axis, axis))
    elif data.type == "AREA":
        half = min(data.spread, math.pi) / 2.0
        edge = math.tan(half) if half < NO_SPREAD else LARGEST_TANGENT
        fade = 1.0 / max(edge - half, 1e-30)
    return Light(
        kind=data.type,
        position=tuple(matrix.translation),
        axis=tuple(axis),
        strength=(red, green, blue),
        edge=edge,
        fade=fade,
        x_axis=tuple(x_axis),
        y_axis=tuple(y_axis),
        casts_shadow=data.use_shadow and data.type in SHADOW_LIGHTS,
    )


def lights_to_bytes(lights: Sequence[Light]) -> bytes:
    """Return the struct Lights of program.py with the first MAX_LIGHTS of `lights`."""
    used = [light.to_bytes() for light in lights[:MAX_LIGHTS]]
    return struct.pack("4i", len(used), 0, 0, 0) + b"".join(used).ljust(80 * MAX_LIGHTS, b"\0")


def _gain(data: bpy.types.Light, matrix: Matrix) -> float:
    """Return the factor on a light's power: 1 if the power is normalized, else the light's area, as in Cycles and EEVEE."""
    match data.type:
        case "AREA":
            scale = matrix.to_scale()
            height = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
            area = abs(data.size * scale.x * height * scale.y) * (math.pi / 4.0 if data.shape in {"DISK", "ELLIPSE"} else 1.0)
            if area == 0.0:  # sends no light
                return 0.0
        case "SUN":
            area = math.pi * math.sin(min(data.angle, math.pi) / 2.0) ** 2 or 1.0
        case "POINT" | "SPOT":
            area = 4.0 * math.pi * data.shadow_soft_size**2 or 4.0
        case _:
            raise ValueError(f"{data.name} is a light of the unknown type {data.type}")
    return 1.0 if data.normalize else area
