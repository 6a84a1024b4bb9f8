# SPDX-License-Identifier: GPL-3.0-or-later
"""The hook that Blender calls in File > Export > USD and File > Import > USD, with Blender's own pxr.

Enabling the extension imports this module, so it imports the other modules and pxr only when Blender calls it. After a failure the
export or import goes on, the material stays as Blender makes it, and a message says so.
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
    """Called by Blender for every material; with a window, in another thread than the main one."""

    bl_idname = "TRUE_DIFFUSE_USD_hook"
    bl_label = "True Diffuse"
    bl_description = "Carries True Diffuse materials to USD and back"

    @staticmethod
    def on_material_export(context: MaterialExport, material: bpy.types.Material, usd_material: "UsdShade.Material") -> bool:
        return _guarded(material.name, lambda: export_material(context.export_texture, material, usd_material))

    @staticmethod
    def on_export(context: SceneExport) -> bool:
        from .names import separate

        write = partial(export_material, _no_texture)
        return _guarded("materials with equal names", lambda: separate(context.get_stage(), context.get_prim_map(), write))

    @staticmethod
    def material_import_poll(_context: MaterialImport, usd_material: "UsdShade.Material") -> bool:
        from .author import KEY

        return usd_material.GetPrim().HasCustomDataKey(KEY)

    @staticmethod
    def on_material_import(context: MaterialImport, material: bpy.types.Material, usd_material: "UsdShade.Material") -> bool:
        return _guarded(material.name, lambda: import_material(context.import_texture, material, usd_material))


def _guarded(name: str, function: Callable[[], bool]) -> bool:
    """Return the result of `function`; where it raises, report that of the material `name` and return False."""
    from pxr import Tf

    try:
        return function()
    except (*FAILURES, Tf.CppException) as error:
        report.add(name, f"is left as Blender has it: {str(error).partition('\n')[0] or type(error).__name__}")
        return False


def export_material(
    export_texture: Callable[[bpy.types.Image], str], material: bpy.types.Material, usd_material: "UsdShade.Material"
) -> bool:
    """Write both networks and the values of one of our materials; returns False where `material` is another."""
    from ..material.read import Names, group_node, identifier, read

    node = group_node(material)
    if node is None:
        return False
    from . import author, materialx, preview

    stage = usd_material.GetPrim().GetStage()
    everything = read(*node, Names(lambda image: _file(stage, image, export_texture), identifier))
    surface, unsupported = everything.supported(materialx.IMAGES[everything.group], materialx.ATTRIBUTES)
    unsupported += [*materialx.unsupported(surface), *preview.unsupported(surface)]
    author.write(usd_material, preview.network(surface), materialx.network(surface, millimeter(stage)))
    author.write_custom_data(usd_material.GetPrim(), surface, unsupported)
    for message in unsupported:
        report.add(material.name, message)
    return True


def millimeter(stage: "Usd.Stage") -> float:
    """Return a millimeter in the stage's units. Blender's exporter takes its own unit for a meter, whatever the scene says."""
    from pxr import UsdGeom

    scale = bpy.context.scene.unit_settings.scale_length if bpy.context.scene else 1.0
    return 0.001 / (scale if scale > 0.0 else 1.0) / UsdGeom.GetStageMetersPerUnit(stage)


def _file(stage: "Usd.Stage", image: bpy.types.Image, export_texture: Callable[[bpy.types.Image], str]) -> str:
    """Write `image` and return its path in the stage. Raises UnsupportedInput where there is no file afterwards."""
    from ..material.read import UnsupportedInput

    path = export_texture(image)
    if not path or not Path(stage.GetRootLayer().ComputeAbsolutePath(path)).is_file():
        raise UnsupportedInput(f"the missing image {image.name}")
    return path


def _no_texture(image: bpy.types.Image) -> str:
    from ..material.read import UnsupportedInput

    raise UnsupportedInput(f"the image {image.name} of a material whose name another one has in USD")


def import_material(
    import_texture: Callable[[str], tuple[str, bool]], material: bpy.types.Material, usd_material: "UsdShade.Material"
) -> bool:
    """Rebuild one of our materials; returns False where `usd_material` is another."""
    from . import author
    from .restore import rebuild

    surface = author.read_custom_data(usd_material)
    if surface is None:
        return False
    for message in rebuild(material, surface, import_texture):
        report.add(material.name, message)
    return True
