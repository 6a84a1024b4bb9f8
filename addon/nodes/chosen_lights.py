# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights that the quality Exact for Chosen Lights is exact for: an inner node group whose drivers follow up to SLOTS of them.

For each light it gives L, the unit vector towards it from the shading point, and E, the irradiance [W/m^2] on a plane that faces it
there, without shadows. An area light counts as its center, a spot with its cone.
"""

import math
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager

import bpy

from ..blender.id_properties import LIGHT_TYPES
from .graph import Graph, Group, Number, Socket, Value

SLOTS = 4
COUNT = "Count"
CHANNELS = ("red", "green", "blue")
NEAR = 1e-12  # m^2, the least squared distance
# Where the irradiance is below this fraction of what the lights would give at normal incidence, the mean fades to its value for
# light from elsewhere; else it would crease at the terminator.
FADE = 0.005
MENU_PATH = "Object > True Diffuse > Use Selected Lights"  # the operator that chooses them

L = Socket("L", "NodeSocketVector", "Unit vector towards the light", (0.0, 0.0, 0.0))


def build(graph: Graph, chosen: Sequence[bpy.types.Object]) -> dict[str, Value]:
    """Return how many lights there are, and L and E of each slot; E is 0 in slots without a light."""
    outputs = {COUNT: graph.constant(float(len(chosen)))}
    dark = graph.vector(0.0, 0.0, 0.0)
    for slot in range(SLOTS):
        l, e = light_vectors(graph, chosen[slot]) if slot < len(chosen) else (dark, dark)
        outputs[f"L {slot + 1}"], outputs[f"E {slot + 1}"] = l, e
    return outputs


def light_vectors(graph: Graph, light: bpy.types.Object) -> tuple[Value, Value]:
    """Return L and E of a light object."""
    data = light.data
    color = graph.vector(*(graph.property(f"{light.name} {name}", data, f"color[{i}]") for i, name in enumerate(CHANNELS)))
    strength = graph.property("Strength", data, "energy") * graph.math("POWER", 2.0, graph.property("Exposure", data, "exposure"))
    energy = color * (strength * (1.0 - graph.property("Hidden", light, "hide_render")))
    # the light's local z axis, from the quaternion of its rotation; it shines along -z
    axis = graph.vector(
        graph.rotation(f"{light.name} axis X", light, "2*(x*z+w*y)"),
        graph.rotation(f"{light.name} axis Y", light, "2*(y*z-w*x)"),
        graph.rotation(f"{light.name} axis Z", light, "1-2*(x*x+y*y)"),
    )
    if data.type == "SUN":
        return axis, energy
    position = graph.vector(*(graph.location(light, axis) for axis in "XYZ"))
    to_light = position - graph.geometry("Position")
    l = graph.normalize(to_light)
    power = energy / graph.maximum(graph.dot(to_light, to_light), NEAR)
    if data.type == "POINT":
        return l, power * (1.0 / (4.0 * math.pi))
    facing = graph.maximum(graph.dot(l, axis), 0.0)
    if data.type == "AREA":
        return l, power * (facing * (1.0 / math.pi))
    # Blender's cone: a smooth step that starts at the cosine of half its angle, over a fraction of the inside
    edge = graph.math("COSINE", graph.property("Cone", data, "spot_size") * 0.5)
    blend = graph.maximum((1.0 - edge) * graph.property("Blend", data, "spot_blend"), 1e-6)
    t = graph.clamp((facing - edge) / blend, 0.0, 1.0)
    return l, power * (t * t * (3.0 - 2.0 * t) * (1.0 / (4.0 * math.pi)))


LIGHTS = Group(
    "lights", ".True Diffuse Lights", "Lights", 3, "The lights that materials are exact for", (), lambda graph: build(graph, ())
)


def weighted_mean(
    graph: Graph, under: Callable[[Value], tuple[Value, Value]], elsewhere: Number, closure: Callable[[Number], Value]
) -> Value:
    """Return the `closure` of the mean of a quantity over the chosen lights, weighted by the irradiance of each, without shadows.

    `under` returns for a light's L the quantity there, and N.L. Light from elsewhere has a small weight and the value `elsewhere`.
    """
    vectors = graph.group(LIGHTS)
    closures = {0: closure(elsewhere)}
    reflected: Number = 0.0
    received: Number = 0.0
    total: Number = 0.0
    for slot in range(1, SLOTS + 1):
        value, mu = under(vectors[f"L {slot}"])
        irradiance = vectors[f"E {slot}"]
        here = irradiance * mu
        reflected, received, total = value * here + reflected, here + received, irradiance + total
        rest = graph.maximum(total * FADE - received, 1e-9)
        closures[slot] = closure((elsewhere * rest + reflected) / (received + rest))
    return graph.switch(vectors[COUNT], closures)


def tree_inside(group: bpy.types.NodeTree) -> bpy.types.ShaderNodeTree | None:
    """Return the tree whose lights a node that holds `group` follows: the file's own or, of a linked group, its file's."""
    trees = (*LIGHTS.trees(), *LIGHTS.trees(linked=True))
    return next((tree for tree in trees if group.contains_tree(tree)), None)


def lights_of(tree: bpy.types.ShaderNodeTree | None) -> list[bpy.types.Object]:
    """Return the lights that a tree of the group follows, in the order of their slots, without those that are deleted."""
    hidden = (target.id for target in _targets(tree) if target.data_path == "hide_render") if tree else ()
    return [light for light in dict.fromkeys(hidden) if light is not None]


def _targets(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.DriverTarget]:
    """Return what the drivers of a tree of the group read, slot by slot, as `build` has made them."""
    curves = tree.animation_data.drivers if tree.animation_data else ()
    return [target for curve in curves for variable in curve.driver.variables for target in variable.targets]


def choose(lights: Sequence[bpy.types.Object]) -> None:
    """Make all materials in the file exact for `lights`; raises ValueError for other objects or for more than SLOTS."""
    if len(lights) > SLOTS:
        raise ValueError(f"at most {SLOTS} lights, not {len(lights)}")
    for light in lights:
        if light.type != "LIGHT":
            raise ValueError(f"{light.name} is not a light")
    LIGHTS.rebuild(lambda graph: build(graph, lights))
    for tree in LIGHTS.trees():
        tree[LIGHT_TYPES] = _types(lights)


def chosen() -> list[bpy.types.Object]:
    """Return the chosen lights, which all of the file's own materials follow, in the order of their slots."""
    return lights_of(next(iter(LIGHTS.trees()), None))


@contextmanager
def following(lights: Sequence[bpy.types.Object]) -> Generator[None]:
    """Choose `lights` inside the context, and the lights chosen before when it ends."""
    before = chosen()
    choose(lights)
    try:
        yield
    finally:
        choose(before)


def keep_up() -> None:
    """Make the nodes anew where a chosen light has been deleted, or has another type or other data than they were made for."""
    if any(map(_is_behind, LIGHTS.trees())):
        choose(chosen())


def _is_behind(tree: bpy.types.ShaderNodeTree) -> bool:
    targets = _targets(tree)
    if any(target.id is None for target in targets):
        return True
    lights = lights_of(tree)
    data = {target.id for target in targets if target.data_path == "energy"}
    return data != {light.data for light in lights} or tree.get(LIGHT_TYPES, _types(lights)) != _types(lights)


def _types(lights: Sequence[bpy.types.Object]) -> str:
    return " ".join(light.data.type for light in lights)
