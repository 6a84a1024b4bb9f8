# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes part in Blender's own File > Export > USD and File > Import > USD. pxr is Blender's.

Enabling the add-on imports this module, so it imports the others, and pxr, when Blender calls.

Whatever goes wrong with a material, the export or import goes on, the material is as Blender makes it, and a line says so.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import bpy

from ..blender import report

if TYPE_CHECKING:
    from pxr import Sdf, Usd, UsdShade

FAILURES = (RuntimeError, TypeError, ValueError, LookupError, AttributeError, ArithmeticError, OSError, ReferenceError)


class MaterialExport(Protocol):
    """What Blender hands to `on_material_export`."""

    def export_texture(self, image: bpy.types.Image) -> str: ...


class SceneExport(Protocol):
    """What Blender hands to `on_export`."""

    def get_stage(self) -> "Usd.Stage": ...
    def get_prim_map(self) -> Mapping["Sdf.Path", Sequence[bpy.types.ID]]: ...


class MaterialImport(Protocol):
    """What Blender hands to `on_material_import`."""

    def import_texture(self, file: str) -> tuple[str, bool]: ...


class TRUE_DIFFUSE_USD_hook(bpy.types.USDHook):
    """Blender calls these for every material, in a thread of its own where there is a window."""

    bl_idname = "TRUE_DIFFUSE_USD_hook"
    bl_label = "True Diffuse"
    bl_description = "Carries True Diffuse materials to USD and back"

    @staticmethod
    def on_material_export(context: MaterialExport, material: bpy.types.Material, usd_material: "UsdShade.Material") -> bool:
        return _guarded(material.name, lambda: export_material(context.export_texture, material, usd_material))

    @staticmethod
    def on_export(context: SceneExport) -> bool:
        return _guarded("materials of one name", lambda: part_materials(context.get_stage(), context.get_prim_map()))

    @staticmethod
    def material_import_poll(_context: MaterialImport, usd_material: "UsdShade.Material") -> bool:
        from ..material.surface import KEY

        return usd_material.GetPrim().HasCustomDataKey(KEY)

    @staticmethod
    def on_material_import(context: MaterialImport, material: bpy.types.Material, usd_material: "UsdShade.Material") -> bool:
        return _guarded(material.name, lambda: import_material(context.import_texture, material, usd_material))


def _guarded(name: str, work: Callable[[], bool]) -> bool:
    """Return what `work` does, or False and say so where it fails."""
    from pxr import Tf

    try:
        return work()
    except (*FAILURES, Tf.CppException) as error:
        report.add(name, f"is left as Blender has it: {str(error).partition('\n')[0] or type(error).__name__}")
        return False


def export_material(
    export_texture: Callable[[bpy.types.Image], str], material: bpy.types.Material, usd_material: "UsdShade.Material"
) -> bool:
    """Write both networks and the values of one of our materials; returns False where it is none of ours."""
    from ..material.read import Names, group_node, identifier, read

    found = group_node(material)
    if found is None:
        return False
    from . import author, materialx, preview

    stage = usd_material.GetPrim().GetStage()
    surface, lost = read(*found, Names(lambda image: _file(stage, image, export_texture), identifier))
    lost += [*materialx.lost(surface), *preview.lost(surface)]
    author.write(usd_material, preview.network(surface), materialx.network(surface, millimeter(stage)))
    author.remember(usd_material.GetPrim(), surface, lost)
    for text in lost:
        report.add(material.name, text)
    return True


def millimeter(stage: "Usd.Stage") -> float:
    """Return a millimeter in the stage's units. Blender's exporter takes its own unit for a meter, whatever the scene says."""
    from pxr import UsdGeom

    scale = bpy.context.scene.unit_settings.scale_length if bpy.context.scene else 1.0
    return 0.001 / (scale if scale > 0.0 else 1.0) / UsdGeom.GetStageMetersPerUnit(stage)


def _file(stage: "Usd.Stage", image: bpy.types.Image, export_texture: Callable[[bpy.types.Image], str]) -> str:
    """Return how the stage refers to `image`, after writing it. Raises Lost where the file is not there then."""
    from ..material.read import Lost

    path = export_texture(image)
    if not path or not Path(stage.GetRootLayer().ComputeAbsolutePath(path)).is_file():
        raise Lost(f"the missing image {image.name}")
    return path


def part_materials(stage: "Usd.Stage", written: Mapping["Sdf.Path", Sequence[bpy.types.ID]]) -> bool:
    """Part materials that have one name in USD; `written` are the data-blocks that Blender wrote, by prim."""
    from . import names

    return names.part(stage, written, partial(export_material, _no_texture))


def _no_texture(image: bpy.types.Image) -> str:
    from ..material.read import Lost

    raise Lost(f"the image {image.name} of a material whose name another one has in USD")


def import_material(
    import_texture: Callable[[str], tuple[str, bool]], material: bpy.types.Material, usd_material: "UsdShade.Material"
) -> bool:
    """Rebuild one of our materials; returns False where it is none of ours."""
    from . import author
    from .restore import rebuild

    surface = author.recall(usd_material)
    if surface is None:
        return False
    for text in rebuild(material, surface, import_texture):
        report.add(material.name, text)
    return True
