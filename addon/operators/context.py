# SPDX-License-Identifier: GPL-3.0-or-later
"""What the editor shows that an operator is called from or a panel is drawn in."""

import bpy


def material_of(context: bpy.types.Context) -> bpy.types.Material | None:
    """Return the material that the editor shows, pinned or not, else the active object's; None where there is none."""
    material = getattr(context, "material", None)  # of the Properties editor
    if material is not None:
        return material
    if _is_node_editor(context):
        shown = context.space_data.id
        return shown if isinstance(shown, bpy.types.Material) else None
    return context.object.active_material if context.object else None


def node_of(context: bpy.types.Context) -> bpy.types.Node | None:
    """Return the Shader Editor's active node where it holds a group of ours, else the one that makes the material's surface."""
    from ..material.read import group_node
    from ..nodes import GROUPS
    from ..nodes.graph import stamp_of

    if _is_node_editor(context) and context.space_data.edit_tree:
        active = context.space_data.edit_tree.nodes.active
        if active and stamp_of(active)[0] in {group.key for group in GROUPS}:
            return active
    material = material_of(context)
    found = group_node(material) if material else None
    return found[0] if found else None


def refused_in_editor(context: bpy.types.Context) -> str:
    """Return why what the Shader Editor shows cannot be changed, as a sentence; empty where it can."""
    from ..material.materials import refusal

    owner, tree = context.space_data.id, context.space_data.edit_tree
    if isinstance(owner, bpy.types.Material) and refusal(owner):
        return f"The material {refusal(owner)}"
    return "" if tree.is_editable else "The node group is linked from another file"


def _is_node_editor(context: bpy.types.Context) -> bool:
    return context.space_data is not None and context.space_data.type == "NODE_EDITOR"
