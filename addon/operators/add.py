# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that add a True Diffuse node in the Shader Editor."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import bpy

from .base import Operator
from .context import editor_obstacle

if TYPE_CHECKING:
    from ..material.materials import Setting
    from ..nodes import Group


class AddNode(Operator):
    """Base of operators that add a node at the mouse in the Shader Editor."""

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        return editor_obstacle(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.space_data.cursor_location_from_region(event.mouse_region_x, event.mouse_region_y)
        result = self.execute(context)
        if result == {"FINISHED"}:
            bpy.ops.node.translate_attach_remove_on_cancel("INVOKE_DEFAULT")
        return result

    def add(self, context: bpy.types.Context, name: str, group: "Group", inputs: "Mapping[str, Setting]") -> set[str]:
        """Add a node that holds `group`, its sockets set to `inputs`, and report `name`; returns what `execute` does."""
        from ..material.materials import add_group, set_inputs

        tree, group_tree = context.space_data.edit_tree, group.ensure()
        if group_tree == tree or group_tree.contains_tree(tree):
            return self.cancel_with("A group cannot contain itself")
        for node in tree.nodes:
            node.select = False
        node = add_group(tree, group)
        set_inputs(node, inputs)
        node.location = context.space_data.cursor_location
        tree.nodes.active = node
        self.report({"INFO"}, f"Added {name}")
        return {"FINISHED"}


def _groups() -> "dict[str, Group]":
    from ..nodes import GROUPS

    return {group.key: group for group in GROUPS}


def _items(_operator: bpy.types.Operator, _context: bpy.types.Context | None) -> list[tuple[str, str, str]]:
    return [(key, group.label, group.description) for key, group in _groups().items()]


class TRUE_DIFFUSE_OT_add_group(AddNode):
    """Add a True Diffuse node group"""

    bl_idname = "true_diffuse.add_group"
    bl_label = "Add True Diffuse Group"

    key: bpy.props.EnumProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Group", description="Node group to add", items=_items
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return _groups()[properties.key].description

    def execute(self, context: bpy.types.Context) -> set[str]:
        group = _groups()[self.key]
        return self.add(context, group.label, group, {})


CLASSES = (TRUE_DIFFUSE_OT_add_group,)
