# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame times of True Diffuse Realtime beside what else could draw the same scene: plain Lambert of our own, EEVEE, and three.js.

All draw the same characters in the same looks under the same suns and sky, in pictures of one size, by one graphics driver. Nothing
changes between frames: shadow maps are drawn before.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median

import bpy

from mathutils import Matrix, Vector

from true_diffuse.addon.blender import engines, report
from true_diffuse.addon.blender.engines import EEVEE
from true_diffuse.addon.blender.glsl import SHADERS, source
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import MODELS, OrenNayar, Specular
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.addon.realtime.materials import RenderMaterial
from true_diffuse.addon.realtime.renderer import TRANSPARENT, Renderer
from true_diffuse.addon.realtime.scene_cache import SceneCache
from true_diffuse.addon.realtime.view import View
from true_diffuse.scenes import five_characters
from true_diffuse.scenes.elements import add, add_sun
from true_diffuse.scenes.five_characters import BACKDROP_ALBEDO, FILL_RADIANCE, KEY_IRRADIANCE, CharacterLook
from true_diffuse.scripts.studies.cost import in_turns
from true_diffuse.scripts.studies.frame_time import ALBEDO, CLOCKS, PLAIN_LAMBERT, VARIANTS, Stopwatch, Times
from true_diffuse.scripts.studies.study import Step, Table, pivot
from true_diffuse.scripts.web.browser import Browser, Page
from true_diffuse.scripts.web.engines import ROOM
from true_diffuse.scripts.web.packages import node_modules

SIZE, QUICK_SIZE = (480, 270), (160, 90)  # of the picture [pixels]
DETAIL = 0.1  # of the character's triangles, which leaves 11 000, as a game's character has
LIGHTS, QUICK_LIGHTS = (1, 4, 16), (1,)
COUNTS, QUICK_COUNTS = (1, 5, 25, 100), (5,)
SHADOWED, QUICK_SHADOWED = ((1, 5), (4, 5), (1, 100)), ()  # numbers of lights and of characters, whose suns cast shadows
STEP = 1.2  # from one character to the next, over its width
DOWN, LENS = math.radians(20.0), 85.0  # how far the camera looks down, and its lens on a sensor of 36 mm
TURN = 0.618034  # from one sun to the next, which spreads them evenly around
ROUNDS, QUICK_ROUNDS = 3, 2
EEVEE_SAMPLES = (1, 3)  # of the two renders whose difference is what so many samples more take
LONG_ENOUGH, MOST_FRAMES = 0.3, 20  # seconds of three.js's frames in a row, as its processor time has steps of 10 ms

REALTIME = "Realtime"
DIFFUSE = "EEVEE, Diffuse BSDF"
THREE = {"three.js, glTF": "file", "three.js, setReflectance": "reflectance", "three.js, MeshLambert": "lambert"}  # in frames.js


@dataclass(frozen=True)
class Setting:
    """What is drawn: so many characters under so many suns."""

    lights: int
    characters: int
    shadows: bool = False


class Crowd:
    """Characters on a floor, in the looks of the five in turn, and the camera that frames them."""

    def __init__(self, mesh: bpy.types.Mesh, size: tuple[int, int], detail: float = DETAIL) -> None:
        """Build the scene of `mesh`, with a fraction `detail` of its triangles, for pictures of `size` [pixels]."""
        five = five_characters.build(mesh, ALBEDO, False, size)
        self.scene, self.size = five.scene, size
        bpy.context.window.scene = five.scene
        bpy.data.objects.remove(five.key)
        subjects = [character.subject for character in five.characters]
        self._looks = [(character.look, character.subject.material_slots[0].material) for character in five.characters]
        floor = next(item for item in five.scene.objects if item.type == "MESH" and item not in subjects)
        color = (BACKDROP_ALBEDO,) * 3 + (1.0,)  # in a group of ours, as glTF has no Diffuse BSDF
        floor.data.materials[0] = materials.create("Floor", ROUGH_DIFFUSE, Model=MODELS["lambert"].label, Color=color)
        self._plain = five.plain
        self._mesh = _decimated(subjects[0], self.scene, detail)
        for subject in subjects:
            bpy.data.objects.remove(subject)
        self._items: list[bpy.types.Object] = []
        self._suns: list[bpy.types.Object] = []

    @property
    def looks(self) -> list[CharacterLook]:
        """The looks, each of one material of the same name."""
        return [look for look, _ in self._looks]

    @property
    def triangles(self) -> int:
        """The number of a character's triangles."""
        self._mesh.calc_loop_triangles()
        return len(self._mesh.loop_triangles)

    def arrange(self, setting: Setting, has_own: bool = False) -> None:
        """Have the scene show a setting, the characters with one mesh, or each with its own."""
        own = [item.data for item in self._items if item.data != self._mesh]
        bpy.data.batch_remove([*self._items, *own])
        for sun in self._suns:
            bpy.data.lights.remove(sun.data)
        low, high = (Vector(map(f, zip(*(v.co for v in self._mesh.vertices), strict=True))) for f in (min, max))
        step, columns = STEP * (high.x - low.x), min(setting.characters, max(5, round(setting.characters**0.5)))
        rows = setting.characters // columns
        self._items = []
        for index in range(setting.characters):
            row, column = divmod(index, columns)
            place = Matrix.Translation((step * (column - (columns - 1) / 2.0), step * (row - (rows - 1) / 2.0), 0.0))
            item = add(self.scene, "Character", self._mesh.copy() if has_own else self._mesh, place)
            item.material_slots[0].link = "OBJECT"
            self._items.append(item)
        self.wear(plain=False)
        self._suns = []
        for index in range(setting.lights):
            turn = 2.0 * math.pi * (0.9 + index * TURN)
            direction = (math.sin(turn), -math.cos(turn), 1.0)
            sun = add_sun(self.scene, "Sun", direction, KEY_IRRADIANCE / setting.lights)
            sun.data.use_shadow = setting.shadows
            self._suns.append(sun)
        self.middle = Vector((0.0, 0.0, high.z / 2.0))
        self.radius = Vector((step * columns, step * rows, high.z)).length / 2.0
        camera = self.scene.camera
        camera.data.lens, camera.data.shift_y, aspect = LENS, 0.0, self.size[0] / self.size[1]
        across = max(step * columns, aspect * (high.z + math.sin(DOWN) * step * rows))
        away = across * LENS / 36.0 + step * rows / 2.0
        camera.data.clip_start, camera.data.clip_end = away / 10.0, away * 10.0
        camera.matrix_world = (
            Matrix.Translation(self.middle) @ Matrix.Rotation(-DOWN, 4, "X") @ Matrix.Translation((0.0, -away, 0.0))
        ) @ Matrix.Rotation(math.pi / 2.0, 4, "X")
        self.scene.view_layers[0].update()

    def wear(self, plain: bool) -> None:
        """Give the characters their looks, or with `plain` a Diffuse BSDF."""
        for index, item in enumerate(self._items):
            item.material_slots[0].material = self._plain if plain else self._looks[index % len(self._looks)][1]

    def view(self) -> View:
        """Return the camera's view."""
        depsgraph = self.scene.view_layers[0].depsgraph
        camera, (width, height) = self.scene.camera.evaluated_get(depsgraph), self.size
        projection = camera.calc_matrix_camera(depsgraph, x=width, y=height)
        return View(projection @ camera.matrix_world.inverted(), camera.matrix_world.translation.copy(), True, width, height)

    def export(self, path: Path) -> None:
        """Write a .glb file of the characters and the floor."""
        for item in self.scene.objects:
            item.select_set(item.type == "MESH")
        bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True)
        report.take()

    def for_three(self) -> dict[str, object]:
        """Return what frames.js needs beside the file, in glTF's axes; a matrix has its columns one after the other."""
        to_gltf = Matrix.Rotation(-math.pi / 2.0, 4, "X")
        depsgraph = self.scene.view_layers[0].depsgraph
        camera, (width, height) = self.scene.camera.evaluated_get(depsgraph), self.size
        place = to_gltf @ camera.matrix_world
        projection = camera.calc_matrix_camera(depsgraph, x=width, y=height)
        return {
            "size": self.size,
            "projection": [number for column in projection.transposed() for number in column],
            "camera": [number for column in place.transposed() for number in column],
            "suns": [
                {"direction": list(to_gltf @ sun.matrix_world.col[2].xyz), "irradiance": sun.data.energy} for sun in self._suns
            ],
            "shadows": any(sun.data.use_shadow for sun in self._suns),
            "middle": list(to_gltf @ self.middle),
            "radius": self.radius,
            "sky": FILL_RADIANCE,
        }


class Realtime:
    """The scene drawn by Realtime, each material as it is or all as one. A frame is a sample, added and shown."""

    def __init__(self, crowd: Crowd, material: RenderMaterial | None = None) -> None:
        """Read the scene and compile its shaders."""
        cache = SceneCache()
        layer = crowd.scene.view_layers[0]
        layer.update()
        cache.update(layer.depsgraph)
        if material:
            cache.materials = dict.fromkeys(cache.materials, material)
            for part in cache.groups:
                part.mesh.prepare(crowd.scene.objects[0].data, {part.slot: ()}, crowd.scene.objects[0].data.copy)
        self._view, self._sample = crowd.view(), 0
        self._renderer = Renderer(cache)
        self._renderer.refresh()
        for _ in self._renderer.compile():
            pass
        self._stopwatch = Stopwatch()
        self._renderer.begin(self._view)

    def frame(self) -> Times:
        """Draw a sample and wait until it is done; return how long that took [s]."""

        def draw() -> None:
            self._renderer.add(self._view, self._sample, 1.5, TRANSPARENT)
            self._sample += 1

        return self._stopwatch.time(self._renderer, draw)

    def pixels(self) -> Sequence[float]:
        """Return the picture so far: red, green, blue, alpha of each pixel, rows from the bottom."""
        return self._renderer.read()


def eevee_frame(crowd: Crowd) -> Times:
    """Return what a sample of EEVEE takes with Blender's Diffuse BSDF [s]: what a render of more takes longer, for each."""
    crowd.wear(plain=True)
    times = []
    for samples in EEVEE_SAMPLES:
        engines.use(crowd.scene, EEVEE, samples)
        wall, processor = time.perf_counter(), time.process_time()
        render.render(crowd.scene)
        times.append((time.perf_counter() - wall, time.process_time() - processor))
    few, many = EEVEE_SAMPLES
    readback, processor = ((late - early) / (many - few) for early, late in zip(*times, strict=True))
    return {"readback": readback, "processor": processor}


class Three:
    """The scene drawn by three.js on a page of a browser."""

    def __init__(self, browser: Browser, page: Page) -> None:
        self._browser, self._page = browser, page
        page.open("/web/frames.html")
        page.call("() => new Promise(done => { const wait = () => window.framesOf ? done(null) : setTimeout(wait, 10); wait() })")

    @property
    def renderer(self) -> str:
        """The name of the graphics driver."""
        return self._page.call("() => driver()")

    def load(self, crowd: Crowd, path: Path) -> None:
        """Load what `crowd` has exported to `path`, whose folder is /files. Raises WebError."""
        shown = crowd.for_three() | {"file": f"/files/{path.name}", "models": {look.label: _model(look) for look in crowd.looks}}
        self._page.call("scene => load(scene)", shown)

    def frame(self, material: str) -> Times:
        """Draw frames in one of THREE's materials; return how long one took [s]."""
        once = self._frames(material, 1)  # shaders are compiled the first time
        count = max(2, min(math.ceil(LONG_ENOUGH / once), MOST_FRAMES))  # the first of one draws the shadow maps anew
        processor = self._browser.processor_time()
        seconds = self._frames(material, count)
        return {"readback": seconds / count, "processor": (self._browser.processor_time() - processor) / count}

    def _frames(self, material: str, count: int) -> float:
        return self._page.call("([material, count]) => framesOf(material, count)", [material, count])

    def pixels(self, material: str) -> Sequence[float]:
        """Return a frame's red, green, blue, alpha of each pixel, rows from the bottom."""
        return self._page.floats("material => pixelsOf(material)", material)


def files(folder: Path) -> dict[str, Path]:
    """Return what the page of `Three` is given."""
    return {"web": ROOM, "npm": node_modules(), "files": folder, "shaders": SHADERS}


def _model(look: CharacterLook) -> dict[str, object]:
    """Return the model of a look as setReflectance takes it."""
    if isinstance(look.model, Specular):
        return {
            "model": "blinn_phong",
            "text": source("blinn_phong", "directional_albedo"),
            "parameters": [look.model.specular, look.model.exponent],
        }
    if isinstance(look.model, OrenNayar):
        return {"model": "oren_nayar", "text": source("oren_nayar", "directional_albedo"), "parameters": [look.model.sigma]}
    return {"model": "lambert", "text": source("lambert", "directional_albedo"), "parameters": []}


def _decimated(item: bpy.types.Object, scene: bpy.types.Scene, detail: float) -> bpy.types.Mesh:
    """Return the mesh of an object with a fraction `detail` of its triangles."""
    modifier = item.modifiers.new("Fewer", "DECIMATE")
    modifier.ratio = detail
    layer = scene.view_layers[0]
    layer.update()
    evaluated = item.evaluated_get(layer.depsgraph)
    mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=layer.depsgraph)
    mesh.validate()
    return mesh


def steps(crowd: Crowd, three: Three | None, folder: Path, quick: bool) -> list[Step]:
    """Return a step for each number of suns and of characters, without shadows and with them; files are written to `folder`.

    There is a record for each of what draws and each clock.
    """
    numbers = product(QUICK_LIGHTS if quick else LIGHTS, QUICK_COUNTS if quick else COUNTS)
    settings = [Setting(*each) for each in numbers] + [Setting(*each, True) for each in (QUICK_SHADOWED if quick else SHADOWED)]
    rounds = QUICK_ROUNDS if quick else ROUNDS
    return [
        Step(
            f"{each.lights} suns  {each.characters} characters{'  shadows' * each.shadows}",
            partial(compare, crowd, three, folder, each, rounds),
            5.0 + each.lights / 4.0 + each.characters / 10.0,
        )
        for each in settings
    ]


def compare(crowd: Crowd, three: Three | None, folder: Path, setting: Setting, rounds: int) -> Iterator[Record]:
    """Yield a record of `setting` for each that draws and each clock, timed in turns: the median, also of the ratios."""
    crowd.arrange(setting)
    own, plain = Realtime(crowd), Realtime(crowd, VARIANTS[PLAIN_LAMBERT])
    drawn: dict[str, Callable[[], Times]] = {
        REALTIME: own.frame,
        PLAIN_LAMBERT: plain.frame,
        DIFFUSE: partial(eevee_frame, crowd),
    }
    if three:
        path = folder / "crowd.glb"
        crowd.export(path)
        three.load(crowd, path)
        drawn |= {name: partial(three.frame, material) for name, material in THREE.items()}
    times = in_turns(drawn, rounds)
    for name, clock in product(drawn, CLOCKS):
        yield {
            "target": name,
            "clock": clock,
            "lights": setting.lights,
            "characters": setting.characters,
            "shadows": setting.shadows,
            "triangles": setting.characters * crowd.triangles,
            "seconds": median(one[clock] for one in times[name]),
            "over_realtime": median(one[clock] / mine[clock] for one, mine in zip(times[name], times[REALTIME], strict=True)),
        }


def table(found: Sequence[Record]) -> Table:
    """Return columns and rows: milliseconds of processor time of a frame, and in brackets over Realtime's."""

    def cell(shared: list[Record]) -> str:
        (one,) = shared
        ratio = "" if one["target"] == REALTIME else f" ({one['over_realtime']:.2g})"
        return f"{1e3 * one['seconds']:.3g}{ratio}"

    def row(one: Record) -> tuple[str, ...]:
        return f"{one['lights']}{', shadows' * one['shadows']}", f"{one['characters']}"

    timed = [record for record in found if record.get("clock") == "processor"]
    return pivot(timed, ("Suns", "Characters"), row, lambda one: one["target"], cell)
