# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each model comes to its formula where N is not the mesh's normal: mapped, bumped, or of a coarse smooth mesh.

A triangle for each case, one pixel each, seen from above, with its own normals; a picture for each sun. Where a normal is mapped,
Cycles shadows Lambert's law, too. What counts is the radiance over that of Lambert with the same N, over the same quotient of the
formulas: its error is the model's own.
"""

import math
import random
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import bpy

from mathutils import Quaternion
from mathutils import Vector as BlenderVector

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.quality import BALANCED
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import Lambert, Model
from true_diffuse.addon.models.vector import Vector, dot, from_polar
from true_diffuse.scenes.elements import add, add_sun
from true_diffuse.scripts.studies.rough import EVERY, LAMBERT, PAPER, Configuration, MeasuredModel
from true_diffuse.scripts.studies.study import Step, Table, percent, pivot, text

NORMAL, NORMAL_MAP, BUMP, SMOOTH = "Normal", "Normal Map", "Bump", "Smooth Shading"
SOURCES = (NORMAL, NORMAL_MAP, BUMP, SMOOTH)
TILTS = (0.0, 15.0, 30.0, 45.0)  # degrees between N and the normal of the mesh
SIGMAS = (0.33, 1.0)
PLACES = 48  # pairs of normals for each tilt
SUNS = tuple((angle, 40.0 * k) for k, angle in enumerate((15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 100.0, 110.0)))
"""Polar angle from the viewer and azimuth in degrees."""
VIEWER: Vector = (0.0, 0.0, 1.0)
LOWEST = (
    0.1  # the least cosine of either normal to light and viewer; nearer to a horizon all radiance vanishes, and shares of it vary
)
ALBEDO = 0.8
HALF = 0.45  # of a pixel: how far each triangle reaches
CONFIGURATIONS = (Configuration(CYCLES, BALANCED), Configuration(CYCLES, BALANCED, osl=True), Configuration(EEVEE, BALANCED))


@dataclass(frozen=True)
class Place:
    """The unit normal of a triangle, the shading normal N, and the angle between them in degrees."""

    face: Vector
    n: Vector
    tilt: float


@dataclass(frozen=True)
class Shown:
    """A model of a roughness whose N comes from one of SOURCES."""

    source: str
    measured: MeasuredModel
    sigma: float

    @property
    def formula(self) -> Model:
        return self.measured.formula(self.sigma)


def shown(quick: bool) -> list[Shown]:
    """Return every model with a constant Normal, and equation (1) with each other source; Lambert is first of each source."""
    result = []
    for source in SOURCES:
        others = [each for each in EVERY.values() if each not in (PAPER, LAMBERT)] if source == NORMAL and not quick else []
        result.append(Shown(source, LAMBERT, 0.0))
        result += [
            Shown(source, each, sigma) for each in (PAPER, *others) for sigma in SIGMAS if each.is_rough or sigma == SIGMAS[0]
        ]
    return result


def places(count: int = PLACES) -> list[Place]:
    """Return `count` pairs of normals for each of TILTS, which face the viewer: the same N as far as may be, and in every run."""
    result = []
    for tilt in TILTS:
        rng, found = random.Random(18), list[Place]()
        while len(found) < count:
            n = from_polar(rng.uniform(LOWEST, 1.0), rng.uniform(0.0, 2.0 * math.pi))
            across, face = BlenderVector(n).orthogonal(), BlenderVector(n)
            across.rotate(Quaternion(n, rng.uniform(0.0, 2.0 * math.pi)))
            face.rotate(Quaternion(across, math.radians(tilt)))
            if face.z > LOWEST:
                found.append(Place(tuple(face), n, tilt))
        result += found
    return result


def steps(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return a step for each way to render, whose records have the RMS and the largest error of each case by tilt, as fractions."""

    def measure(configuration: Configuration) -> Iterator[Record]:
        cases, where = shown(quick), places(PLACES // 4 if quick else PLACES)
        pictures = [(light, render_cases(configuration, cases, where, light)) for light in lights()]
        for index, case in enumerate(cases):
            lambert = next(k for k, one in enumerate(cases) if one.source == case.source)
            for tilt in TILTS:
                errors = [
                    values[index][k]
                    / values[lambert][k]
                    / (_radiance(case.formula, place, light) / _radiance(Lambert(), place, light))
                    - 1.0
                    for light, values in pictures
                    for k, place in enumerate(where)
                    if place.tilt == tilt and min(dot(place.n, light), dot(place.face, light)) > LOWEST
                ]
                if index != lambert:
                    yield {
                        **configuration.record,
                        "normal": case.source,
                        "model": case.measured.name,
                        "sigma": case.sigma if case.measured.is_rough else None,
                        "tilt": tilt,
                        "rms_error": math.sqrt(sum(error * error for error in errors) / len(errors)),
                        "largest_error": max(map(abs, errors)),
                        "lights_and_views": len(errors),
                    }

    own = [each for each in CONFIGURATIONS if each.engine in used and (compiles_osl() or not each.osl)]
    return [Step(f"Mapped normals  {each.name}", partial(measure, each), 10.0) for each in own]


def lights() -> list[Vector]:
    """Return the directions towards SUNS."""
    return [from_polar(math.cos(math.radians(angle)), math.radians(azimuth)) for angle, azimuth in SUNS]


def _radiance(model: Model, place: Place, light: Vector) -> float:
    return model.radiance(place.n, light, VIEWER, ALBEDO)


def render_cases(configuration: Configuration, cases: Sequence[Shown], where: Sequence[Place], light: Vector) -> list[list[float]]:
    """Return for each case the radiance at each place, for a sun of irradiance 1 W/m^2 from `light`."""
    count = len(cases) * len(where)
    width = math.ceil(math.sqrt(count))
    height = math.ceil(count / width)
    mesh = _mesh(cases, where, width)
    source = bpy.data.scenes.new("Mapped Normals")
    subject = add(source, "Mapped Normals", mesh)
    lamp = add_sun(source, "Mapped Normals", light, 1.0)
    lens = bpy.data.cameras.new("Mapped Normals")
    lens.type, lens.ortho_scale, lens.clip_end = "ORTHO", max(width, height), 4000.0
    source.camera = add(source, "Mapped Normals", lens)
    source.camera.location = (0.5 * width, 0.5 * height, 2000.0)
    source.render.resolution_x, source.render.resolution_y = width, height
    source.cycles.shading_system = configuration.osl
    source.view_layers[0].update()
    with render.measurement_scene(source, subject, lamp) as scene:
        rows = render.radiance(scene, configuration.engine, 4 if configuration.engine is EEVEE else 1)[1]
    bpy.data.scenes.remove(source)
    pixels = array(
        "f", [rows[3 * (width * y + x)] for y in reversed(range(height)) for x in range(width)]
    )  # rows come from the top
    return [list(pixels[k : k + len(where)]) for k in range(0, count, len(where))]


def _mesh(cases: Sequence[Shown], where: Sequence[Place], width: int) -> bpy.types.Mesh:
    """Return a triangle for each case and place, around the middle of its pixel, with the case's material."""
    corners, slots, own, mapped, bump = array("f"), array("i"), array("f"), array("f"), array("f")
    for index, (case, place) in enumerate((case, place) for case in cases for place in where):
        face = place.face
        for x, y in ((-HALF, -HALF), (HALF, -HALF), (0.0, HALF)):
            corners.extend((index % width + 0.5 + x, index // width + 0.5 + y, -(face[0] * x + face[1] * y) / face[2]))
        slots.append(index // len(where))
        own.extend(place.n if case.source == SMOOTH else face)
        mapped.extend(place.n)
        # a Bump node turns the normal to face - gradient of its height
        bump.extend(f - n / dot(face, place.n) for f, n in zip(face, place.n, strict=True))
    count = len(slots)
    mesh = bpy.data.meshes.new("Mapped Normals")
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", corners)
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", range(3 * count))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", range(0, 3 * count, 3))
    mesh.polygons.foreach_set("material_index", slots)
    mesh.shade_smooth()
    mesh.update(calc_edges=True)
    mesh.normals_split_custom_set([own[3 * k : 3 * k + 3] for k in range(count) for _ in range(3)])  # to some 1e-4
    for name, vectors in (("mapped", mapped), ("slope", bump)):
        mesh.attributes.new(name, "FLOAT_VECTOR", "FACE").data.foreach_set("vector", vectors)
    for case in cases:
        mesh.materials.append(_material(case))
    return mesh


def _material(case: Shown) -> bpy.types.Material:
    """Return the material of a case, which reads N from the mesh's attributes."""
    rough = {"Roughness": case.sigma} if case.measured.is_rough else {}
    material = case.measured.material(BALANCED, Color=(ALBEDO, ALBEDO, ALBEDO, 1.0), **rough)
    tree = material.node_tree
    group = next(node for node in tree.nodes if node.type == "GROUP")

    def attribute(name: str) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        return node.outputs["Vector"]

    def calculated(operation: str, first: bpy.types.NodeSocket, second: bpy.types.NodeSocket | Vector) -> bpy.types.Node:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        tree.links.new(first, node.inputs[0])
        if isinstance(second, tuple):
            node.inputs[1].default_value = second
        else:
            tree.links.new(second, node.inputs[1])
        return node

    if case.source == NORMAL:
        tree.links.new(attribute("mapped"), group.inputs["Normal"])
    elif case.source == NORMAL_MAP:
        node = tree.nodes.new("ShaderNodeNormalMap")
        node.space = "WORLD"
        half = calculated("MULTIPLY", attribute("mapped"), (0.5, 0.5, 0.5))
        color = calculated("ADD", half.outputs[0], (0.5, 0.5, 0.5))
        tree.links.new(color.outputs[0], node.inputs["Color"])
        tree.links.new(node.outputs[0], group.inputs["Normal"])
    elif case.source == BUMP:
        node = tree.nodes.new("ShaderNodeBump")
        node.inputs["Distance"].default_value = 1.0
        position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
        height = calculated("DOT_PRODUCT", position, attribute("slope"))
        tree.links.new(height.outputs["Value"], node.inputs["Height"])
        tree.links.new(node.outputs[0], group.inputs["Normal"])
    return material


def table(records: Sequence[Record]) -> Table:
    """Return a row for each case, RMS and in brackets the largest error by tilt, in %."""

    def row(one: Record) -> tuple[str, ...]:
        return f"{one['engine']} {one['target']}", one["normal"], one["model"], text(one["sigma"])

    def cell(found: list[Record]) -> str:
        return f"{percent(found[0]['rms_error'], '.1f')} ({percent(found[0]['largest_error'], '.0f')})"

    titles = ("Configuration", "Normal from", "Model", "Sigma")
    return pivot(records, titles, row, lambda one: f"{one['tilt']:g}\u00b0", cell)
