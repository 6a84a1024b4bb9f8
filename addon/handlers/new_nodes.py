# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes of ours need however they come to a file: added as a group, pasted, appended, dropped from an asset library, undone.

They use the groups that the file already has, and their materials have the thickness that EEVEE needs. Blender calls this in
background mode, too, where it updates a view layer or imports; a script that renders before calls `nodes.sharing.share`
and `materials.set_thickness`.
"""

from collections.abc import Iterable

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import GROUP_ID


@bpy.app.handlers.persistent
def keep_up_imported(context: bpy.types.BlendImportContext) -> None:
    """Look after imported groups and materials."""
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
    _set_thickness(item for item in items if isinstance(item, bpy.types.Material))
    bpy.data.batch_remove([*needless, *strays])


@bpy.app.handlers.persistent
def keep_up(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Look after the groups and materials whose nodes have changed."""
    if not depsgraph.id_type_updated("NODETREE"):  # which is all that most changes cost
        return
    if not any(GROUP_ID in tree for tree in bpy.data.node_groups):
        return
    kinds = bpy.types.ShaderNodeTree, bpy.types.Material
    changed = [update.id.original for update in depsgraph.updates if isinstance(update.id, kinds)]
    trees = [item for item in changed if isinstance(item, bpy.types.ShaderNodeTree)]
    from ..nodes.sharing import copies_in, share

    if copies := copies_in(trees):
        bpy.data.batch_remove([tree for tree in share(copies) if not tree.users])
    _set_thickness(item for item in changed if isinstance(item, bpy.types.Material))


def _set_thickness(materials: Iterable[bpy.types.Material]) -> None:
    """Set the thickness of those `materials` that can be changed."""
    from ..material.materials import locked_reason, set_thickness

    for material in materials:
        if not locked_reason(material):
            set_thickness(material)


register, unregister = register_handlers_factory((("blend_import_post", keep_up_imported), ("depsgraph_update_post", keep_up)))
