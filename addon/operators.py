# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: thin wrappers that hand the work to the library."""

import bpy

from .materials import add_group, thicken
from .nodes import GROUPS, lamps


class TRUE_DIFFUSE_OT_add_group(bpy.types.Operator):
    """Add a True Diffuse node group"""

    bl_idname = "true_diffuse.add_group"
    bl_label = "Add True Diffuse Group"
    bl_options = {"REGISTER", "UNDO"}

    key: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Group",
        description="Node group to add",
        items=[(group.key, group.label, group.description) for group in GROUPS],
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return next(group.description for group in GROUPS if group.key == properties.key)

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

    def execute(self, context: bpy.types.Context) -> set[str]:
        group = next(group for group in GROUPS if group.key == self.key)
        tree, added = context.space_data.edit_tree, group.ensure()
        if added == tree or added.contains_tree(tree):
            self.report({"ERROR"}, "A group cannot contain itself")
            return {"CANCELLED"}
        for node in tree.nodes:
            node.select = False
        node = add_group(tree, group)
        thicken(tree)
        node.location = context.space_data.cursor_location
        tree.nodes.active = node
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.space_data.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        result = self.execute(context)
        if result == {"FINISHED"}:
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result


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


register, unregister = bpy.utils.register_classes_factory((TRUE_DIFFUSE_OT_add_group, TRUE_DIFFUSE_OT_choose_lamps))
