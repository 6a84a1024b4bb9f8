# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus named True Diffuse: 3D Viewport > Object, Shader Editor > Add and Node; and entries in other menus of Blender.

Blender's menu search (F3) finds only what stands in the menus of editors, so whatever an artist may search for does.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING

import bpy
import bpy.utils.previews

from ..operators.add import TRUE_DIFFUSE_OT_add_group
from ..operators.assets import TRUE_DIFFUSE_OT_add_assets
from ..operators.context import is_node_editor, material_of, node_of
from ..operators.convert import (
    TRUE_DIFFUSE_OT_convert,
    TRUE_DIFFUSE_OT_convert_nodes,
    TRUE_DIFFUSE_OT_match_engines,
    TRUE_DIFFUSE_OT_revert,
)
from ..operators.exports import TRUE_DIFFUSE_OT_check_exports
from ..operators.lights import TRUE_DIFFUSE_OT_use_selected_lights
from ..operators.measure import TRUE_DIFFUSE_OT_measure
from ..operators.presets import TRUE_DIFFUSE_OT_add_preset, TRUE_DIFFUSE_OT_apply_preset, TRUE_DIFFUSE_OT_assign_preset
from ..operators.scene import TRUE_DIFFUSE_OT_build_comparison
from ..operators.upgrade import TRUE_DIFFUSE_OT_upgrade

if TYPE_CHECKING:
    from ..material.presets import Preset

COLUMNS = 3
GALLERY_COLUMNS = 6
PICTURE_SIZE = 3.2  # times an icon's
BALL_SIZE = 96  # pixels across the picture of what is no preset
pictures: bpy.utils.previews.ImagePreviewCollection  # of the presets drawn so far, by key; set while the extension is registered


class PresetMenu(bpy.types.Menu):
    """Base of menus of the presets whose kind is the menu's label."""

    def draw(self, context: bpy.types.Context) -> None:
        """Offer the presets: as a new node in the Shader Editor, as a new material of objects in other editors."""
        from ..material.presets import PRESETS

        operator = TRUE_DIFFUSE_OT_add_preset if is_node_editor(context) else TRUE_DIFFUSE_OT_assign_preset
        draw_pictures(self.layout, [preset for preset in PRESETS.values() if preset.kind == self.bl_label], operator)


class TRUE_DIFFUSE_MT_matte(PresetMenu):
    """Chalk, clay and other matte materials"""

    bl_label = "Matte"


class TRUE_DIFFUSE_MT_skin(PresetMenu):
    """Skin tones"""

    bl_label = "Skin"


class TRUE_DIFFUSE_MT_translucent(PresetMenu):
    """Marble, milk and other measured translucent materials"""

    bl_label = "Translucent"


PRESET_MENUS = (TRUE_DIFFUSE_MT_matte, TRUE_DIFFUSE_MT_skin, TRUE_DIFFUSE_MT_translucent)


class TRUE_DIFFUSE_PT_gallery(bpy.types.Panel):
    """All presets, as pictures to click"""

    bl_label = "True Diffuse Presets"
    bl_space_type = "TOPBAR"  # drawn as a popover alone
    bl_region_type = "HEADER"
    bl_ui_units_x = round(GALLERY_COLUMNS * (PICTURE_SIZE + 1.0))

    def draw(self, context: bpy.types.Context) -> None:
        """Offer the presets: for the selected objects in the 3D Viewport, else for the editor's material, in place."""
        from ..material.apply_preset import preset_of
        from ..material.presets import PRESETS

        in_place = context.area.type != "VIEW_3D" and material_of(context) is not None
        operator = TRUE_DIFFUSE_OT_apply_preset if in_place else TRUE_DIFFUSE_OT_assign_preset
        node = node_of(context)
        current = preset_of(node) if node else None
        for menu in PRESET_MENUS:
            presets = [preset for preset in PRESETS.values() if preset.kind == menu.bl_label]
            self.layout.label(text=menu.bl_label)
            for first in range(0, len(presets), GALLERY_COLUMNS):
                row = self.layout.row()
                for preset in presets[first : first + GALLERY_COLUMNS]:
                    draw_card(row, preset, operator, preset == current)
                for _ in range(first + GALLERY_COLUMNS - len(presets)):
                    row.label()  # as wide as a card


class TRUE_DIFFUSE_MT_add(bpy.types.Menu):
    """Rough diffuse and subsurface node groups, and materials made of them"""

    bl_label = "True Diffuse"

    def draw(self, context: bpy.types.Context) -> None:
        from ..nodes import GROUPS

        for group in GROUPS:
            self.layout.operator(TRUE_DIFFUSE_OT_add_group.bl_idname, text=group.label).key = group.key
        self.layout.separator()
        draw_common(self.layout)


class TRUE_DIFFUSE_MT_object(bpy.types.Menu):
    """Materials for the selected objects, and the lights they are exact for"""

    bl_label = "True Diffuse"

    def draw(self, context: bpy.types.Context) -> None:
        draw_common(self.layout)
        for operators in (
            (TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_revert, TRUE_DIFFUSE_OT_upgrade),
            (TRUE_DIFFUSE_OT_use_selected_lights, TRUE_DIFFUSE_OT_match_engines, TRUE_DIFFUSE_OT_build_comparison),
            (TRUE_DIFFUSE_OT_measure, TRUE_DIFFUSE_OT_check_exports),
            (TRUE_DIFFUSE_OT_add_assets,),
        ):
            draw_operators(self.layout, *operators)


class TRUE_DIFFUSE_MT_node(bpy.types.Menu):
    """What to do with the material of the Shader Editor"""

    bl_label = "True Diffuse"

    def draw(self, context: bpy.types.Context) -> None:
        draw_gallery_entry(self.layout)
        draw_operators(self.layout, TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_revert, TRUE_DIFFUSE_OT_upgrade)
        draw_operators(self.layout, TRUE_DIFFUSE_OT_use_selected_lights, TRUE_DIFFUSE_OT_measure, TRUE_DIFFUSE_OT_check_exports)


def draw_pictures(layout: bpy.types.UILayout, presets: "Sequence[Preset]", operator: type[bpy.types.Operator]) -> None:
    """Draw a picture and the name of each preset in a menu; both call `operator` with its key.

    Blender's menu search draws menus, too, in no menu's style, to list what has an operator: there each preset is a name alone.
    """
    if layout.emboss == "NORMAL":
        for preset in presets:
            layout.operator(operator.bl_idname, text=preset.name).key = preset.key
        return
    row = layout.row()
    for first in range(COLUMNS):  # column by column: Blender puts a picture right of everything drawn before it in other columns
        column = row.column()
        column.ui_units_x = PICTURE_SIZE + 1.0  # else short names make small pictures
        for preset in presets[first::COLUMNS]:
            draw_card(column, preset, operator)


def draw_card(layout: bpy.types.UILayout, preset: "Preset", operator: type[bpy.types.Operator], is_current: bool = False) -> None:
    """Draw a preset's picture over its name; both call `operator` with its key."""
    card = layout.column(align=True)
    behind_picture(card).operator(operator.bl_idname, text="", depress=is_current).key = preset.key
    card.template_icon(picture(preset), scale=PICTURE_SIZE)
    card.operator(operator.bl_idname, text=preset.name, depress=is_current).key = preset.key


def behind_picture(card: bpy.types.UILayout) -> bpy.types.UILayout:
    """Return a layout for the button that is to lie behind the `template_icon` which is drawn next, of scale PICTURE_SIZE.

    Blender's buttons have small icons, and a large one is a label, which does not react to clicks: so a layout that takes no height
    holds a button as large as the label.
    """
    flat = card.column()
    flat.ui_units_y = 0.01
    button = flat.column()
    button.scale_y = PICTURE_SIZE
    return button


def picture(preset: "Preset | None") -> int:
    """Return the icon of a preset's picture, which is read when it is first drawn; without a preset, that of a gray ball."""
    key = preset.key if preset else ""
    if key not in pictures:
        if preset:
            pictures.load(key, str(preset.picture), "IMAGE")
        else:
            ball = pictures.new(key)
            ball.image_size, ball.image_pixels_float = (BALL_SIZE, BALL_SIZE), [v for pixel in _ball(BALL_SIZE) for v in pixel]
    return pictures[key].icon_id


def _ball(size: int) -> Iterator[tuple[float, float, float, float]]:
    """Yield the pixels of a Lambert ball before black, lit from the upper left, row by row from the lowest."""
    for row, column in product(range(size), repeat=2):
        x, y = (2.4 * (index + 0.5) / size - 1.2 for index in (column, row))
        light = max(y - x + math.sqrt(max(1.0 - x * x - y * y, 0.0)), 0.0) / math.sqrt(3.0) if x * x + y * y < 1.0 else 0.0
        yield (0.6 * light, 0.6 * light, 0.6 * light, 1.0)


def draw_gallery_entry(layout: bpy.types.UILayout) -> None:
    """Draw a menu's entry that opens the gallery in place of the menu: beside it, it would close as the mouse goes there."""
    entry = layout.operator("wm.call_panel", text=f"{TRUE_DIFFUSE_PT_gallery.bl_label}...")
    entry.name, entry.keep_open = TRUE_DIFFUSE_PT_gallery.__name__, False


def draw_common(layout: bpy.types.UILayout) -> None:
    """Draw the presets, which all menus have."""
    for menu in PRESET_MENUS:
        layout.menu(menu.__name__)


def draw_operators(layout: bpy.types.UILayout, *operators: type[bpy.types.Operator]) -> None:
    """Draw entries below a line."""
    layout.separator()
    for operator in operators:
        layout.operator(operator.bl_idname)


def draw_add_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entry at the end of the Shader Editor's Add menu."""
    _draw_menu(self.layout, context, TRUE_DIFFUSE_MT_add)


def draw_node_menu(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entry at the end of the Shader Editor's Node menu."""
    _draw_menu(self.layout, context, TRUE_DIFFUSE_MT_node)


def _draw_menu(layout: bpy.types.UILayout, context: bpy.types.Context, menu: type[bpy.types.Menu]) -> None:
    """Draw the entry of a menu for materials, and none where the editor shows the nodes of a light or a world."""
    space = context.space_data
    if space.tree_type == "ShaderNodeTree" and isinstance(space.id, (bpy.types.Material, type(None))):
        layout.separator()
        layout.menu(menu.__name__)


def draw_library_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry at the end of the Asset Browser's Library menu."""
    draw_operators(self.layout, TRUE_DIFFUSE_OT_add_assets)


def draw_object_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    """Draw the entry at the end of the 3D Viewport's Object menu."""
    self.layout.separator()
    self.layout.menu(TRUE_DIFFUSE_MT_object.__name__)


def draw_convert(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entries at the end of the context menus of objects and of materials."""
    self.layout.separator()
    draw_gallery_entry(self.layout)
    self.layout.operator(TRUE_DIFFUSE_OT_convert.bl_idname)
    if TRUE_DIFFUSE_OT_revert.poll(context):
        self.layout.operator(TRUE_DIFFUSE_OT_revert.bl_idname)


def draw_convert_nodes(self: bpy.types.Menu, context: bpy.types.Context) -> None:
    """Draw the entries at the end of the Shader Editor's context menu of a material, on nodes that they are for."""
    if material_of(context) is None:
        return
    operators = [each for each in (TRUE_DIFFUSE_OT_convert_nodes, TRUE_DIFFUSE_OT_revert) if each.poll(context)]
    self.layout.separator()
    draw_gallery_entry(self.layout)
    for operator in operators:
        self.layout.operator(operator.bl_idname)


# Blender's menus, and the function that draws our entry at their end
ENTRIES = (
    ("NODE_MT_add", draw_add_menu),
    ("NODE_MT_node", draw_node_menu),
    ("ASSETBROWSER_MT_library", draw_library_menu),
    ("VIEW3D_MT_object", draw_object_menu),
    ("VIEW3D_MT_object_context_menu", draw_convert),
    ("MATERIAL_MT_context_menu", draw_convert),
    ("NODE_MT_context_menu", draw_convert_nodes),
)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    (*PRESET_MENUS, TRUE_DIFFUSE_PT_gallery, TRUE_DIFFUSE_MT_add, TRUE_DIFFUSE_MT_node, TRUE_DIFFUSE_MT_object)
)


def register() -> None:
    global pictures
    pictures = bpy.utils.previews.new()
    _register_classes()
    for menu, draw in ENTRIES:
        getattr(bpy.types, menu).append(draw)


def unregister() -> None:
    for menu, draw in reversed(ENTRIES):
        getattr(bpy.types, menu).remove(draw)
    _unregister_classes()
    bpy.utils.previews.remove(pictures)
