# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on: registered in order, unregistered in reverse. Nothing heavy is imported before it is used."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType

    import bpy

    from io_scene_gltf2.blender.exp.material.encode_image import ExportImage
    from io_scene_gltf2.io.com.gltf2_io import Gltf, Image, Material
    from io_scene_gltf2.io.imp.gltf2_io_gltf import glTFImporter


class glTF2ExportUserExtension:
    """The hook of Blender's glTF exporter, which looks for this name in the modules of add-ons and makes one for each export."""

    def __init__(self) -> None:
        from .gltf.export import Export

        self._export = Export()

    def pre_export_hook(self, settings: dict) -> None:
        self._export.begin()

    def gather_material_hook(self, gltf_material: "Material", material: "bpy.types.Material", settings: dict) -> None:
        self._export.gather_material(gltf_material, material, settings)

    def gather_image_hook(self, image: "Image", export_image: "ExportImage", _sockets: object, settings: dict) -> None:
        self._export.extras.add_image(image, export_image, settings)

    def gather_gltf_hook(self, _scene: int, _scenes: object, _animations: object, settings: dict) -> None:
        self._export.write_extras(settings)

    def gather_gltf_extensions_hook(self, document: "Gltf", _settings: dict) -> None:
        self._export.extras.write_values(document)


class glTF2ImportUserExtension:
    """The hook of Blender's glTF importer, which looks for this name in the modules of add-ons and makes one for each import."""

    def __init__(self) -> None:
        from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

        from .gltf.diffuse_roughness import NAME
        from .gltf.importer import Import

        self._import = Import()
        self.extensions = [Extension(NAME, {}, required=True)]  # the importer refuses what it does not know

    def gather_import_gltf_before_hook(self, _gltf: "glTFImporter") -> None:
        self._import.begin()

    def gather_import_material_before_hook(
        self, gltf_material: "Material", _vertex_color: str | None, _gltf: "glTFImporter"
    ) -> None:
        self._import.take_extras(gltf_material)

    def gather_import_material_after_hook(
        self, gltf_material: "Material", vertex_color: str | None, material: "bpy.types.Material", gltf: "glTFImporter"
    ) -> None:
        self._import.add(gltf, gltf_material, vertex_color, material)

    def gather_import_scene_after_animation_hook(self, _gltf_scene: object, _scene: object, gltf: "glTFImporter") -> None:
        self._import.finish(gltf)


def _modules() -> tuple["ModuleType", ...]:
    """Return the modules that register something with Blender, in order."""
    from . import gltf, operators, realtime, ui, usd
    from .blender import asset_library, properties
    from .handlers import lights, new_nodes
    from .ui import preferences

    return preferences, properties, operators, ui, realtime, usd, gltf, lights, new_nodes, asset_library


def register() -> None:
    for module in _modules():
        module.register()


def unregister() -> None:
    for module in reversed(_modules()):
        module.unregister()
