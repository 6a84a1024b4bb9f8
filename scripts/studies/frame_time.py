# SPDX-License-Identifier: GPL-3.0-or-later
"""Frame times of True Diffuse Realtime: every model and form of equation (1), interleaved with Lambert's, and how they grow.

What is drawn are the five characters, all of one model, without Blender's part of a render.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import linear_regression, median, quantiles

import bpy

import gpu
from mathutils import Vector

from true_diffuse.addon.material.expression import Constant
from true_diffuse.addon.material.surface import Surface
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import MODELS, Specular
from true_diffuse.addon.realtime.driver import TRANSPARENT
from true_diffuse.addon.realtime.materials import RenderMaterial, plain_material, surface_material
from true_diffuse.addon.realtime.renderer import Renderer
from true_diffuse.addon.realtime.scene_cache import SceneCache
from true_diffuse.addon.realtime.view import View
from true_diffuse.addon.realtime.world import NO_WORLD
from true_diffuse.scenes import five_characters
from true_diffuse.scripts.studies.cost import in_turns
from true_diffuse.scripts.studies.formulations import FORMS, glsl_form
from true_diffuse.scripts.studies.study import Step, Table, pivot

SIGMA = 0.33
INPUTS = {"Roughness": SIGMA}
RESOLUTION, QUICK_RESOLUTION = (1920, 1080), (480, 270)
ALBEDO = 0.8
LIGHTS, ROUNDS = (1, 2, 4, 8), 5
QUICK_LIGHTS, QUICK_ROUNDS = (1,), 2
PIXELS, TRIANGLES = (0.25, 0.5, 1.0, 2.0), (0.25, 1.0, 4.0)  # times the picture's and the characters'
GROWTH_LIGHTS = 4  # while pixels and triangles change
SUNS = tuple((0.2 * k - 0.7, -0.75, 0.5 - 0.05 * k) for k in range(8))  # towards each of the lights, before the characters
SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "software")  # in the names of drivers that draw on the processor
AS_BUILT = "key, shadow, sky"
CLOCKS = ("readback", "processor")

PLAIN_LAMBERT, LAMBERT, OREN_NAYAR = "plain Lambert", "lambert.glsl", "oren_nayar.glsl"
PLAIN = (PLAIN_LAMBERT, "plain (1), as printed", "plain (1), simplified", "plain (1), folded")


def _shipped(model: str, **inputs: float) -> RenderMaterial:
    """Return a surface of a registered model without layers but those of `inputs`."""
    given = {name: Constant(value) for name, value in inputs.items()}
    return surface_material(Surface(model, {"base_color": Constant((ALBEDO, ALBEDO, ALBEDO)), **given}), 1.0)


SHIPPED = {f"{name}.glsl": _shipped(name, diffuse_roughness=SIGMA) for name in MODELS}
VARIANTS: Mapping[str, RenderMaterial] = {
    **{
        name: plain_material(glsl_form(form), ALBEDO, glsl_form(form).constants(INPUTS))
        for name, form in zip(PLAIN, FORMS, strict=True)
    },
    **SHIPPED,
    "blinn_phong.glsl": _shipped("lambert", highlight_weight=Specular().specular, highlight_exponent=Specular().exponent),
}
GROWING = {name: VARIANTS[name] for name in (LAMBERT, OREN_NAYAR)}
AS_BUILT_VARIANTS = {PLAIN_LAMBERT: VARIANTS[PLAIN_LAMBERT], **SHIPPED}

type Times = Mapping[str, float]
"""Seconds of a frame by two clocks: readback (until a pixel is read back) and processor (of all threads)."""


@dataclass(frozen=True)
class Setting:
    """What is drawn: suns, the lights that cost least, or with 0 the key light, its shadow and the sky of the scene as built.

    Pixels and triangles are multiples of the picture's and the characters'.
    """

    lights: int
    pixels: float = 1.0
    triangles: float = 1.0

    @property
    def lit_by(self) -> str:
        return f"{self.lights} sun{'s' * (self.lights > 1)}" if self.lights else AS_BUILT


class Stopwatch:
    """Times what is drawn until a pixel of it is read back. Needs a graphics context."""

    def __init__(self) -> None:
        self._pixel = gpu.types.GPUTexture((1, 1), format="RGBA32F")  # kept, as a framebuffer does not keep its textures
        self._finished = gpu.types.GPUFrameBuffer(color_slots=self._pixel)

    def time(self, renderer: Renderer, draw: Callable[[], None]) -> Times:
        """Return what `draw` takes, and showing the picture of `renderer` then [s]."""
        self._wait()
        wall, processor = time.perf_counter(), time.process_time()
        draw()
        with self._finished.bind():
            renderer.show()
        self._wait()
        return {"readback": time.perf_counter() - wall, "processor": time.process_time() - processor}

    def _wait(self) -> None:
        """Wait until everything that was drawn is there."""
        with self._finished.bind():
            gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "FLOAT")


class Characters:
    """The five characters before their backdrop, all of one model.

    A frame is one sample of every pixel, added to the picture; reading back a pixel of it ends the frame. Putting it into a window
    is not part of it.
    """

    def __init__(self, mesh: bpy.types.Mesh, resolution: tuple[int, int]) -> None:
        """Build the scene of `mesh`. Needs a graphics driver."""
        if bpy.app.background:
            gpu.init()
        self.five = five_characters.build(mesh, ALBEDO, True, resolution)
        self._resolution, self._meshes, self._detail = resolution, {1.0: mesh}, 0.0
        self._stopwatch = Stopwatch()

    def prepare(self, setting: Setting) -> Record:
        """Have `setting` ready to draw; return its width, height and triangles."""
        self._read(setting.triangles, setting.pixels)
        if setting.lights:
            key = self._cache.lights[0]
            towards = [tuple(Vector(one).normalized()) for one in SUNS[: setting.lights]]
            self._cache.own_lights = [replace(key, axis=one, casts_shadow=False, size=0.0) for one in towards]
            self._cache.environment = NO_WORLD
            self._cache.version += 1
        triangles = sum(part.mesh.triangles * len(group) for part, group in self._cache.groups.items())
        return {"width": self._view.width, "height": self._view.height, "triangles": triangles}

    def frame(self, model: RenderMaterial) -> Times:
        """Draw everything as `model` and wait until it is done; return how long that took [s].

        Processor time of all threads is the work of a driver that draws there.
        """
        self._cache.materials = dict.fromkeys(self._materials, model)
        self._cache.version += 1
        renderer = self._renderer
        renderer.refresh()
        for _ in renderer.compile():
            pass
        renderer.begin(self._view)  # draws the shadow maps, which stay while nothing moves

        def draw() -> None:
            renderer.begin(self._view)
            renderer.add(self._view, 0, 0.0, TRANSPARENT)

        return self._stopwatch.time(renderer, draw)

    def pixels(self) -> Sequence[float]:
        """Return the last frame: red, green, blue, alpha of each pixel, rows from the bottom."""
        return self._renderer.read()

    def _read(self, detail: float, share: float) -> None:
        """Read the scene at `detail` times its triangles, and look at it with `share` times its pixels."""
        if detail != self._detail:
            self._detail = detail
            for character in self.five.characters:
                character.subject.data = self._mesh(detail)
        layer = self.five.scene.view_layers[0]
        layer.update()
        self._cache = SceneCache()
        self._cache.update(layer.depsgraph)
        self._materials = dict(self._cache.materials)
        for part in self._cache.groups:  # the variants read no attributes
            part.mesh.prepare(self._meshes[1.0], {part.slot: ()}, self._meshes[1.0].copy)
        width, height = (round(length * math.sqrt(share)) for length in self._resolution)
        camera = self.five.scene.camera.evaluated_get(layer.depsgraph)
        projection = camera.calc_matrix_camera(layer.depsgraph, x=width, y=height)
        place = camera.matrix_world
        self._view = View(projection @ place.inverted(), place.translation.copy(), True, width, height)
        self._renderer = Renderer(self._cache)

    def _mesh(self, detail: float) -> bpy.types.Mesh:
        """Return the character with `detail` times its triangles: decimated for fewer, each cut into four for more."""
        if detail not in self._meshes:
            subject = self.five.characters[0].subject
            subject.data = self._meshes[1.0]
            if detail < 1.0:
                modifier = subject.modifiers.new("Fewer", "DECIMATE")
                modifier.ratio = detail
            else:
                modifier = subject.modifiers.new("More", "SUBSURF")
                modifier.subdivision_type, modifier.levels = "SIMPLE", round(math.log(detail, 4.0))
            layer = self.five.scene.view_layers[0]
            layer.update()
            evaluated = subject.evaluated_get(layer.depsgraph)
            self._meshes[detail] = bpy.data.meshes.new_from_object(
                evaluated, preserve_all_data_layers=True, depsgraph=layer.depsgraph
            )
            subject.modifiers.remove(modifier)
        return self._meshes[detail]


def is_software(renderer: str) -> bool:
    """Return whether the driver of this name draws on the processor, so that its times are good for ratios alone."""
    return any(name in renderer.lower() for name in SOFTWARE)


def _series(quick: bool) -> dict[str, tuple[list[Setting], Mapping[str, RenderMaterial]]]:
    """Return what is timed, by what changes from setting to setting: the settings, and the models that take turns in each."""
    if quick:
        return {"lights": ([Setting(count) for count in QUICK_LIGHTS], VARIANTS)}
    return {
        "lights": ([Setting(count) for count in LIGHTS], VARIANTS),
        "pixels": ([Setting(GROWTH_LIGHTS, pixels=factor) for factor in PIXELS], GROWING),
        "triangles": ([Setting(GROWTH_LIGHTS, triangles=factor) for factor in TRIANGLES], GROWING),
    }


def steps(characters: Characters, quick: bool) -> list[Step]:
    """Return steps that time each variant under each number of lights, how the cost grows (not if `quick`), and the scene as built.

    There is a record for each variant and clock. A frame's work is 1, and a fifth of that for each light.
    """
    rounds = QUICK_ROUNDS if quick else ROUNDS

    def step(setting: Setting, models: Mapping[str, RenderMaterial], growing: list[Record], is_kept: bool = True) -> Step:
        def measure() -> list[Record]:
            found = compare(characters, setting, models, rounds)
            growing.extend(one for one in found if one["model"] in GROWING)
            return found if is_kept else []

        name = f"{setting.lit_by}  {setting.pixels:g} x pixels  {setting.triangles:g} x triangles"
        return Step(name, measure, len(models) * rounds * (1.0 + setting.lights / 5.0))

    found = []
    for what, (settings, models) in _series(quick).items():
        growing: list[Record] = []
        found += [step(setting, models, growing, is_kept=what == "lights") for setting in settings]
        if not quick:
            found.append(Step(f"growth with {what}", partial(growth, what, growing), 0.0))
    return [*found, step(Setting(0), AS_BUILT_VARIANTS, [])]


def compare(characters: Characters, setting: Setting, models: Mapping[str, RenderMaterial], rounds: int) -> list[Record]:
    """Return a record for each of `models` and each clock, timed in turns: medians and quartiles, also of the ratios."""
    about = {"lit_by": setting.lit_by, "lights": setting.lights, **characters.prepare(setting)}
    times = in_turns({name: partial(characters.frame, model) for name, model in models.items()}, rounds)
    found = []
    for name in models:
        for clock in CLOCKS:
            record = {"target": "realtime", "model": name, "clock": clock, **about, "rounds": rounds}
            record |= _spread("seconds", [time[clock] for time in times[name]])
            for key, other in (("over_lambert", LAMBERT), ("over_plain_lambert", PLAIN_LAMBERT)):
                if other in models:
                    ratios = [own[clock] / theirs[clock] for own, theirs in zip(times[name], times[other], strict=True)]
                    record |= _spread(key, ratios)
            found.append(record)
    return found


def growth(what: str, found: Sequence[Record]) -> Iterator[Record]:
    """Yield for each model and clock of `found` the line that a frame's seconds follow: where it starts, and its slope by `what`.

    Pixels and triangles are counted in millions. `off` is how far the farthest point is from the line, as a fraction of its own.
    """
    for name, clock in dict.fromkeys((record["model"], record["clock"]) for record in found):
        points = [(_amount(what, one), one["seconds"]) for one in found if (one["model"], one["clock"]) == (name, clock)]
        if len(points) > 1:
            slope, start = linear_regression(*zip(*points, strict=True))
            off = max(abs(start + slope * x - y) / y for x, y in points)
            about = {"target": "realtime", "model": name, "clock": clock, "grows_with": what}
            yield {**about, "points": points, "start": start, "slope": slope, "off": off}


def table(found: Sequence[Record], clock: str, absolute: bool) -> Table:
    """Return columns and rows: under each light a frame's time by `clock` over that of lambert.glsl and of plain Lambert.

    Milliseconds are there if they are `absolute`.
    """

    def cell(shared: list[Record]) -> str:
        (one,) = shared
        milliseconds = f"{1e3 * one['seconds']:.3g} ms  " if absolute else ""
        return f"{milliseconds}{one['over_lambert']:.2f} / {one['over_plain_lambert']:.2f}"

    timed = [record for record in found if "over_plain_lambert" in record and record["clock"] == clock]
    return pivot(timed, ("Model",), lambda one: (one["model"],), lambda one: one["lit_by"], cell)


def growth_table(found: Sequence[Record], absolute: bool) -> Table:
    """Return columns and rows: fractions of the slowest frame timed, and the line in milliseconds if times are `absolute`."""
    rows: list[tuple[str, ...]] = []
    for record in found:
        if "grows_with" in record:
            start, slope = record["start"], record["slope"]
            most, seconds = max(record["points"])
            shares = [f"{100.0 * share:.0f} %" for share in (start / seconds, slope * most / seconds, record["off"])]
            line = (f"{1e3 * start:.3g} + {1e3 * slope:.3g} x ms",) if absolute else ()
            unit = "" if record["grows_with"] == "lights" else " million"
            rows.append((f"{record['model']}, {record['clock']}", f"{most:.3g}{unit} {record['grows_with']}", *shares, *line))
    return ("Model", "At", "Fixed", "Grows", "Off the line", *("Line",) * absolute), rows


def _spread(key: str, values: Sequence[float]) -> Record:
    """Return the median of `values`, and under `key`_low and `key`_high their quartiles."""
    low, _, high = quantiles(values, n=4, method="inclusive")
    return {key: median(values), f"{key}_low": low, f"{key}_high": high}


def _amount(what: str, record: Record) -> float:
    """Return how many lights, or how many millions of pixels or triangles, a record has."""
    amounts = {
        "lights": record["lights"],
        "pixels": 1e-6 * record["width"] * record["height"],
        "triangles": 1e-6 * record["triangles"],
    }
    return amounts[what]
