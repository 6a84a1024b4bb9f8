# SPDX-License-Identifier: GPL-3.0-or-later
"""How a group node is used: the constant sockets, the engines that render it, the chosen lights that shine."""

import json
from collections.abc import Iterable, Mapping, Sequence

import bpy

from ..blender.engines import EEVEE, uses_osl
from ..closures.quality import CHOSEN_LIGHTS
from ..nodes import chosen_lights
from ..nodes.rough_diffuse import QUALITY
from .arithmetic import Plain
from .folding import Use

type Owner = bpy.types.Material | bpy.types.ShaderNodeTree  # where a group's node is: a material, or a group of the artist
type Users = Mapping[bpy.types.ID, Iterable[bpy.types.ID]]


def tree_of(owner: Owner) -> bpy.types.ShaderNodeTree | None:
    return owner.node_tree if isinstance(owner, bpy.types.Material) else owner


def scenes_of(owner: Owner, users: Users) -> list[bpy.types.Scene]:
    """Return the scenes that use `owner` directly or through other data-blocks; `users` is `bpy.data.user_map()`."""
    reached, pending = {owner}, [owner]
    while pending:
        for user in users.get(pending.pop(), ()):
            if user not in reached:
                reached.add(user)
                pending.append(user)
    return [scene for scene in bpy.data.scenes if scene in reached]


def constant_inputs(owner: Owner, node: bpy.types.Node) -> dict[str, Plain | str]:
    """Return the values of the sockets without link, driver or keyframes, by name; colors without alpha."""
    animated = animated_paths(owner)
    inputs: dict[str, Plain | str] = {}
    for socket in node.inputs:
        if not socket.is_linked and not any(socket.path_from_id("default_value") in path for path in animated):
            value = socket.default_value
            if isinstance(value, bool):
                value = float(value)
            inputs[socket.name] = value if isinstance(value, (str, float)) else tuple(value)[:3]
    return inputs


def animated_paths(owner: Owner) -> set[str]:
    """Return the data paths of `owner` and its node tree that have drivers, keyframes or NLA strips."""
    paths: set[str] = set()
    for item in (owner, tree_of(owner)):
        data = item.animation_data if item else None
        if data is None:
            continue
        paths.update(curve.data_path for curve in data.drivers)
        for action in (data.action, *(strip.action for track in data.nla_tracks for strip in track.strips)):
            for layer in action.layers if action else ():
                for bag in (bag for strip in layer.strips for bag in strip.channelbags):
                    paths.update(curve.data_path for curve in bag.fcurves)
    return paths


def in_eevee(scene: bpy.types.Scene) -> bool:
    """Return whether EEVEE renders `scene`, as the driver of `Graph.in_eevee` does."""
    return scene.render.engine == EEVEE.identifier


def meter(scene: bpy.types.Scene) -> float:
    """Return a meter in `scene`'s units, as the driver of `Graph.meter` does."""
    return 1.0 / scene.unit_settings.scale_length


def shines(light: bpy.types.Object | None, scene: bpy.types.Scene) -> bool:
    """Return whether `light` is in `scene` and emits light in a render, or may do so in another frame."""
    if light is None or light.name not in scene.objects or scene.objects[light.name] != light:
        return False
    if light.animation_data or light.data.animation_data:
        return True
    return not light.hide_render and light.data.energy != 0.0 and any(light.data.color)


def use_of(owner: Owner, node: bpy.types.Node, scenes: Sequence[bpy.types.Scene]) -> Use:
    """Return what is constant of a group node rendered in `scenes`, of which there is at least one."""
    inputs = constant_inputs(owner, node)
    shining = (True,) * chosen_lights.SLOTS
    if inputs.get(QUALITY.name) == CHOSEN_LIGHTS:
        shining = tuple(any(shines(light, scene) for scene in scenes) for light in chosen_lights.slots())
    return Use(
        inputs,
        eevee=_common(map(in_eevee, scenes)),
        osl=_common(map(uses_osl, scenes)),
        meter=_common(map(meter, scenes)),
        shining=shining,
    )


def _common[T](values: Iterable[T]) -> T | None:
    """Return the value that all `values` have, None where they differ."""
    first, *others = values
    return first if all(value == first for value in others) else None


def has_inputs(use: Use, owner: Owner, node: bpy.types.Node) -> bool:
    """Return whether the constant sockets of `node` are those of `use`, with the same values."""
    return json.dumps(use.inputs, sort_keys=True) == json.dumps(constant_inputs(owner, node), sort_keys=True)  # NaN equals NaN


def holds_in(use: Use, scene: bpy.types.Scene) -> bool:
    """Return whether `use` is true of `scene` as it is now."""
    if any(
        constant is not None and constant != current(scene)
        for constant, current in ((use.eevee, in_eevee), (use.osl, uses_osl), (use.meter, meter))
    ):
        return False
    if all(use.shining):
        return True
    dark = [light for light, shining in zip(chosen_lights.slots(), use.shining, strict=True) if not shining]
    return not any(shines(light, scene) for light in dark)
