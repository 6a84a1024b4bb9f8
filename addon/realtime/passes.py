# SPDX-License-Identifier: GPL-3.0-or-later
"""The passes of a render besides Combined and Depth, as Blender, the compositor and the shaders know them."""

from collections.abc import Iterator
from typing import NamedTuple

import bpy


class DataPass(NamedTuple):
    """A pass: its name in Blender, the `setting` of view layers that asks for it, and Blender's names of channels and type.

    `value` is in GLSL, of the variables of surface_fragment.glsl. Of a mean every sample counts, else the first alone, at the
    pixel's center. `follows_opacity`: samples see through a surface by chance, as in Combined; else it is there if it is as opaque
    as the view layer's threshold.
    """

    name: str
    setting: str
    channels: str
    kind: str
    value: str
    is_mean: bool = False
    follows_opacity: bool = False


NUMBER = "texelFetch(numbers, ivec2(object_index & 255, object_index >> 8), 0).xxx"  # of an object, as objects.glsl counts them
DATA_PASSES = (
    DataPass("Position", "use_pass_position", "XYZ", "VECTOR", "world_position"),
    DataPass("Normal", "use_pass_normal", "XYZ", "VECTOR", "n", is_mean=True),
    DataPass("Object Index", "use_pass_object_index", "X", "VALUE", NUMBER),
    DataPass("Material Index", "use_pass_material_index", "X", "VALUE", NUMBER),
    DataPass("Diffuse Color", "use_pass_diffuse_color", "RGB", "COLOR", "weight * albedo", is_mean=True, follows_opacity=True),
)


def asked(layer: bpy.types.ViewLayer) -> Iterator[DataPass]:
    """Yield the passes that a view layer asks for."""
    return (data for data in DATA_PASSES if getattr(layer, data.setting))
