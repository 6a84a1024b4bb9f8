# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that convert Blender's own materials to True Diffuse."""

import functools
from typing import TYPE_CHECKING

import bpy

from ..blender.wording import counted_names
from .base import Operator
from .context import editor_obstacle, is_node_editor, is_properties_editor, scene_obstacle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..material.convert import Report


@functools.cache  # Blender needs the strings to stay
def _qualities() -> tuple[tuple[str, str, str], ...]:
    from ..closures.quality import BALANCED, PRECISE

    return (
        (BALANCED, BALANCED, "EEVEE close to Cycles, for little more render time"),
        (PRECISE, PRECISE, "EEVEE closest to Cycles under every light, for one and a half to four times the render time"),
    )


def _items(_operator: bpy.types.Operator, _context: bpy.types.Context | None) -> tuple[tuple[str, str, str], ...]:
    return _qualities()


class ConvertOperator(Operator):
    """Base of operators that convert materials."""

    quality: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Quality", description="Quality of the Rough Diffuse groups", items=_items
    )

    def report_conversion(self, report: "Report", unchanged: str) -> set[str]:
        """Report what was converted, or `unchanged` where there was nothing to do; returns what `execute` returns."""
        is_changed = bool(report.converted or report.settings)
        converted = f"Converted {counted_names(report.converted, 'material')}"
        message = "; ".join([converted, *report.settings]) if is_changed or report.lines else unchanged
        self.report_with_notes(message, report.lines)
        return {"FINISHED"} if is_changed else {"CANCELLED"}


class OfMaterials:
    """Base of operators on `_materials`; their docstrings tell of objects."""

    @classmethod
    def description(cls, context: bpy.types.Context, _properties: bpy.types.OperatorProperties) -> str:
        text = cls.__doc__ or ""
        has_own = is_node_editor(context) or is_properties_editor(context)
        return text.replace("the selected objects' materials", "this material") if has_own else text


class TRUE_DIFFUSE_OT_convert(OfMaterials, ConvertOperator):
    """Replace the Diffuse, Principled and Subsurface Scattering BSDFs of the selected objects' materials by True Diffuse groups"""

    bl_idname = "true_diffuse.convert"
    bl_label = "Convert to True Diffuse"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        return "" if _materials(context) else "Select objects with materials"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert

        materials, meter = _materials(context), context.scene.unit_settings.scale_length
        return self.report_conversion(convert.convert_materials(materials, meter, self.quality), _unchanged(materials))


class TRUE_DIFFUSE_OT_convert_nodes(ConvertOperator):
    """Replace the selected Diffuse, Principled and Subsurface Scattering BSDFs by True Diffuse groups, with values and links"""

    bl_idname = "true_diffuse.convert_nodes"
    bl_label = "Convert to True Diffuse"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        message = editor_obstacle(context)
        if not message and not _selected(context.space_data.edit_tree):
            return "Select a Diffuse, Principled or Subsurface Scattering BSDF"
        return message

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert
        from ..material.materials import set_thickness

        tree, material = context.space_data.edit_tree, context.space_data.id
        count, lines = convert.convert_nodes(tree, _selected(tree), context.scene.unit_settings.scale_length, self.quality)
        if count:
            set_thickness(material)
        return self.report_conversion(convert.Report([material.name] if count else [], lines=lines), "Nothing was converted")


class TRUE_DIFFUSE_OT_revert(OfMaterials, Operator):
    """Turn the True Diffuse nodes of the selected objects' materials back into Blender's own, as before a conversion"""

    bl_idname = "true_diffuse.revert"
    bl_label = "Revert to Blender's Nodes"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        from ..material.revert import nodes_of

        if any(nodes_of(material) for material in _materials(context)):
            return ""
        return "Select objects with True Diffuse materials"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import revert

        report = revert.revert_materials(_materials(context), context.scene.unit_settings.scale_length)
        self.report_with_notes(f"Reverted {counted_names(report.reverted, 'material')}", report.lines)
        return {"FINISHED"} if report.reverted else {"CANCELLED"}


class TRUE_DIFFUSE_OT_match_engines(ConvertOperator):
    """Make EEVEE look like Cycles: convert the materials that the engines shade differently, and align render settings"""

    bl_idname = "true_diffuse.match_engines"
    bl_label = "Match EEVEE to Cycles"

    quality: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Quality", description="Quality of the Rough Diffuse groups", items=_items, default=1
    )

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        return scene_obstacle(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import convert

        return self.report_conversion(convert.match_engines(context.scene, self.quality), "EEVEE is set up like Cycles already")


def _materials(context: bpy.types.Context) -> list[bpy.types.Material]:
    """Return the material of the Properties or Shader Editor, in other editors the materials of the selected objects."""
    if is_node_editor(context):
        return [context.space_data.id] if isinstance(context.space_data.id, bpy.types.Material) else []
    if is_properties_editor(context):
        material = getattr(context, "material", None)
        return [material] if material else []
    slots = (slot for item in context.selected_objects for slot in item.material_slots)
    return list(dict.fromkeys(slot.material for slot in slots if slot.material))


def _unchanged(materials: "Sequence[bpy.types.Material]") -> str:
    """Return why none of `materials` was converted, as a message."""
    from ..material.revert import nodes_of

    others = [material.name for material in materials if not nodes_of(material)]
    if not others:
        return "Already True Diffuse"
    return f"No Diffuse, Principled or Subsurface Scattering BSDF is used in {counted_names(others, 'material')}"


def _selected(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.Node]:
    from ..material.convert import CONVERTIBLE

    return [node for node in tree.nodes if node.select and node.type in CONVERTIBLE]


CLASSES = (TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_convert_nodes, TRUE_DIFFUSE_OT_revert, TRUE_DIFFUSE_OT_match_engines)
