# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a scene as shaders/lights.glsl takes them, in Blender's units."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import bpy

from mathutils import Matrix, Vector

from .program import LIGHT_TYPES, MAX_LIGHTS

NO_SPREAD = math.radians(89.99)  # half of an area light's spread from which on its spread cuts nothing off
LARGEST_TANGENT = 1e15  # in the place of the tangent of 90 degrees
BASES = (2, 3, 5)  # of Halton's sequence, which fills a cube evenly
SHIFT_BASES = (7, 11)  # the same, for what moves a light's shadow map
BETWEEN_LIGHTS = 0.6180339887498949  # by which fraction of the cube each light's sequence is moved after the one before
ROUND = {"DISK", "ELLIPSE"}  # shapes of area lights

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
    `size`: half the angle of a sun [radians], the radius of a point or a spot [m].
    `sides`: from an area light's center to the middles of two sides [m]; `is_round`: whether it is an ellipse.
    `shift`: by which part of a texel a sample's shadow map is moved, so that the mean over samples smooths its edges; None where
    one map has to do for all samples.
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
    size: float = 0.0
    sides: tuple[Triple, Triple] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    is_round: bool = False
    shift: tuple[float, float] | None = None

    def to_bytes(self, first_tile: int = 0, tiles: int = 0) -> bytes:
        """Return the struct Light of shaders/lights.glsl with its tiles of the shadow map. Raises ValueError for unknown kinds."""
        first, second = (*self.position, LIGHT_TYPES.index(self.kind), *self.axis, self.edge), (*self.strength, self.fade)
        counted = tiles if self.casts_shadow else -tiles  # no surface is shaded by them
        return struct.pack("20f", *first, *second, *self.x_axis, first_tile, *self.y_axis, counted)

    def at_sample(self, sample: int, index: int) -> "Light":
        """Return the point of the light that a sample of a picture sees, as a light without size; the first sees its center.

        All points together shine as the light does, whose radiance is the same everywhere. A sun's directions are as dense as the
        projection of its disk, so that a plane that faces it gets the same from each. Points and spots are spread in a ball, as the
        uniform points of a 3-sphere are when their fourth coordinate is left out: from anywhere far away they fill a disk evenly.
        `index`: the light's place among others, which shine from other points at the same time.
        """
        if not self.is_soft:
            return self
        start = 0.5 + (index * BETWEEN_LIGHTS if sample else 0.0)
        u, v, w = ((start + radical_inverse(sample, base)) % 1.0 for base in BASES)
        across, along = ((start + radical_inverse(sample, base)) % 1.0 - 0.5 for base in SHIFT_BASES)
        shift = (across, along) if sample else None
        if self.kind == "SUN":
            x, y = (math.sin(self.size) * coordinate for coordinate in disk(u, v))
            cosine = math.sqrt(max(1.0 - x * x - y * y, 1e-6))
            towards = Vector(self.axis).to_track_quat("Z", "Y") @ Vector((x, y, cosine))
            red, green, blue = (strength / cosine for strength in self.strength)
            return replace(self, axis=tuple(towards), strength=(red, green, blue), size=0.0, shift=shift)
        if self.kind == "AREA":
            x, y = disk(u, v) if self.is_round else (2.0 * u - 1.0, 2.0 * v - 1.0)
            moves = (x * a + y * b for a, b in zip(*self.sides, strict=True))
        else:
            moves = (self.size * coordinate for coordinate in _ball(u, v, w))
        position = tuple(here + move for here, move in zip(self.position, moves, strict=True))
        return replace(self, position=position, size=0.0, sides=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), shift=shift)

    @property
    def is_soft(self) -> bool:
        """Whether the light has a size."""
        return self.size > 0.0 or any(coordinate != 0.0 for side in self.sides for coordinate in side)


def read_light(item: bpy.types.Object, matrix: Matrix) -> Light:
    """Return a light object, or an instance of one, placed by `matrix`. Raises ValueError for an unknown type of light."""
    data = item.data
    gain = data.energy * 2.0**data.exposure * _gain(data, matrix)
    tint = data.temperature_color if data.use_temperature else (1.0, 1.0, 1.0)
    red, green, blue = (color * warmth * gain for color, warmth in zip(data.color, tint, strict=True))
    to_world = matrix.to_3x3()
    edge = fade = size = 0.0
    axis = (to_world @ Vector((0.0, 0.0, 1.0))).normalized()
    x_axis = y_axis = right = up = Vector()
    match data.type:
        case "SUN":
            size = _half_angle(data)
        case "POINT":
            size = data.shadow_soft_size
        case "SPOT":
            size = data.shadow_soft_size
            edge = math.cos(data.spot_size / 2.0)
            fade = (1.0 - edge) * data.spot_blend
            x_axis, y_axis, axis = to_world.inverted_safe()  # its rows
            x_axis, y_axis, axis = (row / max(axis.length, 1e-30) for row in (x_axis, y_axis, axis))
        case "AREA":
            right, up = to_world @ Vector((data.size / 2.0, 0.0, 0.0)), to_world @ Vector((0.0, _height(data) / 2.0, 0.0))
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
        casts_shadow=data.use_shadow,
        size=size,
        sides=(tuple(right), tuple(up)),
        is_round=data.type == "AREA" and data.shape in ROUND,
    )


def lights_to_bytes(lights: Sequence[Light], tiles: Sequence[int]) -> bytes:
    """Return the struct Lights of program.py with at most MAX_LIGHTS `lights`; `tiles`: how many each has in the shadow map."""
    firsts = accumulate(tiles, initial=0)
    used = [light.to_bytes(first, count) for light, first, count in zip(lights[:MAX_LIGHTS], firsts, tiles, strict=False)]
    return struct.pack("4i", len(used), 0, 0, 0) + b"".join(used).ljust(80 * MAX_LIGHTS, b"\0")


def _half_angle(sun: bpy.types.SunLight) -> float:
    return min(sun.angle, math.pi) / 2.0


def _height(area: bpy.types.AreaLight) -> float:
    return area.size_y if area.shape in {"RECTANGLE", "ELLIPSE"} else area.size


def _gain(data: bpy.types.Light, matrix: Matrix) -> float:
    """Return the factor on a light's power: 1 if the power is normalized, else the light's area, as in Cycles and EEVEE."""
    match data.type:
        case "AREA":
            scale = matrix.to_scale()
            area = abs(data.size * scale.x * _height(data) * scale.y) * (math.pi / 4.0 if data.shape in ROUND else 1.0)
            if area == 0.0:  # sends no light
                return 0.0
        case "SUN":
            area = math.pi * math.sin(_half_angle(data)) ** 2 or 1.0
        case "POINT" | "SPOT":
            area = 4.0 * math.pi * data.shadow_soft_size**2 or 4.0
        case _:
            raise ValueError(f"{data.name} is a light of the unknown type {data.type}")
    return 1.0 if data.normalize else area


def radical_inverse(number: int, base: int) -> float:
    """Return `number` with its digits in `base` mirrored at the point: J. Halton (1960)."""
    inverse, place = 0.0, 1.0
    while number:
        number, digit = divmod(number, base)
        place /= base
        inverse += place * digit
    return inverse


def disk(u: float, v: float) -> tuple[float, float]:
    """Return the point of a disk of radius 1 for one of a square; P. Shirley and K. Chiu, "A Low Distortion Map Between Disk and
    Square" (1997)."""
    x, y = 2.0 * u - 1.0, 2.0 * v - 1.0
    if x == y == 0.0:
        return 0.0, 0.0
    radius, angle = (x, math.pi / 4.0 * y / x) if abs(x) > abs(y) else (y, math.pi / 2.0 - math.pi / 4.0 * x / y)
    return radius * math.cos(angle), radius * math.sin(angle)


def _ball(u: float, v: float, w: float) -> Triple:
    """Return three coordinates of a uniform point of the 3-sphere of radius 1, the center for the middle of the cube.

    K. Shoemake, "Uniform Random Rotations" (1992).
    """
    height = 1.0 - (u + 0.5) % 1.0
    across = math.sqrt(1.0 - height)
    return (
        across * math.cos(2.0 * math.pi * v),
        across * math.sin(2.0 * math.pi * v),
        math.sqrt(height) * math.sin(2.0 * math.pi * w),
    )
