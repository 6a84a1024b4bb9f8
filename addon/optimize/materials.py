# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives each node of our groups a tree specialized for its use, which renders the same picture, and restores the group, also
once the node is used otherwise.

The node keeps its sockets, their values and links; only its node tree is replaced. A specialized tree has its use (`folding.Use`)
as a property; nodes with equal uses share one.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import bpy

from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR
from ..material.upgrade import upgrade_node
from ..nodes import GROUPS, Group, chosen_lights
from ..nodes.graph import fingerprint, key_and_version
from .folding import ConstantFoldingGraph
from .reasons import reasons
from .usage import Owner, Use, from_json, tree_of, use_of


@dataclass(frozen=True)
class OptimizedNode:
    """The result of optimizing one node."""

    owner: str
    node: str
    left_out: tuple[str, ...] = ()
    """What was left out, and why."""
    problem: str = ""
    """Why the node was left alone, empty where it was not."""


def optimize_materials() -> list[OptimizedNode]:
    """Specialize all True Diffuse materials of the file for how they are used.

    Returns a result for each node of our groups that is linked to something, in the order of their owners' names.
    """
    run = _Run()
    results = [run.optimize(owner, node) for owner, node in group_nodes() if any(output.is_linked for output in node.outputs)]
    _remove_unused_specialized()
    return results


def restore_materials() -> int:
    """Restore the groups of all optimized nodes of the file; returns how many there were."""
    nodes = [node for _, node in group_nodes() if SPECIALIZED_FOR in node.node_tree and node.node_tree.library is None]
    for node in nodes:
        restore_node(node)
    _remove_unused_specialized()
    return len(nodes)


def _remove_unused_specialized() -> None:
    bpy.data.batch_remove([tree for tree in bpy.data.node_groups if SPECIALIZED_FOR in tree and tree.users == 0])


def restore_node(node: bpy.types.Node) -> None:
    """Replace a node's specialized tree by its group, in this version."""
    group, (_, version) = group_of(node), key_and_version(node)
    if version == str(group.version):
        node.node_tree = group.ensure()
    else:
        upgrade_node(node.id_data, node, group)


def invalidate(owners: Iterable[Owner] | None = None) -> int:
    """Restore the nodes of `owners`, of the whole file without them, whose sockets are used otherwise; returns how many."""
    wrong = []
    for owner, node in group_nodes(owners):
        text = node.node_tree.get(SPECIALIZED_FOR)
        if text is not None and not owner.library:
            use = from_json(text)
            if use is None or not use.holds(owner, node):
                wrong.append(node)
    for node in wrong:
        restore_node(node)
    return len(wrong)


def group_of(node: bpy.types.Node) -> Group:
    """Return the group that `node`, one of ours, holds in whichever version; raises KeyError where it holds none."""
    return {group.key: group for group in GROUPS}[key_and_version(node)[0]]


def group_nodes(owners: Iterable[Owner] | None = None) -> Iterator[tuple[Owner, bpy.types.Node]]:
    """Yield the nodes of our groups in `owners`; without them in all materials and the artist's own groups, ordered by name."""
    if owners is None:
        own_groups = [tree for tree in bpy.data.node_groups if tree.bl_idname == "ShaderNodeTree" and GROUP_ID not in tree]
        owners = (*bpy.data.materials, *own_groups)
    keys = {group.key for group in GROUPS}
    for owner in owners:
        tree = tree_of(owner)
        for node in tree.nodes if tree else ():
            if key_and_version(node)[0] in keys:
                yield owner, node


COLUMNS = ("Material", "Left out")


def rows(results: Sequence[OptimizedNode]) -> list[tuple[str, ...]]:
    """Return a table of `results` under COLUMNS."""
    return [
        (result.owner, f"nothing: {result.problem}" if result.problem else "; ".join(result.left_out) or "nothing")
        for result in results
    ]


class _Run:
    """What one run has found: specialized trees by group and use, and which trees somebody has edited."""

    def __init__(self) -> None:
        trees = (tree for tree in bpy.data.node_groups if SPECIALIZED_FOR in tree and tree.library is None)
        self.specialized = {(tree[GROUP_ID], tree[SPECIALIZED_FOR]): tree for tree in trees}
        self.edited: dict[bpy.types.ShaderNodeTree, bool] = {}

    def optimize(self, owner: Owner, node: bpy.types.Node) -> OptimizedNode:
        """Give `node` the tree for its use, its group where that has nothing to leave out."""
        problem = self.problem(owner, node)
        if problem:
            return OptimizedNode(owner.name, node.name, problem=problem)
        group, use = group_of(node), use_of(owner, node)
        left_out = tuple(reasons(group.key, use))
        if left_out:
            key = group.identifier, use.to_json()
            tree = self.specialized.get(key) or self.specialized.setdefault(key, specialized(group, use))
        else:
            tree = group.ensure() if SPECIALIZED_FOR in node.node_tree else node.node_tree
        if node.node_tree != tree:
            node.node_tree = tree
        return OptimizedNode(owner.name, node.name, left_out)

    def problem(self, owner: Owner, node: bpy.types.Node) -> str:
        """Return why a node has to be left alone, empty where it need not."""
        _, version = key_and_version(node)
        group = group_of(node)
        if owner.library:
            use = from_json(text) if (text := node.node_tree.get(SPECIALIZED_FOR)) else None
            wrong = text and not (use and use.holds(owner, node))
            return f"linked from {owner.library.filepath}" + (", where it was optimized for another use" if wrong else "")
        if owner.override_library:
            return "a library override"
        if not node.id_data.is_editable:
            return "it cannot be edited"
        if node.node_tree.library:
            return f"its group is linked from {node.node_tree.library.filepath}"
        if node.mute:
            return "its node is muted"
        if version != str(group.version):
            return f"its group is of version {version}, not {group.version}"
        if any(socket.is_linked for socket in node.inputs if socket.bl_idname == "NodeSocketMenu"):
            return "a menu of it is linked to a node"
        if SPECIALIZED_FOR not in node.node_tree and any(map(self.is_edited, _with_groups(node.node_tree))):
            return "its group has been edited, or comes from an older file"
        return ""

    def is_edited(self, tree: bpy.types.ShaderNodeTree) -> bool:
        if tree not in self.edited:
            self.edited[tree] = tree.get(BUILT_FINGERPRINT) != fingerprint(tree)
        return self.edited[tree]


def _with_groups(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.ShaderNodeTree]:
    """Return `tree` and all groups in it at any depth, each once."""
    trees = [tree]
    for outer in trees:
        inner = (node.node_tree for node in outer.nodes if node.type == "GROUP" and node.node_tree)
        trees += [tree for tree in dict.fromkeys(inner) if tree not in trees]
    return trees


def specialized(group: Group, use: Use) -> bpy.types.ShaderNodeTree:
    """Return a new tree with the sockets of `group`, and only the nodes that `use` needs."""
    tree = group.ensure().copy()
    tree.name = f".{group.name}, Optimized"
    tree.nodes.clear()
    tree.animation_data_clear()
    del tree[BUILT_FINGERPRINT]
    tree[SPECIALIZED_FOR] = use.to_json()
    tree.use_fake_user = False
    graph = ConstantFoldingGraph(tree, use)
    graph.end(group.build(graph))
    graph.arrange()
    return tree


def remove_unused() -> None:
    """Remove all our node trees without users; they are built again when they are needed.

    The group that holds the chosen lights stays, also in a saved file.
    """
    for tree in chosen_lights.LIGHTS.trees() if chosen_lights.chosen() else ():
        tree.use_fake_user = True
    while unused := [tree for tree in bpy.data.node_groups if GROUP_ID in tree and tree.users == 0]:
        bpy.data.batch_remove(unused)
