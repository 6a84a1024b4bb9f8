# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials in the realtime engine, against Cycles: layers, textures, normals, alpha; and what is said not to be drawn."""

import math
import random
from array import array
from collections.abc import Callable, Sequence
from itertools import product

import bpy

import bmesh
import pytest
from mathutils import Matrix, Vector

from support import scene_at_centers
from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.addon.realtime import not_drawn, shadows

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("registered", "driver", "empty_file")]

SIZE = 32  # pixels of an item
APART = 2.4  # m, between the middles of items
INTERIOR = 0.93  # of a ball's radius: beyond it the engines may see another side of an edge
SUN = Vector((0.5, -1.0, 0.6))


def ball(shown: bpy.types.Material) -> bpy.types.Mesh:
    mesh, solid = bpy.data.meshes.new("Ball"), bmesh.new()
    solid.loops.layers.uv.new("UVMap")
    bmesh.ops.create_uvsphere(solid, u_segments=64, v_segments=32, radius=1.0, calc_uvs=True)
    solid.to_mesh(mesh)
    solid.free()
    mesh.shade_smooth()
    mesh.materials.append(shown)
    return mesh


def panel(shown: bpy.types.Material) -> bpy.types.Mesh:
    """Return a square that faces the camera, whose UV map goes beyond the image on all sides."""
    mesh = bpy.data.meshes.new("Panel")
    mesh.from_pydata([(-1.2, 0.0, -1.2), (1.2, 0.0, -1.2), (1.2, 0.0, 1.2), (-1.2, 0.0, 1.2)], [], [(0, 1, 2, 3)])
    for place, corner in zip(
        mesh.uv_layers.new(name="UVMap").uv, [(-0.6, -0.3), (1.7, -0.3), (1.7, 1.5), (-0.6, 1.5)], strict=True
    ):
        place.vector = corner
    mesh.materials.append(shown)
    return mesh


def row(shown: Sequence[bpy.types.Material], item: Callable[[bpy.types.Material], bpy.types.Mesh] = ball) -> bpy.types.Scene:
    """Return a scene of items side by side, each of a material, under a sun; they do not shade each other."""
    scene = scene_at_centers(SIZE * len(shown), SIZE)
    for place, material in enumerate(shown):
        material.cycles.use_bump_map_correction = False  # which dims light at grazing angles, in Cycles alone
        made = bpy.data.objects.new("Item", item(material))
        made.location.x = APART * place
        made.visible_shadow = made.visible_diffuse = made.visible_glossy = False
        scene.collection.objects.link(made)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", APART * len(shown)
    camera.matrix_world = Matrix.Translation((APART * (len(shown) - 1) / 2.0, -9.0, 0.0)) @ Matrix.Rotation(math.pi / 2.0, 4, "X")
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.data.use_shadow = 3.0, 0.0, False
    sun.matrix_world = SUN.to_track_quat("Z", "Y").to_matrix().to_4x4()
    for made in (camera, sun):
        scene.collection.objects.link(made)
    scene.camera = camera
    return scene


def radiance(scene: bpy.types.Scene, engine: engines.Engine, samples: int = 1) -> array[float]:
    return render.radiance(scene, engine, samples)[1]


def errors(got: Sequence[float], expected: Sequence[float], count: int, radius: float = INTERIOR) -> list[float]:
    """Return the RMS difference of each item within a radius of its middle [m], over the RMS of what is expected."""
    found = []
    for item in range(count):
        difference = square = 0.0
        for y, x in product(range(SIZE), repeat=2):
            if math.dist((x + 0.5, y + 0.5), (SIZE / 2.0, SIZE / 2.0)) * APART / SIZE < radius:
                at = 3 * (y * SIZE * count + item * SIZE + x)
                difference += sum((a - b) ** 2 for a, b in zip(got[at : at + 3], expected[at : at + 3], strict=True))
                square += sum(b * b for b in expected[at : at + 3])
        found.append(math.sqrt(difference / square))
    return found


def principled(name: str = "Principled", **inputs: object) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket, value in inputs.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    return material


GOLD = {"Base_Color": (0.9, 0.5, 0.2, 1.0), "Metallic": 1.0}
LAYERS = {
    "default": {},
    "rough": {"Roughness": 1.0},
    "dense and tinted": {"IOR": 2.0, "Roughness": 0.4, "Specular_Tint": (0.5, 0.6, 1.0, 1.0)},
    "smooth metal": {**GOLD, "Roughness": 0.3},
    "rough metal of another edge": {**GOLD, "Roughness": 0.8, "Specular_Tint": (0.2, 0.9, 0.5, 1.0)},
    "half metal": {**GOLD, "Metallic": 0.5},
    "coat": {"Coat_Weight": 0.8, "Coat_Roughness": 0.3, "Coat_Tint": (0.9, 0.3, 0.2, 1.0)},
    "sheen": {"Sheen_Weight": 1.0, "Sheen_Roughness": 0.4},
    "anisotropic metal": {**GOLD, "Roughness": 0.4, "Anisotropic": 0.7, "Anisotropic_Rotation": 0.1},
    "light under a coat": {"Emission_Strength": 1.0, "Emission_Color": (1.0, 0.2, 0.1, 1.0), "Coat_Weight": 1.0},
    "rough diffuse": {"Diffuse_Roughness": 0.7},
    "several": {"Metallic": 0.3, "Coat_Weight": 0.5, "Sheen_Weight": 0.5, "Diffuse_Roughness": 0.5, "Emission_Strength": 0.2},
}
# RMS of each from Cycles, whose tables have 32 x 32 entries as ours, and which chooses among layers by chance
LAYER_ERROR = 0.01


def test_layers_under_a_sun_are_those_of_cycles() -> None:
    shown = [principled(name, **inputs) for name, inputs in LAYERS.items()]
    scene = row(shown)
    found = errors(radiance(scene, engines.REALTIME), radiance(scene, engines.CYCLES, 64), len(shown))
    assert max(found) < LAYER_ERROR, dict(zip(LAYERS, found, strict=True))


def test_layers_under_an_even_sky_are_those_of_cycles() -> None:
    """The noise of 64 samples is 0.8 %, that of 256 half of it."""
    names = [name for name in LAYERS if "anisotropic" not in name]
    shown = [principled(name, **LAYERS[name]) for name in names]
    scene = row(shown)
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 0.8, 0.6, 1.0)
    scene.cycles.max_bounces = 1  # without a bounce Cycles sees a part of the sky alone
    bpy.data.objects["Sun"].hide_render = True
    found = errors(radiance(scene, engines.REALTIME), radiance(scene, engines.CYCLES, 128), len(shown))
    assert max(found) < 0.015, dict(zip(names, found, strict=True))


# ---- images

dice = random.Random(3)


def noise_image(
    name: str, is_float: bool = False, is_data: bool = False, alpha: str = "STRAIGHT", size: int = 5
) -> bpy.types.Image:
    image = bpy.data.images.new(name, size, size, alpha=True, float_buffer=is_float, is_data=is_data)
    image.alpha_mode = alpha
    image.pixels[:] = [dice.random() if k % 4 < 3 else dice.choice((0.3, 0.6, 1.0)) for k in range(4 * size * size)]
    image.update()
    return image


def lamp(
    image: bpy.types.Image, extension: str = "REPEAT", interpolation: str = "Linear", reads_alpha: bool = False
) -> bpy.types.Material:
    """Return a material that emits the color of an image; with `reads_alpha` times its alpha."""
    material = bpy.data.materials.new(f"{image.name} {extension} {interpolation} {reads_alpha}")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    texture, emission, output = (nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Emission", "OutputMaterial"))
    texture.image, texture.extension, texture.interpolation = image, extension, interpolation
    links.new(texture.outputs["Color"], emission.inputs["Color"])
    if reads_alpha:
        links.new(texture.outputs["Alpha"], emission.inputs["Strength"])
    links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def test_images_are_sampled_as_in_cycles() -> None:
    image = noise_image("Packed", alpha="CHANNEL_PACKED")
    ways = list(product(("REPEAT", "EXTEND", "CLIP", "MIRROR"), ("Linear", "Closest", "Cubic")))
    shown = [lamp(image, *way) for way in ways]
    scene = row(shown, panel)
    found = errors(radiance(scene, engines.REALTIME), radiance(scene, engines.CYCLES), len(shown), math.inf)
    assert max(found) < 0.004, dict(zip(ways, found, strict=True))  # a driver holds 8 bits of linear color near black


# Where Blender gives both engines the same pixels
KINDS = [
    *((False, is_data, alpha) for is_data in (False, True) for alpha in ("STRAIGHT", "CHANNEL_PACKED", "NONE")),
    *((True, is_data, alpha) for is_data in (False, True) for alpha in ("PREMUL", "CHANNEL_PACKED", "NONE")),
    (True, False, "STRAIGHT"),
]


def test_alpha_of_images_is_as_in_cycles() -> None:
    """Color is multiplied by alpha unless Alpha is read, too, or the image is of data or packed channels."""
    cases = list(product(KINDS, (False, True)))
    shown = [lamp(noise_image(f"Image {k}", *kind), reads_alpha=reads) for k, (kind, reads) in enumerate(cases)]
    scene = row(shown, panel)
    found = errors(radiance(scene, engines.REALTIME), radiance(scene, engines.CYCLES), len(shown), math.inf)
    # Cycles multiplies bytes by alpha before it filters them, and rounds; times alpha once more for some
    assert max(found) < 0.01, dict(zip(cases, found, strict=True))


# ---- what feeds the inputs


def textured(kind: str) -> bpy.types.Material:
    """Return a Principled BSDF with an image in an input, or with a normal or a value that nodes compute."""
    material = principled(kind, Roughness=0.5)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    node = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    image = nodes.new("ShaderNodeTexImage")
    image.image = noise_image(kind, is_data=kind != "Base Color", alpha="NONE", size=8)
    image.interpolation = "Cubic"
    coordinates, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value, mapping.inputs["Rotation"].default_value = (1.5, 2.0, 1.0), (0.0, 0.0, 0.4)
    links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], image.inputs["Vector"])
    match kind:
        case "Normal Map":
            normal = nodes.new("ShaderNodeNormalMap")
            normal.inputs["Strength"].default_value = 0.3
            links.new(image.outputs["Color"], normal.inputs["Color"])
            links.new(normal.outputs["Normal"], node.inputs["Normal"])
        case "Bump":
            bump = nodes.new("ShaderNodeBump")
            bump.inputs["Strength"].default_value, bump.inputs["Distance"].default_value = 0.5, 0.1
            links.new(image.outputs["Color"], bump.inputs["Height"])
            links.new(bump.outputs["Normal"], node.inputs["Normal"])
        case "Tilt":
            tilt = nodes.new("ShaderNodeCombineXYZ")
            for axis, value in zip("XYZ", (0.4, -0.8, 0.4), strict=True):
                tilt.inputs[axis].default_value = value
            links.new(tilt.outputs["Vector"], node.inputs["Normal"])
        case "Generated" | "Object" | "Normal" | "Reflection":
            links.new(coordinates.outputs[kind], node.inputs["Base Color"])
        case "Ramp":
            ramp = nodes.new("ShaderNodeValToRGB")
            ramp.color_ramp.elements.new(0.4).color = (0.9, 0.2, 0.1, 1.0)
            links.new(image.outputs["Color"], ramp.inputs["Fac"])
            links.new(ramp.outputs["Color"], node.inputs["Base Color"])
        case _:
            links.new(image.outputs["Color"], node.inputs[kind])
    return material


FED = ("Base Color", "Roughness", "Metallic", "Emission Strength", "Coat Weight", "Diffuse Roughness", "Normal Map", "Bump", "Tilt")
FED += ("Generated", "Object", "Normal", "Reflection", "Ramp")


def test_what_feeds_an_input_is_as_in_cycles() -> None:
    """All in one picture; to 2 %, as bumps are finite differences over a tenth of a pixel in both engines."""
    shown = [textured(kind) for kind in FED]
    scene = row(shown)
    found = errors(radiance(scene, engines.REALTIME), radiance(scene, engines.CYCLES, 64), len(shown), 0.85)
    assert max(found) < 0.02, dict(zip(FED, found, strict=True))


def test_model_has_the_roughness_of_an_image_at_each_point() -> None:
    """Oren-Nayar's sigma from an image: the left half of a panel has one, the right half another, as two materials have them."""
    sigmas = (0.1, 0.6)
    mapped = materials.create("Mapped", ROUGH_DIFFUSE, Model="Oren-Nayar")
    image = bpy.data.images.new("Sigma", 2, 1, float_buffer=True, is_data=True)
    image.pixels[:] = [channel for sigma in sigmas for channel in (sigma, sigma, sigma, 1.0)]
    image.update()
    texture = mapped.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    mapped.node_tree.links.new(texture.outputs["Color"], mapped.node_tree.nodes[ROUGH_DIFFUSE.name].inputs["Roughness"])
    plain = [materials.create(f"Sigma {sigma}", ROUGH_DIFFUSE, Model="Oren-Nayar", Roughness=sigma) for sigma in sigmas]

    def halves(shown: bpy.types.Material) -> bpy.types.Mesh:
        mesh = panel(shown)
        for place, u in zip(mesh.uv_layers["UVMap"].uv, (0.0, 1.0, 1.0, 0.0), strict=True):
            place.vector = (u, 0.5)
        return mesh

    got = radiance(row([mapped, *plain], halves), engines.REALTIME)
    line = got[3 * 3 * SIZE * (SIZE // 2) :][: 9 * SIZE : 3]
    left, right = SIZE // 4, 3 * SIZE // 4
    # the coefficients are 32-bit floats of the shader on one side, of the CPU on the other; halves of images are exact to 2^-11
    assert line[left] == pytest.approx(line[SIZE + left], rel=1e-3) and line[right] == pytest.approx(
        line[2 * SIZE + right], rel=1e-3
    )
    assert line[left] != pytest.approx(line[right], rel=0.02)


# ---- alpha


def test_opacity_is_the_mean_over_samples() -> None:
    """Two panels, one behind the other, of opacities a and b: the alpha of the film is 1 - (1 - a) (1 - b)."""
    pairs = ((0.25, 0.0), (0.5, 0.5), (0.75, 0.4))
    shown = [principled(f"Alpha {front}", Alpha=front) for front, _ in pairs]
    behind = [principled(f"Alpha {back} behind", Alpha=back) for _, back in pairs]
    scene = row(shown, panel)
    for place, material in enumerate(behind):
        made = bpy.data.objects.new("Behind", panel(material))
        made.location = (APART * place, 1.0, 0.0)
        scene.collection.objects.link(made)
    engines.use(scene, engines.REALTIME, 64)
    _, channels = render._render(scene)
    alpha = render.interleaved(channels, "Combined", "A")
    for item, (front, back) in enumerate(pairs):
        inside = [alpha[y * SIZE * 3 + item * SIZE + x] for y in range(4, SIZE - 4) for x in range(4, SIZE - 4)]
        # 576 pixels of 64 samples: chance alone would give sqrt(.25 / 36864) = 0.003
        assert sum(inside) / len(inside) == pytest.approx(1.0 - (1.0 - front) * (1.0 - back), abs=0.01)


def test_shadow_of_a_transparent_panel_lets_its_part_of_the_light_through(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadows, "MAP_SIZE", 256)  # a graphics driver in software is slow with more
    white, half = principled("White", Specular_IOR_Level=0.0), principled("Half", Alpha=0.4)
    scene = row([white], panel)
    scene.objects["Sun"].data.use_shadow = True
    scene.objects["Sun"].matrix_world = Matrix.Rotation(math.pi / 2.0, 4, "X")  # from the camera
    shade = bpy.data.objects.new("Shade", panel(half))
    shade.location.y, shade.visible_camera = -1.0, False
    scene.collection.objects.link(shade)
    got = radiance(scene, engines.REALTIME, 64)
    inside = [got[3 * (y * SIZE + x)] for y in range(4, SIZE - 4) for x in range(4, SIZE - 4)]
    assert sum(inside) / len(inside) == pytest.approx(0.6 * 3.0 * 0.8 / math.pi, rel=0.02)


def test_back_is_culled_where_the_material_says_so() -> None:
    shown = [principled("Both"), principled("Culled")]
    shown[1].use_backface_culling = True
    scene = row(shown, panel)
    for item in (item for item in scene.objects if item.type == "MESH"):
        item.rotation_euler.z = math.pi
    engines.use(scene, engines.REALTIME, 1)
    _, channels = render._render(scene)
    alpha = render.interleaved(channels, "Combined", "A")
    middle = 2 * SIZE * (SIZE // 2) + SIZE // 2
    assert (alpha[middle], alpha[middle + SIZE]) == (1.0, 0.0)


# ---- what is said


def test_what_is_not_drawn_is_said_with_material_input_and_what_takes_its_place() -> None:
    glass = principled("Glass", Transmission_Weight=1.0)
    film = principled("Film", Thin_Film_Thickness=300.0)
    tiles = bpy.data.images.new("Tiles", 4, 4)
    tiles.source = "TILED"
    scene = row([glass, film, lamp(tiles)])
    radiance(scene, engines.REALTIME)
    said = not_drawn.messages(scene)
    for material, what, instead in (
        ("Glass", "refraction", "straight through"),
        ("Film", "Thin Film", "without it"),
        ("Tiles", "Tiles (tiled)", "instead"),
    ):
        assert any(line.startswith(material) and what in line and instead in line for line in said), said


def test_pixels_that_a_script_sets_are_drawn() -> None:
    image = noise_image("Painted", is_float=True, alpha="NONE")
    scene = row([lamp(image)], panel)
    radiance(scene, engines.REALTIME)
    image.pixels[:] = [0.25, 0.5, 1.0, 1.0] * 25
    image.update()
    assert list(radiance(scene, engines.REALTIME)[:3]) == pytest.approx([0.25, 0.5, 1.0], rel=1e-3)
