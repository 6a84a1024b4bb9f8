# SPDX-License-Identifier: GPL-3.0-or-later
"""What the first picture of a viewport of True Diffuse Realtime takes after an engine is switched to, beside compiling and drawing.

Times are processor times of all threads. What Blender does itself when it switches engines is not part of them.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from types import SimpleNamespace

import bpy

import gpu
from mathutils import Matrix

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.realtime.driver import TRANSPARENT, forget_shaders
from true_diffuse.addon.realtime.renderer import Renderer
from true_diffuse.addon.realtime.shadow_maps import COARSE
from true_diffuse.addon.realtime.view import View
from true_diffuse.addon.realtime.viewport import FIRST_READING, Viewport
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.studies.competitors import DETAIL, Crowd, Setting
from true_diffuse.scripts.studies.study import Step, Table

# Numbers of characters, whether each has a mesh of its own, and with which part of the character's triangles
SHOWN, QUICK_SHOWN = ((5, False, 1.0), (5, True, 1.0), (100, False, DETAIL), (100, True, DETAIL)), ((5, False, DETAIL),)
ROUNDS = 3
OBJECTS, FRAMES = 100, 50
TURN = Matrix.Rotation(0.01, 4, "Z")  # to another view of the same
IMPORT = """
import sys, time
sys.path.insert(0, {scripts!r})
import bpy
import checkout
import true_diffuse
true_diffuse.register()
start = time.process_time()
import true_diffuse.addon.realtime.viewport
print(time.process_time() - start)
"""


class Window:
    """What Blender hands to an engine that draws into a window: a view of `crowd`, and a place for messages."""

    bl_label = "Realtime"

    def __init__(self, crowd: Crowd) -> None:
        if bpy.app.background:
            gpu.init()
        view = crowd.view()
        width, height = crowd.size
        place = crowd.scene.camera.matrix_world
        self.seen = SimpleNamespace(
            view_matrix=place.inverted(), perspective_matrix=view.projection, is_perspective=True, view_perspective="PERSP"
        )
        area = next(area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
        region = SimpleNamespace(width=width, height=height, as_pointer=lambda: 0)
        self._context = SimpleNamespace(region=region, region_data=self.seen, space_data=area.spaces.active)
        self.depsgraph = crowd.scene.view_layers[0].depsgraph
        self._target = gpu.types.GPUTexture(crowd.size, format="RGBA32F")
        self._buffer = gpu.types.GPUFrameBuffer(color_slots=self._target)

    def report(self, _kinds: set[str], message: str) -> None:
        """Fail, as Blender would report an error."""
        raise RuntimeError(message)

    def update_stats(self, _stats: str, _info: str) -> None:
        """Take what Blender would show in the viewport."""

    def read(self, viewport: Viewport) -> None:
        """Have `viewport` read the scene."""
        viewport.update(self, self._context, self.depsgraph)

    def draw(self, viewport: Viewport) -> None:
        """Have `viewport` add a sample, and wait until it is there."""
        with self._buffer.bind():
            viewport.draw(self, self._context, self.depsgraph)
            self._buffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")

    def draw_again(self, renderer: Renderer, view: View) -> None:
        """Have the renderer of a viewport draw what it has from another place, with shadow maps of the size that they have."""
        width, height = view.width, view.height
        turned = View(view.projection @ TURN, view.eye, True, width, height)
        renderer._shadow_maps._size //= COARSE
        with self._buffer.bind():
            gpu.state.viewport_set(0, 0, width, height)
            renderer.begin(turned)
            renderer.add(turned, 0, 1.5, TRANSPARENT)
            renderer.show_blended(0, 0)
            self._buffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")


def steps(mesh: bpy.types.Mesh, size: tuple[int, int], quick: bool) -> list[Step]:
    """Return steps that time the first picture of characters of `mesh` under a sun with shadows, and how long modules load.

    `size` is the picture's [pixels].
    """

    def step(count: int, has_own: bool, detail: float) -> Step:
        return Step(f"first picture of {count}", partial(measure, mesh, size, count, has_own, detail), 1.0 + count / 20.0)

    found = [step(*shown) for shown in (QUICK_SHOWN if quick else SHOWN)]
    found.append(Step("a sample of nothing", overhead, 0.5))
    return found if quick else [*found, Step("modules", modules, 4.0)]


def measure(mesh: bpy.types.Mesh, size: tuple[int, int], count: int, has_own: bool, detail: float) -> Iterator[Record]:
    """Yield a record of `count` characters, each with a mesh of its own or all with one.

    `reading`: what is read of the scene before the first picture [s], `compiling`: what that takes longer than with all programs
    compiled, `drawing`: another view of what it shows, with its shadow map, `sending`: what it takes longer than that. `redraws`
    are needed after it until the scene is complete, in which reading takes `completing` [s].
    """
    crowd = Crowd(mesh, size, detail)
    crowd.arrange(Setting(1, count, shadows=True), has_own)
    crowd.scene.true_diffuse.viewport_samples = 2
    window = Window(crowd)
    found = []
    for _ in range(ROUNDS):
        forget_shaders()
        times = []
        for _ in range(2):
            viewport = Viewport()
            times.append((_seconds(partial(window.read, viewport)), _seconds(partial(window.draw, viewport))))
        (_, cold), (reading, warm) = times
        cache, renderer = viewport._cache, viewport._renderer
        assert cache and renderer
        again = _seconds(partial(window.draw_again, renderer, crowd.view()))
        redraws, completing = 0, 0.0
        while not cache.is_complete:
            completing += _seconds(partial(cache.read_rest, window.depsgraph, None, FIRST_READING * 2.0 ** (redraws + 1)))
            redraws += 1
        parts = {"reading": reading, "sending": warm - again, "drawing": again, "compiling": cold - warm}
        found.append({**parts, "redraws": redraws, "completing": completing})
    medians = {key: median(one[key] for one in found) for key in found[0]}
    about = {"characters": count, "triangles": count * crowd.triangles, "meshes": "own" if has_own else "one"}
    yield {"target": "realtime", **about, **medians}


def overhead() -> Iterator[Record]:
    """Yield a record of a sample of OBJECTS objects that are a triangle each, and of a redraw that adds none, with few pixels [s].

    That is Python's part of a frame and the driver's calls, whatever the objects are.
    """
    mesh = bpy.data.meshes.new("Triangle")
    mesh.from_pydata([(-0.5, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.0, 2.0)], [], [(0, 1, 2)])
    mesh.attributes.new(ALBEDO_ATTRIBUTE, "FLOAT_COLOR", "POINT")
    mesh.materials.append(None)
    crowd = Crowd(mesh, (16, 16), 1.0)
    crowd.arrange(Setting(1, OBJECTS, shadows=True))
    crowd.scene.true_diffuse.viewport_samples = FRAMES + 1
    window, viewport = Window(crowd), Viewport()
    window.read(viewport)
    window.draw(viewport)
    sample, redraw = (median(_seconds(partial(window.draw, viewport)) for _ in range(FRAMES)) for _ in range(2))
    yield {"target": "realtime", "objects": OBJECTS, "sample": sample, "redraw": redraw}


def modules() -> Iterator[Record]:
    """Yield a record of what loading the modules takes, which Blender does once: here in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        surroundings = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
        surroundings["PYTHONPYCACHEPREFIX"] = folder
        command = [sys.executable, "-c", IMPORT.format(scripts=str(Path(__file__).resolve().parents[1]))]
        for _ in range(2):  # the first writes their bytecode
            said = subprocess.run(command, env=surroundings, capture_output=True, text=True, check=True).stdout
    yield {"target": "realtime", "loading": float(said.split()[-1])}


def table(found: Sequence[Record]) -> Table:
    """Return columns and rows: milliseconds of each part of a first picture, and what comes after it."""
    parts = ("reading", "sending", "drawing", "compiling")
    rows: list[tuple[str, ...]] = []
    for one in found:
        if "reading" in one:
            about = f"{one['characters']}, {one['meshes']}", f"{one['triangles'] / 1e3:.0f} 000"
            after = f"{1e3 * one['completing']:.0f} in {one['redraws']}" if one["redraws"] else "-"
            rows.append((*about, *(f"{1e3 * one[part]:.0f}" for part in parts), after))
        elif "loading" in one:
            rows.append(("modules, once", "-", f"{1e3 * one['loading']:.0f}", "-", "-", "-", "-"))
    return ("Characters, meshes", "Triangles", "Read the scene", "Send it", "Draw", "Compile", "Read the rest in redraws"), rows


def overhead_table(found: Sequence[Record]) -> Table:
    """Return columns and rows: milliseconds of a sample and of a redraw of next to nothing."""
    rows: list[tuple[str, ...]] = [
        (f"{one['objects']}", f"{1e3 * one['sample']:.2f}", f"{1e3 * one['redraw']:.2f}") for one in found if "sample" in one
    ]
    return ("Objects", "Another sample", "A redraw without one"), rows


def _seconds(act: Callable[[], object]) -> float:
    start = time.process_time()
    act()
    return time.process_time() - start
