# SPDX-License-Identifier: GPL-3.0-or-later
"""What Realtime draws of each material, by its own description, as far as that names images, attributes and values."""

from collections.abc import Mapping

import bpy

from true_diffuse.addon.realtime.materials import Texture, render_material
from true_diffuse.scripts.census.values import ImageUse, Value, constant, product

type Held = dict[str, dict[str, list[Value]]]


def read(materials: Mapping[str, bpy.types.Material]) -> tuple[Held, list[str]]:
    """Return what is drawn on each channel by the names of the materials, and the lines said."""
    held: Held = {}
    lines: list[str] = []
    for name, material in materials.items():
        drawn = render_material(material, 1.0)
        lines += [f"{name}: {loss}" for loss in getattr(drawn, "losses", ())]
        source = drawn.source
        color = constant(drawn.color)
        if isinstance(source, Texture):
            color = product((color, _texture(source)))
        elif source is not None:
            color = product((color, Value(attributes=frozenset({source.primvar}))))
        held[name] = {"base color": [color]}
        if drawn.coat[0] > 0.0:
            held[name]["roughness"] = [constant(drawn.coat[1])]
        if drawn.has_subsurface:
            held[name]["subsurface"] = [constant(drawn.scattering[3])]
        if drawn.normals:
            held[name]["normal"] = [_texture(drawn.normals.texture).but("NORMAL_MAP")]
    return held, lines


def _texture(texture: Texture) -> Value:
    uv_map = "" if texture.source.primvar == "st" else texture.source.primvar
    return Value(images=frozenset({ImageUse(texture.source.file, "rgb", uv_map)}))
