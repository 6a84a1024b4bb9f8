# SPDX-License-Identifier: GPL-3.0-or-later
"""The lens of a camera with depth of field, one point of which each sample of a picture looks through."""

import math
from dataclasses import dataclass

import bpy

from mathutils import Matrix, Vector

from .lights import disk, radical_inverse

BASES = (7, 11)  # of Halton's sequence: others than those of the lights, which are independent
SMALLEST = 1e-5  # f-stop, and focus distance [m], as in Cycles
FEWEST_BLADES = 3  # with fewer, the aperture is round


@dataclass(frozen=True)
class Lens:
    """A thin lens in the place of a pinhole, whose middle is at `center` [m].

    `right`, `up` and `axis` are the camera's unit axes, `axis` towards the viewer. What is `focus` away along it [m] is sharp. The
    aperture is `radius` high and `radius` / `ratio` wide [m] from its middle: a regular polygon of `blades` corners, turned by
    `rotation` [radians], or with less than three a disk.
    """

    center: Vector
    right: Vector
    up: Vector
    axis: Vector
    focus: float
    radius: float
    ratio: float
    blades: int
    rotation: float

    def offset(self, sample: int) -> Vector:
        """Return from the middle of the lens to the point that a sample looks through [m]; the first looks through the middle."""
        x, y = disk(*((0.5 + radical_inverse(sample, base)) % 1.0 for base in BASES))
        if self.blades >= FEWEST_BLADES:
            x, y = _polygon(x, y, self.blades, self.rotation)
        return self.radius * (x / self.ratio * self.right + y * self.up)

    def defocus(self) -> Vector:
        """Return the four numbers whose product with a point (x, y, z, 1) says how far it is from the plane in focus.

        They are 1 at the lens, 0 in focus and below 0 behind.
        """
        return Vector((*(self.axis / self.focus), 1.0 - self.center.dot(self.axis) / self.focus))

    def shear(self, offset: Vector) -> Matrix:
        """Return the shear of the world that keeps what is in focus, and brings the point at `offset` of the lens to its middle."""
        defocus = self.defocus()
        return Matrix.Identity(4) - Matrix([move * defocus for move in (*offset, 0.0)])


def read_lens(camera: bpy.types.Object, place: Matrix) -> Lens | None:
    """Return the lens of an evaluated camera that stands at `place`, as in Cycles; None where all is in focus."""
    data = camera.data
    dof = data.dof
    if not dof.use_dof or data.type not in {"PERSP", "ORTHO"}:
        return None
    right, up, axis = (place.col[column].to_3d().normalized() for column in range(3))
    diameter = (data.lens * 0.001 if data.type == "PERSP" else 1.0) / max(dof.aperture_fstop, SMALLEST)
    return Lens(
        center=place.translation.copy(),
        right=right,
        up=up,
        axis=axis,
        focus=max(_focus_distance(dof, place.translation, axis), SMALLEST),
        radius=diameter / 2.0,
        ratio=dof.aperture_ratio,
        blades=dof.aperture_blades,
        rotation=dof.aperture_rotation,
    )


def _focus_distance(dof: bpy.types.CameraDOFSettings, center: Vector, axis: Vector) -> float:
    """Return how far the plane in focus is: that of the focus object or its bone, else the distance that is set."""
    item = dof.focus_object
    if item is None:
        return dof.focus_distance
    bone = item.pose.bones.get(dof.focus_subtarget) if item.pose else None
    target = item.matrix_world @ bone.matrix if bone else item.matrix_world
    return abs(axis.dot(center - target.translation))


def _polygon(x: float, y: float, corners: int, rotation: float) -> tuple[float, float]:
    """Return the point of a regular polygon in a circle of radius 1 for one of the disk; equal areas stay equal.

    The middle of its first side is at the angle `rotation`. Each sector of the disk becomes a triangle, its circles lines.
    """
    half = math.pi / corners
    side = math.floor(math.atan2(y, x) / (2.0 * half) + 0.5)
    along, radius = math.atan2(y, x) - 2.0 * half * side, math.hypot(x, y)
    turn = rotation + 2.0 * half * side
    out, aside = radius * math.cos(half), radius * math.sin(half) * along / half
    return out * math.cos(turn) - aside * math.sin(turn), out * math.sin(turn) + aside * math.cos(turn)
