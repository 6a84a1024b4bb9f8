# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension's handlers take of an update and of a change of frame, and an edit of one of many optimized materials."""

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from statistics import median

import bpy

import true_diffuse
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.materials import Setting
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE, Group, chosen_lights
from true_diffuse.addon.optimize.materials import optimize_materials
from true_diffuse.scenes.elements import add
from true_diffuse.scripts.studies.study import Step, Table

OBJECTS, MATERIALS = 5000, 200
ROUNDS = 21
MANY: dict[str, tuple[Group, dict[str, Setting]]] = {
    "Exact for Chosen Lights": (ROUGH_DIFFUSE, {"Quality": "Exact for Chosen Lights"}),
    "Subsurface": (SUBSURFACE, {}),
}
"""The one material of the many objects, by its name in the table."""


def scene_of(count: int) -> bpy.types.Scene:
    """Return the scene of an empty file with so many triangles in it, and a light that is chosen."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("Triangle")
    mesh.from_pydata([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)], [], [(0, 1, 2)])
    mesh.materials.append(bpy.data.materials.new("None"))
    for index in range(count):
        add(scene, f"Triangle {index}", mesh)
    chosen_lights.choose([add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))])
    return scene


def milliseconds(act: Callable[[int], object]) -> float:
    """Return the median time of a call of `act` with the number of the round, after one that does not count."""
    times = []
    for index in range(ROUNDS + 1):
        start = time.perf_counter()
        act(index)
        times.append(1000.0 * (time.perf_counter() - start))
    return median(times[1:])


def updates(name: str) -> Iterator[Record]:
    """Yield what moving an object and changing the frame take without our handlers, and how much longer with them."""
    scene = scene_of(OBJECTS)
    group, inputs = MANY[name]
    scene.objects[0].data.materials[0] = materials.create(name, group, **inputs)
    optimize_materials()

    def move(index: int) -> None:
        scene.objects[0].location.x = index
        scene.view_layers[0].update()

    for what, act in (("an object moves", move), ("the frame changes", lambda index: scene.frame_set(index))):
        without = milliseconds(act)
        true_diffuse.register()
        handled = milliseconds(act)
        true_diffuse.unregister()
        yield {"scene": f"{OBJECTS} objects, {name}", "what": what, "without_ms": without, "handlers_ms": handled - without}


def edits() -> Iterator[Record]:
    """Yield what an edit of one of many optimized materials takes, and the whole edit without our handlers."""
    scene = scene_of(MATERIALS)
    made = [materials.create(f"Edited {index}", ROUGH_DIFFUSE, Roughness=index / MATERIALS) for index in range(MATERIALS)]
    for item, material in zip(scene.objects, made, strict=False):
        item.material_slots[0].link, item.material_slots[0].material = "OBJECT", material
    scene.view_layers[0].update()

    def edit(index: int) -> None:
        node = next(node for node in made[index].node_tree.nodes if node.type == "GROUP")
        node.inputs["Roughness"].default_value = 0.987
        scene.view_layers[0].update()

    without = milliseconds(edit)
    for index, material in enumerate(made):
        next(node for node in material.node_tree.nodes if node.type == "GROUP").inputs["Roughness"].default_value = index / MATERIALS
    optimize_materials()
    scene.view_layers[0].update()
    true_diffuse.register()
    handled = milliseconds(edit)
    true_diffuse.unregister()
    what = "one is edited"
    yield {"scene": f"{MATERIALS} materials", "what": what, "without_ms": without, "handlers_ms": handled - without}


def steps() -> list[Step]:
    """Return a step for each material of many objects, and one for many materials."""
    return [*(Step(name, partial(updates, name)) for name in MANY), Step(f"{MATERIALS} materials", edits)]


def table(found: Sequence[Record]) -> Table:
    """Return a row for each record."""
    columns = ("Scene", "What", "Blender's own [ms]", "Handlers [ms]")
    return columns, [
        (record["scene"], record["what"], f"{record['without_ms']:.2f}", f"{record['handlers_ms']:.2f}") for record in found
    ]
