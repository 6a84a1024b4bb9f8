# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's preferences."""

import bpy

from ..blender import asset_library
from ..blender.extension import IS_INSTALLED, PACKAGE, website
from ..operators.assets import TRUE_DIFFUSE_OT_add_assets, TRUE_DIFFUSE_OT_remove_assets


class TrueDiffusePreferences(bpy.types.AddonPreferences):
    """Settings for all files of this user."""

    bl_idname = PACKAGE

    report: bpy.props.StringProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Report",
        description="Report written by scripts/report.py on this machine, which Pick Settings for Error then goes by. "
        "Without one it measures what it needs by itself",
        subtype="FILE_PATH",
    )

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "report")
        folder = asset_library.folder() if IS_INSTALLED else None
        has_library = folder is not None and asset_library.entry(folder) is not None
        if folder and has_library and not asset_library.is_current(folder):
            layout.label(text="Another version of True Diffuse wrote the asset library", icon="INFO")
        row = layout.row()
        if has_library:
            row.operator(TRUE_DIFFUSE_OT_add_assets.bl_idname, text="Update Asset Library", icon="FILE_REFRESH")
            row.operator(TRUE_DIFFUSE_OT_remove_assets.bl_idname, text="Remove Asset Library", icon="TRASH")
        else:
            row.operator(TRUE_DIFFUSE_OT_add_assets.bl_idname, text="Add Asset Library", icon="ASSET_MANAGER")
        address = website()
        if address:
            layout.operator("wm.url_open", text="Manual", icon="HELP").url = address


register, unregister = bpy.utils.register_classes_factory((TrueDiffusePreferences,))
