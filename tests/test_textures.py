# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's texture nodes: the reference against what Cycles renders of them, and the GLSL against the reference."""

import itertools
import math
import random
from pathlib import Path
from typing import NamedTuple

import bpy

import pytest

from true_diffuse.addon.blender.glsl import source
from true_diffuse.addon.material.expression import triple
from true_diffuse.addon.material.operations import OPERATIONS, Triple, Value
from true_diffuse.addon.material.textures import TEXTURES, Texture, operation_name
from true_diffuse.scripts.studies.glsl_values import evaluate_functions

# Of the reference from Cycles: rounding of values up to 10 in some ten steps of 32 bits. No pixel is left out: the coordinates are
# what Cycles has, to the last bit. Of GLSL from the reference: what the driver's sine and the rounding of phases add.
CYCLES_TOLERANCE, GLSL_TOLERANCE = 1e-5, 1e-4
SIDE, COLUMNS = 8, 16  # of a case's square in pixels; squares in a row of the picture
PIXEL = 0.29  # length of a pixel in the coordinates, of which each square has the same, around 0


class Case(NamedTuple):
    """An output of a texture node under values of its properties and sockets."""

    node: str
    output: str
    properties: dict[str, object]
    sockets: dict[str, object]

    @property
    def texture(self) -> Texture:
        return TEXTURES[self.node]

    @property
    def name(self) -> str:
        return operation_name(self.texture, self.properties, self.output)


def product(node: str, sockets: dict[str, object], /, **menus: tuple) -> list[Case]:
    """Return the cases of all combinations of menus, for each output."""
    return [
        Case(node, output, dict(zip(menus, choices, strict=True)), sockets)
        for choices in itertools.product(*menus.values())
        for output in TEXTURES[node].outputs
    ]


def first_outputs(node: str, sockets: dict[str, object], /, **menus: tuple) -> list[Case]:
    """Return the cases of the first output."""
    return product(node, sockets, **menus)[:: len(TEXTURES[node].outputs)]


DIMENSIONS = ("1D", "2D", "3D", "4D")
NOISE_TYPES = ("MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "HETERO_TERRAIN")
# Values that 32-bit floats do not hold exactly, a detail with a fraction, and one below the range.
NOISE = {"Scale": 1.7, "Detail": 2.6, "Roughness": 0.55, "Lacunarity": 2.1, "Offset": 0.8, "Gain": 1.3, "Distortion": 0.4}
COLORS = {"Color1": (0.8, 0.2, 0.1, 1.0), "Color2": (0.05, 0.3, 0.9, 1.0)}
BRICK = {
    **COLORS,
    **{"Mortar": (0.3, 0.2, 0.1, 1.0), "Scale": 1.2, "Mortar Size": 0.06, "Mortar Smooth": 0.7, "Bias": 0.1},
    **{"Brick Width": 0.55, "Row Height": 0.35},
}
VORONOI = {"Scale": 1.4, "Detail": 1.4, "Roughness": 0.6, "Lacunarity": 1.9, "Exponent": 0.7, "Smoothness": 0.8, "Randomness": 0.9}
VORONOI_MENUS = ("voronoi_dimensions", "feature", "distance", "normalize")
VORONOI_CASES = [
    Case("ShaderNodeTexVoronoi", output, dict(zip(VORONOI_MENUS, menus, strict=True)), VORONOI | {"Detail": detail})
    for output, detail, *menus in (
        # each feature in each number of dimensions, and each output of both
        ("Distance", 1.4, "1D", "F1", "EUCLIDEAN", True),
        ("Color", 1.4, "1D", "F2", "EUCLIDEAN", True),
        ("W", 1.4, "1D", "SMOOTH_F1", "EUCLIDEAN", True),
        ("Color", 1.4, "2D", "F1", "EUCLIDEAN", True),
        ("Position", 1.4, "2D", "F2", "EUCLIDEAN", True),
        ("Distance", 1.4, "2D", "SMOOTH_F1", "EUCLIDEAN", True),
        ("Position", 1.4, "3D", "F1", "EUCLIDEAN", True),
        ("Distance", 1.4, "3D", "F2", "EUCLIDEAN", True),
        ("Color", 1.4, "3D", "SMOOTH_F1", "EUCLIDEAN", True),
        ("W", 1.4, "4D", "F1", "EUCLIDEAN", True),
        ("Color", 0.0, "4D", "F2", "EUCLIDEAN", True),
        ("Position", 0.0, "4D", "SMOOTH_F1", "EUCLIDEAN", True),
        *(
            ("Distance", detail, f"{n}D", "DISTANCE_TO_EDGE", "EUCLIDEAN", detail > 0.0)
            for n in (1, 2, 3, 4)
            for detail in (0.0, 1.4)
        ),
        *(("Radius", 0.0, f"{n}D", "N_SPHERE_RADIUS", "EUCLIDEAN", False) for n in (1, 2, 3, 4)),
        # each metric
        *(("Distance", 0.0, "2D", "F1", metric, True) for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI")),
        *(("Color", 0.0, "3D", "F2", metric, False) for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI")),
        *(("Distance", 0.0, "3D", "SMOOTH_F1", metric, False) for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI")),
    )
]
CASES = [
    *product("ShaderNodeTexNoise", NOISE, noise_dimensions=DIMENSIONS, noise_type=("FBM",), normalize=(False,)),
    *first_outputs("ShaderNodeTexNoise", NOISE, noise_dimensions=DIMENSIONS, noise_type=("FBM",), normalize=(True,)),
    *first_outputs("ShaderNodeTexNoise", NOISE, noise_dimensions=DIMENSIONS, noise_type=NOISE_TYPES, normalize=(False,)),
    # to beyond a million, where the noise has repeated and changes
    *product(
        "ShaderNodeTexNoise",
        {"Scale": 300.0, "Detail": 15.0},
        noise_dimensions=("3D",),
        noise_type=("HYBRID_MULTIFRACTAL",),
        normalize=(True,),
    ),
    *first_outputs("ShaderNodeTexNoise", {"Detail": -1.0}, noise_dimensions=("2D",), noise_type=("FBM",), normalize=(True,)),
    *product("ShaderNodeTexWhiteNoise", {}, noise_dimensions=DIMENSIONS),
    *product("ShaderNodeTexChecker", COLORS | {"Scale": 0.7}),
    *product(
        "ShaderNodeTexGradient",
        {},
        gradient_type=("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"),
    ),
    *product("ShaderNodeTexMagic", {"Scale": 0.9, "Distortion": 1.2}, turbulence_depth=tuple(range(11))),
    *product("ShaderNodeTexMagic", {"Distortion": 0.0}, turbulence_depth=(0, 3)),
    *first_outputs(
        "ShaderNodeTexWave",
        {"Scale": 0.8, "Distortion": 1.3, "Detail": 1.5, "Detail Scale": 1.7, "Detail Roughness": 0.6, "Phase Offset": 0.7},
        wave_type=("BANDS", "RINGS"),
        bands_direction=("X",),
        rings_direction=("SPHERICAL",),
        wave_profile=("SIN", "SAW", "TRI"),
    ),
    *first_outputs(
        "ShaderNodeTexWave",
        {"Scale": 1.1},
        wave_type=("BANDS", "RINGS"),
        bands_direction=("X", "Y", "Z", "DIAGONAL"),
        rings_direction=("X", "Y", "Z", "SPHERICAL"),
        wave_profile=("SIN",),
    ),
    *VORONOI_CASES,
    VORONOI_CASES[5]._replace(sockets=VORONOI | {"Smoothness": 0.0, "Roughness": 0.0}),  # one octave of F1
    *product("ShaderNodeTexBrick", BRICK, offset_frequency=(0, 2, 3), squash_frequency=(2,), offset=(0.3,), squash=(0.7,)),
    *product(
        "ShaderNodeTexBrick",
        BRICK | {"Mortar Smooth": 0.0},
        offset_frequency=(2,),
        squash_frequency=(3,),
        offset=(0.5,),
        squash=(1.5,),
    ),
]
NODES = list(TEXTURES)
every_texture = pytest.mark.parametrize("node", NODES, ids=lambda node: TEXTURES[node].stem)


class Pixel(NamedTuple):
    """What Cycles reads and gives at a pixel's center."""

    vector: Triple
    w: float
    value: Triple


class Measured(NamedTuple):
    """A case as rendered: its pixels, what the reference gives at each, and the other arguments, as Blender's 32-bit floats."""

    case: Case
    pixels: list[Pixel]
    references: list[Triple]
    constants: dict[str, Value]


def references(case: Case, pixels: list[Pixel], constants: dict[str, Value]) -> list[Triple]:
    function = OPERATIONS[case.name].python
    given = [constants | {"Vector": pixel.vector, "W": pixel.w} for pixel in pixels]
    return [triple(function(*(values[name] for name in case.texture.arguments))) for values in given]


@pytest.fixture(scope="module")
def measured(tmp_path_factory) -> dict[str, list[Measured]]:
    """Every case by its node, from three pictures: of the textures and of the two coordinates that they read."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    folder = tmp_path_factory.mktemp("textures")
    materials = [texture_material(case) for case in CASES]
    scene = squares([material for material, _ in materials])
    overrides = (None, coordinate_material("Vector"), coordinate_material("W"))
    pictures = [render(scene, override, folder / f"{index}.exr") for index, override in enumerate(overrides)]
    found = {node: [] for node in NODES}
    for index, (case, (_, constants)) in enumerate(zip(CASES, materials, strict=True)):
        left, bottom = SIDE * (index % COLUMNS), SIDE * (index // COLUMNS)
        at = [(bottom + y) * SIDE * COLUMNS + left + x for y in range(SIDE) for x in range(SIDE)]
        pixels = [Pixel(pictures[1][i], pictures[2][i][0], pictures[0][i]) for i in at]
        found[case.node].append(Measured(case, pixels, references(case, pixels, constants), constants))
    return found


def squares(materials: list[bpy.types.Material]) -> bpy.types.Scene:
    """Return a scene whose camera sees a square for each material, SIDE pixels wide, in rows from the bottom left."""
    scene = bpy.context.scene
    rows = -(-len(materials) // COLUMNS)
    for index, material in enumerate(materials):
        left, bottom = SIDE * (index % COLUMNS), SIDE * (index // COLUMNS)
        mesh = bpy.data.meshes.new("Square")
        corners = [(x * SIDE / 2, y * SIDE / 2, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        mesh.materials.append(material)
        square = bpy.data.objects.new("Square", mesh)
        square.location = (left + SIDE / 2, bottom + SIDE / 2, 0.0)
        scene.collection.objects.link(square)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", SIDE * max(COLUMNS, rows)
    camera.location = (SIDE * COLUMNS / 2, SIDE * rows / 2, 1.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 1, False, False
    scene.cycles.filter_width = 0.01
    settings = scene.render
    settings.resolution_x, settings.resolution_y, settings.resolution_percentage = SIDE * COLUMNS, SIDE * rows, 100
    settings.image_settings.file_format, settings.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    return scene


def render(scene: bpy.types.Scene, override: bpy.types.Material | None, path: Path) -> list[tuple[float, float, float]]:
    """Return the picture's pixels from the bottom left, with one material on everything if there is an `override`."""
    scene.view_layers[0].material_override = override
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = image.pixels[:]
    return list(zip(values[::4], values[1::4], values[2::4], strict=True))


def emission(name: str) -> tuple[bpy.types.Material, dict[str, bpy.types.NodeSocket], bpy.types.NodeSocket]:
    """Return a new material, its coordinates Vector and W, which vary over a square, and the color that it emits."""
    material = bpy.data.materials.new(name)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader = nodes.new("ShaderNodeEmission")
    links.new(shader.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs[0])
    mapping = nodes.new("ShaderNodeMapping")
    mapping.inputs["Location"].default_value = (0.1, 0.2, 0.3)
    mapping.inputs["Rotation"].default_value = (0.6, 0.5, 0.4)
    mapping.inputs["Scale"].default_value = (PIXEL,) * 3
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Object"], mapping.inputs["Vector"])
    dot = nodes.new("ShaderNodeVectorMath")
    dot.operation = "DOT_PRODUCT"
    dot.inputs[1].default_value = (0.7, -0.9, 0.4)
    links.new(mapping.outputs[0], dot.inputs[0])
    return material, {"Vector": mapping.outputs[0], "W": dot.outputs["Value"]}, shader.inputs["Color"]


def coordinate_material(name: str) -> bpy.types.Material:
    material, coordinates, color = emission(name)
    material.node_tree.links.new(coordinates[name], color)
    return material


def texture_material(case: Case) -> tuple[bpy.types.Material, dict[str, Value]]:
    """Return a material that emits what the case's node gives, and the constants that the node has."""
    material, coordinates, color = emission(case.name)
    node = material.node_tree.nodes.new(case.node)
    for name, value in case.properties.items():
        setattr(node, name, value)
    sockets = {socket.identifier: socket for socket in node.inputs}
    for name, socket in coordinates.items():
        if name in sockets:
            material.node_tree.links.new(socket, sockets[name])
    for name, value in case.sockets.items():
        sockets[name].default_value = value
    material.node_tree.links.new(next(s for s in node.outputs if s.identifier == case.output), color)
    constants = {}
    for name in case.texture.arguments:
        if name not in coordinates:
            value = sockets[name].default_value if name in sockets else getattr(node, name)
            constants[name] = value if isinstance(value, (int, float)) else tuple(value)[:3]
    return material, constants


@pytest.mark.render
@every_texture
def test_reference_is_what_cycles_renders(node: str, measured: dict[str, list[Measured]]) -> None:
    for one in measured[node]:
        off = [(p, v) for p, v in zip(one.pixels, one.references, strict=True) if distance(p.value, v) > CYCLES_TOLERANCE]
        assert not off, (one.case.name, len(off), off[0])


@pytest.mark.render
@pytest.mark.usefixtures("driver")
@every_texture
def test_glsl_is_the_reference(node: str, measured: dict[str, list[Measured]]) -> None:
    texture = TEXTURES[node]
    for cases in itertools.batched(measured[node], 4, strict=False):  # a program of more takes longer to compile than several
        branches, rows = "", []
        for index, one in enumerate(cases):
            given = {name: literal(value) for name, value in one.constants.items()} | {"Vector": "vector", "W": "w"}
            call = OPERATIONS[one.case.name].glsl.format(*(given[name] for name in texture.arguments))
            branches += f"if (index == {index}) return vec3({call});\n"
            rows += [((*pixel.vector, pixel.w), (float(index),)) for pixel in one.pixels]
        functions = f"{source(texture.stem)}\nvec3 chosen(int index, vec3 vector, float w) {{ {branches} return vec3(0.0); }}"
        got = evaluate_functions(functions, "chosen(int(b.x), a.xyz, a.w)", rows)
        for one, values in zip(cases, itertools.batched(got, SIDE * SIDE, strict=True), strict=True):
            off = [pair for pair in zip(one.references, values, strict=True) if distance(*pair) > GLSL_TOLERANCE]
            assert not off, (one.case.name, len(off), off[0])


@pytest.mark.parametrize("name", ["noise_value(5D, FBM, True)", "noise_value(3D, FBM)", "gradient_fac()", "no_texture(3D)"])
def test_unknown_operation_raises(name: str) -> None:
    with pytest.raises(KeyError):
        OPERATIONS[name]


def literal(value: Value) -> str:
    return f"vec3{value!r}" if isinstance(value, tuple) else repr(float(value))


def distance(a: Triple, b: Triple) -> float:
    """Return the largest difference of a component."""
    return max(abs(x - y) for x, y in zip(a, b, strict=True))


HARD = (0.0, -0.0, 1.0, -1.0, 15.0, 1e-30, 1e30, math.inf, -math.inf, math.nan)


@pytest.mark.parametrize("case", {case.name: case for case in CASES}.values(), ids=lambda case: case.name)
def test_reference_has_a_value_for_any_input(case: Case) -> None:
    dice = random.Random(1)
    for _ in range(10):
        given = [
            tuple(dice.choices(HARD, k=3)) if name in ("Vector", "Color1", "Color2", "Mortar") else dice.choice(HARD)
            for name in case.texture.arguments
        ]
        value = OPERATIONS[case.name].python(*given)
        assert isinstance(value, {"number": float, "triple": tuple}[OPERATIONS[case.name].kind]), value
