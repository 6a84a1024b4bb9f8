# SPDX-License-Identifier: GPL-3.0-or-later
"""What optimizing materials saves, before and after: nodes, closures, first and later renders; and the pictures' difference."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import product
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
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.optimize.materials import optimize_materials
from true_diffuse.scenes import five_characters
from true_diffuse.scenes.elements import add
from true_diffuse.scenes.sphere import sphere_under_sun
from true_diffuse.scripts.characters import face
from true_diffuse.scripts.studies import noise
from true_diffuse.scripts.studies.study import Step, Table

SAMPLES, PICTURE_SAMPLES = {EEVEE: 4, CYCLES: 32}, {EEVEE: 16, CYCLES: 256}
FIVE, FACE, SPHERE = (240, 90), (200, 80), 96  # pixels
ROUNDS = 2
WARM = 2  # renders after the first, in each process
CLOSURES = ("ShaderNodeBsdf", "ShaderNodeSubsurface", "ShaderNodeEmission", "ShaderNodeScript")  # how their identifiers start
# Renders a scene of a file repeatedly in a new process, and prints the seconds of each render
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


def test_scenes(load: Callable[[], bpy.types.Mesh], folder: Path) -> dict[str, Callable[[], dict[Engine, bpy.types.Scene]]]:
    """Return what builds each test scene in an empty file, for each engine; `load` returns the human's mesh."""

    def both(scene: bpy.types.Scene) -> dict[Engine, bpy.types.Scene]:
        return {EEVEE: scene, CYCLES: scene}

    return {
        "five characters": lambda: both(five_characters.build(load(), 0.8, True, FIVE).scene),
        "face": lambda: both(face.build(load(), True, FACE).scene),
        "USD character": lambda: both(_imported(folder / "character.usdc")),
        "everything on": _everything,
    }


def empty_file() -> None:
    """Start from a file with nothing in it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


def _imported(file: Path) -> bpy.types.Scene:
    """Return a scene that was imported from USD: a monkey made of skin."""
    stage = sphere_under_sun(SPHERE)
    bpy.ops.mesh.primitive_monkey_add()
    inputs = {**PRESETS["skin_2"].inputs, "Subsurface": 0.6}
    bpy.context.object.data.materials.append(materials.create("Skin", SUBSURFACE, **inputs))
    bpy.data.objects.remove(stage.sphere)
    bpy.ops.wm.usd_export(filepath=str(file), convert_world_material=False)
    empty_file()
    bpy.ops.wm.usd_import(filepath=str(file))
    usd.report.take()
    scene = bpy.context.scene
    scene.camera = next(item for item in scene.objects if item.type == "CAMERA")
    scene.render.resolution_x = scene.render.resolution_y = SPHERE
    return scene


def _everything() -> dict[Engine, bpy.types.Scene]:
    """Return a scene for each engine, in different units, of the same two balls: every socket is linked and Cycles uses OSL."""
    stage = sphere_under_sun(SPHERE)
    scene = stage.scene
    for x, group in ((-0.5, ROUGH_DIFFUSE), (0.5, SUBSURFACE)):
        material = materials.create(f"Everything, {group.name}", group)
        _link_sockets(material.node_tree.nodes[group.name])
        ball = add(scene, group.name, stage.sphere.data)
        ball.location.x, ball.scale = x, (0.5, 0.5, 0.5)
        ball.material_slots[0].link, ball.material_slots[0].material = "OBJECT", material
    bpy.data.objects.remove(stage.sphere)
    scenes = {EEVEE: scene, CYCLES: scene.copy()}
    scenes[CYCLES].unit_settings.scale_length = 0.5
    scenes[CYCLES].cycles.shading_system = compiles_osl()
    for engine, own in scenes.items():
        engines.use(own, engine, SAMPLES[engine])
    return scenes


def _link_sockets(node: bpy.types.Node) -> None:
    """Link each socket of `node`, except menus, to a node with the socket's own value; Normal to the surface's normal."""
    tree = node.id_data
    for socket in node.inputs:
        if socket.type == "MENU":
            continue
        if socket.name == "Normal":
            output = tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
        elif socket.type == "VECTOR":
            source = tree.nodes.new("ShaderNodeCombineXYZ")
            for component, value in zip(source.inputs, socket.default_value, strict=True):
                component.default_value = value
            output = source.outputs[0]
        else:
            output = tree.nodes.new("ShaderNodeRGB" if socket.type == "RGBA" else "ShaderNodeValue").outputs[0]
            output.default_value = socket.default_value
        tree.links.new(output, socket)


def steps(load: Callable[[], bpy.types.Mesh], used: Sequence[Engine], folder: Path) -> list[Step]:
    """Return a step for each test scene and engine; `load` returns the human's mesh, files are written to `folder` and stay there.

    `rms_difference` is relative to the picture's RMS, without noise; `noise` is the difference that another seed makes.
    `first_seconds`, with the compilation of the materials, and `seconds` of a later render are medians, with renders before and
    after interleaved.
    """
    builders = test_scenes(load, folder)

    @cache
    def caches() -> _Caches:
        return _Caches(folder)

    def measure(name: str, engine: Engine) -> Iterator[Record]:
        shaders = caches()  # builds a file of its own
        empty_file()
        scene = builders[name]()[engine]
        width, height = scene.render.resolution_x, scene.render.resolution_y
        render.crop(scene, render.Region(1, 0, width - 1, height))  # EEVEE's other noise needs the column at the left
        engines.use(scene, engine, SAMPLES[engine])
        before, counts = _saved(folder / "before.blend"), _counts(scene, "before")
        original = _pair(scene, engine)
        engines.use(scene, engine, SAMPLES[engine])
        found = optimize_materials()
        after, counts = _saved(folder / "after.blend"), counts | _counts(scene, "after")
        optimized = _pair(scene, engine)
        pixels = range(len(original[0]) // 3)
        runs: dict[Path, list[list[float]]] = {before: [], after: []}
        for _ in range(ROUNDS):
            for file, seconds in runs.items():
                seconds.append(_clock(file, scene.name, shaders.next()))
        yield {
            "scene": name,
            "engine": engine.key,
            "materials": len(found),
            "rms_difference": noise.difference(optimized, original, pixels),
            "noise": error.difference(*original, pixels),
            **counts,
            **{
                f"{what}_{file.stem}": median(value for run in seconds for value in run[part])
                for file, seconds in runs.items()
                for what, part in (("first_seconds", slice(0, 1)), ("seconds", slice(1, None)))
            },
        }

    return [Step(f"{engine.label}  {name}", partial(measure, name, engine)) for name, engine in product(builders, used)]


def _pair(scene: bpy.types.Scene, engine: Engine) -> noise.Pair:
    """Return two pictures with independent noise."""
    first, second = (render.radiance(scene, engine, PICTURE_SAMPLES[engine], seed)[1] for seed in (0, 1))
    return first, second


def _counts(scene: bpy.types.Scene, when: str) -> Record:
    """Return how many nodes and closures of the scene's materials the engine gets, as Blender resolves groups and constants."""
    layer = scene.view_layers[0]
    layer.update()
    inlined = [
        bpy.types.InlineShaderNodes.from_material(each) for each in layer.depsgraph.ids if isinstance(each, bpy.types.Material)
    ]
    kinds = [node.bl_idname for each in inlined for node in each.node_tree.nodes]
    closures = sum(kind.startswith(CLOSURES) for kind in kinds)
    return {f"nodes_{when}": len(kinds), f"closures_{when}": closures}


def _saved(file: Path) -> Path:
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    return file


class _Caches:
    """Mesa's shader caches, each a copy of one with only Blender's own shaders, so that no process finds a material in it."""

    def __init__(self, folder: Path) -> None:
        self.own, self.copy = folder / "own_shaders", folder / "shaders"
        empty_file()
        stage = sphere_under_sun(SPHERE)
        _scattering(stage.plain)
        engines.use(stage.scene, EEVEE, SAMPLES[EEVEE])
        _clock(_saved(folder / "own.blend"), stage.scene.name, self.own)

    def next(self) -> Path:
        """Return the folder for the next process."""
        shutil.rmtree(self.copy, ignore_errors=True)
        return shutil.copytree(self.own, self.copy)


def _scattering(material: bpy.types.Material) -> None:
    """Give `material` diffuse, specular and subsurface closures, so that all of EEVEE's own shaders are needed."""
    tree = material.node_tree
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    principled.inputs["Subsurface Weight"].default_value = 0.5
    tree.links.new(principled.outputs[0], tree.get_output_node("EEVEE").inputs["Surface"])


def _clock(file: Path, scene: str, cache: Path) -> list[float]:
    """Return the seconds of each render of a scene in a new process, with `cache` as Mesa's shader cache."""
    code, binary = CLOCK.format(count=1 + WARM, scene=scene), bpy.app.binary_path
    blender = [binary, "--background", "--factory-startup", str(file), "--python-expr", code]
    command = blender if binary else [sys.executable, "-c", code, str(file)]
    environment = os.environ | {"MESA_SHADER_CACHE_DIR": str(cache)}
    result = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    line = next(line for line in result.stdout.splitlines() if line.startswith("SECONDS"))
    return json.loads(line.removeprefix("SECONDS"))


def table(found: Sequence[Record]) -> Table:
    """Return a row for each test scene and engine."""
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
