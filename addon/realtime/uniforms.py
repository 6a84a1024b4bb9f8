# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders' uniform blocks as bytes in std140 layout. No bpy.

Their structs, in program.py and shaders/lights.glsl, have only vectors and matrices of four components, where std140 pads nothing:
each function packs a struct's members one after another.
"""

import struct
from collections.abc import Iterable, Sequence

from .program import LIGHT_TYPES, MAX_LIGHTS

LIGHT_SIZE = 80  # bytes


def matrix_to_bytes(matrix: Iterable[Iterable[float]]) -> bytes:
    """Return a mat4, column by column; `matrix` is given by rows, as mathutils.Matrix is."""
    return struct.pack("16f", *(value for column in zip(*matrix, strict=True) for value in column))


def view_to_bytes(
    projection: Iterable[Iterable[float]], eye: Sequence[float], is_perspective: bool, world: Sequence[float]
) -> bytes:
    """Return the struct View.

    `projection` goes from the world to clip space. `eye` is the camera's position [m] or, in a parallel projection, the unit vector
    towards it. `world` is the world's radiance [W/(m^2 sr)].
    """
    return matrix_to_bytes(projection) + struct.pack("8f", *eye, float(is_perspective), *world, 0.0)


def material_to_bytes(
    color: Sequence[float],
    shape: Sequence[float],
    coat: Sequence[float],
    scattering: Sequence[float],
    normal_strength: tuple[float, float] = (0.0, 0.0),
) -> bytes:
    """Return the struct Material.

    `shape` holds up to four numbers that the model folds from the material's inputs; `normal_strength` scales a normal map along u
    and v; the others are as in materials.RenderMaterial.
    """
    u, v = normal_strength
    return struct.pack("16f", *color, u, *(*shape, 0.0, 0.0, 0.0, 0.0)[:4], *coat, v, *scattering)


def light_to_bytes(
    kind: str,
    position: Sequence[float],
    axis: Sequence[float],
    strength: Sequence[float],
    edge: float = 0.0,
    fade: float = 0.0,
    x_axis: Sequence[float] = (0.0, 0.0, 0.0),
    y_axis: Sequence[float] = (0.0, 0.0, 0.0),
) -> bytes:
    """Return the struct Light of lights.glsl; the arguments are as in lights.Light. Raises ValueError for an unknown `kind`."""
    number = float(LIGHT_TYPES.index(kind))
    return struct.pack("20f", *position, number, *axis, edge, *strength, fade, *x_axis, 0.0, *y_axis, 0.0)


def lights_to_bytes(lights: Sequence[bytes]) -> bytes:
    """Return the struct Lights of the first MAX_LIGHTS of `lights`, each from `light_to_bytes`."""
    used = lights[:MAX_LIGHTS]
    return struct.pack("4i", len(used), 0, 0, 0) + b"".join(used) + bytes(LIGHT_SIZE * (MAX_LIGHTS - len(used)))
