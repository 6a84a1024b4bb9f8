# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that comes through slabs of skin in Cycles and Realtime, against the integral equation of radiative transfer."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from statistics import fmean

import bpy

from mathutils import Matrix

from true_diffuse.addon.blender.engines import CYCLES, REALTIME, Engine
from true_diffuse.addon.closures.subsurface_fit import BEAM, MU, darkened
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import SUBSURFACE
from true_diffuse.scenes.elements import add, add_sun
from true_diffuse.scripts.studies.slab_transmittance import transmittance
from true_diffuse.scripts.studies.study import Step, Table, pivot

MM = 0.001  # m
SKINS = ("fair_skin", "deep_skin")  # presets
THICKNESSES = (0.5, 1.0, 2.0, 5.0)  # mm
WIDTH, VIEW, SIZE = 60.0, 4.0, 16  # mm across a slab and its picture, and pixels
SLAB_SAMPLES = {CYCLES.key: 1024, REALTIME.key: 64}
SEED = 3


def skin(preset: str) -> bpy.types.Material:
    """Return a new material of the color and the mean free paths of a preset, all of whose light scatters below the surface."""
    inputs = PRESETS[preset].inputs
    chosen = {name: inputs[name] for name in ("Color", "Subsurface Radius")}
    return materials.create(preset, SUBSURFACE, **chosen, Subsurface=1.0, Specular=0.0)


def lit_from_behind(thickness: float, material: bpy.types.Material) -> tuple[bpy.types.Scene, bpy.types.Object, bpy.types.Object]:
    """Return a scene with a slab `thickness` [mm] thick, seen along its normal, the slab, and the sun of pi W/m^2 behind it."""
    scene = bpy.data.scenes.new("Slab from Behind")
    mesh = bpy.data.meshes.new("Slab")
    half, depth = 0.5 * WIDTH * MM, thickness * MM
    corners = [(x, y, z) for z in (-depth, 0.0) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))]
    sides = [(k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4) for k in range(4)]
    mesh.from_pydata(corners, [], [(3, 2, 1, 0), (4, 5, 6, 7), *sides])
    mesh.materials.append(material)
    body = add(scene, "Slab", mesh)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale, camera.clip_start, camera.clip_end = "ORTHO", VIEW * MM, 0.01, 1.0
    scene.camera = add(scene, "Camera", camera, Matrix.Translation((0.0, 0.0, 0.3)))
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    sun = add_sun(scene, "Sun", (0.0, 0.0, -1.0), math.pi)
    scene.view_layers[0].update()
    return scene, body, sun


def through(thickness: float, material: bpy.types.Material, engine: Engine, samples: int) -> list[float]:
    """Return the fraction of the light that comes through a slab `thickness` [mm] thick, by channel."""
    scene, body, sun = lit_from_behind(thickness, material)
    with render.measurement_scene(scene, body, sun, shadows=True) as measured:
        _, rgb = render.radiance(measured, engine, samples, SEED)
    return [fmean(rgb[channel::3]) for channel in range(3)]


def expected(preset: str, thickness: float) -> list[float]:
    """Return the same from the integral equation of radiative transfer, of the media that `subsurface_fit` has for the colors."""
    color, path = (PRESETS[preset].inputs[name] for name in ("Color", "Subsurface Radius"))
    if not (isinstance(color, tuple) and isinstance(path, tuple)):
        raise TypeError(f"{preset} is no skin of three channels")
    return [transmittance(1.0 - BEAM.s(darkened(color[channel])) ** 2, thickness / path[channel], MU) for channel in range(3)]


def steps(engines: Sequence[Engine]) -> list[Step]:
    """Return steps that yield what slabs of skin let through."""

    def measure(preset: str, thickness: float) -> Iterator[Record]:
        yield _record(f"{preset}, {thickness:g} mm", "theory", expected(preset, thickness))
        material = skin(preset)
        for engine in engines:
            rgb = through(thickness, material, engine, SLAB_SAMPLES[engine.key])
            yield _record(f"{preset}, {thickness:g} mm", engine.label, rgb)

    return [Step(f"Slab  {name}  {h:g} mm", partial(measure, name, h)) for name in SKINS for h in THICKNESSES]


def _record(case: str, source: str, rgb: Sequence[float]) -> Record:
    return {"case": case, "source": source, "rgb": list(rgb)}


def table(records: Sequence[Record]) -> Table:
    """Return the colors by case and where they come from."""

    def cell(found: list[Record]) -> str:
        return " ".join(f"{value:.4f}" for value in found[0]["rgb"])

    return pivot(records, ("Case",), lambda one: (one["case"],), lambda one: one["source"], cell)
