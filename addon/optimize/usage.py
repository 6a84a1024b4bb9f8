# SPDX-License-Identifier: GPL-3.0-or-later
"""What a group's node is used for: which of its sockets nothing feeds, in which engines it is rendered, which lamps shine on it."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict

import bpy

from ..blender.engines import EEVEE, uses_osl
from ..closures.quality import CHOSEN_LIGHTS
from ..nodes import chosen_lights
from ..nodes.graph import stamp_of
from ..nodes.rough_diffuse import QUALITY
from ..nodes.subsurface import COLOR, MEAN_FREE_PATH, SCALE, SUBSURFACE, WEIGHT
from .arithmetic import Plain
from .blur import is_flat
from .folding import Use

type Owner = bpy.types.Material | bpy.types.ShaderNodeTree  # where a group's node is: a material, or a group of the artist's
type Users = Mapping[bpy.types.ID, Iterable[bpy.types.ID]]


def tree_of(owner: Owner) -> bpy.types.ShaderNodeTree | None:
    return owner.node_tree if isinstance(owner, bpy.types.Material) else owner


def scenes_of(owner: Owner, users: Users) -> list[bpy.types.Scene]:
    """Return the scenes that `owner` can be seen in, through whatever data-blocks; `users` as `bpy.data.user_map` has it."""
    seen, waiting = {owner}, [owner]
    while waiting:
        for user in users.get(waiting.pop(), ()):
            if user not in seen:
                seen.add(user)
                waiting.append(user)
    return [scene for scene in bpy.data.scenes if scene in seen]


def plain_inputs(owner: Owner, node: bpy.types.Node) -> dict[str, Plain | str]:
    """Return the values of the sockets that no link, driver or keyframe feeds, by name; colors without alpha."""
    moved = animated(owner)
    inputs: dict[str, Plain | str] = {}
    for socket in node.inputs:
        if not socket.is_linked and not any(socket.path_from_id("default_value") in path for path in moved):
            value = socket.default_value
            inputs[socket.name] = value if isinstance(value, (str, float)) else tuple(value)[:3]
    return inputs


def animated(owner: Owner) -> set[str]:
    """Return the data paths of `owner` and its node tree that drivers, keyframes or NLA strips move."""
    paths: set[str] = set()
    for moved in (owner, tree_of(owner)):
        data = moved.animation_data if moved else None
        if data is None:
            continue
        paths.update(curve.data_path for curve in data.drivers)
        for action in (data.action, *(strip.action for track in data.nla_tracks for strip in track.strips)):
            for layer in action.layers if action else ():
                for bag in (bag for strip in layer.strips for bag in strip.channelbags):
                    paths.update(curve.data_path for curve in bag.fcurves)
    return paths


def in_eevee(scene: bpy.types.Scene) -> bool:
    """As the driver of `Graph.in_eevee`."""
    return scene.render.engine == EEVEE.identifier


def meter(scene: bpy.types.Scene) -> float:
    """As the driver of `Graph.meter`."""
    return 1.0 / scene.unit_settings.scale_length


def shines(light: bpy.types.Object | None, scene: bpy.types.Scene) -> bool:
    """Return whether `light` is in the scene and sends light in a render, or may do so in another frame."""
    if light is None or light.name not in scene.objects or scene.objects[light.name] != light:
        return False
    if light.animation_data or light.data.animation_data:
        return True
    return not light.hide_render and light.data.energy != 0.0 and any(light.data.color)


def use_of(owner: Owner, node: bpy.types.Node, scenes: Sequence[bpy.types.Scene]) -> Use:
    """Return what is known ahead of a group's node that is rendered in `scenes`, one or more."""
    inputs = plain_inputs(owner, node)
    lit = (True,) * chosen_lights.SLOTS
    if inputs.get(QUALITY.name) == CHOSEN_LIGHTS:
        lit = tuple(any(shines(light, scene) for scene in scenes) for light in chosen_lights.slots())
    return Use(
        inputs,
        _same(map(in_eevee, scenes)),
        _same(map(uses_osl, scenes)),
        _same(map(meter, scenes)),
        lit,
        stamp_of(node)[0] == SUBSURFACE.key and flat_in(inputs, owner, scenes),
    )


def flat_in(inputs: Mapping[str, Plain | str], owner: Owner, scenes: Sequence[bpy.types.Scene], now: bool = False) -> bool:
    """Return whether the matter of the group Subsurface shows no blur in any scene, over all frames or `now`."""
    length, scale, color = (inputs.get(socket.name) for socket in (MEAN_FREE_PATH, SCALE, COLOR))
    if inputs.get(WEIGHT.name) == 0.0 or not isinstance(owner, bpy.types.Material):
        return False
    if not isinstance(length, tuple) or not isinstance(scale, float) or isinstance(color, str):
        return False  # a link or an animation may make it any length
    return all(is_flat(scene, owner, [meter(scene) * 0.001 * scale * x for x in length], color, now) for scene in scenes)


def _same[T](values: Iterable[T]) -> T | None:
    """Return what all `values` are, None where they differ."""
    first, *others = values
    return first if all(value == first for value in others) else None


def packed(use: Use) -> str:
    """Return all of `use` as text, the same for uses that are the same."""
    return json.dumps(asdict(use), sort_keys=True)


def unpacked(text: str) -> Use:
    """Return the use that `packed` made `text` of."""
    values = json.loads(text)
    values["inputs"] = {name: tuple(value) if isinstance(value, list) else value for name, value in values["inputs"].items()}
    return Use(**values)


def still_right(text: str, owner: Owner, node: bpy.types.Node) -> bool:
    """Return whether the sockets of `node` are as in the use that `packed` made `text` of."""
    return json.dumps(json.loads(text)["inputs"], sort_keys=True) == json.dumps(plain_inputs(owner, node), sort_keys=True)


def serves(use: Use, owner: Owner, scene: bpy.types.Scene) -> bool:
    """Return whether what is known in `use` holds in `scene` now."""
    settled = (use.eevee, in_eevee), (use.osl, uses_osl), (use.meter, meter)
    if any(known is not None and known != ask(scene) for known, ask in settled):
        return False
    if not all(use.shining):
        dark = [light for light, lit in zip(chosen_lights.slots(), use.shining, strict=True) if not lit]
        if any(shines(light, scene) for light in dark):
            return False
    return not use.flat or flat_in(use.inputs, owner, [scene], now=True)
