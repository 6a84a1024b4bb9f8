# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on: registered in order, unregistered in reverse. Nothing heavy is imported before it is used."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

    import bpy

    from io_scene_gltf2.io.com.gltf2_io import Material


class glTF2ExportUserExtension:
    """The hook of Blender's glTF exporter, which looks for this name in the modules of add-ons and makes one for each export."""

    def __init__(self) -> None:
        from .gltf.export import Export

        self._export = Export()

    def pre_export_hook(self, settings: dict) -> None:
        self._export.begin()

    def gather_material_hook(self, gltf_material: "Material", material: "bpy.types.Material", settings: dict) -> None:
        self._export.gather_material(gltf_material, material, settings)


def _modules() -> tuple["ModuleType", ...]:
    """Return the modules that register something with Blender, in order."""
    from . import gltf, operators, realtime, ui, usd
    from .blender import properties
    from .handlers import lights, sharing
    from .ui import preferences

    return preferences, properties, operators, ui, realtime, usd, gltf, lights, sharing


def register() -> None:
    for module in _modules():
        module.register()


def unregister() -> None:
    for module in reversed(_modules()):
        module.unregister()
