# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the node groups keep their energy, hold light back and stay finite: records for the accuracy report.

Furnace and extremes look at a sheet bent along lines, convex and from afar: each column of it stands at one N.V to the camera, each
row has inputs of its own, which the mesh carries as attributes. So one picture holds every combination.
"""

import math
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import bpy

from mathutils import Vector

from true_diffuse.addon.blender.engines import EEVEE, Engine
from true_diffuse.addon.closures.lobe import PAIR, SIGNED
from true_diffuse.addon.closures.quality import CHOSEN_LIGHTS
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.models import directional_albedo
from true_diffuse.addon.nodes import chosen_lights
from true_diffuse.scripts.studies.rough import (
    CONFIGURATIONS,
    EON,
    EVERY,
    PAPER,
    SPECULAR,
    SPECULAR_CONFIGURATIONS,
    Configuration,
    MeasuredModel,
)

QUICK_MODELS = (PAPER, EON)
FURNACE_MUS = (1.0, 0.5, 0.2, 0.05)
FURNACE_SIGMAS = (0.0, 0.2, 0.33, 1.0)
FURNACE_ALBEDOS = (1.0, 0.8)
FURNACE_CELL = 8  # pixels across
FURNACE_SAMPLES = {"eevee": 16, "cycles": 1024}  # Cycles' noise of a cell's mean is then some 0.1 %
EXTREME_MUS = (1.0, 0.5, 0.05, 0.01)
EXTREME_CELL = 3
SUNS = (0.0, 60.0, 175.0)  # degrees between sun and viewer: N = L = V in the first column, L next to -V in the last one
NAN, INF = math.nan, math.inf
NUMBERS: dict[str, tuple[float, ...]] = {
    "Roughness": (0.0, 1e-8, 1e-3, math.pi / 2, 1e3, -1.0, INF, NAN),
    "Color": (0.0, 1.0, 1.5, -1.0, INF, NAN),
    "IOR": (1.0, 3.0, 0.0, -1.0, INF, NAN),
    "Specular": (0.0, 1.0, 1e3, -1.0, INF, NAN),
    "Exponent": (0.0, 1e4, 1e6, -1.0, INF, NAN),
}
NORMALS = (
    ("length 0", (0.0, 0.0, 0.0)),
    ("length 1e-20", (0.0, 0.0, 1e-20)),
    ("length 1e20", (0.0, 0.0, 1e20)),
    ("length 3e38", (0.0, 0.0, 3e38)),
    ("away from the viewer", (0.0, 0.0, -1.0)),
    ("across the view", (1.0, 0.0, 0.0)),
    ("NaN", (NAN, NAN, NAN)),
    ("one NaN", (0.0, NAN, 1.0)),
    ("infinite", (0.0, 0.0, INF)),
)
USUAL = {
    "Roughness": (1.0,) * 3,
    "Color": (0.8, 0.8, 0.8),
    "IOR": (1.5,) * 3,
    "Specular": (0.5,) * 3,
    "Exponent": (30.0,) * 3,
    "Normal": (0.0, 0.0, 0.0),
}
BEYOND, HUGE, ONE = " beyond", 1e30, (1.0, 1.0, 1.0)  # HUGE squared is infinite in 32-bit floats
LEAK_COLOR = (0.8, 0.8, 0.8, 1.0)
LEAK_SIGMA = 1.0
LEAK_SIZE = 48  # pixels across
UNLIT = -0.1  # N.L below which nothing may be lit: above it EEVEE fades the light out
SLABS = (0.001, 0.005)  # m
TILT = math.radians(50.0)  # of a slab's normal from the viewer
LEAK_DEGREES = (120.0, 180.0)  # between sun and viewer

type Inputs = dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Sheet:
    """A convex sheet of as many columns as `mus`, seen by an orthographic camera, and a sun of irradiance pi."""

    scene: bpy.types.Scene
    subject: bpy.types.Object
    sun: bpy.types.Object
    columns: int
    rows: int
    cell: int

    def cells(
        self, material: bpy.types.Material, engine: Engine, samples: int, light: "float | bpy.types.World", traced: bool = False
    ) -> list[list[float]]:
        """Return the values of each cell, row by row: all pixels but those on its edge, all channels.

        `light` is the sun's angle in degrees, or a world; `traced`: with EEVEE's ray tracing.
        """
        self.subject.data.materials[0] = material
        used = () if isinstance(light, bpy.types.World) else (self.sun,)
        if used:
            _turn(self.sun, light)
        with render.measurement_scene(self.scene, self.subject, *used) as scene:
            if not used:
                scene.world = light
            scene.eevee.use_raytracing = traced
            _, rgb = render.radiance(scene, engine, samples)
        return [self._cell(rgb, column, row) for row in range(self.rows) for column in range(self.columns)]

    def _cell(self, rgb: array[float], column: int, row: int) -> list[float]:
        values: list[float] = []
        width = 3 * self.columns * self.cell
        for y in range(row * self.cell + 1, (row + 1) * self.cell - 1):
            start = y * width + 3 * column * self.cell
            values += rgb[start + 3 : start + 3 * (self.cell - 1)]
        return values


def sheet(mus: Sequence[float], rows: Sequence[Inputs], cell: int) -> Sheet:
    """Return a sheet whose columns stand at the cosines `mus`, falling, and whose rows have a group's inputs `rows`."""
    scene = bpy.context.scene
    columns, count = len(mus), len(rows)
    slopes = [math.sqrt(1.0 - mu * mu) / mu for mu in mus]
    heights = [-sum(slopes[:column]) for column in range(columns + 1)]
    # the first row of the picture is at the top
    points = [(float(x), -float(y), heights[x]) for y in range(count + 1) for x in range(columns + 1)]
    line = columns + 1
    faces = [
        (y * line + x, (y + 1) * line + x, (y + 1) * line + x + 1, y * line + x + 1) for y in range(count) for x in range(columns)
    ]
    mesh = bpy.data.meshes.new("Sheet")
    mesh.from_pydata(points, [], faces)
    for name in USUAL:
        values = [x for row in rows for _ in range(columns) for x in row[name]]
        for kind, numbers in (("", map(_finite, values)), (BEYOND, (0.0 if math.isfinite(x) else HUGE for x in values))):
            attribute = mesh.attributes.new(name + kind, "FLOAT_VECTOR", "FACE")
            attribute.data.foreach_set("vector", list(numbers))
    mesh.materials.append(None)
    subject = bpy.data.objects.new("Sheet", mesh)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", float(max(columns, count))
    camera.location = (0.5 * columns, -0.5 * count, 10.0)
    camera.data.clip_end = 20.0 - heights[-1]
    sun = _sun()
    for item in (subject, camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = columns * cell, count * cell
    scene.view_layers[0].update()
    return Sheet(scene, subject, sun, columns, count, cell)


def fed(measured: MeasuredModel, quality: str) -> bpy.types.Material:
    """Return a material whose inputs come from the mesh's attributes: numbers that no socket's limits hold back.

    EEVEE reads 0 for an attribute that is not finite, so infinity and NaN are made in nodes: x (1 + HUGE^2), x being 1 and 0.
    """
    material = measured.material(quality)
    tree = material.node_tree
    for name in _inputs(measured):
        x, huge = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeAttribute")
        x.attribute_name, huge.attribute_name = name, name + BEYOND
        sources = (huge.outputs["Vector"], huge.outputs["Vector"]), (None, ONE), (None, x.outputs["Vector"])
        previous = None
        for operation, pair in zip(("MULTIPLY", "ADD", "MULTIPLY"), sources, strict=True):
            node = tree.nodes.new("ShaderNodeVectorMath")
            node.operation = operation
            for source, socket in zip(pair, node.inputs, strict=False):
                if source is ONE:
                    socket.default_value = ONE
                else:
                    tree.links.new(source or previous, socket)
            previous = node.outputs["Vector"]
        tree.links.new(previous, tree.nodes[measured.group.name].inputs[name])
    return material


def _inputs(measured: MeasuredModel) -> list[str]:
    """Return which of the sheet's attributes are inputs of a model's group."""
    return [socket.name for socket in measured.group.inputs if socket.name in USUAL]


def _finite(x: float) -> float:
    """Return x, or the factor that makes of infinity what x is."""
    return x if math.isfinite(x) else 0.0 if math.isnan(x) else math.copysign(1.0, x)


def uniform_world() -> bpy.types.World:
    """Return a world of radiance 1 everywhere."""
    world = bpy.data.worlds.new("White")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    return world


def _sun() -> bpy.types.Object:
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = math.pi
    return sun


def _turn(sun: bpy.types.Object, degrees: float) -> None:
    """Let `sun` shine from `degrees` beside a viewer above."""
    angle = math.radians(degrees)
    sun.matrix_world = Vector((math.sin(angle), 0.0, math.cos(angle))).to_track_quat("Z", "Y").to_matrix().to_4x4()


class Case(NamedTuple):
    configuration: Configuration
    measured: MeasuredModel

    @property
    def name(self) -> str:
        return f"{self.configuration.engine.label}  {self.configuration.target}  {self.configuration.quality}  {self.measured.name}"

    @property
    def record(self) -> Record:
        return {
            "engine": self.configuration.engine.key,
            "target": self.configuration.target,
            "quality": self.configuration.quality,
            "model": self.measured.name,
        }


def _cases(
    used: Sequence[Engine],
    measured: Iterable[MeasuredModel],
    chosen_lights_too: bool,
    configurations: Iterable[Configuration] = CONFIGURATIONS,
) -> list[Case]:
    chosen = [
        configuration
        for configuration in configurations
        if configuration.engine in used and (chosen_lights_too or configuration.quality != CHOSEN_LIGHTS)
    ]
    return [
        Case(configuration, each)
        for configuration in chosen
        for each in measured
        if not (configuration.osl and each.model and each.model.osl is None)
    ]


# Furnace


def furnace(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield the share of a uniform world's light that each model, target and quality reflects, and what the formula says.

    EEVEE renders without ray tracing, and once more with it. Each picture is one unit of work to `progress`.
    """
    rows = [(sigma, rho) for sigma in FURNACE_SIGMAS for rho in FURNACE_ALBEDOS]
    usual = [{**USUAL, "Roughness": (sigma,) * 3, "Color": (rho,) * 3} for sigma, rho in rows]
    bent, white = sheet(FURNACE_MUS, usual, FURNACE_CELL), uniform_world()
    for case, traced in _furnace_cases(used, quick):
        samples = FURNACE_SAMPLES[case.configuration.engine.key]
        bent.scene.cycles.shading_system = case.configuration.osl
        with progress.step(f"Furnace  {case.name}{'  ray tracing' if traced else ''}", 1.0):
            cells = bent.cells(fed(case.measured, case.configuration.quality), case.configuration.engine, samples, white, traced)
        for index, (sigma, rho) in enumerate(rows):
            if not case.measured.is_rough and sigma != FURNACE_SIGMAS[0]:
                continue
            for column, mu in enumerate(FURNACE_MUS):
                values = cells[index * len(FURNACE_MUS) + column]
                yield {
                    **case.record,
                    "sigma": sigma if case.measured.is_rough else None,
                    "albedo": rho,
                    "mu": mu,
                    "ray_tracing": traced,
                    "rendered": sum(values) / len(values),
                    "analytic": _albedo(case.measured, sigma, mu, rho),
                    "samples": samples,
                }


def furnace_work(used: Sequence[Engine], quick: bool) -> int:
    """Return how many pictures `furnace` renders."""
    return len(_furnace_cases(used, quick))


def _furnace_cases(used: Sequence[Engine], quick: bool) -> list[tuple[Case, bool]]:
    plain = [(case, False) for case in _cases(used, QUICK_MODELS if quick else tuple(EVERY.values()), chosen_lights_too=False)]
    return plain + [(case, True) for case, _ in plain if case.configuration.engine is EEVEE and case.measured in QUICK_MODELS]


@cache
def _albedo(measured: MeasuredModel, sigma: float, mu: float, rho: float) -> float:
    return directional_albedo(measured.formula(sigma), mu, rho, order=16)  # to 1e-5 also for Pitted, the least smooth


def furnace_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: rendered and, in brackets, analytic albedo by N.V, for rho = 1."""
    groups: dict[tuple[str, ...], list[Record]] = {}
    for record in records:
        if record["albedo"] == 1.0:
            quality = f"{record['target']}, {record['quality']}{', ray tracing' if record['ray_tracing'] else ''}"
            sigma = "-" if record["sigma"] is None else f"{record['sigma']:g}"
            groups.setdefault((record["engine"], quality, record["model"], sigma), []).append(record)
    rows = [(*key, *(f"{one['rendered']:.3f} ({one['analytic']:.3f})" for one in group)) for key, group in groups.items()]
    return ("Engine", "Target and quality", "Model", "Sigma", *(f"N.V {mu:g}" for mu in FURNACE_MUS)), rows


# Leaks


@dataclass(frozen=True)
class Body:
    """A closed body under a sun: a sphere of 1 m radius, or a slab of 1 m x 1 m, tilted, that fills the picture."""

    scene: bpy.types.Scene
    subject: bpy.types.Object
    sun: bpy.types.Object
    axis: Vector | None
    """The slab's normal towards the viewer; None for the sphere."""

    def leak(self, material: bpy.types.Material, engine: Engine, degrees: float, shadows: bool) -> float:
        """Return the greatest radiance where N.L < UNLIT, lit from `degrees` beside the viewer, over a lit Lambert surface's."""
        self.subject.data.materials[0] = material
        _turn(self.sun, degrees)
        light = (self.sun.matrix_world.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
        with render.measurement_scene(self.scene, self.subject, self.sun, shadows=shadows) as scene:
            _, rgb = render.radiance(scene, engine, 4)
        width = self.scene.render.resolution_x
        worst = 0.0
        for pixel in range(len(rgb) // 3):
            n = self.axis or _sphere_normal(pixel, width)
            if n is not None and n.dot(light) < UNLIT:
                worst = max(worst, *rgb[3 * pixel : 3 * pixel + 3])
        return worst / max(LEAK_COLOR[:3])


def _sphere_normal(pixel: int, width: int) -> Vector | None:
    """Return the normal of a unit sphere that fills a square picture; None beside it."""
    x, y = 2.0 * (pixel % width + 0.5) / width - 1.0, 1.0 - 2.0 * (pixel // width + 0.5) / width
    rest = 1.0 - x * x - y * y
    return Vector((x, y, math.sqrt(rest))) if rest > 0.0 else None


def body(thickness: float | None) -> Body:
    """Return a sphere, or a slab that is `thickness` [m] thick."""
    scene = bpy.context.scene
    if thickness is None:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1.0)
        bpy.context.object.data.shade_smooth()
    else:
        bpy.ops.mesh.primitive_cube_add(size=1.0)
        bpy.context.object.scale = (1.0, 1.0, thickness)
        bpy.context.object.rotation_euler = (0.0, -TILT, 0.0)  # away from all of LEAK_DEGREES
    subject, sun = bpy.context.object, _sun()
    subject.data.materials.append(None)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0 if thickness is None else 0.5
    camera.location = (0.0, 0.0, 5.0)
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = LEAK_SIZE
    scene.view_layers[0].update()
    axis = None if thickness is None else subject.matrix_world.to_quaternion() @ Vector((0.0, 0.0, 1.0))
    return Body(scene, subject, sun, axis)


def leak(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield how much light from behind shows on closed bodies, as a share of what a Lambert surface that faces the light shows.

    Where a quality has Subsurface closures, once with the material as `materials.create` makes it and once with EEVEE's own idea of
    how thick the body is: `thickness` is whether the Material Output has one. Each target, quality, model and body is one unit of
    work to `progress`.
    """
    for thickness in (None, *SLABS):
        solid = body(thickness)
        chosen_lights.choose([solid.sun])
        for case in _leak_cases(used, quick):
            solid.scene.cycles.shading_system = case.configuration.osl
            material = case.measured.material(case.configuration.quality, Color=LEAK_COLOR, Roughness=LEAK_SIGMA)
            name = "sphere" if thickness is None else f"slab {1000.0 * thickness:g} mm"
            with progress.step(f"Leak  {case.name}  {name}", 1.0):
                for wired in (True, False) if case.configuration.lobe_set in (PAIR, SIGNED) else (True,):
                    if not wired:
                        _unwire(material)
                    for degrees in LEAK_DEGREES:
                        for shadows in (False, True):
                            share = solid.leak(material, case.configuration.engine, degrees, shadows)
                            more = {"body": name, "light_degrees": degrees, "shadows": shadows, "thickness": wired, "leak": share}
                            yield {**case.record, **more}
        bpy.data.objects.remove(solid.subject)


def _leak_cases(used: Sequence[Engine], quick: bool) -> list[Case]:
    return _cases(used, QUICK_MODELS[:1] if quick else QUICK_MODELS, chosen_lights_too=True)


def _unwire(material: bpy.types.Material) -> None:
    """Leave the thickness to EEVEE."""
    tree = material.node_tree
    for link in tree.get_output_node("EEVEE").inputs["Thickness"].links:
        tree.links.remove(link)


def leak_work(used: Sequence[Engine], quick: bool) -> int:
    """Return how many targets, qualities, models and bodies `leak` goes through."""
    return len(_leak_cases(used, quick)) * (1 + len(SLABS))


def leak_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: the greatest leak over the lights, by body, without and with shadows."""
    bodies = list(dict.fromkeys(record["body"] for record in records))
    groups: dict[tuple[str, ...], dict[tuple[str, bool], float]] = {}
    for record in records:
        thickness = "as made" if record["thickness"] else "EEVEE's"
        row = groups.setdefault((record["engine"], f"{record['target']}, {record['quality']}", record["model"], thickness), {})
        where = record["body"], record["shadows"]
        row[where] = max(row.get(where, 0.0), record["leak"])
    columns = [f"{name}{', shadows' if shadows else ''}" for name in bodies for shadows in (False, True)]
    rows = [
        (*key, *(f"{100.0 * row[name, shadows]:.2f} %" for name in bodies for shadows in (False, True)))
        for key, row in groups.items()
    ]
    return ("Engine", "Target and quality", "Model", "Thickness", *columns), rows


# Extremes


def extreme_rows(measured: MeasuredModel) -> list[tuple[str, str, Inputs]]:
    """Return what the rows of a sheet for a model's group are: the input that is odd, its value in words, and all inputs."""
    rows = []
    for name in _inputs(measured):
        rows += [(name, f"{value:g}", {**USUAL, name: (value,) * 3}) for value in NUMBERS.get(name, ())]
    return rows + [("Normal", words, {**USUAL, "Normal": value}) for words, value in NORMALS]


def extremes(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield the least and the greatest radiance that each odd input gives, over views, suns and a uniform world.

    `finite` is whether all of it is finite and not negative. Each target, quality and model is one unit of work to `progress`.
    """
    white = uniform_world()
    for cases in _extreme_cases(used, quick):
        rows = extreme_rows(cases[0].measured)
        bent = sheet(EXTREME_MUS, [inputs for _, _, inputs in rows], EXTREME_CELL)
        chosen_lights.choose([bent.sun])
        for case in cases:
            bent.scene.cycles.shading_system = case.configuration.osl
            with progress.step(f"Extremes  {case.name}", 1.0):
                ranges = odd_inputs(bent, fed(case.measured, case.configuration.quality), case.configuration.engine, (*SUNS, white))
            for (name, words, _), (low, high, finite) in zip(rows, ranges, strict=True):
                yield {**case.record, "input": name, "value": words, "minimum": low, "maximum": high, "finite": finite}


def _extreme_cases(used: Sequence[Engine], quick: bool) -> list[list[Case]]:
    """Return the cases of each group."""
    rough = _cases(used, QUICK_MODELS if quick else tuple(EVERY.values()), chosen_lights_too=True)
    return [rough, _cases(used, (SPECULAR,), chosen_lights_too=True, configurations=SPECULAR_CONFIGURATIONS)]


def extremes_work(used: Sequence[Engine], quick: bool) -> int:
    """Return how many targets, qualities and models `extremes` goes through."""
    return sum(map(len, _extreme_cases(used, quick)))


def odd_inputs(
    bent: Sheet, material: bpy.types.Material, engine: Engine, lights: "Iterable[float | bpy.types.World]"
) -> list[tuple[float | None, float | None, bool]]:
    """Return, for each row of a sheet, the least and the greatest finite value, and whether all are finite and none negative."""
    values: list[list[float]] = [[] for _ in range(bent.rows)]
    for light in lights:
        for index, cell in enumerate(bent.cells(material, engine, 1, light)):
            values[index // bent.columns] += cell
    result = []
    for row in values:
        finite = [value for value in row if math.isfinite(value)]
        low, high = min(finite, default=None), max(finite, default=None)
        result.append((low, high, len(finite) == len(row) and low is not None and low >= 0.0))
    return result


def extremes_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each input and value, the range over all models of each target and quality."""
    configurations = list(dict.fromkeys((record["engine"], record["target"], record["quality"]) for record in records))
    groups: dict[tuple[str, str], dict[tuple[str, ...], list[Record]]] = {}
    for record in records:
        row = groups.setdefault((record["input"], record["value"]), {})
        row.setdefault((record["engine"], record["target"], record["quality"]), []).append(record)
    rows: list[tuple[str, ...]] = [
        (*key, *(_range(row[configuration]) if configuration in row else "-" for configuration in configurations))
        for key, row in groups.items()
    ]
    columns: tuple[str, ...] = ("Input", "Value", *(", ".join(configuration) for configuration in configurations))
    return columns, rows


def _range(records: Sequence[Record]) -> str:
    lows = [record["minimum"] for record in records if record["minimum"] is not None]
    highs = [record["maximum"] for record in records if record["maximum"] is not None]
    text = f"{min(lows):.3g} to {max(highs):.3g}" if lows else "none"
    return text if all(record["finite"] for record in records) else f"{text}, NOT SOUND"
