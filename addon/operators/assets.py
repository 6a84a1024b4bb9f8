# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that add the asset library to the user's libraries, and remove it."""

import bpy

from ..blender import asset_library
from ..blender.extension import IS_INSTALLED
from .base import Operator


class ChangeAssets(Operator):
    """Base of operators that change the library."""

    bl_options = {"REGISTER"}  # the open file does not change, so there is nothing to undo

    @classmethod
    def obstacle(cls, _context: bpy.types.Context) -> str:
        return "" if IS_INSTALLED else "Install True Diffuse as an extension"


class TRUE_DIFFUSE_OT_add_assets(ChangeAssets):
    """Write a library of True Diffuse materials for the Asset Browser; takes some seconds"""

    bl_idname = "true_diffuse.add_assets"
    bl_label = "Add True Diffuse Asset Library"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import assets

        if context.window:
            context.window.cursor_set("WAIT")
        try:
            assets.add(asset_library.folder())
        except assets.AssetError as error:
            return self.cancel_with(error)
        finally:
            if context.window:
                context.window.cursor_set("DEFAULT")
        count = len(assets.PRESETS) + len(assets.GROUPS)
        self.report({"INFO"}, f"The library {asset_library.NAME} is in the Asset Browser: {count} materials")
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_remove_assets(ChangeAssets):
    """Delete the library of True Diffuse materials; files that use its materials keep them"""

    bl_idname = "true_diffuse.remove_assets"
    bl_label = "Remove True Diffuse Asset Library"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..material import assets

        assets.remove(asset_library.folder())
        self.report({"INFO"}, f"Removed the library {asset_library.NAME} from the Asset Browser")
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_add_assets, TRUE_DIFFUSE_OT_remove_assets)
