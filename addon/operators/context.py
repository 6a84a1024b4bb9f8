# SPDX-License-Identifier: GPL-3.0-or-later
"""The active material and node of the editor that calls an operator or draws a panel."""

import bpy


def material_of(context: bpy.types.Context) -> bpy.types.Material | None:
    """Return the editor's material, pinned or not, else the active object's; None where there is none."""
    material = getattr(context, "material", None)  # of the Properties editor
    if material is not None:
        return material
    if _is_node_editor(context):
        owner = context.space_data.id
        return owner if isinstance(owner, bpy.types.Material) else None
    return context.object.active_material if context.object else None


def node_of(context: bpy.types.Context) -> bpy.types.Node | None:
    """Return the Shader Editor's active node if it holds one of our groups, else the node that makes the material's surface."""
    from ..material.read import group_node
    from ..nodes import GROUPS
    from ..nodes.graph import key_and_version

    if _is_node_editor(context) and context.space_data.edit_tree:
        active = context.space_data.edit_tree.nodes.active
        if active and key_and_version(active)[0] in {group.key for group in GROUPS}:
            return active
    material = material_of(context)
    surface = group_node(material) if material else None
    return surface[0] if surface else None


def locked_reason_in_editor(context: bpy.types.Context) -> str:
    """Return a sentence on why the Shader Editor's node tree cannot be changed, empty where it can."""
    from ..material.materials import locked_reason

    owner, tree = context.space_data.id, context.space_data.edit_tree
    if isinstance(owner, bpy.types.Material) and locked_reason(owner):
        return f"The material {locked_reason(owner)}"
    return "" if tree.is_editable else "The node group is linked from another file"


def _is_node_editor(context: bpy.types.Context) -> bool:
    return context.space_data is not None and context.space_data.type == "NODE_EDITOR"
