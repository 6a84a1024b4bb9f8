# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that convert Blender's own materials to True Diffuse."""

import functools
from typing import TYPE_CHECKING

import bpy

from .context import locked_reason_in_editor

if TYPE_CHECKING:
    from ..material.convert import Report


@functools.cache  # Blender needs the strings to stay
def _qualities() -> tuple[tuple[str, str, str], ...]:
    from ..closures.quality import BALANCED, PRECISE

    return (
        (BALANCED, BALANCED, "EEVEE close to Cycles, for little more render time"),
        (PRECISE, PRECISE, "EEVEE closest to Cycles, for three times the render time, and slow to start"),
    )


def _items(_operator: bpy.types.Operator, _context: bpy.types.Context | None) -> tuple[tuple[str, str, str], ...]:
    return _qualities()


class Converts(bpy.types.Operator):
    """Base of operators that convert materials."""

    bl_options = {"REGISTER", "UNDO"}

    quality: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Quality", description="Quality of the Rough Diffuse groups", items=_items
    )

    def report_conversion(self, report: "Report") -> set[str]:
        """Report each line in the Info editor and a summary in the status bar; returns what `execute` returns."""
        for line in report.lines:
            self.report({"WARNING"}, line)
        names = report.converted
        parts = [f"Converted {names[0] if len(names) == 1 else f'{len(names) or "no"} materials'}", *report.settings]
        if report.lines:
            parts.append(report.lines[0] if len(report.lines) == 1 else f"{len(report.lines)} notes are in the Info editor")
        self.report({"INFO"}, "; ".join(parts))
        return {"FINISHED"} if names or report.settings else {"CANCELLED"}


class TRUE_DIFFUSE_OT_convert(Converts):
    """Replace the Diffuse, Principled and Subsurface Scattering BSDFs of the selected objects' materials by True Diffuse groups"""

    bl_idname = "true_diffuse.convert"
    bl_label = "Convert to True Diffuse"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _materials(context):
            cls.poll_message_set("Select objects with materials")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert

        meter = context.scene.unit_settings.scale_length
        return self.report_conversion(convert.convert_materials(_materials(context), meter, self.quality))


class TRUE_DIFFUSE_OT_convert_nodes(Converts):
    """Replace the selected Diffuse, Principled and Subsurface Scattering BSDFs by True Diffuse groups, with values and links"""

    bl_idname = "true_diffuse.convert_nodes"
    bl_label = "Convert to True Diffuse"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        space = context.space_data
        if space is None or space.type != "NODE_EDITOR" or space.edit_tree is None or space.tree_type != "ShaderNodeTree":
            cls.poll_message_set("Open a material in the Shader Editor")
            return False
        reason = locked_reason_in_editor(context)
        if reason:
            cls.poll_message_set(reason)
            return False
        if not _selected(space.edit_tree):
            cls.poll_message_set("Select a Diffuse, Principled or Subsurface Scattering BSDF")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert
        from ..material.materials import set_thickness

        tree, owner = context.space_data.edit_tree, context.space_data.id
        count, lines = convert.convert_nodes(tree, _selected(tree), context.scene.unit_settings.scale_length, self.quality)
        if count and isinstance(owner, bpy.types.Material):
            set_thickness(owner)
        return self.report_conversion(convert.Report([owner.name] if count else [], lines=lines))


class TRUE_DIFFUSE_OT_match_engines(Converts):
    """Make EEVEE look like Cycles: convert the materials that the engines shade differently, and align render settings"""

    bl_idname = "true_diffuse.match_engines"
    bl_label = "Match EEVEE to Cycles"

    quality: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Quality", description="Quality of the Rough Diffuse groups", items=_items, default=1
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.is_editable:
            cls.poll_message_set("The scene is linked from another file")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert

        return self.report_conversion(convert.match_engines(context.scene, self.quality))


def _materials(context: bpy.types.Context) -> list[bpy.types.Material]:
    """Return the Properties editor's material, in other editors the materials of the selected objects."""
    if context.space_data is not None and context.space_data.type == "PROPERTIES":
        material = getattr(context, "material", None)
        return [material] if material else []
    slots = (slot for item in context.selected_objects for slot in item.material_slots)
    return list(dict.fromkeys(slot.material for slot in slots if slot.material))


def _selected(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.Node]:
    from ..material.convert import CONVERTIBLE

    return [node for node in tree.nodes if node.select and node.type in CONVERTIBLE]


CLASSES = (TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_convert_nodes, TRUE_DIFFUSE_OT_match_engines)
