# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the surface of a stand-in one Principled BSDF, with an emission beside it, which is all that the exporter knows.

Mixes that choose one side, and those with a Transparent BSDF, become what they are; of any other mix or sum one side is kept, and
that is said. Links are changed in the tree that holds them, unless several group nodes share that.
"""

from collections.abc import Iterator, Sequence

from ..material.links import Place, source, trail, upstream
from ..material.surface import Loss
from .inputs import constant, is_white
from .stand_in import Replaced

EMISSION = "ShaderNodeEmission"


def reduce(place: Place, replaced: Sequence[Replaced]) -> Iterator[Loss]:
    """Reduce what feeds a closure's input `place`; yields what is lost. `replaced` are the nodes that count most."""
    origin = source(place)
    if not origin.socket.is_output or not _is_own(place, origin):
        return
    if origin.node.bl_idname == "ShaderNodeMixShader":
        yield from _reduce_mix(place, origin, replaced)
    elif origin.node.bl_idname == "ShaderNodeAddShader":
        yield from _reduce_sum(place, origin, replaced)


def _reduce_mix(place: Place, mix: Place, replaced: Sequence[Replaced]) -> Iterator[Loss]:
    factor, sides = constant(mix.input(0)), (mix.input(1), mix.input(2))
    first, second = (source(side) for side in sides)
    if factor is not None:
        factor = min(max(factor, 0.0), 1.0)
    if factor in (0.0, 1.0) or first == second:
        kept = sides[1] if factor == 1.0 else sides[0]
    else:
        transparent = next((index for index in (0, 1) if _is_transparent((first, second)[index])), None)
        if transparent is not None:
            other = sides[1 - transparent]
            yield from reduce(other, replaced)
            if not _take_opacity(mix, source(other), transparent == 0, factor):
                return
            kept = other
        else:
            kept = sides[_heavier(sides, factor, replaced)]
            yield Loss("", mix.label, f"the node {mix.node.bl_label}", f"{source(kept).label} alone is written")
    _keep(place, mix, kept)
    yield from reduce(place, replaced)


def _reduce_sum(place: Place, total: Place, replaced: Sequence[Replaced]) -> Iterator[Loss]:
    sides = (total.input(0), total.input(1))
    there = [side for side in sides if source(side).socket.is_output]
    emitting = [side for side in there if source(side).node.bl_idname == EMISSION]
    if len(there) == 2 and len(emitting) == 1:
        yield from reduce(next(side for side in there if side not in emitting), replaced)
        return
    if len(there) == 2:
        kept = sides[_heavier(sides, None, replaced)]
        yield Loss("", total.label, f"the node {total.node.bl_label}", f"{source(kept).label} alone is written")
    else:
        kept = there[0] if there else sides[0]
    _keep(place, total, kept)
    yield from reduce(place, replaced)


def _is_own(place: Place, origin: Place) -> bool:
    """Return whether the trees from an input to where it comes from may be changed: no other group node has them."""
    groups = {*place.groups, *origin.groups}
    return all(group.node_tree.users == 1 for group in groups)


def _keep(place: Place, node: Place, side: Place) -> None:
    """Link what feeds a `side` of the closure `node` in its place."""
    end = next(one for one in reversed(trail(place)) if not one.socket.is_output and one.groups == node.groups)
    tree = node.node.id_data
    links = [link for link in side.socket.links if link.is_valid and not link.is_muted]
    for link in list(end.socket.links):
        tree.links.remove(link)
    if links:
        tree.links.new(links[0].from_socket, end.socket)


def _heavier(sides: Sequence[Place], factor: float | None, replaced: Sequence[Replaced]) -> int:
    """Return which of two sides counts more: the one of ours, else the only one that is linked, else the one with more weight."""
    ours = [any(one.principled == output.node for output in upstream(side) for one in replaced) for side in sides]
    there = [source(side).socket.is_output for side in sides]
    for is_better in (ours, there):
        if is_better[0] != is_better[1]:
            return is_better.index(True)
    return int(factor is not None and factor > 0.5)


def _is_transparent(place: Place) -> bool:
    return place.node.bl_idname == "ShaderNodeBsdfTransparent" and is_white(place.input("Color"))


def _take_opacity(mix: Place, closure: Place, is_opacity: bool, factor: float | None) -> bool:
    """Give a Principled BSDF the factor of a mix with a Transparent BSDF as its alpha; returns whether that can be."""
    if closure.node.bl_idname != "ShaderNodeBsdfPrincipled" or not _is_own(mix, closure):
        return False
    alpha = closure.node.inputs["Alpha"]
    if alpha.is_linked or alpha.default_value != 1.0:
        return False
    if factor is not None:
        alpha.default_value = factor if is_opacity else 1.0 - factor
    elif is_opacity and mix.groups == closure.groups:
        closure.node.id_data.links.new(mix.node.inputs[0].links[0].from_socket, alpha)
    else:
        return False
    return True
