# SPDX-License-Identifier: GPL-3.0-or-later
"""Stand-ins: copies of our materials for Blender's glTF exporter, in which a Principled BSDF takes the place of each of our groups.

The exporter follows links into groups and takes the closures that it finds there for the artist's. In a stand-in it finds what it
would find in a material that was never converted: the same textures, transforms, UV maps, color attributes and cutoffs.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import bpy

from ..blender.id_properties import GROUP_ID
from ..material.read import shown
from ..material.read_closures import ENGINES, TARGETS
from ..material.revert import is_ours, to_principled
from ..material.surface import Loss
from ..nodes import ROUGH_DIFFUSE
from ..nodes.graph import key_and_version


@dataclass
class Replaced:
    """A node of ours, still in the artist's tree, and the Principled BSDF that stands for it."""

    node: bpy.types.Node
    principled: bpy.types.Node
    groups: tuple[bpy.types.Node, ...]
    """The group nodes of the stand-in that hold the Principled BSDF, from the outside in."""
    mean_roughness: float | None = None
    """The mean of the model's roughness over an image of it."""
    has_eon_roughness: bool = False
    """Whether an image of EON's roughness has taken the place of the model's."""

    @property
    def label(self) -> str:
        """What the interface calls the node."""
        return self.node.label or self.node.name


@dataclass
class StandIn:
    """The copy of a material, and what else was made for it."""

    material: bpy.types.Material
    groups: list[bpy.types.ShaderNodeTree] = field(default_factory=list)
    """Copies of the artist's groups."""
    images: list[bpy.types.Image] = field(default_factory=list)
    """What was baked."""
    replaced: list[Replaced] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)
    """What glTF cannot hold."""

    @property
    def blocks(self) -> list[bpy.types.ID]:
        """The data-blocks that were made."""
        return [self.material, *self.groups, *self.images]


class StandIns:
    """The stand-ins of one export. `remove` must be called after it: stand-ins are data-blocks of the open file."""

    def __init__(self) -> None:
        self._by_material: dict[int, StandIn] = {}

    def add(self, material: bpy.types.Material) -> StandIn:
        """Return a new stand-in of `material`, which stays as it is."""
        made = StandIn(material.copy())
        try:
            if made.material.override_library:  # whose nodes could not be changed
                made.material.make_local(clear_liboverride=True)
            tree = made.material.node_tree
            is_animated = tree.animation_data is not None
            tree.animation_data_clear()  # whose actions are the material's own, too, and would lose the curves of what is replaced
            made.groups = to_principled(made.material).copies
            if is_animated:
                tree.animation_data_create()  # by which the exporter knows that there is something to animate
            made.losses += _keep_output(tree, shown(material))
            made.replaced = list(_replaced(material.node_tree, tree, ()))
            for replaced in made.replaced:
                if key_and_version(replaced.node)[0] == ROUGH_DIFFUSE.key:
                    replaced.principled.inputs["Roughness"].default_value = 1.0  # of a specular layer that it has not
        except BaseException:
            bpy.data.batch_remove(made.blocks)
            raise
        self._by_material[material.session_uid] = made
        return made

    def of(self, material: bpy.types.Material) -> StandIn | None:
        """Return the stand-in of `material`, or of the material that it is the evaluated copy of; None where it has none."""
        return self._by_material.get(material.original.session_uid)

    def remove(self) -> None:
        """Remove all stand-ins from the open file."""
        made = list(self._by_material.values())
        self._by_material.clear()
        bpy.data.batch_remove([block for stand_in in made for block in stand_in.blocks])


def _keep_output(tree: bpy.types.ShaderNodeTree, target: str | None) -> list[Loss]:
    """Make the output for a target, else for EEVEE or Cycles, the only one of `tree`: the exporter knows none of one engine alone.

    Returns what is lost by that.
    """
    targets = (target, *TARGETS) if target else TARGETS
    kept = next((output for each in targets if (output := tree.get_output_node(each))), None)
    if kept is None:
        return []
    others = [other for other in (tree.get_output_node(each) for each in ENGINES) if other and other != kept]
    losses = [Loss("", others[0].name, "another engine's output", f"{kept.name} is written")] if others else []
    for node in [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL" and node != kept]:
        tree.nodes.remove(node)
    kept.target, kept.is_active_output = "ALL", True
    return losses


def holds_ours(tree: bpy.types.ShaderNodeTree) -> bool:
    """Return whether `tree`, or an artist's group in it, holds one of our groups."""
    return any(map(is_ours, tree.nodes)) or any(holds_ours(node.node_tree) for node in tree.nodes if _is_artists_group(node))


def _is_artists_group(node: bpy.types.Node) -> bool:
    return node.type == "GROUP" and node.node_tree is not None and GROUP_ID not in node.node_tree


def _replaced(
    original: bpy.types.ShaderNodeTree, copy: bpy.types.ShaderNodeTree, groups: tuple[bpy.types.Node, ...]
) -> Iterator[Replaced]:
    """Yield what was replaced in `copy`, a copy of the tree `original`, in which nodes have the same names."""
    for node in original.nodes:
        if is_ours(node):
            yield Replaced(node, copy.nodes[node.name], groups)
        elif _is_artists_group(node):
            twin = copy.nodes[node.name]
            yield from _replaced(node.node_tree, twin.node_tree, (*groups, twin))
