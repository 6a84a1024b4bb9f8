# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera's projection of a picture, of a rectangle of it, and of one sample of every pixel."""

import math
import struct
from dataclasses import dataclass, replace

from mathutils import Matrix, Vector

from .lens import Lens

BLACKMAN_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)  # Blackman and Harris's window, as cosines of multiples of its angle


@dataclass(frozen=True)
class View:
    """A camera. `projection` takes a point of the world to the clip space of `width` x `height` pixels.

    `eye` is its position [m] in perspective, and the unit vector towards it in a parallel projection. What has the depth d in clip
    space, -1 to 1, is (x + y d) / (z + w d) of `distances` away along the view's axis [m]. `lens` is None where all is in focus.
    """

    projection: Matrix
    eye: Vector
    is_perspective: bool
    width: int
    height: int
    distances: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 0.0)
    lens: Lens | None = None

    def cropped(self, x: int, y: int, width: int, height: int) -> "View":
        """Return the view of a rectangle of the picture in pixels; `x`, `y` is its corner at the bottom left."""
        scale_x, scale_y = self.width / width, self.height / height
        right, up = scale_x - 1.0 - 2.0 * x / width, scale_y - 1.0 - 2.0 * y / height
        crop = Matrix(((scale_x, 0.0, 0.0, right), (0.0, scale_y, 0.0, up), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
        return replace(self, projection=crop @ self.projection, width=width, height=height)

    def widened(self, reach: float, depth: float) -> "View":
        """Return the view with as much more around it as `reach` [m] covers at a `depth` [m] along its axis, in whole pixels."""
        scale = max(depth, 1e-6) if self.is_perspective else 1.0
        x, y = (math.ceil(min(reach / (size * scale), 1e6)) for size in self.pixel_size())
        return self.cropped(-x, -y, self.width + 2 * x, self.height + 2 * y)

    def shifted(self, x: float, y: float) -> "View":
        """Return the view with each pixel's center moved by `x` pixels to the right and `y` upwards."""
        shift = Matrix.Translation((-2.0 * x / self.width, -2.0 * y / self.height, 0.0))
        return replace(self, projection=shift @ self.projection)

    def at_sample(self, sample: int, filter_size: float) -> "View":
        """Return the view that a sample has, of another point of every pixel, through another point of the lens.

        `filter_size` is in pixels.
        """
        shifted = self.shifted(*sample_offset(sample, filter_size))
        if not self.lens:
            return shifted
        offset = self.lens.offset(sample)
        eye = self.eye + (offset if self.is_perspective else offset / self.lens.focus)
        return replace(
            shifted,
            projection=shifted.projection @ self.lens.shear(offset),
            eye=eye if self.is_perspective else eye.normalized(),
        )

    def holding(self) -> "tuple[View, ...]":
        """Return views that hold together what all points of the lens see; what they show of it is distorted.

        In front of the plane in focus and behind it, what is seen grows with the distance from that plane.
        """
        if not self.lens:
            return (self,)
        reach = self.lens.radius * max(1.0, 1.0 / self.lens.ratio)
        spread = reach * max(row.to_3d().length for row in self.projection[:2]) * self.lens.defocus()
        rows = self.projection[:3]
        return tuple(replace(self, projection=Matrix((*rows, self.projection[3] + sign * spread))) for sign in (1.0, -1.0))

    @property
    def is_mirrored(self) -> bool:
        """Whether the picture is mirrored, as that of a camera with a negative scale is."""
        return self.projection.determinant() > 0.0  # clip space is left-handed

    def pixel_size(self) -> tuple[float, float]:
        """Return the width and height of a pixel [m], at a depth of 1 m or, in a parallel projection, anywhere."""
        right, up, _, forward = (row.to_3d() for row in self.projection)  # `forward` is a unit vector, or 0
        x, y = (2.0 / max((row - row.dot(forward) * forward).length, 1e-30) for row in (right, up))
        return x / self.width, y / self.height

    def directions(self) -> tuple[Vector, Vector, Vector]:
        """Return vectors R, U and F with x R + y U + F looking at the place x, y of the picture, -1 to 1, at any distance."""
        right, up, _, forward = (row.to_3d() for row in self.projection)
        if not self.is_perspective:
            return Vector(), Vector(), -self.eye
        return tuple(Matrix((right, up, forward)).inverted().col)

    def depth_row(self) -> Vector:
        """Return the vector whose product with a point of the world is its depth [m], as the gather pass has it."""
        return self.projection[3].copy() if self.is_perspective else Vector((*-self.eye, 0.0))

    def from_pixel(self) -> Matrix:
        """Return the matrix whose first two columns, times clip coordinates x and y, third, times a depth, and fourth add up to a
        point of the world [m]; in perspective the first two are to be multiplied by the depth, too.
        """
        right, up = self.projection[0], self.projection[1]
        axes = Matrix((right.to_3d(), up.to_3d(), self.depth_row().to_3d())).inverted_safe()
        origin = self.eye if self.is_perspective else axes @ Vector((-right.w, -up.w, 0.0))
        columns = axes.to_4x4()
        columns.translation = origin
        return columns

    def to_bytes(self, world: tuple[float, float, float], sample: int) -> bytes:
        """Return the struct View of program.py; `world` is the world's radiance [W/(m^2 sr)], `sample` the sample's number."""
        return matrix_to_bytes(self.projection) + struct.pack("8f", *self.eye, self.is_perspective, *world, sample)


def matrix_to_bytes(matrix: Matrix) -> bytes:
    """Return a mat4: 16 floats, column by column."""
    return struct.pack("16f", *(value for column in matrix.col for value in column))


def eye_of(matrix: Matrix, is_perspective: bool) -> Vector:
    """Return View.eye for a camera placed by `matrix`, which looks along its -z axis."""
    return matrix.translation.copy() if is_perspective else (matrix.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()


def distances_of(projection: Matrix, is_perspective: bool) -> tuple[float, float, float, float]:
    """Return View.distances of a camera's `projection`, from its own space, in which it looks along -z, to clip space."""
    slope, offset = projection[2][2], projection[2][3]
    return (offset, 0.0, slope, 1.0) if is_perspective else (offset, -1.0, slope, 0.0)


def sample_offset(sample: int, size: float) -> tuple[float, float]:
    """Return the offset of a sample to the right of and above the pixel's center [pixels], for a filter `size` pixels wide.

    The first sample is at the center. The others follow the additive recurrence of the plastic number, which fills a square evenly
    (M. Roberts, 2018), with the density of Blackman and Harris's window, so that all samples have the same weight.
    """
    x, y = (_warped((0.5 + sample * step) % 1.0) for step in (0.7548776662466927, 0.5698402909980532))
    return x * size, y * size


def _warped(fraction: float) -> float:
    """Return the position in Blackman and Harris's window, -0.5 to 0.5, below which `fraction` of its area lies."""
    constant, *terms = BLACKMAN_HARRIS
    low, high = -0.5, 0.5
    for _ in range(30):  # bisection, to 1e-9
        middle = (low + high) / 2.0
        frequencies = [2.0 * math.pi * k for k in range(1, len(terms) + 1)]
        waves = sum(term * math.sin(f * (middle + 0.5)) / f for term, f in zip(terms, frequencies, strict=True))
        low, high = (middle, high) if (middle + 0.5) + waves / constant < fraction else (low, middle)
    return (low + high) / 2.0
