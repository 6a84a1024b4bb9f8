# SPDX-License-Identifier: GPL-3.0-or-later
"""What the rough models cost: operations and time of equation (1) in GLSL, and render time against Blender's own Diffuse BSDF."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from statistics import median

import bpy

import bmesh
import gpu
from mathutils import Matrix

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.blender.glsl import FULLSCREEN_VERTEX_SHADER, source, triangle
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, EEVEE_LOBES, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.scenes.elements import add, towards
from true_diffuse.scenes.five_characters import FiveCharacters
from true_diffuse.scenes.sphere import SphereUnderSun
from true_diffuse.scripts.studies.formulations import FORMS, Form
from true_diffuse.scripts.studies.study import Step, Table, text

SIZE, EVALUATIONS = 256, 200  # pixels each way, and evaluations in each
ROUNDS = 3
SIGMA = 0.33
FRAME = 256  # pixels across the sphere
FRAME_OF_FIVE = (400, 180)
AREA_LIGHTS = ((-3.0, -3.0, 4.0), (3.0, -2.0, 3.0), (0.0, 3.0, 4.0))  # m, in the textured scene
SAMPLES_OF_TEXTURED = {EEVEE: 16, CYCLES: 64}
SAMPLES = {EEVEE: 16, CYCLES: 32}
SAMPLES_OF_FIVE = {EEVEE: 16, CYCLES: 16}
ONE_LOBE = "One lobe"  # not a quality: Blender's Diffuse BSDF and, beside it, another one through Shader to RGB
ANOTHER = "Oren-Nayar 1994"  # a model that is compiled before another one's compile time is taken


def forms() -> Iterator[Record]:
    """Yield a record for each form: operations, and nanoseconds of one evaluation on the graphics driver, measured in turns.

    What an empty loop takes is subtracted. The last record is shaders/oren_nayar.glsl, whose dot products have twice the digits and
    which takes any input.
    """
    safe = Form(
        "shaders/oren_nayar.glsl", "return rho_over_pi * oren_nayar_radiance(oren_nayar_surface(n, e, vec3(1.0), vec2(a, b)), l).x;"
    )
    empty = Form("empty", "return n.x;")
    seconds = in_turns({form: partial(_seconds, _draw(form)) for form in (empty, *FORMS, safe)}, ROUNDS)
    loop = median(seconds[empty])
    for form in (*FORMS, safe):
        nanoseconds = 1e9 * (median(seconds[form]) - loop) / (SIZE * SIZE * EVALUATIONS)
        operations = None if form is safe else form.operations()
        yield {"target": "glsl", "form": form.name, "operations": operations, "nanoseconds": nanoseconds}


def in_turns[Key, Take](takes: Mapping[Key, Callable[[], Take]], rounds: int) -> dict[Key, list[Take]]:
    """Return what each of `takes` returns in each of the rounds, in which all take turns, every other one backwards.

    Each is called once before, which counts for nothing, as shaders are compiled then.
    """
    for take in takes.values():
        take()
    found: dict[Key, list[Take]] = {key: [] for key in takes}
    for turn in range(rounds):
        for key in list(takes)[:: -1 if turn % 2 else 1]:
            found[key].append(takes[key]())
    return found


def _seconds(do: Callable[[], object]) -> float:
    """Return how long something takes [s]."""
    start = time.perf_counter()
    do()
    return time.perf_counter() - start


def _draw(form: Form) -> Callable[[], None]:
    """Return a function that draws a picture whose every pixel evaluates `form` many times, and waits for it."""
    if bpy.app.background:
        gpu.init()
    info = gpu.types.GPUShaderCreateInfo()
    info.vertex_in(0, "VEC2", "position")
    info.fragment_out(0, "VEC4", "result")
    info.push_constant("FLOAT", "roughness")
    info.vertex_source(FULLSCREEN_VERTEX_SHADER)
    info.fragment_source(f"""{source("oren_nayar")}
{form.function()}
void main() {{
    vec3 l = vec3(gl_FragCoord.xy / {float(2 * SIZE)}, 0.5);
    float sum = 0.0;
    for (int k = 0; k < {EVALUATIONS}; k++) {{
        float turn = float(k) * 1e-3;
        sum += form(vec3(turn, 0.0, 1.0), l * (1.0 - turn * turn), vec3(0.3, turn, 0.7), roughness + turn, roughness, turn, 0.3);
    }}
    result = vec4(sum + roughness);
}}""")
    shader = gpu.shader.create_from_info(info)
    batch = triangle()
    target = gpu.types.GPUOffScreen(SIZE, SIZE, format="RGBA32F")

    def draw() -> None:
        with target.bind():
            shader.bind()
            shader.uniform_float("roughness", SIGMA)
            batch.draw(shader)
            gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, "FLOAT")

    return draw


@dataclass(frozen=True)
class TimedMaterial:
    """A material of the group, or ONE_LOBE, and how it is timed."""

    engine: Engine
    quality: str
    model: str
    shadows: bool = True
    osl: bool = False

    def create(self) -> bpy.types.Material:
        """Return a new material of it."""
        if self.quality == ONE_LOBE:
            return one_lobe()
        return materials.create(self.quality, ROUGH_DIFFUSE, Model=self.model, Quality=self.quality, Roughness=SIGMA)


TIMED_MATERIALS = (
    *(TimedMaterial(EEVEE, quality, "Oren-Nayar", shadows=False) for quality in (FAST, BALANCED, PRECISE, CHOSEN_LIGHTS)),
    TimedMaterial(EEVEE, PRECISE, "EON", shadows=False),
    TimedMaterial(EEVEE, ONE_LOBE, "Lambert", shadows=False),
    *(TimedMaterial(EEVEE, quality, "Oren-Nayar") for quality in (FAST, BALANCED, PRECISE)),
    *(TimedMaterial(CYCLES, BALANCED, model) for model in ("Oren-Nayar", "Fujii", "EON", "Cycles Diffuse")),
    TimedMaterial(CYCLES, CHOSEN_LIGHTS, "Oren-Nayar"),
    TimedMaterial(CYCLES, BALANCED, "Oren-Nayar", osl=True),
)


type Place = tuple[bpy.types.Scene, list[bpy.types.Object], Callable[[TimedMaterial, bpy.types.Material], float]]
"""A scene, its lights, and what returns how long a render of it in a material takes [s]."""


def steps(sphere: SphereUnderSun, five: FiveCharacters, used: Sequence[Engine]) -> list[Step]:
    """Return the step of `forms`, and one for each material and scene: its render time beside that of Blender's Diffuse BSDF.

    Both have the same roughness, and take turns. The sphere under its sun, filling the frame and without bounces, is little but the
    material; the five characters, and a textured monkey on a floor under three area lights, are what an artist renders.
    """
    own, node = materials.create_plain("Diffuse BSDF")
    node.inputs["Roughness"].default_value = SIGMA
    own_textured = own.copy()
    textured = TexturedScene(own_textured)
    places: dict[str, Place] = {
        "sphere": (sphere.scene, [sphere.sun], partial(_sphere_seconds, sphere)),
        "five characters": (five.scene, [five.key], partial(_five_seconds, five)),
        "textured": (textured.scene, textured.lights, textured.seconds),
    }

    def measure(timed: TimedMaterial, where: str) -> Iterator[Record]:
        scene, lights, seconds_of = places[where]
        chosen_lights.choose(lights)
        scene.cycles.shading_system = timed.osl
        material, other = timed.create(), own
        if where == "textured":
            other = own_textured
            textured.paint(material)
        is_new = where == "sphere" and not timed.shadows and timed.quality in EEVEE_LOBES
        compiling = _compile_seconds(partial(seconds_of, timed), timed, material) if is_new else None
        seconds = in_turns({each: partial(seconds_of, timed, each) for each in (material, other)}, ROUNDS)
        yield {
            "scene": where,
            "target": "osl" if timed.osl else "nodes",
            "engine": timed.engine.key,
            "quality": timed.quality,
            "model": timed.model,
            "shadows": timed.shadows,
            "render_seconds": median(seconds[material]),
            "own_seconds": median(seconds[other]),
            "compile_seconds": compiling,
            "ratio": median(a / b for a, b in zip(seconds[material], seconds[other], strict=True)),
        }

    return [Step("GLSL  equation (1)", forms)] * (EEVEE in used) + [
        Step(f"{timed.engine.label}  {timed.quality}  {timed.model}  {where}", partial(measure, timed, where))
        for timed, where in product(TIMED_MATERIALS, places)
        if timed.engine in used
    ]


def _compile_seconds(
    seconds_of: Callable[[bpy.types.Material], float], timed: TimedMaterial, material: bpy.types.Material
) -> float:
    """Return how much longer the first render of `material` takes than the second [s], after another of its quality."""
    seconds_of(replace(timed, model=ANOTHER).create())
    first = seconds_of(material)
    return first - seconds_of(material)


def one_lobe() -> bpy.types.Material:
    """Return a material of a Diffuse BSDF and, beside it, of another one through Shader to RGB, as each lobe of Precise is."""
    material, base = materials.create_plain(ONE_LOBE)
    tree = material.node_tree
    lobe, color, light, both = (
        tree.nodes.new(f"ShaderNode{name}") for name in ("BsdfDiffuse", "ShaderToRGB", "Emission", "AddShader")
    )
    for start, end in ((lobe, color), (color, light), (base, both)):
        tree.links.new(start.outputs[0], end.inputs[0])
    tree.links.new(light.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return material


class TexturedScene:
    """A monkey on a floor, both of one material with an image texture, under three area lights."""

    def __init__(self, material: bpy.types.Material) -> None:
        self.scene = bpy.data.scenes.new("Textured")
        self.image = bpy.data.images.new("Grid", FRAME, FRAME)
        self.image.generated_type = "COLOR_GRID"
        self.paint(material)
        grid = partial(bmesh.ops.create_grid, x_segments=1, y_segments=1, size=5.0)
        self.meshes = []
        for name, make in (("Monkey", bmesh.ops.create_monkey), ("Floor", grid)):
            shape = bmesh.new()
            shape.loops.layers.uv.new("UVMap")
            make(shape, calc_uvs=True)
            mesh = bpy.data.meshes.new(name)
            shape.to_mesh(mesh)
            shape.free()
            mesh.materials.append(material)
            self.meshes.append(mesh)
        monkey = add(self.scene, "Monkey", self.meshes[0])
        monkey.modifiers.new("Smooth", "SUBSURF").render_levels = 2
        add(self.scene, "Floor", self.meshes[1], Matrix.Translation((0.0, 0.0, -1.0)))
        self.lights = []
        for place in AREA_LIGHTS:
            light = bpy.data.lights.new("Area", "AREA")
            light.energy, light.size = 200.0, 1.5
            self.lights.append(add(self.scene, "Area", light, Matrix.Translation(place) @ towards(place)))
        self.scene.camera = add(self.scene, "Camera", bpy.data.cameras.new("Camera"))
        self.scene.camera.matrix_world = Matrix.Translation((0.0, -6.0, 2.5)) @ towards((0.0, -6.0, 2.0))
        self.scene.render.resolution_x = self.scene.render.resolution_y = FRAME

    def paint(self, material: bpy.types.Material) -> None:
        """Give the Color of the material's closures the image."""
        tree = material.node_tree
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = self.image
        for node in tree.nodes:
            if node.type in ("BSDF_DIFFUSE", "GROUP"):
                tree.links.new(texture.outputs["Color"], node.inputs["Color"])

    def seconds(self, timed: TimedMaterial, material: bpy.types.Material) -> float:
        """Return how long a render takes [s]."""
        for mesh in self.meshes:
            mesh.materials[0] = material
        self.scene.eevee.use_shadows = timed.shadows
        engines.use(self.scene, timed.engine, SAMPLES_OF_TEXTURED[timed.engine])
        return _seconds(partial(render.render, self.scene))


def _sphere_seconds(sphere: SphereUnderSun, timed: TimedMaterial, material: bpy.types.Material) -> float:
    return sphere.radiance(material, [sphere.sun], None, timed.engine, SAMPLES[timed.engine], timed.shadows)[0]


def _five_seconds(five: FiveCharacters, timed: TimedMaterial, material: bpy.types.Material) -> float:
    for character in five.characters:
        character.subject.material_slots[0].material = material
    five.scene.eevee.use_shadows = timed.shadows
    engines.use(five.scene, timed.engine, SAMPLES_OF_FIVE[timed.engine])
    return _seconds(partial(render.render, five.scene))


def table(records: Sequence[Record]) -> Table:
    """Return a row for each form and each material."""
    rows: list[tuple[str, ...]] = []
    for record in records:
        if "form" in record:
            operations = "-" if record["operations"] is None else str(record["operations"])
            rows.append(("GLSL", record["form"], operations, f"{record['nanoseconds']:.2f} ns", "", ""))
        else:
            what = f"{record['quality']}, {record['model']}{', OSL' if record['target'] == 'osl' else ''}"
            shadows = "shadows" if record["shadows"] else "no shadows"
            where = f"{record['engine']}, {record['scene']}"
            rows.append(
                (
                    where,
                    what,
                    shadows,
                    f"{record['render_seconds']:.2f} s",
                    f"{record['ratio']:.2f}",
                    text(record["compile_seconds"], ".1f"),
                )
            )
    return ("Where", "What", "Operations or shadows", "Time", "Over Blender's Diffuse", "Compile, s"), rows
