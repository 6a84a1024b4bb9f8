# SPDX-License-Identifier: GPL-3.0-or-later
"""One tree of each of our groups in a file, wherever its materials come from.

Blender copies a group, and all groups inside it, along with what is appended, dropped from an asset library or pasted. The users of
a copy get the file's own tree; a copy that somebody has edited stays.
"""

from collections.abc import Iterable, Sequence

import bpy

from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR
from .graph import fingerprint


def share(copies: Iterable[bpy.types.ShaderNodeTree]) -> list[bpy.types.ShaderNodeTree]:
    """Give the users of `copies` the file's own trees, and return those copies that nobody needs any more.

    So the file's own chosen lights stay.
    """
    pending = dict.fromkeys(copies)
    needless = []
    for tree in list(pending):
        del pending[tree]
        others = [other for other in bpy.data.node_groups if other != tree and other not in pending and _is_same(other, tree)]
        own = next((other for other in others if not _is_edited(other)), None)
        if own and not _is_edited(tree):
            tree.user_remap(own)
            needless.append(tree)
    return needless


def copies_in(trees: Sequence[bpy.types.NodeTree]) -> list[bpy.types.ShaderNodeTree]:
    """Return the groups of ours in the nodes of `trees` that are not the first of their kind in the file.

    Those inside other groups of ours count where one outside of them is a copy: Blender makes no others, and there are many nodes.
    """
    outer = _copies_in(tree for tree in trees if GROUP_ID not in tree)
    return _copies_in(trees) if outer else []


def _copies_in(trees: Iterable[bpy.types.NodeTree]) -> list[bpy.types.ShaderNodeTree]:
    used = {node.node_tree for tree in trees for node in tree.nodes if node.type == "GROUP" and node.node_tree}
    ours = [tree for tree in used if GROUP_ID in tree and tree.library is None]
    return [tree for tree in ours if next(other for other in bpy.data.node_groups if _is_same(other, tree)) != tree]


def _is_same(other: bpy.types.NodeTree, tree: bpy.types.NodeTree) -> bool:
    """Return whether two trees are of the same group, or specialized for the same use of it."""
    return other.library is None and all(other.get(key) == tree.get(key) for key in (GROUP_ID, SPECIALIZED_FOR))


def _is_edited(tree: bpy.types.NodeTree) -> bool:
    return SPECIALIZED_FOR not in tree and tree.get(BUILT_FINGERPRINT) != fingerprint(tree)
