# SPDX-License-Identifier: GPL-3.0-or-later
"""What leaving out saves, and that it leaves the picture: nodes, closures, first and later renders, before and after."""

import json
import math
import os
import shutil
import subprocess
import sys
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import bpy

from true_diffuse.addon import usd
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.optimize.materials import OptimizedNode, optimize_materials, restore_materials, total
from true_diffuse.scenes import five_characters
from true_diffuse.scenes.sphere import sphere_under_sun
from true_diffuse.scripts.characters import face

SAMPLES, PICTURE_SAMPLES = {EEVEE: 4, CYCLES: 32}, {EEVEE: 16, CYCLES: 256}
FIVE, FACE, SPHERE = (240, 90), (200, 80), 96  # pixels
ROUNDS = 2
WARM = 2  # renders after the first, in each process
# Renders a scene of a file in a process of its own, again and again, and prints the seconds of each
CLOCK = """
import bpy, json, sys, time
if not bpy.app.binary_path:
    bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
seconds = []
for _ in range({count}):
    start = time.perf_counter()
    bpy.ops.render.render(scene={scene!r})
    seconds.append(time.perf_counter() - start)
print("SECONDS", json.dumps(seconds), flush=True)
"""


@dataclass(frozen=True)
class Case:
    """What is rendered: the scene for each engine, one for both or one each, which then are rendered by one file."""

    name: str
    scenes: dict[Engine, bpy.types.Scene]


def cases(load: Callable[[], bpy.types.Mesh], folder: Path) -> Iterator[Case]:
    """Yield the cases, each in an empty file; `load` returns the human's mesh."""
    _empty_file()
    five = five_characters.build(load(), 0.8, True, FIVE).scene
    yield Case("five characters", {EEVEE: five, CYCLES: five})
    _empty_file()
    heads = face.build(load(), True, FACE).scene
    yield Case("face", {EEVEE: heads, CYCLES: heads})
    _empty_file()
    imported = _imported(folder / "character.usdc")
    yield Case("USD character", {EEVEE: imported, CYCLES: imported})
    _empty_file()
    yield Case("everything on", _everything())


def _empty_file() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)


def _imported(file: Path) -> bpy.types.Scene:
    """Return a scene that USD's importer filled: a monkey of skin."""
    stage = sphere_under_sun(SPHERE)
    bpy.ops.mesh.primitive_monkey_add()
    inputs = {**PRESETS["skin_2"].inputs, "Subsurface": 0.6}
    bpy.context.object.data.materials.append(materials.create("Skin", SUBSURFACE, **inputs))
    bpy.data.objects.remove(stage.sphere)
    bpy.ops.wm.usd_export(filepath=str(file), convert_world_material=False)
    _empty_file()
    bpy.ops.wm.usd_import(filepath=str(file))
    usd.report.take()
    scene = bpy.context.scene
    scene.camera = next(item for item in scene.objects if item.type == "CAMERA")
    scene.render.resolution_x = scene.render.resolution_y = SPHERE
    return scene


def _everything() -> dict[Engine, bpy.types.Scene]:
    """Return a scene for either engine, in units of their own, that show the same two balls: every socket is fed, OSL is on."""
    stage = sphere_under_sun(SPHERE)
    scene = stage.scene
    for x, group in ((-0.5, ROUGH_DIFFUSE), (0.5, SUBSURFACE)):
        material = materials.create(f"Everything, {group.name}", group)
        _feed(material.node_tree.nodes[group.name])
        ball = bpy.data.objects.new(group.name, stage.sphere.data)
        ball.location.x, ball.scale = x, (0.5, 0.5, 0.5)
        scene.collection.objects.link(ball)
        ball.material_slots[0].link, ball.material_slots[0].material = "OBJECT", material
    bpy.data.objects.remove(stage.sphere)
    other = scene.copy()
    other.unit_settings.scale_length = 0.5
    other.cycles.shading_system = compiles_osl()
    for engine, each in ((EEVEE, scene), (CYCLES, other)):
        engines.use(each, engine, SAMPLES[engine])
    return {EEVEE: scene, CYCLES: other}


def _feed(node: bpy.types.Node) -> None:
    """Link each socket of `node` but its menus to a node that gives the socket's own value; Normal to the surface's."""
    tree = node.id_data
    for socket in node.inputs:
        if socket.type == "MENU":
            continue
        if socket.name == "Normal":
            output = tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
        elif socket.type == "VECTOR":
            source = tree.nodes.new("ShaderNodeCombineXYZ")
            for part, value in zip(source.inputs, socket.default_value, strict=True):
                part.default_value = value
            output = source.outputs[0]
        else:
            output = tree.nodes.new("ShaderNodeRGB" if socket.type == "RGBA" else "ShaderNodeValue").outputs[0]
            output.default_value = socket.default_value
        tree.links.new(output, socket)


def work(used: Sequence[Engine]) -> int:
    """Return how many units of work `records` has: one for each render process, and one for the pictures."""
    return 1 + 4 * len(used) * (2 * ROUNDS + 1)


def records(load: Callable[[], bpy.types.Mesh], used: Sequence[Engine], folder: Path, progress: Progress) -> Iterator[Record]:
    """Yield a record for each case and engine; `load` returns the human's mesh, files are made in `folder` and stay there.

    `rms_difference` of the picture is a share of its RMS, Cycles' noise taken out by two takes of either; `noise` is what another
    seed changes. `first_seconds`, with the compilation of the materials, and `seconds` of a later render are medians, before and
    after taken in turns.
    """
    with progress.step("Blender's own shaders", 1.0):
        caches = _Caches(folder)
    for case in cases(load, folder):
        for engine in used:
            scene = case.scenes[engine]
            with progress.step(f"Pictures  {engine.label}  {case.name}", 1.0):
                restore_materials()
                width, height = scene.render.resolution_x, scene.render.resolution_y
                render.crop(scene, render.Region(1, 0, width - 1, height))  # EEVEE's other noise needs the column at the left
                engines.use(scene, engine, SAMPLES[engine])
                before = _saved(folder / "before.blend")
                whole = _takes(scene, engine)
                engines.use(scene, engine, SAMPLES[engine])
                found = optimize_materials()
                after = _saved(folder / "after.blend")
                least = _takes(scene, engine)
            turns: dict[Path, list[list[float]]] = {before: [], after: []}
            for _ in range(ROUNDS):
                for file, seconds in turns.items():
                    with progress.step(f"{engine.label}  {case.name}  {file.stem}", 1.0):
                        seconds.append(_clock(file, scene.name, caches.next()))
            yield {
                "scene": case.name,
                "engine": engine.key,
                "materials": len(found),
                "rms_difference": _difference(whole, least),
                "noise": error.difference(*whole, range(len(whole[0]) // 3)),
                **_counts("before", found),
                **_counts("after", found),
                **{
                    f"{what}_{file.stem}": median(value for run in seconds for value in run[part])
                    for file, seconds in turns.items()
                    for what, part in (("first_seconds", slice(0, 1)), ("seconds", slice(1, None)))
                },
            }


def _takes(scene: bpy.types.Scene, engine: Engine) -> tuple[array[float], array[float]]:
    """Return two pictures with noise of their own."""
    first, second = (render.radiance(scene, engine, PICTURE_SAMPLES[engine], seed)[1] for seed in (0, 1))
    return first, second


def _difference(whole: tuple[array[float], array[float]], least: tuple[array[float], array[float]]) -> float:
    """Return sqrt(sum (l_1 - w_1)(l_2 - w_2) / sum w_1 w_2), in which noise that two takes do not share cancels."""
    square = math.fsum((l1 - w1) * (l2 - w2) for w1, w2, l1, l2 in zip(*whole, *least, strict=True))
    return math.sqrt(max(0.0, square) / math.fsum(w1 * w2 for w1, w2 in zip(*whole, strict=True)))


def _counts(when: str, found: Sequence[OptimizedNode]) -> Record:
    count = total(found, when)
    return {f"nodes_{when}": count.nodes, f"closures_{when}": count.closures}


def _saved(file: Path) -> Path:
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    return file


class _Caches:
    """Keeps Mesa's shader cache from knowing a material: each process gets a copy of one that knows Blender's own shaders alone."""

    def __init__(self, folder: Path) -> None:
        self.own, self.copy = folder / "own_shaders", folder / "shaders"
        _empty_file()
        stage = sphere_under_sun(SPHERE)
        _scattering(stage.plain)
        engines.use(stage.scene, EEVEE, SAMPLES[EEVEE])
        _clock(_saved(folder / "own.blend"), stage.scene.name, self.own)

    def next(self) -> Path:
        """Return the folder for the next process."""
        shutil.rmtree(self.copy, ignore_errors=True)
        return shutil.copytree(self.own, self.copy)


def _scattering(material: bpy.types.Material) -> None:
    """Make `material` reflect, mirror and scatter below the surface, so that all of EEVEE's own shaders are needed."""
    tree = material.node_tree
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    principled.inputs["Subsurface Weight"].default_value = 0.5
    tree.links.new(principled.outputs[0], tree.get_output_node("EEVEE").inputs["Surface"])


def _clock(file: Path, scene: str, cache: Path) -> list[float]:
    """Return the seconds of each render of a scene in a new process, with `cache` for Mesa's shaders."""
    code, binary = CLOCK.format(count=1 + WARM, scene=scene), bpy.app.binary_path
    blender = [binary, "--background", "--factory-startup", str(file), "--python-expr", code]
    command = blender if binary else [sys.executable, "-c", code, str(file)]
    environment = os.environ | {"MESA_SHADER_CACHE_DIR": str(cache)}
    result = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    line = next(line for line in result.stdout.splitlines() if line.startswith("SECONDS"))
    return json.loads(line.removeprefix("SECONDS"))


def table(found: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people."""
    columns = ("Scene", "Engine", "Nodes", "Closures", "RMS difference", "Noise", "First render", "Later renders")
    return columns, [
        (
            record["scene"],
            record["engine"],
            f"{record['nodes_before']} -> {record['nodes_after']}",
            f"{record['closures_before']} -> {record['closures_after']}",
            f"{record['rms_difference']:.1e}",
            f"{record['noise']:.1e}",
            f"{record['first_seconds_before']:.2f} -> {record['first_seconds_after']:.2f} s",
            f"{record['seconds_before']:.2f} -> {record['seconds_after']:.2f} s",
        )
        for record in found
    ]
