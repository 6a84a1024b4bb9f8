# SPDX-License-Identifier: GPL-3.0-or-later
"""Restores a node's group once the node is used otherwise than its specialized tree was made for."""

import bpy

from ..blender.id_properties import SPECIALIZED_FOR
from .folding import Use
from .materials import group_nodes, restore_node
from .usage import has_inputs, holds_in, scenes_of


def invalidate(scene: bpy.types.Scene | None) -> int:
    """Restore the nodes whose specialized trees are wrong for their sockets or for `scene`; returns how many.

    Without `scene`, all scenes of the file count.
    """
    users = None
    restored = 0
    for owner, node in list(group_nodes()):
        text = node.node_tree.get(SPECIALIZED_FOR)
        if text is None or owner.library:
            continue
        use = Use.from_json(text)
        valid = has_inputs(use, owner, node)
        if valid:
            violating = [other for other in ([scene] if scene else bpy.data.scenes) if not holds_in(use, owner, other)]
            if violating:
                users = users or bpy.data.user_map()
                valid = set(violating).isdisjoint(scenes_of(owner, users))
        if not valid:
            restore_node(node)
            restored += 1
    return restored


def depends_on_objects(tree: bpy.types.ShaderNodeTree) -> bool:
    """Return whether a change of a light, an object or a camera can make a specialized tree wrong."""
    use = Use.from_json(tree[SPECIALIZED_FOR])
    return use.flat or not all(use.shining)
