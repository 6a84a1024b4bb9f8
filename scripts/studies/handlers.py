# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension's handlers take of an update and of a change of frame."""

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
from true_diffuse.scenes.elements import add
from true_diffuse.scripts.studies.study import Step, Table

OBJECTS = 5000
MATERIALS = 500
ROUNDS = 21
LISTS = ("depsgraph_update_post", "frame_change_post")
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


def measured(act: Callable[[int], object]) -> Record:
    """Return the median milliseconds of a call of `act` with the number of the round, and what our handlers take of it.

    A first round does not count. Blender's own part of it is what Blender takes for the data-blocks that changed.
    """
    spent = 0.0

    def timed(handler: Callable[..., None]) -> Callable[..., None]:
        def call(*arguments: object) -> None:
            nonlocal spent
            start = time.perf_counter()
            handler(*arguments)
            spent += time.perf_counter() - start

        return call

    true_diffuse.register()
    registered = {name: list(getattr(bpy.app.handlers, name)) for name in LISTS}
    for name, handlers in registered.items():
        getattr(bpy.app.handlers, name)[:] = [
            timed(handler) if handler.__module__.startswith("true_diffuse.") else handler for handler in handlers
        ]
    rounds = []
    for index in range(ROUNDS + 1):
        spent, start = 0.0, time.perf_counter()
        act(index)
        rounds.append((time.perf_counter() - start, spent))
    for name, handlers in registered.items():
        getattr(bpy.app.handlers, name)[:] = handlers
    true_diffuse.unregister()
    whole, ours = (1000.0 * median(times) for times in zip(*rounds[1:], strict=True))
    return {"whole_ms": whole, "handlers_ms": ours}


def updates(name: str) -> Iterator[Record]:
    """Yield what it takes to move one of many objects and to change the frame."""
    scene = scene_of(OBJECTS)
    group, inputs = MANY[name]
    scene.objects[0].data.materials[0] = materials.create(name, group, **inputs)
    scene.objects[1].keyframe_insert("location", frame=1)

    def move(index: int) -> None:
        scene.objects[0].location.x = index
        scene.view_layers[0].update()

    for what, act in (("an object moves", move), ("the frame changes", lambda index: scene.frame_set(index))):
        yield {"scene": f"{OBJECTS} objects, {name}", "what": what, **measured(act)}


def updates_of_materials(name: str) -> Iterator[Record]:
    """Yield what it takes to move the chosen light, and an input's slider, where many objects have materials of their own."""
    scene = scene_of(OBJECTS)
    group, inputs = MANY[name]
    for item in scene.objects[:MATERIALS]:
        item.data = item.data.copy()
        item.data.materials[0] = materials.create(name, group, **inputs)
    node = scene.objects[0].data.materials[0].node_tree.nodes[group.name]

    def turn(index: int) -> None:
        scene.objects["Sun"].rotation_euler.x = 0.1 * index
        scene.view_layers[0].update()

    def slide(index: int) -> None:
        node.inputs["Roughness"].default_value = 0.01 * index
        scene.view_layers[0].update()

    for what, act in (("the chosen light moves", turn), ("an input changes", slide)):
        yield {"scene": f"{OBJECTS} objects, {MATERIALS} materials, {name}", "what": what, **measured(act)}


def steps() -> list[Step]:
    """Return steps for each material, of many objects and many times over."""
    return [Step(name, partial(measure, name)) for measure in (updates, updates_of_materials) for name in MANY]


def table(found: Sequence[Record]) -> Table:
    """Return a row for each record."""
    columns = ("Scene", "What", "All of it [ms]", "Handlers [ms]")
    return columns, [
        (record["scene"], record["what"], f"{record['whole_ms']:.2f}", f"{record['handlers_ms']:.3f}") for record in found
    ]
