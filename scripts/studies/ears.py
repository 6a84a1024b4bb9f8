# SPDX-License-Identifier: GPL-3.0-or-later
"""Light through ears in EEVEE against Cycles: the face scene's head of subsurface scattering alone, in light and dark skin."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, partial

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import SUBSURFACE
from true_diffuse.scripts.characters import face
from true_diffuse.scripts.characters.face import Face
from true_diffuse.scripts.studies.face import mean, visible_regions
from true_diffuse.scripts.studies.study import Step, Table, pivot
from true_diffuse.scripts.studies.work_precision.test_scenes import Silent

RESOLUTION = (900, 360)
SAMPLES = {EEVEE: 16, CYCLES: 96}
SKINS = {"as in the face scene": None, "Fair Skin": "fair_skin", "Deep Skin": "deep_skin"}  # presets; None: paint of the mesh
REGIONS = ("ears", "cheeks", "nose", "forehead")


def steps(mesh: bpy.types.Mesh, quick: bool) -> list[Step]:
    """Return steps that yield the mean radiance of regions of skin in both engines, under key and back light with shadows."""
    stage = face.build(mesh, True, RESOLUTION)
    (head,) = (head for head in stage.heads if head.look.name == "bssrdf")
    stage = replace(stage, heads=(head,))
    regions = cache(lambda: visible_regions(stage, Silent())[0].pixels)

    def measure(name: str, preset: str | None) -> Iterator[Record]:
        if preset:
            _paint(stage, preset)
        with render.measurement_scene(stage.scene, head.subject, *stage.lights, shadows=True) as scene:
            pictures = {engine: render.radiance(scene, engine, samples)[1] for engine, samples in SAMPLES.items()}
        for region in REGIONS:
            pixels = regions()[region]
            radiance = {engine.key: mean(rgb, pixels) for engine, rgb in pictures.items()}
            difference = error.difference(pictures[EEVEE], pictures[CYCLES], pixels)
            yield {"skin": name, "region": region, "mean_radiance": radiance, "rms_difference": difference}

    skins = list(SKINS.items())[: 1 if quick else None]
    return [Step(name, partial(measure, name, preset)) for name, preset in skins]


def _paint(stage: Face, preset: str) -> None:
    """Give the skin the color and the lengths of a preset."""
    tree = stage.heads[0].subject.material_slots[2].material.node_tree
    inputs = tree.nodes[SUBSURFACE.name].inputs
    for link in inputs["Color"].links:
        tree.links.remove(link)
    for socket in ("Color", "Subsurface Radius"):
        inputs[socket].default_value = PRESETS[preset].inputs[socket]


def table(records: Sequence[Record]) -> Table:
    """Return red, green and blue in EEVEE over those in Cycles, and the RMS difference, by skin and region."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        pairs = zip(one["mean_radiance"][EEVEE.key], one["mean_radiance"][CYCLES.key], strict=True)
        return " ".join(f"{a:.3f}/{b:.3f}" for a, b in pairs) + f" ({100.0 * one['rms_difference']:.0f} %)"

    return pivot(records, ("Skin",), lambda one: (one["skin"],), lambda one: one["region"], cell)
