# SPDX-License-Identifier: GPL-3.0-or-later
"""The active material and node of the editor that calls an operator or draws a panel."""

import bpy


def material_of(context: bpy.types.Context) -> bpy.types.Material | None:
    """Return the editor's material, pinned or not, else the active object's; None where there is none."""
    material = getattr(context, "material", None)  # of the Properties editor
    if material is not None:
        return material
    if is_node_editor(context):
        owner = context.space_data.id
        return owner if isinstance(owner, bpy.types.Material) else None
    return context.object.active_material if context.object else None


def node_of(context: bpy.types.Context) -> bpy.types.Node | None:
    """Return the Shader Editor's active node if it holds one of our groups, else the group node of the material's surface."""
    from ..material.read import group_node
    from ..nodes import GROUPS
    from ..nodes.graph import key_and_version

    if is_node_editor(context) and context.space_data.edit_tree:
        active = context.space_data.edit_tree.nodes.active
        if active and key_and_version(active)[0] in {group.key for group in GROUPS}:
            return active
    material = material_of(context)
    surface = group_node(material) if material else None
    return surface[0] if surface else None


def editor_obstacle(context: bpy.types.Context) -> str:
    """Return why the editor is no Shader Editor whose material can be changed, as a message; empty where it is one."""
    from ..material.materials import locked_reason

    space = context.space_data
    if not is_node_editor(context) or not isinstance(space.id, bpy.types.Material) or space.edit_tree is None:
        return "Open a material in the Shader Editor"
    if locked_reason(space.id):
        return f"The material {locked_reason(space.id)}"
    return "" if space.edit_tree.is_editable else "The node group is linked from another file"


def scene_obstacle(context: bpy.types.Context) -> str:
    """Return why the settings of the scene cannot be changed, as a message; empty where they can."""
    return "" if context.scene.is_editable else "The scene is linked from another file"


def redraw(context: bpy.types.Context) -> None:
    """Have all editors of the window drawn again: what they show of our own records has changed, which Blender does not see."""
    for area in context.screen.areas if context.screen else ():
        area.tag_redraw()


def is_node_editor(context: bpy.types.Context) -> bool:
    return _editor(context) == "NODE_EDITOR"


def is_properties_editor(context: bpy.types.Context) -> bool:
    return _editor(context) == "PROPERTIES"


def _editor(context: bpy.types.Context) -> str:
    return context.space_data.type if context.space_data else ""
