# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives each node of our groups the least tree that renders the same picture, and the whole group back.

A node keeps its sockets, their values and links; only the tree behind it is another, made for one use (`folding.Use`) and kept with
that use as a property. Nodes that are used alike share one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy

from ..blender.id_properties import AS_BUILT, SPECIALIZED_FOR, STAMP
from ..material.upgrade import upgrade_node
from ..nodes import GROUPS, Group, chosen_lights
from ..nodes.graph import fingerprint, stamp_of
from .folding import Folding, Use
from .node_count import Count, count
from .reasons import reasons
from .usage import Owner, packed, scenes_of, serves, tree_of, unpacked, use_of


@dataclass(frozen=True)
class Finding:
    """What was found of one node: what it needed before and what it needs `after`; None where it was left alone."""

    owner: str
    node: str
    before: Count | None
    after: Count | None
    why: tuple[str, ...]
    """What was left out and why, or why nothing was."""

    def figures(self) -> tuple[str, str]:
        """Return how many nodes and closures there were and are, for people."""
        if self.before is None or self.after is None:
            return "-", "-"
        return f"{self.before.nodes} -> {self.after.nodes}", f"{self.before.closures} -> {self.after.closures}"


def optimize_materials() -> list[Finding]:
    """Make all of the file's materials render by the least that gives the same picture in the scenes that use them.

    Returns a finding for each node of our groups that a scene uses, in the order of their owners' names.
    """
    restore_materials()
    users = bpy.data.user_map()
    made = _Made()
    found = []
    for owner, node in group_nodes():
        scenes = scenes_of(owner, users)
        if scenes and any(output.is_linked for output in node.outputs):
            found.append(_simplify(owner, node, scenes, made))
    return found


def restore_materials() -> int:
    """Give all nodes of the file their whole groups back; returns how many had less."""
    nodes = [node for _, node in group_nodes() if SPECIALIZED_FOR in node.node_tree and node.node_tree.library is None]
    for node in nodes:
        restore_node(node)
    for tree in [tree for tree in bpy.data.node_groups if SPECIALIZED_FOR in tree and tree.users == 0]:
        bpy.data.node_groups.remove(tree)
    return len(nodes)


def restore_node(node: bpy.types.Node) -> None:
    """Give a node its whole group back, in this version."""
    key, version = stamp_of(node)
    group = next(group for group in GROUPS if group.key == key)
    if version == str(group.version):
        node.node_tree = group.ensure()
    else:
        upgrade_node(node.id_data, node, group)


def group_nodes() -> Iterator[tuple[Owner, bpy.types.Node]]:
    """Yield the nodes of our groups in materials and in the artist's own groups, in the order of names."""
    theirs = [tree for tree in bpy.data.node_groups if tree.bl_idname == "ShaderNodeTree" and STAMP not in tree]
    keys = {group.key for group in GROUPS}
    for owner in (*bpy.data.materials, *theirs):
        tree = tree_of(owner)
        for node in tree.nodes if tree else ():
            if stamp_of(node)[0] in keys:
                yield owner, node


COLUMNS = ("Material", "Left out", "Nodes", "Closures")


def rows(found: Sequence[Finding]) -> list[tuple[str, ...]]:
    """Return findings for people, under COLUMNS; the last row is all of them together."""
    together = Finding("All", "", total(found, "before"), total(found, "after"), ())
    return [(each.owner, "; ".join(each.why), *each.figures()) for each in (*found, together)]


def total(found: Sequence[Finding], when: str) -> Count:
    """Return the nodes and closures, `when` before or after, of all that were not left alone."""
    counts = [getattr(finding, when) for finding in found if finding.after is not None]
    return Count(sum(count.nodes for count in counts), sum(count.closures for count in counts))


class _Made:
    """What one run has worked out already: the same for nodes that are used alike."""

    def __init__(self) -> None:
        self.whole: dict[tuple[str, ...], Count] = {}
        self.least: dict[tuple[str, str], tuple[bpy.types.ShaderNodeTree | None, Count]] = {}


def _simplify(owner: Owner, node: bpy.types.Node, scenes: Sequence[bpy.types.Scene], made: _Made) -> Finding:
    refused = _refusal(owner, node, scenes)
    if refused:
        return Finding(owner.name, node.name, None, None, (refused,))
    use = use_of(owner, node, scenes)
    menus = (str(node.node_tree[STAMP]), *(value for value in use.inputs.values() if isinstance(value, str)))
    before = made.whole.get(menus) or made.whole.setdefault(menus, count(node))
    key = node.node_tree.name, packed(use)
    if key in made.least:
        tree, after = made.least[key]
        if tree:
            node.node_tree = tree
    else:
        whole = node.node_tree
        tree = node.node_tree = least(next(group for group in GROUPS if group.key == stamp_of(node)[0]), whole, use)
        after = count(node)
        if after.nodes >= before.nodes and after.closures >= before.closures:
            node.node_tree = whole
            bpy.data.node_groups.remove(tree)
            tree = None
        made.least[key] = tree, after
    return Finding(owner.name, node.name, before, after, reasons(node, use) if tree else ("nothing to leave out",))


def _refusal(owner: Owner, node: bpy.types.Node, scenes: Sequence[bpy.types.Scene]) -> str:
    """Return why a node has to be left alone, or nothing."""
    key, version = stamp_of(node)
    group = next(group for group in GROUPS if group.key == key)
    if owner.library:
        text = node.node_tree.get(SPECIALIZED_FOR)
        wrong = text is not None and not all(serves(unpacked(text), owner, scene) for scene in scenes)
        return f"left alone: linked from {owner.library.filepath}" + (", where it was simplified for another use" if wrong else "")
    if owner.override_library:
        return "left alone: a library override"
    if not node.id_data.is_editable:
        return "left alone: it cannot be edited"
    if node.node_tree.library:
        return f"left alone: its group is linked from {node.node_tree.library.filepath}"
    if node.mute:
        return "left alone: its node is muted"
    if version != str(group.version):
        return f"left alone: its group is of version {version}, not {group.version}"
    if any(socket.is_linked for socket in node.inputs if socket.bl_idname == "NodeSocketMenu"):
        return "left alone: a node chooses from its menus"
    if any(tree.get(AS_BUILT) != fingerprint(tree) for tree in _within(node.node_tree)):
        return "left alone: its group has been edited, or comes from an older file"
    return ""


def _within(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.ShaderNodeTree]:
    """Return `tree` and all groups in it, each once."""
    found = [tree]
    for each in found:
        inner = (node.node_tree for node in each.nodes if node.type == "GROUP" and node.node_tree)
        found += [tree for tree in dict.fromkeys(inner) if tree not in found]
    return found


def least(group: Group, whole: bpy.types.ShaderNodeTree, use: Use) -> bpy.types.ShaderNodeTree:
    """Return a new tree with the sockets of `whole`, a tree of `group`, that gives the same for one `use`."""
    tree = whole.copy()
    tree.name = f".{group.name}, Simplified"
    tree.nodes.clear()
    tree.animation_data_clear()
    del tree[AS_BUILT]
    tree[SPECIALIZED_FOR] = packed(use)
    tree.use_fake_user = False
    graph = Folding(tree, use)
    graph.end(group.build(graph))
    graph.arrange()
    return tree


def remove_unused() -> None:
    """Remove all trees of ours that no node has any more; they are built again when they are needed.

    The group that knows the chosen lamps stays, also in a file that is saved.
    """
    for tree in chosen_lights.LIGHTS.trees() if chosen_lights.chosen() else ():
        tree.use_fake_user = True
    while unused := [tree for tree in bpy.data.node_groups if STAMP in tree and tree.users == 0]:
        bpy.data.batch_remove(unused)
