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
    from . import appended, lamp_watch, operators, preferences, properties, realtime, ui, usd
    from .leave_out import watch

    preferences.register()
    properties.register()
    operators.register()
    ui.register()
    realtime.register()
    usd.register()
    watch.register()
    lamp_watch.register()
    appended.register()


def unregister() -> None:
    from . import appended, lamp_watch, operators, preferences, properties, realtime, ui, usd
    from .leave_out import watch

    appended.unregister()
    lamp_watch.unregister()
    watch.unregister()
    usd.unregister()
    realtime.unregister()
    ui.unregister()
    operators.unregister()
    properties.unregister()
    preferences.unregister()
