# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame times of the engine True Diffuse Realtime: the five characters, drawn by its painter without Blender's part of a render."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import bpy

import gpu
from mathutils import Vector

from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.realtime.contents import BLACK, Contents
from true_diffuse.addon.realtime.drawing import CLEAR, Painter
from true_diffuse.addon.realtime.laws import LAWS, Law
from true_diffuse.addon.realtime.view import View
from true_diffuse.scenes import five_characters
from true_diffuse.scripts.studies import frame_time
from true_diffuse.scripts.studies.frame_time import Setting

RESOLUTION, QUICK_RESOLUTION = (1920, 1080), (480, 270)
ALBEDO = 0.8
QUICK_LAMPS, QUICK_ROUNDS = (1,), 2
AS_BUILT = "key, shadow, sky"
DETAILS = (0.25, 1.0, 4.0)
AS_BUILT_LAWS: Mapping[str, Law] = {frame_time.PLAIN_LAMBERT: frame_time.CONTESTANTS[frame_time.PLAIN_LAMBERT]} | {
    f"{law.stem}.glsl": law for law in LAWS.values()
}


class Stage:
    """The five characters before their backdrop, all of one law.

    A frame is one sample of every pixel, added to the picture; reading back a pixel of that ends it. To put it into a window is not
    part of it.
    """

    details = DETAILS

    def __init__(self, mesh: bpy.types.Mesh, resolution: tuple[int, int]) -> None:
        """Build the scene of `mesh`. Needs a graphics driver."""
        if bpy.app.background:
            gpu.init()
        self.five = five_characters.build(mesh, ALBEDO, True, resolution)
        self._resolution, self._meshes, self._detail = resolution, {1.0: mesh}, 0.0
        self._pixel = gpu.types.GPUTexture((1, 1), format="RGBA32F")
        self._finished = gpu.types.GPUFrameBuffer(color_slots=self._pixel)

    def prepare(self, setting: Setting) -> Record:
        """As `frame_time.Stage` has it."""
        self._read(setting.triangles, setting.pixels)
        key = self._contents.lamps[0]
        towards = [tuple(Vector(one).normalized()) for one in frame_time.SUNS[: setting.lamps]]
        self._contents.lamps = [replace(key, towards=one, casts=False) for one in towards]
        self._contents.world = BLACK
        return self._size()

    def prepare_as_built(self) -> Record:
        """Have the scene ready with its own light: the key light, its shadow and the sky. Returns what `prepare` does."""
        self._read(1.0, 1.0)
        return self._size()

    def frame(self, law: Law) -> frame_time.Times:
        """As `frame_time.Stage` has it. Processor time of all threads is the work of a driver that draws there."""
        shape = law.fold(frame_time.INPUTS)
        self._contents.looks = {uid: replace(look, law=law, shape=shape) for uid, look in self._looks.items()}
        painter = self._painter
        painter.refresh()
        for _ in painter.compile():
            pass
        painter.begin(self._view)  # draws the shadow maps, which stay while nothing moves
        self._wait()
        wall, processor = time.perf_counter(), time.process_time()
        painter.begin(self._view)
        painter.add(self._view, 0, 0.0, CLEAR)
        with self._finished.bind():
            painter.show()
        self._wait()
        return {"readback": time.perf_counter() - wall, "processor": time.process_time() - processor}

    def pixels(self) -> Sequence[float]:
        """Return the last frame: red, green, blue, alpha of each pixel, rows from the bottom."""
        return self._painter.read()

    def _wait(self) -> None:
        """Wait until all that was drawn is there."""
        with self._finished.bind():
            gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "FLOAT")

    def _read(self, detail: float, share: float) -> None:
        """Read the scene at `detail` times its triangles, and look at it with `share` times its pixels."""
        if detail != self._detail:
            self._detail = detail
            for character in self.five.characters:
                character.subject.data = self._mesh(detail)
        layer = self.five.scene.view_layers[0]
        layer.update()
        self._contents = Contents()
        self._contents.update(layer.depsgraph)
        self._looks = dict(self._contents.looks)
        width, height = (round(length * math.sqrt(share)) for length in self._resolution)
        camera = self.five.scene.camera.evaluated_get(layer.depsgraph)
        projection = camera.calc_matrix_camera(layer.depsgraph, x=width, y=height)
        place = camera.matrix_world
        self._view = View(projection @ place.inverted(), place.translation.copy(), True, width, height)
        self._painter = Painter(self._contents)

    def _mesh(self, detail: float) -> bpy.types.Mesh:
        """Return the character with `detail` times its triangles: with fewer decimated, with more each cut into four."""
        if detail not in self._meshes:
            scene, subject = self.five.scene, self.five.characters[0].subject
            subject.data = self._meshes[1.0]
            if detail < 1.0:
                modifier = subject.modifiers.new("Fewer", "DECIMATE")
                modifier.ratio = detail
            else:
                modifier = subject.modifiers.new("More", "SUBSURF")
                modifier.subdivision_type, modifier.levels = "SIMPLE", round(math.log(detail, 4.0))
            layer = scene.view_layers[0]
            layer.update()
            evaluated = subject.evaluated_get(layer.depsgraph)
            self._meshes[detail] = bpy.data.meshes.new_from_object(
                evaluated, preserve_all_data_layers=True, depsgraph=layer.depsgraph
            )
            subject.modifiers.remove(modifier)
        return self._meshes[detail]

    def _size(self) -> Record:
        triangles = sum(part.mesh.triangles for part in self._contents.parts)
        return {"width": self._view.width, "height": self._view.height, "triangles": triangles}


def work(stage: Stage, quick: bool) -> float:
    """Return how many units of work `records` has."""
    lamps, rounds = (QUICK_LAMPS, QUICK_ROUNDS) if quick else (frame_time.LAMPS, frame_time.ROUNDS)
    return frame_time.work(stage, lamps, rounds, grows=not quick) + len(AS_BUILT_LAWS) * rounds


def records(stage: Stage, quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield what `frame_time.records` does, and a record for each shipped rough model in the scene as it is built."""
    lamps, rounds = (QUICK_LAMPS, QUICK_ROUNDS) if quick else (frame_time.LAMPS, frame_time.ROUNDS)
    yield from frame_time.records(stage, lamps, rounds, not quick, progress)
    about = {"lit_by": AS_BUILT, "lamps": 1, **stage.prepare_as_built()}
    with progress.step(AS_BUILT, len(AS_BUILT_LAWS) * rounds):
        yield from frame_time.in_turns(stage, about, AS_BUILT_LAWS, rounds, progress.within)
