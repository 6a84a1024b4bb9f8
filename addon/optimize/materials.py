# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives each node of our groups a tree specialized for its use, which renders the same picture, and restores the group, also
once the node is used otherwise.

The node keeps its sockets, their values and links; only its node tree is replaced. A specialized tree has its use (`folding.Use`)
as a property; nodes with equal uses share one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy

from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR
from ..material.upgrade import upgrade_node
from ..nodes import GROUPS, Group, chosen_lights
from ..nodes.graph import fingerprint, key_and_version
from .folding import ConstantFoldingGraph, Use
from .node_count import NodeCount, node_count
from .reasons import reasons
from .usage import Owner, has_inputs, holds_in, scenes_of, tree_of, use_of


@dataclass(frozen=True)
class OptimizedNode:
    """The result of optimizing one node; `before` and `after` are None where it was left alone."""

    owner: str
    node: str
    before: NodeCount | None
    after: NodeCount | None
    reasons: tuple[str, ...]
    """What was left out and why, or why nothing was."""


def optimize_materials() -> list[OptimizedNode]:
    """Specialize all True Diffuse materials of the file for the scenes that use them.

    Returns a result for each node of our groups that a scene uses, in the order of their owners' names.
    """
    restore_materials()
    users = bpy.data.user_map()
    cache = _Cache()
    results = []
    for owner, node in group_nodes():
        scenes = scenes_of(owner, users)
        if scenes and any(output.is_linked for output in node.outputs):
            results.append(_optimize(owner, node, scenes, cache))
    return results


def restore_materials() -> int:
    """Restore the groups of all optimized nodes of the file; returns how many there were."""
    nodes = [node for _, node in group_nodes() if SPECIALIZED_FOR in node.node_tree and node.node_tree.library is None]
    for node in nodes:
        restore_node(node)
    for tree in [tree for tree in bpy.data.node_groups if SPECIALIZED_FOR in tree and tree.users == 0]:
        bpy.data.node_groups.remove(tree)
    return len(nodes)


def restore_node(node: bpy.types.Node) -> None:
    """Replace a node's specialized tree by its group, in this version."""
    group, (_, version) = group_of(node), key_and_version(node)
    if version == str(group.version):
        node.node_tree = group.ensure()
    else:
        upgrade_node(node.id_data, node, group)


def invalidate(scene: bpy.types.Scene | None) -> int:
    """Restore the nodes whose specialized trees are wrong for their sockets or for `scene`; returns how many.

    Without `scene`, all scenes of the file count.
    """
    users = None
    wrong = []
    for owner, node in group_nodes():
        text = node.node_tree.get(SPECIALIZED_FOR)
        if text is None or owner.library:
            continue
        use = Use.from_json(text)
        valid = use is not None and has_inputs(use, owner, node)
        if use and valid:
            violating = [other for other in ([scene] if scene else bpy.data.scenes) if not holds_in(use, other)]
            if violating:
                users = users or bpy.data.user_map()
                valid = set(violating).isdisjoint(scenes_of(owner, users))
        if not valid:
            wrong.append(node)
    for node in wrong:
        restore_node(node)
    return len(wrong)


def depends_on_objects(tree: bpy.types.ShaderNodeTree) -> bool:
    """Return whether a change of a light can make a specialized tree wrong."""
    use = Use.from_json(tree[SPECIALIZED_FOR])
    return use is not None and not all(use.shining)


def group_of(node: bpy.types.Node) -> Group:
    """Return the group that `node`, one of ours, holds in whichever version; raises KeyError where it holds none."""
    return {group.key: group for group in GROUPS}[key_and_version(node)[0]]


def group_nodes() -> Iterator[tuple[Owner, bpy.types.Node]]:
    """Yield the nodes of our groups in materials and in the artist's own groups, in the order of names."""
    own_groups = [tree for tree in bpy.data.node_groups if tree.bl_idname == "ShaderNodeTree" and GROUP_ID not in tree]
    keys = {group.key for group in GROUPS}
    for owner in (*bpy.data.materials, *own_groups):
        tree = tree_of(owner)
        for node in tree.nodes if tree else ():
            if key_and_version(node)[0] in keys:
                yield owner, node


COLUMNS = ("Material", "Left out", "Nodes", "Closures")


def rows(results: Sequence[OptimizedNode]) -> list[tuple[str, ...]]:
    """Return a table of `results` under COLUMNS; the last row is their total."""
    table: list[tuple[str, ...]] = []
    for result in (*results, OptimizedNode("All", "", total(results, "before"), total(results, "after"), ())):
        before, after = result.before, result.after
        counts = (f"{before.nodes} -> {after.nodes}", f"{before.closures} -> {after.closures}") if before and after else ("-", "-")
        table.append((result.owner, "; ".join(result.reasons), *counts))
    return table


def total(results: Sequence[OptimizedNode], when: str) -> NodeCount:
    """Return the nodes and closures, `when` "before" or "after", of all nodes that were not left alone."""
    counts = [getattr(result, when) for result in results if result.after is not None]
    return NodeCount(sum(count.nodes for count in counts), sum(count.closures for count in counts))


class _Cache:
    """Counts of whole groups by identifier and menus, and specialized trees by name of the group and use, within one run."""

    def __init__(self) -> None:
        self.counts: dict[tuple[str, ...], NodeCount] = {}
        self.trees: dict[tuple[str, str], tuple[bpy.types.ShaderNodeTree | None, NodeCount]] = {}


def _optimize(owner: Owner, node: bpy.types.Node, scenes: Sequence[bpy.types.Scene], cache: _Cache) -> OptimizedNode:
    problem = _problem(owner, node, scenes)
    if problem:
        return OptimizedNode(owner.name, node.name, None, None, (f"left alone: {problem}",))
    use = use_of(owner, node, scenes)
    menus = (str(node.node_tree[GROUP_ID]), *(value for value in use.inputs.values() if isinstance(value, str)))
    before = cache.counts.get(menus) or cache.counts.setdefault(menus, node_count(node))
    key = node.node_tree.name, use.to_json()
    if key in cache.trees:
        tree, after = cache.trees[key]
        if tree:
            node.node_tree = tree
    else:
        whole = node.node_tree
        tree = node.node_tree = specialized(group_of(node), whole, use)
        after = node_count(node)
        if after.nodes >= before.nodes and after.closures >= before.closures:
            node.node_tree = whole
            bpy.data.node_groups.remove(tree)
            tree = None
        cache.trees[key] = tree, after
    why = tuple(reasons(key_and_version(node)[0], use)) if tree else ("nothing to leave out",)
    return OptimizedNode(owner.name, node.name, before, after, why)


def _problem(owner: Owner, node: bpy.types.Node, scenes: Sequence[bpy.types.Scene]) -> str:
    """Return why a node has to be left alone, empty where it need not."""
    _, version = key_and_version(node)
    group = group_of(node)
    if owner.library:
        text = node.node_tree.get(SPECIALIZED_FOR)
        use = Use.from_json(text) if text else None
        wrong = text and not (use and all(holds_in(use, scene) for scene in scenes))
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
    if any(tree.get(BUILT_FINGERPRINT) != fingerprint(tree) for tree in _with_groups(node.node_tree)):
        return "its group has been edited, or comes from an older file"
    return ""


def _with_groups(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.ShaderNodeTree]:
    """Return `tree` and all groups in it at any depth, each once."""
    trees = [tree]
    for outer in trees:
        inner = (node.node_tree for node in outer.nodes if node.type == "GROUP" and node.node_tree)
        trees += [tree for tree in dict.fromkeys(inner) if tree not in trees]
    return trees


def specialized(group: Group, whole: bpy.types.ShaderNodeTree, use: Use) -> bpy.types.ShaderNodeTree:
    """Return a new tree with the sockets of `whole`, a tree of `group`, and only the nodes that `use` needs."""
    tree = whole.copy()
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
