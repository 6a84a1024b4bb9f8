# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit costs a viewport of True Diffuse Realtime, by the number of objects: reading the scene, drawing the first sample.

What Blender does itself before it tells the engine of an edit is not part of it. Times are processor times of all threads, which
other programs hardly affect; of a graphics card they hold the driver's part alone.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from statistics import median
from types import SimpleNamespace

import bpy

import gpu
from mathutils import Matrix, Vector

from true_diffuse.addon.blender.engines import REALTIME
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.addon.realtime.viewport import Viewport
from true_diffuse.scripts.studies.study import Step, Table, pivot

COUNTS, QUICK_COUNTS = (1, 100, 1000, 5000), (1, 100)
MATERIALS = 10
SIZE = (480, 270)  # of the viewport [pixels]
ROUNDS = 5
LATTICE = 2.5  # between objects [m]

FIRST, SELECT, MOVE, MATERIAL, VIEW = EDITS = ("first picture", "select", "move one", "edit a material", "turn the view")


class Watched:
    """A viewport of `count` spheres on a lattice under a sun, each with a mesh of its own or all with one."""

    bl_label = "Realtime"  # as of the engine that Blender hands to a viewport

    def __init__(self, count: int, is_shared: bool) -> None:
        """Build the scene. Needs a graphics driver."""
        if bpy.app.background:
            gpu.init()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.scene.render.engine = REALTIME.identifier
        self.scene.true_diffuse.viewport_samples = 1
        self.materials = [materials.create(f"Material {k}", ROUGH_DIFFUSE, Roughness=0.05 * k) for k in range(MATERIALS)]
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
        first = bpy.context.object
        first.data.materials.append(self.materials[0])
        self.objects = [first]
        side = round(count**0.5) or 1
        for k in range(1, count):
            item = first.copy()
            if not is_shared:
                item.data = first.data.copy()
                item.data.materials[0] = self.materials[k % MATERIALS]
            item.location = (LATTICE * (k % side), LATTICE * (k // side), 0.0)
            self.scene.collection.objects.link(item)
            self.objects.append(item)
        sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.rotation_euler = (0.6, 0.4, 0.0)
        self.scene.collection.objects.link(sun)
        area = next(area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
        width, height = SIZE
        self._across = LATTICE * (side + 1)
        self._seen = SimpleNamespace(
            view_matrix=Matrix(), perspective_matrix=Matrix(), is_perspective=False, view_perspective="ORTHO"
        )
        region = SimpleNamespace(width=width, height=height, as_pointer=lambda: 0)
        self._context = SimpleNamespace(region=region, region_data=self._seen, space_data=area.spaces.active, area=area)
        self._viewport = Viewport()
        self._target = gpu.types.GPUTexture(SIZE, format="RGBA32F")
        self._window = gpu.types.GPUFrameBuffer(color_slots=self._target)
        self._reading = 0.0

    def report(self, _kinds: set[str], message: str) -> None:
        """Fail, as Blender would report an error."""
        raise RuntimeError(message)

    def update_stats(self, _stats: str, _info: str) -> None:
        """Take what Blender would show in the viewport."""

    def costs(self) -> dict[str, tuple[float, float]]:
        """Return what each of EDITS costs: reading and drawing [s of processor time]."""
        bpy.app.handlers.depsgraph_update_post.append(self._read)
        try:
            return {name: self._cost(change, 1 if name == FIRST else ROUNDS) for name, change in self._edits().items()}
        finally:
            bpy.app.handlers.depsgraph_update_post.remove(self._read)

    def _edits(self) -> dict[str, Callable[[int], object]]:
        def first(_: int) -> None:
            self._look(0.0)
            self.scene.update_tag()

        def select(turn: int) -> None:
            self.objects[turn % len(self.objects)].select_set(turn % 2 == 0)

        def move(turn: int) -> None:
            self.objects[-1].location.z = 0.1 * (turn + 1)

        def edit(turn: int) -> None:
            group = next(node for node in self.materials[0].node_tree.nodes if node.type == "GROUP")
            group.inputs["Roughness"].default_value = 0.1 * (turn + 1)

        return dict(zip(EDITS, (first, select, move, edit, lambda turn: self._look(0.1 * (turn + 1))), strict=True))

    def _look(self, angle: float) -> None:
        """Look at all objects from above, turned by `angle`."""
        middle = Vector((self._across / 2.0, self._across / 2.0, 0.0))
        scale = Matrix.Diagonal((1.6 / self._across * SIZE[1] / SIZE[0], 1.6 / self._across, -1e-3, 1.0))
        self._seen.perspective_matrix = scale @ Matrix.Rotation(angle, 4, "X") @ Matrix.Translation(-middle)

    def _read(self, _scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        start = time.process_time()
        self._viewport.update(self, self._context, depsgraph)
        if self._viewport._cache and not self._viewport._cache.is_complete:  # the first picture is to show all, too
            self._viewport.update(self, self._context, depsgraph)
        self._reading += time.process_time() - start

    def _cost(self, change: Callable[[int], object], rounds: int) -> tuple[float, float]:
        reading, drawing = [], []
        for turn in range(rounds):
            self._reading = 0.0
            change(turn)
            bpy.context.view_layer.update()
            reading.append(self._reading)
            with self._window.bind():
                start = time.process_time()
                self._viewport.draw(self, self._context, bpy.context.evaluated_depsgraph_get())
                self._window.read_color(0, 0, 1, 1, 4, 0, "FLOAT")  # waits until all is drawn
                drawing.append(time.process_time() - start)
        return median(reading), median(drawing)


def steps(quick: bool) -> Iterator[Step]:
    """Yield steps that time the edits for each number of objects, with meshes of their own and with one for all."""

    def step(count: int, is_shared: bool) -> Step:
        def measure() -> list[Record]:
            about = {"target": "realtime", "objects": count, "meshes": "one" if is_shared else "own"}
            found = Watched(count, is_shared).costs().items()
            return [{**about, "edit": name, "reading": reading, "drawing": drawing} for name, (reading, drawing) in found]

        return Step(f"{count} objects", measure, float(count))

    for count in QUICK_COUNTS if quick else COUNTS:
        yield from (step(count, is_shared) for is_shared in (False, True))


def table(found: Sequence[Record]) -> Table:
    """Return columns and rows: milliseconds of processor time, reading + drawing, for each number of objects and each edit."""

    def cell(shared: list[Record]) -> str:
        (one,) = shared
        return f"{1e3 * one['reading']:.1f} + {1e3 * one['drawing']:.1f}"

    def objects(one: Record) -> tuple[str, ...]:
        return f"{one['objects']}", one["meshes"]

    return pivot(found, ("Objects", "Meshes"), objects, lambda one: one["edit"], cell)
