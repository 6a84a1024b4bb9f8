# SPDX-License-Identifier: GPL-3.0-or-later
"""What a picture is seen through: the projection of all of it, of a part of it, and of one sample of every pixel."""

import math
from dataclasses import dataclass, replace

from mathutils import Matrix, Vector

from . import blocks

BLACKMAN_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)  # Blackman and Harris's window, as cosines of multiples of its angle


@dataclass(frozen=True)
class View:
    """A camera. `projection` takes a point of the world to the clip space of `width` x `height` pixels.

    `eye` is its place [m] in perspective, the direction towards it in a parallel one.
    """

    projection: Matrix
    eye: Vector
    is_perspective: bool
    width: int
    height: int

    def part(self, x: int, y: int, width: int, height: int) -> "View":
        """Return the view of a rectangle of the picture in pixels, `x`, `y` its corner at the bottom left."""
        wide, high = self.width / width, self.height / height
        right, up = wide - 1.0 - 2.0 * x / width, high - 1.0 - 2.0 * y / height
        crop = Matrix(((wide, 0.0, 0.0, right), (0.0, high, 0.0, up), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
        return replace(self, projection=crop @ self.projection, width=width, height=height)

    def shifted(self, x: float, y: float) -> "View":
        """Return the view whose pixels' centers are where this one has what is `x`, `y` pixels right of and above them."""
        shift = Matrix.Translation((-2.0 * x / self.width, -2.0 * y / self.height, 0.0))
        return replace(self, projection=shift @ self.projection)

    @property
    def is_mirrored(self) -> bool:
        """Whether it shows the world as in a mirror, as a camera of a negative scale does."""
        return self.projection.determinant() > 0.0  # the clip space is left-handed

    def pixel_size(self) -> tuple[float, float]:
        """Return what a pixel covers across and along [m], at a depth of 1 m or, in a parallel projection, anywhere."""
        right, up, _, ahead = (row.to_3d() for row in self.projection)  # `ahead` is a unit vector, or 0
        across, along = (2.0 / max((row - row.dot(ahead) * ahead).length, 1e-30) for row in (right, up))
        return across / self.width, along / self.height

    def packed(self, world: tuple[float, float, float]) -> bytes:
        """Return the struct View of program.py, with the world's radiance [W/(m^2 sr)]."""
        return blocks.view(self.projection, self.eye, self.is_perspective, world)


def eye_at(place: Matrix, is_perspective: bool) -> Vector:
    """Return the eye of a View, of a camera that stands at `place` and looks along its -z axis."""
    return place.translation.copy() if is_perspective else (place.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()


def offset(sample: int, size: float) -> tuple[float, float]:
    """Return where a sample is taken, right of and above the pixel's center [pixels], in a filter `size` pixels wide.

    The first is the center's; the rest follow the additive recurrence of the plastic number, which fills a square evenly
    (M. Roberts, 2018), with the density of Blackman and Harris's window, so that all count alike.
    """
    x, y = (_windowed((0.5 + sample * step) % 1.0) for step in (0.7548776662466927, 0.5698402909980532))
    return x * size, y * size


def _windowed(share: float) -> float:
    """Return the place in Blackman and Harris's window, -0.5 to 0.5, below which `share` of it lies."""
    constant, *terms = BLACKMAN_HARRIS
    low, high = -0.5, 0.5
    for _ in range(30):  # halves, to 1e-9
        at = (low + high) / 2.0
        turns = [2.0 * math.pi * k for k in range(1, len(terms) + 1)]
        waves = sum(term * math.sin(turn * (at + 0.5)) / turn for term, turn in zip(terms, turns, strict=True))
        low, high = (at, high) if (at + 0.5) + waves / constant < share else (low, at)
    return (low + high) / 2.0
