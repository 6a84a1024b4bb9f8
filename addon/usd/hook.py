# SPDX-License-Identifier: GPL-3.0-or-later
"""The hook that Blender calls in File > Export > USD and File > Import > USD, with Blender's own pxr.

Enabling the extension imports this module, so it imports the other modules and pxr only when Blender calls it. After a failure the
export or import goes on, the material stays as Blender makes it, and a message says so.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import bpy

from ..blender import report

if TYPE_CHECKING:
    from pxr import Sdf, Usd, UsdShade

    from .export import Export

FAILURES = (RuntimeError, TypeError, ValueError, LookupError, AttributeError, ArithmeticError, OSError, ReferenceError)


class MaterialExport(Protocol):
    """What Blender hands to `on_material_export`."""

    def get_stage(self) -> "Usd.Stage": ...
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
        return _guarded(material.name, lambda: _export_of(context.get_stage()).add(material, usd_material, context.export_texture))

    @staticmethod
    def on_export(context: SceneExport) -> bool:
        return _guarded("this export", lambda: _finish(context.get_stage(), context.get_prim_map()))

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


_exports: dict[str, "Export"] = {}
"""What is known of the stages that Blender writes now, by their files."""


def _export_of(stage: "Usd.Stage") -> "Export":
    from .export import Export

    file = stage.GetRootLayer().identifier
    if file not in _exports or _exports[file].stage != stage:  # one whose export failed may be left
        _exports[file] = Export(stage)
    return _exports[file]


def _finish(stage: "Usd.Stage", written: Mapping["Sdf.Path", Sequence[bpy.types.ID]]) -> bool:
    """Separate materials of equal names, and settle the names of UV maps and attributes; returns whether there was any."""
    export = _export_of(stage)
    try:
        return export.finish(written)
    finally:
        del _exports[stage.GetRootLayer().identifier]


def import_material(
    import_texture: Callable[[str], tuple[str, bool]], material: bpy.types.Material, usd_material: "UsdShade.Material"
) -> bool:
    """Rebuild one of our materials. Where that raises, the material has the nodes again that Blender gave it."""
    from ..material.restore import undone_on_failure
    from .restore import rebuild

    with undone_on_failure(material):
        for message in rebuild(material, usd_material, import_texture):
            report.add(material.name, message)
    return True
