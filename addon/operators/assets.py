# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that put the asset library among the user's, and remove it again."""

import bpy

from ..blender.extension import PACKAGE


class ChangesAssets(bpy.types.Operator):
    """What operators share that change the library: nothing of it is in the open file, so nothing is to undo."""

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if not PACKAGE.startswith("bl_ext."):
            cls.poll_message_set("Install True Diffuse as an extension")
            return False
        return True


class TRUE_DIFFUSE_OT_add_assets(ChangesAssets):
    """Make a library of True Diffuse materials and node groups and show it in the Asset Browser; takes some seconds"""

    bl_idname = "true_diffuse.add_assets"
    bl_label = "Add Asset Library"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import assets

        if context.window:
            context.window.cursor_set("WAIT")
        try:
            assets.add(assets.place())
        except assets.AssetsFailed as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            if context.window:
                context.window.cursor_set("DEFAULT")
        self.report({"INFO"}, f"The Asset Browser has the library {assets.NAME}")
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_remove_assets(ChangesAssets):
    """Remove the library of True Diffuse materials from the Asset Browser and from the disk; files that use them keep them"""

    bl_idname = "true_diffuse.remove_assets"
    bl_label = "Remove Asset Library"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import assets

        assets.remove(assets.place())
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_add_assets, TRUE_DIFFUSE_OT_remove_assets)
