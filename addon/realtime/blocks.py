# SPDX-License-Identifier: GPL-3.0-or-later
"""What the shaders' uniform blocks hold, as bytes: the structs of program.py in std140. No bpy."""

import struct
from collections.abc import Iterable, Sequence

from .program import KINDS, MOST_LAMPS

LAMP_SIZE = 80  # bytes


def columns(matrix: Iterable[Iterable[float]]) -> bytes:
    """Return a matrix of four rows as shaders take it, column by column."""
    return struct.pack("16f", *(value for column in zip(*matrix, strict=True) for value in column))


def view(projection: Iterable[Iterable[float]], eye: Sequence[float], is_perspective: bool, world: Sequence[float]) -> bytes:
    """Return the struct View: `projection` from the world to clip space, where the `eye` is [m] or, in a parallel projection, the
    direction towards it, and the radiance of the `world` [W/(m^2 sr)].
    """
    return columns(projection) + struct.pack("8f", *eye, float(is_perspective), *world, 0.0)


def material(
    color: Sequence[float],
    shape: Sequence[float],
    coat: Sequence[float],
    scattering: Sequence[float],
    relief: tuple[float, float] = (0.0, 0.0),
) -> bytes:
    """Return the struct Material; `shape` are the up to four numbers that a law folds, the others as materials.Look has them."""
    return struct.pack("16f", *color, relief[0], *(*shape, 0.0, 0.0, 0.0, 0.0)[:4], *coat, relief[1], *scattering)


def lamp(
    kind: str,
    place: Sequence[float],
    towards: Sequence[float],
    strength: Sequence[float],
    edge: float = 0.0,
    fade: float = 0.0,
    across: Sequence[float] = (0.0, 0.0, 0.0),
    up: Sequence[float] = (0.0, 0.0, 0.0),
) -> bytes:
    """Return the struct Lamp of shaders/lights.glsl; the arguments are as lights.Lamp has them."""
    number = float(KINDS.index(kind))
    return struct.pack("20f", *place, number, *towards, edge, *strength, fade, *across, 0.0, *up, 0.0)


def lamps(packed: Sequence[bytes]) -> bytes:
    """Return the struct Lamps, with at most MOST_LAMPS of the `packed` lamps."""
    used = packed[:MOST_LAMPS]
    return struct.pack("4i", len(used), 0, 0, 0) + b"".join(used) + bytes(LAMP_SIZE * (MOST_LAMPS - len(used)))
