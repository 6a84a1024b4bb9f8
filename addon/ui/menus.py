# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus: Shader Editor > Add > True Diffuse, and 3D Viewport > Object > True Diffuse."""

import bpy
import bpy.utils.previews

from ..nodes import GROUPS
from ..operators.add import TRUE_DIFFUSE_OT_add_group
from ..operators.lamps import TRUE_DIFFUSE_OT_choose_lamps
from ..operators.presets import TRUE_DIFFUSE_OT_add_preset, TRUE_DIFFUSE_OT_assign_preset
from ..presets import PRESETS

COLUMNS = 3
PICTURE_SIZE = 4.0  # times an icon's
pictures: bpy.utils.previews.ImagePreviewCollection  # by a preset's key, while the extension is registered


class TRUE_DIFFUSE_MT_skin(bpy.types.Menu):
    """Tones of skin"""

    bl_idname = "TRUE_DIFFUSE_MT_skin"
    bl_label = "Skin"

    def draw(self, context: bpy.types.Context) -> None:
        draw_presets(self.layout, context, self.bl_label)


class TRUE_DIFFUSE_MT_media(bpy.types.Menu):
    """Measured media"""

    bl_idname = "TRUE_DIFFUSE_MT_media"
    bl_label = "Media"

    def draw(self, context: bpy.types.Context) -> None:
        draw_presets(self.layout, context, self.bl_label)


class TRUE_DIFFUSE_MT_add(bpy.types.Menu):
    """Rough diffuse and subsurface node groups, and materials made of them"""

    bl_idname = "TRUE_DIFFUSE_MT_add"
    bl_label = "True Diffuse"

    def draw(self, context: bpy.types.Context) -> None:
        for group in GROUPS:
            self.layout.operator(TRUE_DIFFUSE_OT_add_group.bl_idname, text=group.label).key = group.key
        self.layout.separator()
        draw_common(self.layout)


class TRUE_DIFFUSE_MT_object(bpy.types.Menu):
    """Materials for the selected objects, and the lamps they are exact for"""

    bl_idname = "TRUE_DIFFUSE_MT_object"
    bl_label = "True Diffuse"

    def draw(self, context: bpy.types.Context) -> None:
        draw_common(self.layout)


def draw_presets(layout: bpy.types.UILayout, context: bpy.types.Context, kind: str) -> None:
    """Draw pictures of the presets of `kind`, and names that add a node in the Shader Editor, elsewhere give objects a material."""
    in_shader_editor = context.space_data.type == "NODE_EDITOR"
    operator = TRUE_DIFFUSE_OT_add_preset if in_shader_editor else TRUE_DIFFUSE_OT_assign_preset
    presets = [preset for preset in PRESETS.values() if preset.kind == kind]
    row = layout.row()
    for first in range(COLUMNS):  # one after the other: Blender puts a picture right of all that came before it in other columns
        column = row.column()
        for preset in presets[first::COLUMNS]:
            column.template_icon(pictures[preset.key].icon_id, scale=PICTURE_SIZE)
            column.operator(operator.bl_idname, text=preset.name).key = preset.key


def draw_common(layout: bpy.types.UILayout) -> None:
    """Draw what either editor's menu has."""
    layout.menu(TRUE_DIFFUSE_MT_skin.bl_idname)
    layout.menu(TRUE_DIFFUSE_MT_media.bl_idname)
    layout.separator()
    layout.operator(TRUE_DIFFUSE_OT_choose_lamps.bl_idname)


def draw_add_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entry at the end of the Shader Editor's Add menu."""
    space = context.space_data
    if space.tree_type == "ShaderNodeTree" and (space.id is None or isinstance(space.id, (bpy.types.Material, bpy.types.Light))):
        self.layout.separator()
        self.layout.menu(TRUE_DIFFUSE_MT_add.bl_idname)


def draw_object_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry at the end of the 3D Viewport's Object menu."""
    self.layout.separator()
    self.layout.menu(TRUE_DIFFUSE_MT_object.bl_idname)


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    (TRUE_DIFFUSE_MT_skin, TRUE_DIFFUSE_MT_media, TRUE_DIFFUSE_MT_add, TRUE_DIFFUSE_MT_object)
)


def register() -> None:
    global pictures
    pictures = bpy.utils.previews.new()
    for key, preset in PRESETS.items():
        pictures.load(key, str(preset.picture), "IMAGE")
    _register_classes()
    bpy.types.NODE_MT_add.append(draw_add_menu)
    bpy.types.VIEW3D_MT_object.append(draw_object_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_object.remove(draw_object_menu)
    bpy.types.NODE_MT_add.remove(draw_add_menu)
    _unregister_classes()
    bpy.utils.previews.remove(pictures)
