# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that applies a preset to the panel's node."""

import bpy

from .context import material_of, node_of
from .presets import PicksPreset


class TRUE_DIFFUSE_OT_apply_preset(PicksPreset, bpy.types.Operator):
    """Set the True Diffuse node to the values of a preset; linked sockets stay linked"""

    bl_idname = "true_diffuse.apply_preset"
    bl_label = "Apply True Diffuse Preset"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        from ..material.materials import locked_reason
        from ..material.summary import node_summary

        node, material = node_of(context), material_of(context)
        if node is None:
            cls.poll_message_set("The material has no True Diffuse node")
            return False
        reason = locked_reason(material) if material else ""
        if reason or not node.id_data.is_editable:
            cls.poll_message_set(f"The material {reason or 'is linked from another file'}")
            return False
        if node_summary(node) is None:
            cls.poll_message_set(f"{node.node_tree.name} is of another version")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material.materials import set_inputs
        from ..material.presets import PRESETS
        from ..nodes.graph import key_and_version

        node, preset = node_of(context), PRESETS[self.key]
        if key_and_version(node)[0] != preset.group.key:
            self.report({"ERROR"}, f"{preset.name} is a preset of the group {preset.group.label}, the node holds another")
            return {"CANCELLED"}
        set_inputs(node, preset.inputs)
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_apply_preset,)
