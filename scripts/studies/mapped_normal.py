# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each model comes to its formula where N is not the mesh's normal: mapped, bumped, or of a coarse smooth mesh.

A triangle for each case, one pixel each, seen from above, with its own normals; a picture for each sun. Where a normal is mapped,
Cycles shadows Lambert's law, too. What counts is the radiance over that of Lambert with the same N, over the same quotient of the
formulas: its error is the model's own.
"""

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import bpy

from mathutils import Quaternion
from mathutils import Vector as BlenderVector

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.quality import BALANCED
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import Lambert, Model
from true_diffuse.addon.models.vector import Vector, dot, from_polar
from true_diffuse.scenes.elements import towards
from true_diffuse.scripts.studies import triangles
from true_diffuse.scripts.studies.rough import EVERY, LAMBERT, PAPER, Configuration, MeasuredModel
from true_diffuse.scripts.studies.study import Step, Table, percent, pivot, text
from true_diffuse.scripts.studies.triangles import VIEWER

NORMAL, NORMAL_MAP, BUMP, SMOOTH = "Normal", "Normal Map", "Bump", "Smooth Shading"
SOURCES = (NORMAL, NORMAL_MAP, BUMP, SMOOTH)
TILTS = (0.0, 15.0, 30.0, 45.0)  # degrees between N and the normal of the mesh
SIGMAS = (0.33, 1.0)
PLACES = 48  # pairs of normals for each tilt
SUNS = tuple((angle, 40.0 * k) for k, angle in enumerate((15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 100.0, 110.0)))
"""Polar angle from the viewer and azimuth in degrees."""
LOWEST = (
    0.1  # the least cosine of either normal to light and viewer; nearer to a horizon all radiance vanishes, and shares of it vary
)
ALBEDO = 0.8
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
    mesh = _mesh(cases, where)
    rows = triangles.shade(mesh, towards(light).to_euler(), configuration.engine, osl=configuration.osl)
    bpy.data.meshes.remove(mesh)
    return [list(rows[3 * k : 3 * (k + len(where)) : 3]) for k in range(0, len(cases) * len(where), len(where))]


def _mesh(cases: Sequence[Shown], where: Sequence[Place]) -> bpy.types.Mesh:
    """Return a triangle for each case and place, with the case's material."""
    every = [(case, place) for case in cases for place in where]
    mesh = triangles.triangles([place.face for _, place in every], [slot for slot in range(len(cases)) for _ in where])
    mesh.shade_smooth()
    normals = [place.n if case.source == SMOOTH else place.face for case, place in every]
    mesh.normals_split_custom_set([n for n in normals for _ in range(3)])  # to some 1e-4
    triangles.set_attribute(mesh, "mapped", [x for _, place in every for x in place.n], is_vector=True)
    # a Bump node turns the normal to face - gradient of its height
    slopes = (f - n / dot(place.face, place.n) for _, place in every for f, n in zip(place.face, place.n, strict=True))
    triangles.set_attribute(mesh, "slope", list(slopes), is_vector=True)
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
