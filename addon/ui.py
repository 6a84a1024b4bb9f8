# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus: Shader Editor > Add > True Diffuse, and 3D Viewport > Object > Choose Lamps."""

import bpy

from .nodes import GROUPS
from .operators import TRUE_DIFFUSE_OT_add_group, TRUE_DIFFUSE_OT_choose_lamps


class TRUE_DIFFUSE_MT_add(bpy.types.Menu):
    """Rough diffuse node groups"""

    bl_idname = "TRUE_DIFFUSE_MT_add"
    bl_label = "True Diffuse"

    def draw(self, context: bpy.types.Context) -> None:
        for group in GROUPS:
            self.layout.operator(TRUE_DIFFUSE_OT_add_group.bl_idname, text=group.label).key = group.key
        self.layout.separator()
        self.layout.operator(TRUE_DIFFUSE_OT_choose_lamps.bl_idname)


def draw_add_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entry at the end of the Shader Editor's Add menu."""
    space = context.space_data
    if space.tree_type == "ShaderNodeTree" and (space.id is None or isinstance(space.id, (bpy.types.Material, bpy.types.Light))):
        self.layout.separator()
        self.layout.menu(TRUE_DIFFUSE_MT_add.bl_idname)


def draw_object_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry at the end of the 3D Viewport's Object menu."""
    self.layout.separator()
    self.layout.operator(TRUE_DIFFUSE_OT_choose_lamps.bl_idname)


_register_classes, _unregister_classes = bpy.utils.register_classes_factory((TRUE_DIFFUSE_MT_add,))


def register() -> None:
    _register_classes()
    bpy.types.NODE_MT_add.append(draw_add_menu)
    bpy.types.VIEW3D_MT_object.append(draw_object_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_object.remove(draw_object_menu)
    bpy.types.NODE_MT_add.remove(draw_add_menu)
    _unregister_classes()
