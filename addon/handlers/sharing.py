# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets what is appended, dropped from an asset library or pasted use the groups that the file already has."""

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import GROUP_ID


@bpy.app.handlers.persistent
def share_imported(context: bpy.types.BlendImportContext) -> None:
    """Make imported materials use the file's own groups."""
    items = {item.id: item for item in context.import_items if item.id}
    trees = [tree for tree in items if isinstance(tree, bpy.types.ShaderNodeTree) and GROUP_ID in tree and tree.library is None]
    if not trees:
        return
    from ..nodes import chosen_lights
    from ..nodes.sharing import share

    indirect = {imported for imported, item in items.items() if "INDIRECT_USAGE" in item.import_info}
    # a light that came along because its file had chosen it, and that Blender may have put into the scene
    lights = [item for item in indirect if isinstance(item, bpy.types.Object) and item.type == "LIGHT"]
    users = bpy.data.user_map(subset=lights) if lights else {}
    strays = [light for light in lights if not any(user in items and GROUP_ID not in user for user in users[light])]
    needless = [tree for tree in share(trees) if tree in indirect]  # what was asked for by name may be about to get to a node
    kept = [light for light in chosen_lights.chosen() if light not in strays]
    if kept != chosen_lights.chosen():
        chosen_lights.choose(kept)
    bpy.data.batch_remove([*needless, *strays])


@bpy.app.handlers.persistent
def share_new(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Make new nodes use the file's own groups."""
    if not depsgraph.id_type_updated("NODETREE"):  # which is all that most changes cost
        return
    changed = [update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.ShaderNodeTree)]
    groups = [node.node_tree for tree in changed for node in tree.nodes if node.type == "GROUP" and node.node_tree]
    if not any(GROUP_ID in group for group in groups):
        return
    from ..nodes.sharing import copies_in, share

    if copies := copies_in(changed):
        bpy.data.batch_remove([tree for tree in share(copies) if not tree.users])


register, unregister = register_handlers_factory((("blend_import_post", share_imported), ("depsgraph_update_post", share_new)))
