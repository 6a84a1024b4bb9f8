# SPDX-License-Identifier: GPL-3.0-or-later
"""A low-poly figure made of ellipsoids, in the axes of glTF: meters, Y up, facing +Z. No bpy."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

type Vector = tuple[float, ...]

HEIGHT = 1.8  # m
DIGITS = 5  # so that a file does not depend on the last digit of a system's sine


@dataclass
class Part:
    """A smooth closed mesh. UVs are glTF's: v is 0 at the top of an image."""

    positions: list[Vector] = field(default_factory=list)
    normals: list[Vector] = field(default_factory=list)
    uvs: list[Vector] = field(default_factory=list)
    front_uvs: list[Vector] = field(default_factory=list)
    """A second UV map: the whole figure seen from the front, 0 to 1 over its height."""
    triangles: list[Vector] = field(default_factory=list)

    def add(self, other: "Part") -> None:
        """Append the mesh of another part."""
        first = len(self.positions)
        self.triangles += [tuple(first + corner for corner in triangle) for triangle in other.triangles]
        self.positions += other.positions
        self.normals += other.normals
        self.uvs += other.uvs
        self.front_uvs += other.front_uvs


# Name: center [m], radii [m], segments around and from pole to pole
ELLIPSOIDS = {
    "head": (((0.0, 1.6, 0.0), (0.16, 0.2, 0.18), (14, 9)),),
    "body": (((0.0, 1.08, 0.0), (0.24, 0.4, 0.17), (14, 9)),),
    "arms": (((-0.34, 1.08, 0.0), (0.08, 0.36, 0.08), (8, 5)), ((0.34, 1.08, 0.0), (0.08, 0.36, 0.08), (8, 5))),
    "legs": (((-0.13, 0.4, 0.0), (0.11, 0.4, 0.12), (8, 5)), ((0.13, 0.4, 0.0), (0.11, 0.4, 0.12), (8, 5))),
}


def figure(mirrored: bool = False) -> dict[str, Part]:
    """Return the parts head, body, arms and legs.

    Where `mirrored`, the half with x < 0 has the texture of the other half, as artists unfold symmetric characters.
    """
    parts: dict[str, Part] = {}
    for name, ellipsoids in ELLIPSOIDS.items():
        parts[name] = Part()
        for center, radii, segments in ellipsoids:
            parts[name].add(ellipsoid(center, radii, segments, mirrored))
    return parts


def colors(part: Part, color: Callable[[float, float], Vector]) -> list[Vector]:
    """Return the color of each vertex, by a function of its two front UV coordinates."""
    return [tuple(round(value, DIGITS) for value in color(*uv)) for uv in part.front_uvs]


def ellipsoid(center: Vector, radii: Vector, segments: tuple[int, int], mirrored: bool = False) -> Part:
    """Return the mesh of an ellipsoid, of so many `segments` around and from pole to pole."""
    around, along = segments
    part = Part()
    for row in range(along + 1):
        theta = math.pi * row / along
        for column in range(around + 1):
            u = column / around
            phi = 2.0 * math.pi * u  # from the back, over +X and the front
            on_sphere = (math.sin(theta) * math.sin(phi), math.cos(theta), -math.sin(theta) * math.cos(phi))
            position = [c + r * s for c, r, s in zip(center, radii, on_sphere, strict=True)]
            normal = [s / r for r, s in zip(radii, on_sphere, strict=True)]
            length = math.hypot(*normal)
            part.positions.append(_rounded(*position))
            part.normals.append(_rounded(*(component / length for component in normal)))
            part.uvs.append(_rounded(min(2.0 * u, 2.0 - 2.0 * u) if mirrored else u, row / along))
            part.front_uvs.append(_rounded(0.5 + position[0] / HEIGHT, 1.0 - position[1] / HEIGHT))
    for row in range(along):
        for column in range(around):
            a, b = row * (around + 1) + column, (row + 1) * (around + 1) + column
            if row > 0:
                part.triangles.append((a, a + 1, b + 1))
            if row < along - 1:
                part.triangles.append((a, b + 1, b))
    return part


def _rounded(*values: float) -> Vector:
    return tuple(round(value, DIGITS) + 0.0 for value in values)  # -0.0 + 0.0 is 0.0
