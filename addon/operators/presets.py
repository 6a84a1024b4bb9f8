# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that add a preset: as a node in the Shader Editor, or as a material of objects."""

from typing import TYPE_CHECKING

import bpy

from .add import AddsNode

if TYPE_CHECKING:
    from ..material.presets import Preset

SHADED = {"MESH", "CURVE", "SURFACE", "META", "FONT"}  # types of objects whose surface is a material's


def _presets() -> "dict[str, Preset]":
    from ..material.presets import PRESETS

    return PRESETS


def _items(_operator: bpy.types.Operator, _context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    return [(key, preset.name, preset.description) for key, preset in _presets().items()]


class PicksPreset:
    """Base of operators that offer the presets."""

    key: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Preset",
        description="Material to pick",
        items=_items,
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return _presets()[properties.key].description


class TRUE_DIFFUSE_OT_add_preset(PicksPreset, AddsNode):
    """Add a node of a preset"""

    bl_idname = "true_diffuse.add_preset"
    bl_label = "Add True Diffuse Preset"

    def execute(self, context: bpy.types.Context) -> set[str]:
        preset = _presets()[self.key]
        return self.add(context, preset.group, preset.inputs)


class TRUE_DIFFUSE_OT_assign_preset(PicksPreset, bpy.types.Operator):
    """Give the selected objects one new material of a preset, in the active material slot"""

    bl_idname = "true_diffuse.assign_preset"
    bl_label = "Assign True Diffuse Preset"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        ours, linked = _with_surface(context)
        if not ours:
            cls.poll_message_set("The selected objects are linked from other files" if linked else "Select objects with a surface")
        return bool(ours)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material.materials import create

        preset = _presets()[self.key]
        ours, linked = _with_surface(context)
        material = create(preset.name, preset.group, **preset.inputs)
        for item in ours:
            item.active_material = material
        if linked:
            self.report({"WARNING"}, f"Linked from other files and not changed: {', '.join(item.name for item in linked)}")
        return {"FINISHED"}


def _with_surface(context: bpy.types.Context) -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """Return the objects that can get a material, and those that cannot as they are linked from other files.

    They are the selected objects, in the Properties editor its active object.
    """
    in_properties = context.space_data is not None and context.space_data.type == "PROPERTIES"
    items = [context.object] if in_properties and context.object else context.selected_objects
    shaded = [item for item in items if item.type in SHADED]
    ours = [item for item in shaded if item.is_editable and item.data.is_editable]
    return ours, [item for item in shaded if item not in ours]


CLASSES = (TRUE_DIFFUSE_OT_add_preset, TRUE_DIFFUSE_OT_assign_preset)
