# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: thin wrappers that hand the work to the library."""

from collections.abc import Mapping

import bpy

from .materials import Setting, add_group, create, set_inputs, set_thickness
from .nodes import GROUPS, SUBSURFACE, Group, lamps
from .presets import PRESETS

SHADED = {"MESH", "CURVE", "SURFACE", "META", "FONT"}  # types of objects whose surface is a material's


class AddsNode(bpy.types.Operator):
    """What operators share that add a node where the mouse is in the Shader Editor."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        space = context.space_data
        if space is None or space.type != "NODE_EDITOR" or not isinstance(space.id, bpy.types.Material) or space.edit_tree is None:
            cls.poll_message_set("Open a material in the Shader Editor")
            return False
        if not space.edit_tree.is_editable:
            cls.poll_message_set("The material is linked from another file")
            return False
        return True

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.space_data.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        result = self.execute(context)
        if result == {"FINISHED"}:
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result

    def add(self, context: bpy.types.Context, group: Group, inputs: Mapping[str, Setting]) -> set[str]:
        """Add a node that holds `group`, its sockets set to `inputs`; returns what an operator's `execute` does."""
        tree, added = context.space_data.edit_tree, group.ensure()
        if added == tree or added.contains_tree(tree):
            self.report({"ERROR"}, "A group cannot contain itself")
            return {"CANCELLED"}
        for node in tree.nodes:
            node.select = False
        node = add_group(tree, group)
        set_inputs(node, inputs)
        set_thickness(context.space_data.id)
        node.location = context.space_data.cursor_location
        tree.nodes.active = node
        return {"FINISHED"}


class PicksPreset:
    """What operators share that offer the presets."""

    key: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Preset",
        description="Material to pick",
        items=[(preset.key, preset.name, preset.description) for preset in PRESETS.values()],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return PRESETS[properties.key].description


class TRUE_DIFFUSE_OT_add_group(AddsNode):
    """Add a True Diffuse node group"""

    bl_idname = "true_diffuse.add_group"
    bl_label = "Add True Diffuse Group"

    key: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Group",
        description="Node group to add",
        items=[(group.key, group.label, group.description) for group in GROUPS],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return next(group.description for group in GROUPS if group.key == properties.key)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.add(context, next(group for group in GROUPS if group.key == self.key), {})


class TRUE_DIFFUSE_OT_add_preset(PicksPreset, AddsNode):
    """Add a Subsurface node of a preset"""

    bl_idname = "true_diffuse.add_preset"
    bl_label = "Add True Diffuse Preset"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.add(context, SUBSURFACE, PRESETS[self.key].inputs)


class TRUE_DIFFUSE_OT_assign_preset(PicksPreset, bpy.types.Operator):
    """Give the selected objects one new material of a preset, in the place of each one's active material"""

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
        preset = PRESETS[self.key]
        ours, linked = _with_surface(context)
        material = create(preset.name, SUBSURFACE, **preset.inputs)
        for item in ours:
            item.active_material = material
        if linked:
            self.report({"WARNING"}, f"Linked from other files and left alone: {', '.join(item.name for item in linked)}")
        return {"FINISHED"}


def _with_surface(context: bpy.types.Context) -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """Return the selected objects that a material can be given to, and those it cannot since they are linked from other files."""
    shaded = [item for item in context.selected_objects if item.type in SHADED]
    ours = [item for item in shaded if item.is_editable and item.data.is_editable]
    return ours, [item for item in shaded if item not in ours]


class TRUE_DIFFUSE_OT_choose_lamps(bpy.types.Operator):
    """Make the selected lights, or all of the scene if none is selected, the ones that the mode Lamps is exact for"""

    bl_idname = "true_diffuse.choose_lamps"
    bl_label = "Choose Lamps"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        lights = _lights(context)
        if not lights:
            cls.poll_message_set("The scene has no light")
        elif len(lights) > lamps.SLOTS:
            cls.poll_message_set(f"Select up to {lamps.SLOTS} lights")
        return 0 < len(lights) <= lamps.SLOTS

    def execute(self, context: bpy.types.Context) -> set[str]:
        lights = _lights(context)
        lamps.choose(lights)
        self.report({"INFO"}, f"Mode Lamps follows {', '.join(light.name for light in lights)}")
        if lamps.LAMPS.trees(linked=True):
            self.report({"WARNING"}, "Materials linked from other files keep the lamps chosen there")
        return {"FINISHED"}


def _lights(context: bpy.types.Context) -> list[bpy.types.Object]:
    selected = [item for item in context.selected_objects if item.type == "LIGHT"]
    return selected or [item for item in context.scene.objects if item.type == "LIGHT"]


register, unregister = bpy.utils.register_classes_factory(
    (TRUE_DIFFUSE_OT_add_group, TRUE_DIFFUSE_OT_add_preset, TRUE_DIFFUSE_OT_assign_preset, TRUE_DIFFUSE_OT_choose_lamps)
)
