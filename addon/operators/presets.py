# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that use a preset: as a new node in the Shader Editor, as a new material of objects, or in a material that is there."""

from typing import TYPE_CHECKING

import bpy

from ..blender.object_types import WITH_FACES
from ..blender.wording import counted, listed
from .add import AddNode
from .base import Operator
from .context import is_properties_editor, material_of, node_of

if TYPE_CHECKING:
    from ..material.presets import Preset


def _presets() -> "dict[str, Preset]":
    from ..material.presets import PRESETS

    return PRESETS


def _items(_operator: bpy.types.Operator, _context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    return [(key, preset.name, preset.description) for key, preset in _presets().items()]


class UsePreset:
    """Base of operators that offer the presets."""

    key: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Preset", description="Material to use", items=_items
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return _presets()[properties.key].description

    @property
    def preset(self) -> "Preset":
        return _presets()[self.key]


class TRUE_DIFFUSE_OT_add_preset(UsePreset, AddNode):
    """Add a node of a preset"""

    bl_idname = "true_diffuse.add_preset"
    bl_label = "Add True Diffuse Preset"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.add(context, self.preset.name, self.preset.group, self.preset.inputs)


class TRUE_DIFFUSE_OT_assign_preset(UsePreset, Operator):
    """Give the selected objects one new material of a preset, in the active material slot"""

    bl_idname = "true_diffuse.assign_preset"
    bl_label = "Assign True Diffuse Preset"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        editable, linked = _with_surface(context)
        if editable:
            return ""
        return "The selected objects are linked from other files" if linked else "Select objects with a surface"

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material.apply_preset import create_material

        editable, linked = _with_surface(context)
        material = create_material(self.preset)
        for item in editable:
            item.active_material = material
        objects = editable[0].name if len(editable) == 1 else counted(len(editable), "object")
        notes = [f"linked from other files and not changed: {listed([item.name for item in linked])}"] if linked else []
        self.report_with_notes(f"Assigned {self.preset.name} to {objects}", notes)
        return {"FINISHED"}


def _with_surface(context: bpy.types.Context) -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """Return the objects that can get a material, and those that cannot as they are linked from other files.

    They are the selected objects, in the Properties editor its active object.
    """
    items = [context.object] if is_properties_editor(context) and context.object else context.selected_objects
    shaded = [item for item in items if item.type in WITH_FACES]
    editable = [item for item in shaded if item.is_editable and item.data.is_editable]
    return editable, [item for item in shaded if item not in editable]


class TRUE_DIFFUSE_OT_apply_preset(UsePreset, Operator):
    """Make the material one of a preset; what is linked or animated stays, as far as it has a place there"""

    bl_idname = "true_diffuse.apply_preset"
    bl_label = "Apply True Diffuse Preset"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        from ..material.materials import locked_reason
        from ..material.summary import node_summary

        node, material = node_of(context), material_of(context)
        if material is None or material.node_tree is None:
            return "There is no material"
        if reason := locked_reason(material):
            return f"The material {reason}"
        if node is None:
            return ""
        if not node.id_data.is_editable:
            return f"The group {node.id_data.name} is linked from another file"
        return f"{node.node_tree.name} is of another version" if node_summary(node) is None else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.apply(context, material_of(context))

    def apply(self, context: bpy.types.Context, material: bpy.types.Material) -> set[str]:
        """Apply the preset to `material` and report the result; returns what `execute` does."""
        from ..material.apply_preset import apply
        from ..material.convert import ConversionError

        try:
            notes = apply(material, node_of(context), self.preset, context.scene.unit_settings.scale_length)
        except ConversionError as reason:
            return self.cancel_with(f"{material.name} {reason}")
        self.report_with_notes(f"Applied {self.preset.name} to {material.name}", notes)
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_add_preset, TRUE_DIFFUSE_OT_assign_preset, TRUE_DIFFUSE_OT_apply_preset)
