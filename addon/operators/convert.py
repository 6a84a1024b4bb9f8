# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that make Blender's own materials True Diffuse ones."""

from typing import TYPE_CHECKING

import bpy

from ..closures.quality import BALANCED, PRECISE
from .context import refused_in_editor

if TYPE_CHECKING:
    from ..material.convert import Report

MODES = (
    (BALANCED, BALANCED, "EEVEE is near Cycles, for little more render time"),
    (PRECISE, PRECISE, "EEVEE is nearest to Cycles, for three times the render time and a long wait at first"),
)


class Converts(bpy.types.Operator):
    """What operators share that convert materials."""

    bl_options = {"REGISTER", "UNDO"}

    mode: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Quality", description="How EEVEE makes rough reflection without a highlight", items=MODES
    )

    def tell(self, report: "Report") -> set[str]:
        """Report what was done, in the Info editor line by line, in the status bar its sum; returns what `execute` does."""
        for line in report.lines:
            self.report({"WARNING"}, line)
        names = report.converted
        parts = [f"Converted {names[0] if len(names) == 1 else f'{len(names) or "no"} materials'}", *report.settings]
        if report.lines:
            parts.append(report.lines[0] if len(report.lines) == 1 else f"{len(report.lines)} notes are in the Info editor")
        self.report({"INFO"}, "; ".join(parts))
        return {"FINISHED"} if names or report.settings else {"CANCELLED"}


class TRUE_DIFFUSE_OT_convert(Converts):
    """Make the Diffuse, Principled and Subsurface Scattering BSDFs of the selected objects' materials True Diffuse groups"""

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
        return self.tell(convert.convert_materials(_materials(context), meter, self.mode))


class TRUE_DIFFUSE_OT_convert_nodes(Converts):
    """Make the selected Diffuse, Principled and Subsurface Scattering BSDFs True Diffuse groups, with their values and links"""

    bl_idname = "true_diffuse.convert_nodes"
    bl_label = "Convert to True Diffuse"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        space = context.space_data
        if space is None or space.type != "NODE_EDITOR" or space.edit_tree is None or space.tree_type != "ShaderNodeTree":
            cls.poll_message_set("Open a material in the Shader Editor")
            return False
        refused = refused_in_editor(context)
        if refused:
            cls.poll_message_set(refused)
            return False
        if not _chosen(space.edit_tree):
            cls.poll_message_set("Select a Diffuse, Principled or Subsurface Scattering BSDF")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert
        from ..material.materials import set_thickness

        tree, owner = context.space_data.edit_tree, context.space_data.id
        count, lines = convert.convert_nodes(tree, _chosen(tree), context.scene.unit_settings.scale_length, self.mode)
        if count and isinstance(owner, bpy.types.Material):
            set_thickness(owner)
        return self.tell(convert.Report([owner.name] if count else [], lines=lines))


class TRUE_DIFFUSE_OT_match_engines(Converts):
    """Make EEVEE show the scene as Cycles does: convert the materials that EEVEE reads differently, and align settings"""

    bl_idname = "true_diffuse.match_engines"
    bl_label = "Match EEVEE to Cycles"

    mode: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Quality", description="How EEVEE makes rough reflection without a highlight", items=MODES, default=PRECISE
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.scene.is_editable:
            cls.poll_message_set("The scene is linked from another file")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert

        return self.tell(convert.match_engines(context.scene, self.mode))


def _materials(context: bpy.types.Context) -> list[bpy.types.Material]:
    """Return the material that the Properties editor shows, elsewhere those of the selected objects."""
    if context.space_data is not None and context.space_data.type == "PROPERTIES":
        material = getattr(context, "material", None)
        return [material] if material else []
    slots = (slot for item in context.selected_objects for slot in item.material_slots)
    return list(dict.fromkeys(slot.material for slot in slots if slot.material))


def _chosen(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.Node]:
    from ..material.convert import CONVERTIBLE

    return [node for node in tree.nodes if node.select and node.type in CONVERTIBLE]


CLASSES = (TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_convert_nodes, TRUE_DIFFUSE_OT_match_engines)
