# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on: registered in order, unregistered in reverse. Nothing heavy is imported before it is used."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import bpy

    from io_scene_gltf2.io.com.gltf2_io import Material


class glTF2ExportUserExtension:
    """Blender's glTF exporter makes one of these for an export; it looks for this name in the modules of add-ons."""

    def gather_material_hook(self, made: "Material", material: "bpy.types.Material", settings: dict) -> None:
        from . import gltf

        gltf.gather_material(made, material, settings)


def register() -> None:
    from . import operators, ui, usd

    operators.register()
    ui.register()
    usd.register()


def unregister() -> None:
    from . import operators, ui, usd

    usd.unregister()
    ui.unregister()
    operators.unregister()
