# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives a node its whole group back where it is used otherwise than its least tree was made for."""

import bpy

from ..blender.id_properties import SPECIALIZED_FOR
from .materials import group_nodes, restore_node
from .usage import scenes_of, serves, still_right, unpacked


def check(scene: bpy.types.Scene | None) -> int:
    """Restore the nodes whose sockets have changed, or whose least trees are wrong for `scene`, None: for a scene that uses them.

    Returns how many.
    """
    users = None
    restored = 0
    for owner, node in list(group_nodes()):
        text = node.node_tree.get(SPECIALIZED_FOR)
        if text is None or owner.library:
            continue
        right = still_right(text, owner, node)
        if right:
            use = unpacked(text)
            doubtful = [each for each in ([scene] if scene else bpy.data.scenes) if not serves(use, owner, each)]
            if doubtful:
                users = users or bpy.data.user_map()
                right = set(doubtful).isdisjoint(scenes_of(owner, users))
        if not right:
            restore_node(node)
            restored += 1
    return restored


def depends_on_places(tree: bpy.types.ShaderNodeTree) -> bool:
    """Return whether a light, an object or a camera that changes can make a least tree wrong."""
    use = unpacked(tree[SPECIALIZED_FOR])
    return use.flat or not all(use.shining)
