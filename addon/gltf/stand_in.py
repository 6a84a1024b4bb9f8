# SPDX-License-Identifier: GPL-3.0-or-later
"""Stand-ins: copies of our materials for Blender's glTF exporter, in which a Principled BSDF takes the place of each of our groups.

The exporter follows links into groups and takes the closures that it finds there for the artist's. In a stand-in it finds what it
would find in a material that was never converted: the same textures, transforms, UV maps, color attributes and cutoffs.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import bpy

from ..material.read import Names, linked_output, read
from ..material.surface import Loss
from ..material.upgrade import current_name
from ..nodes import GROUPS, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group
from ..nodes.graph import key_and_version
from ..usd import preview

BY_KEY: Mapping[str, Group] = {group.key: group for group in GROUPS}
# Principled's sockets by those of our groups; where no table is for a group, its sockets have Principled's names.
SOCKETS: Mapping[str, Mapping[str, str]] = {
    ROUGH_DIFFUSE.key: {"Color": "Base Color", "Normal": "Normal"},
    SUBSURFACE.key: {
        "Color": "Base Color",
        "Subsurface": "Subsurface Weight",
        "Specular": "Specular IOR Level",
        "Specular Roughness": "Roughness",
        "IOR": "IOR",
        "Normal": "Normal",
    },
    SPECULAR_GROUP.key: {"Color": "Base Color", "Normal": "Normal"},
}


@dataclass
class Replaced:
    """A node of ours, still in the artist's tree, and the Principled BSDF that stands for it."""

    node: bpy.types.Node
    group: Group
    version: int
    principled: bpy.types.Node
    groups: tuple[bpy.types.Node, ...]
    """The group nodes of the stand-in that hold it, from the outside in."""

    @property
    def label(self) -> str:
        """What the interface calls the node."""
        return self.node.label or self.node.name

    def has_no_place(self, socket: str) -> bool:
        """Return whether an input of the node has no counterpart in the Principled BSDF."""
        table = SOCKETS.get(self.group.key)
        return (table.get(current_name(socket), "") if table else socket) not in self.principled.inputs


@dataclass
class StandIn:
    """The copy of a material, the copies of the artist's groups in it, and what was replaced in them."""

    material: bpy.types.Material
    groups: list[bpy.types.ShaderNodeTree] = field(default_factory=list)
    images: list[bpy.types.Image] = field(default_factory=list)
    """What was baked for it."""
    replaced: list[Replaced] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)
    """What glTF cannot hold of it."""


class StandIns:
    """The stand-ins of one export. `remove` must be called after it: stand-ins are data-blocks of the open file."""

    def __init__(self) -> None:
        self._by_material: dict[int, StandIn] = {}

    def add(self, material: bpy.types.Material) -> StandIn:
        """Return a new stand-in of `material`, which stays as it is."""
        made = StandIn(material.copy())
        try:
            _replace(material.node_tree, made.material.node_tree, (), made)
        except BaseException:
            _remove([made])
            raise
        self._by_material[material.session_uid] = made
        return made

    @property
    def made(self) -> list[StandIn]:
        """All stand-ins."""
        return list(self._by_material.values())

    def of(self, material: bpy.types.Material) -> StandIn | None:
        """Return the stand-in of `material`, or of the material that it is the evaluated copy of; None where it has none."""
        return self._by_material.get(material.original.session_uid)

    def remove(self) -> None:
        """Remove all stand-ins from the open file."""
        made = self.made
        self._by_material.clear()
        _remove(made)


def _remove(made: list[StandIn]) -> None:
    bpy.data.batch_remove([block for stand_in in made for block in (stand_in.material, *stand_in.groups, *stand_in.images)])


def holds_ours(tree: bpy.types.ShaderNodeTree) -> bool:
    """Return whether `tree`, or an artist's group in it, holds one of our groups."""
    groups = map(_artists_group, tree.nodes)
    return any(map(_ours, tree.nodes)) or any(holds_ours(group) for group in groups if group)


def _ours(node: bpy.types.Node) -> Group | None:
    return BY_KEY.get(key_and_version(node)[0]) if node.type == "GROUP" else None


def _artists_group(node: bpy.types.Node) -> bpy.types.ShaderNodeTree | None:
    return node.node_tree if node.type == "GROUP" and not _ours(node) else None


def _replace(
    original: bpy.types.ShaderNodeTree, copy: bpy.types.ShaderNodeTree, groups: tuple[bpy.types.Node, ...], made: StandIn
) -> None:
    """Replace our groups in `copy`, a copy of the tree `original`, and in copies of the artist's groups in it."""
    for node in list(original.nodes):
        twin, group, artists = copy.nodes[node.name], _ours(node), _artists_group(node)
        if group:
            version = key_and_version(node)[1]
            version = int(version) if version.isdecimal() else group.version
            made.replaced.append(Replaced(node, group, version, _principled(copy, twin, group, version), groups))
        elif artists and holds_ours(artists):
            twin.node_tree = artists.copy()
            made.groups.append(twin.node_tree)
            _replace(artists, twin.node_tree, (*groups, twin), made)


def _principled(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, group: Group, version: int) -> bpy.types.Node:
    """Replace `node`, of one of our groups, by a Principled BSDF with its values and links; returns that."""
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    table = SOCKETS.get(group.key)
    if table:
        principled.inputs["Specular IOR Level"].default_value = 0.0
        principled.inputs["Roughness"].default_value = 1.0
    if group is SPECULAR_GROUP:
        gloss = preview.gloss(read(node, group, version, Names(lambda image: image.name, str)))
        principled.inputs["Specular IOR Level"].default_value = 0.5 * gloss.weight
        principled.inputs["Roughness"].default_value = gloss.roughness
        principled.inputs["IOR"].default_value = gloss.ior
    for socket, wanted in _pairs(node, principled, table):
        if socket.type == wanted.type and not (table and socket.name == "Normal"):
            wanted.default_value = socket.default_value
        output = linked_output(socket)
        if output:
            tree.links.new(output, wanted)
    if group is SUBSURFACE:
        _halve(tree, principled.inputs["Specular IOR Level"])
    for link in list(node.outputs["BSDF"].links):
        tree.links.new(principled.outputs["BSDF"], link.to_socket).is_muted = link.is_muted
    principled.mute, principled.label = node.mute, node.label or node.name
    tree.nodes.remove(node)
    return principled


def _pairs(
    node: bpy.types.Node, principled: bpy.types.Node, table: Mapping[str, str] | None
) -> Iterator[tuple[bpy.types.NodeSocket, bpy.types.NodeSocket]]:
    for socket in node.inputs:
        name = current_name(socket.name)
        wanted = principled.inputs.get(table.get(name, "") if table else name)
        if wanted:
            yield socket, wanted


def _halve(tree: bpy.types.ShaderNodeTree, level: bpy.types.NodeSocket) -> None:
    """Make of a weight what Principled's Specular IOR Level is for it: 0.5 is the full reflectance of the index of refraction."""
    output = linked_output(level)
    if output is None:
        level.default_value = 0.5 * min(max(level.default_value, 0.0), 1.0)
        return
    half = tree.nodes.new("ShaderNodeMath")
    half.operation = "MULTIPLY"
    half.inputs[1].default_value = 0.5
    tree.links.new(output, half.inputs[0])
    tree.links.new(half.outputs[0], level)
