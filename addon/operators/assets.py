# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that add the asset library to the user's libraries, and remove it."""

import bpy

from ..blender.extension import PACKAGE
from .base import Operator


class ChangeAssets(Operator):
    """Base of operators that change the library."""

    bl_options = {"REGISTER"}  # the open file does not change, so there is nothing to undo

    @classmethod
    def obstacle(cls, _context: bpy.types.Context) -> str:
        return "" if PACKAGE.startswith("bl_ext.") else "Install True Diffuse as an extension"


class TRUE_DIFFUSE_OT_add_assets(ChangeAssets):
    """Write a library of True Diffuse materials and node groups for the Asset Browser; takes some seconds"""

    bl_idname = "true_diffuse.add_assets"
    bl_label = "Add Asset Library"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import assets

        if context.window:
            context.window.cursor_set("WAIT")
        try:
            assets.add(assets.folder())
        except assets.AssetError as error:
            return self.cancel_with(error)
        finally:
            if context.window:
                context.window.cursor_set("DEFAULT")
        self.report({"INFO"}, f"The library {assets.NAME} is in the Asset Browser")
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_remove_assets(ChangeAssets):
    """Delete the library of True Diffuse materials; files that use its materials keep them"""

    bl_idname = "true_diffuse.remove_assets"
    bl_label = "Remove Asset Library"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..material import assets

        assets.remove(assets.folder())
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_add_assets, TRUE_DIFFUSE_OT_remove_assets)
