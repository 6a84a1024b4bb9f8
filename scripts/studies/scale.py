# SPDX-License-Identifier: GPL-3.0-or-later
"""What hundreds of materials cost: as many spheres as materials, beside Blender's own Diffuse BSDF.

Each number comes from a process of its own that opens a saved file: CPU seconds to open it, of the first render, of the next one
and of a change of the frame, the process's memory and the file's size. Kinds of material take turns, so that all share what else
the machine does.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SUBSURFACE, Group, chosen_lights
from true_diffuse.scenes.sphere import sphere_under_sun
from true_diffuse.scripts.studies.study import Step, Table

COUNTS, QUICK_COUNTS = (1, 10, 100, 500), (1, 20)
SIZE, ROUNDS = 64, 3
SEGMENTS = 12  # of a sphere, so that materials are what a scene costs
DIFFUSE, OWN_PRINCIPLED = "Diffuse BSDF", "Principled BSDF"
GROUPS: dict[str, tuple[Group, dict[str, materials.Setting]]] = {
    "Rough Diffuse": (ROUGH_DIFFUSE, {"Quality": BALANCED}),
    "Rough Diffuse, Precise": (ROUGH_DIFFUSE, {"Quality": PRECISE}),
    "Rough Diffuse, Chosen Lights": (ROUGH_DIFFUSE, {"Quality": CHOSEN_LIGHTS}),
    "Subsurface": (SUBSURFACE, {}),
    "Principled Rough Diffuse": (PRINCIPLED, {"Diffuse Roughness": 0.3}),
}
KINDS = (DIFFUSE, OWN_PRINCIPLED, *GROUPS)
# Opens a file and prints what is measured
CLOCK = """
import bpy, json, re, sys, time
from pathlib import Path
def seconds(do):
    start = time.process_time()
    do()
    return time.process_time() - start
opened = seconds(lambda: bpy.ops.wm.open_mainfile(filepath=sys.argv[1])) if not bpy.app.binary_path else 0.0
scene = bpy.context.scene
first, later = seconds(bpy.ops.render.render), seconds(bpy.ops.render.render)
frame = seconds(lambda: scene.frame_set(scene.frame_current + 1))
status = Path("/proc/self/status")  # of Linux; the most memory that the process had
peak = 1024 * int(re.search(r"VmHWM:\\s+(\\d+)", status.read_text())[1]) if status.exists() else None
found = {"open": opened, "first": first, "later": later, "frame": frame, "memory": peak}
print("FOUND", json.dumps(found), flush=True)
"""


def build(kind: str, count: int, engine: Engine) -> None:
    """Make the open file one of `count` spheres, each of a material of its own of that `kind`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage = sphere_under_sun(SIZE)
    scene, mesh = stage.scene, _small_sphere()
    chosen_lights.choose([stage.sun])
    side = 1 + int((count - 1) ** 0.5)
    for index in range(count):
        color = (0.1 + 0.1 * (index % 7), 0.1 + 0.07 * (index % 11), 0.1 + 0.06 * (index % 13), 1.0)
        sphere = bpy.data.objects.new(f"Sphere {index}", mesh)
        sphere.scale = (0.8 / side,) * 3
        sphere.location = (2.0 * (index % side + 0.5) / side - 1.0, 0.0, 2.0 * (index // side + 0.5) / side - 1.0)
        scene.collection.objects.link(sphere)
        sphere.material_slots[0].link = "OBJECT"
        sphere.material_slots[0].material = material(kind, f"Material {index}", color)
    bpy.data.objects.remove(stage.sphere)
    engines.use(scene, engine, 1)


def material(kind: str, name: str, color: tuple[float, ...]) -> bpy.types.Material:
    """Return a material of a kind of KINDS."""
    if kind in GROUPS:
        group, inputs = GROUPS[kind]
        return materials.create(name, group, **{"Base Color" if group is PRINCIPLED else "Color": color}, **inputs)
    if kind == DIFFUSE:
        made, node = materials.create_plain(name)
        node.inputs["Color"].default_value = color
        return made
    made = bpy.data.materials.new(name)
    made.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
    return made


def _small_sphere() -> bpy.types.Mesh:
    """Return a mesh of a sphere with an empty material slot."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=SEGMENTS, ring_count=SEGMENTS // 2)
    mesh = bpy.context.object.data
    bpy.data.objects.remove(bpy.context.object)
    mesh.materials.append(None)
    return mesh


def steps(used: Sequence[Engine], folder: Path, quick: bool) -> list[Step]:
    """Return a step for each engine and number of materials; files are written to `folder` and stay there."""

    def measure(engine: Engine, count: int) -> Iterator[Record]:
        files: dict[str, Path] = {}
        for kind in KINDS:
            build(kind, count, engine)
            files[kind] = folder / f"{engine.key} {count} {kind}.blend"
            bpy.ops.wm.save_as_mainfile(filepath=str(files[kind]), copy=True, compress=False)
        found: dict[str, list[dict[str, float]]] = {kind: [] for kind in KINDS}
        for turn in range(1 if quick else ROUNDS):
            for kind in KINDS[:: -1 if turn % 2 else 1]:
                found[kind].append(_clock(files[kind]))
        for kind in KINDS:
            values = {what: [each[what] for each in found[kind]] for what in found[kind][0]}
            numbers = {what: None if None in each else median(each) for what, each in values.items()}
            record: Record = {"engine": engine.key, "materials": count, "kind": kind}
            yield record | {"file": files[kind].stat().st_size, **numbers}

    counts = QUICK_COUNTS if quick else COUNTS
    return [Step(f"{engine.label}  {n} materials", partial(measure, engine, n), n + 20) for engine, n in product(used, counts)]


def _clock(file: Path) -> dict[str, float]:
    """Return what CLOCK measures of a file, in a new process."""
    binary = bpy.app.binary_path
    blender = [binary, "--background", "--factory-startup", str(file), "--python-expr", CLOCK]
    command = blender if binary else [sys.executable, "-c", CLOCK, str(file)]
    result = subprocess.run(command, env=dict(os.environ), capture_output=True, text=True, check=True)
    line = next(line for line in result.stdout.splitlines() if line.startswith("FOUND"))
    return json.loads(line.removeprefix("FOUND"))


def table(found: Sequence[Record]) -> Table:
    """Return a row for each engine, number and kind of material; renders also over those of the Diffuse BSDF."""
    columns = ("Engine", "Materials", "Kind", "Open", "First render", "Next render", "Frame change", "Memory", "File")
    base = {(record["engine"], record["materials"]): record for record in found if record["kind"] == DIFFUSE}

    def row(record: Record) -> tuple[str, ...]:
        plain = base[record["engine"], record["materials"]]

        def with_ratio(what: str) -> str:
            return f"{record[what]:.2f} s ({record[what] / plain[what]:.2f})"

        times = with_ratio("first"), with_ratio("later"), f"{1000.0 * record['frame']:.1f} ms"
        memory = "-" if record["memory"] is None else f"{record['memory'] / 1e6:.0f} MB"
        sizes = memory, f"{record['file'] / 1e6:.1f} MB"
        return record["engine"], str(record["materials"]), record["kind"], f"{record['open']:.2f} s", *times, *sizes

    return columns, [row(record) for record in found]
