# SPDX-License-Identifier: GPL-3.0-or-later
"""Light through the ears of the face in EEVEE and Realtime against Cycles, and what it costs in EEVEE."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from statistics import median
from unittest.mock import patch

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import SUBSURFACE, subsurface
from true_diffuse.scripts.characters import face
from true_diffuse.scripts.studies.cost import in_turns
from true_diffuse.scripts.studies.face import mean, regions_of
from true_diffuse.scripts.studies.study import Step, Table, pivot

RESOLUTION, RESOLUTION_OF_COST = (900, 360), (450, 180)
SAMPLES = {CYCLES: 96, EEVEE: 16, REALTIME: 64}
COMPARED = (EEVEE, REALTIME)  # with Cycles
PAINTED = {"Fair Skin": "fair_skin", "Deep Skin": "deep_skin"}  # presets, in the place of the paint of the mesh
REGIONS = ("ears", "cheeks", "nose", "forehead")
SEED = 3
ROUNDS = 3


def steps(mesh: bpy.types.Mesh, quick: bool) -> list[Step]:
    """Return steps that yield the mean radiance of regions of skin in each engine, under key and back light with shadows.

    The skins are those of the three heads of the face scene, and the second of them with the colors of presets, all on one head.
    """
    stage = face.build(mesh, True, RESOLUTION)
    materials = {head.look.label: head.subject.material_slots[2].material for head in stage.heads}
    head = next(head for head in stage.heads if head.look.name == "bssrdf")
    materials |= {name: _painted(materials[head.look.label], preset) for name, preset in PAINTED.items()}
    regions = cache(lambda: regions_of(stage, head))

    def measure(name: str) -> Iterator[Record]:
        head.subject.material_slots[2].material = materials[name]
        with render.measurement_scene(stage.scene, head.subject, *stage.lights, shadows=True) as scene:
            pictures = {engine: render.radiance(scene, engine, samples, SEED)[1] for engine, samples in SAMPLES.items()}
        for region in REGIONS:
            pixels = regions()[region]
            for engine in COMPARED:
                radiance = {one.key: mean(pictures[one], pixels) for one in (engine, CYCLES)}
                difference = error.difference(pictures[engine], pictures[CYCLES], pixels)
                about: Record = {"skin": name, "region": region, "engine": engine.key}
                yield about | {"mean_radiance": radiance, "rms_difference": difference}

    return [Step(name, partial(measure, name)) for name in ([head.look.label] if quick else materials)]


def _painted(material: bpy.types.Material, preset: str) -> bpy.types.Material:
    """Return a copy of a `material` of the face that has the color and the lengths of a preset."""
    copy = material.copy()
    inputs = copy.node_tree.nodes[SUBSURFACE.name].inputs
    for link in inputs["Color"].links:
        copy.node_tree.links.remove(link)
    for socket in ("Color", "Subsurface Radius"):
        inputs[socket].default_value = PRESETS[preset].inputs[socket]
    return copy


def table(records: Sequence[Record]) -> Table:
    """Return red, green and blue in each engine over those in Cycles, and the RMS difference, by skin and region."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        pairs = zip(one["mean_radiance"][one["engine"]], one["mean_radiance"][CYCLES.key], strict=True)
        return " ".join(f"{a:.4f}/{b:.4f}" for a, b in pairs) + f" ({100.0 * one['rms_difference']:.0f} %)"

    return pivot(records, ("Skin", "Engine"), lambda one: (one["skin"], one["engine"]), lambda one: one["region"], cell)


def costs(mesh: bpy.types.Mesh) -> list[Step]:
    """Return the step that yields the processor time of a head of skin in EEVEE, with and without light from behind."""
    stage = face.build(mesh, True, RESOLUTION_OF_COST)
    head = next(head for head in stage.heads if head.look.name == "bssrdf")
    node = head.subject.material_slots[2].material.node_tree.nodes[SUBSURFACE.name]
    whole = node.node_tree
    with patch.object(subsurface, "from_behind", lambda *_: 0.0):
        plain = replace(SUBSURFACE, key="subsurface_from_the_front", name="Subsurface from the Front").ensure()

    def seconds(tree: bpy.types.NodeTree) -> float:
        node.node_tree = tree
        with render.measurement_scene(stage.scene, head.subject, *stage.lights, shadows=True) as scene:
            start = time.process_time()
            render.radiance(scene, EEVEE, SAMPLES[EEVEE])
            return time.process_time() - start

    def measure() -> Iterator[Record]:
        found = in_turns({name: partial(seconds, tree) for name, tree in (("without", plain), ("with", whole))}, ROUNDS)
        node.node_tree = whole
        yield from ({"light_from_behind": name, "cpu_seconds": median(taken)} for name, taken in found.items())

    return [Step("Cost", measure)]


def table_of_costs(records: Sequence[Record]) -> Table:
    """Return the processor time with and without light from behind, and over that without."""
    base = records[0]["cpu_seconds"]
    columns = ("Light from behind", "Processor time", "Ratio")
    return columns, [
        (one["light_from_behind"], f"{one['cpu_seconds']:.2f} s", f"{one['cpu_seconds'] / base:.2f}") for one in records
    ]
