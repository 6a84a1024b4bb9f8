# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters as they are: their meshes and materials in the five looks, and what of them is held against the models."""

import json
import math
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import bpy

import pytest
from mathutils import Vector

from support import assert_bad_input, run_script
from true_diffuse.addon.blender.engines import CYCLES
from true_diffuse.addon.material.closure_nodes import closures, trees
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP
from true_diffuse.addon.nodes.graph import key_and_version
from true_diffuse.scenes import five_characters, subject
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters import character
from true_diffuse.scripts.studies import five
from true_diffuse.scripts.studies.comparison import five as comparison

pytestmark = pytest.mark.usefixtures("empty_file")

compare = partial(run_script, "compare.py")
PROGRESS = SimpleNamespace(step=lambda _text, _work: nullcontext(), within=lambda _work: None)
# Linear colors of an image's two halves; as bytes they are exact
LEFT, RIGHT = (1.0, 0.2, 0.0), (0.0, 0.4, 1.0)
SIZE = (240, 120)


def image() -> bpy.types.Image:
    """An image whose left half has another color than the right, packed."""
    result = bpy.data.images.new("Paint", 4, 4, is_data=True)
    result.pixels = [value for _ in range(4) for color in (LEFT, LEFT, RIGHT, RIGHT) for value in (*color, 1.0)]
    result.pack()
    return result


def principled(name: str, **inputs: object) -> tuple[bpy.types.Material, bpy.types.Node]:
    material = bpy.data.materials.new(name)
    node = material.node_tree.nodes["Principled BSDF"]
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return material, node


def painted() -> bpy.types.Material:
    material, node = principled("Cloth", Roughness=0.5)
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image(), "Closest"
    material.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    return material


@pytest.fixture
def figure_file(tmp_path: Path) -> Path:
    """A .blend file: a ball in cloth on a flat-shaded metal cube, its child, moved by an armature's pose."""
    bpy.ops.object.armature_add()
    rig = bpy.context.object
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    cube = bpy.context.object
    cube.data.materials.append(principled("Metal", Metallic=1.0, Base_Color=(0.9, 0.6, 0.3, 1.0))[0])
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0.0, 0.0, 2.0))
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(None)
    ball.material_slots[0].link = "OBJECT"  # the object's material, not the mesh's
    ball.material_slots[0].material = painted()
    ball.parent = cube
    cube.parent, cube.parent_type, cube.parent_bone = rig, "BONE", "Bone"
    rig.pose.bones["Bone"].rotation_mode = "XYZ"
    rig.pose.bones["Bone"].rotation_euler.x = math.pi / 2
    path = tmp_path / "figure.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def load(path: Path) -> subject.Figure:
    return character.load_figures(path, (None,), pytest.fail)[None]


def test_figure_has_all_meshes_in_pose_with_their_materials_and_shading(figure_file: Path) -> None:
    figure = load(figure_file)
    assert [part.name for part in figure.parts] == ["Cube", "Sphere"]
    cube, ball = figure.parts
    assert [[material.name for material in part.mesh.materials] for part in figure.parts] == [["Metal"], ["Cloth"]]
    heights = [point.z for point in figure.points]
    assert min(heights) == pytest.approx(0.0, abs=1e-5) and max(heights) == pytest.approx(subject.HEIGHT, abs=1e-5)
    # A bone's Y axis is along it, here the world's Z: at rest the ball would be beside the cube. The pose puts it below.
    assert (ball.matrix.translation - cube.matrix.translation - Vector((0.0, 0.0, -2.0 * figure.scale))).length < 1e-5
    assert all(polygon.use_smooth for polygon in ball.mesh.polygons)
    assert not any(polygon.use_smooth for polygon in cube.mesh.polygons)
    assert not bpy.data.objects and len(bpy.data.scenes) == 1


def test_figure_keeps_slots_custom_normals_and_sheared_instances() -> None:
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.materials.append(principled("One")[0])
    plane.data.materials.append(None)
    plane.data.normals_split_custom_set([(0.6, 0.0, 0.8)] * 4)
    parts = bpy.data.collections.new("Parts")
    parts.objects.link(plane)
    bpy.context.scene.collection.objects.unlink(plane)
    plane.rotation_euler = (math.pi / 2, 0.4, 0.0)
    bpy.ops.object.collection_instance_add(collection="Parts")
    bpy.context.object.scale = (1.0, 3.0, 1.0)  # with the rotation inside: a shear
    figure = subject.character_figure(bpy.context.object, bpy.context.evaluated_depsgraph_get(), pytest.fail)
    (part,) = figure.parts
    assert [material and material.name for material in part.mesh.materials] == ["One", None]
    assert all((corner.vector - Vector((0.6, 0.0, 0.8))).length < 1e-3 for corner in part.mesh.corner_normals)
    stage = five_characters.build_as_is((figure,), SIZE)
    for shown in stage.characters:
        (item,) = shown.parts
        moved = shown.subject.matrix_world @ part.matrix
        assert [tuple(row) for row in item.matrix_world] == [pytest.approx(tuple(row), abs=1e-6) for row in moved]
        assert len(item.material_slots) == 2 and all(slot.material for slot in item.material_slots)


def nodes_of(material: bpy.types.Material) -> Iterator[bpy.types.Node]:
    return (node for tree in trees(material) for node in closures(tree))


def test_looks_differ_in_the_reflectance_model_alone(figure_file: Path) -> None:
    stage = five_characters.build_as_is((load(figure_file),), SIZE)
    assert stage.notes == ()
    specular, *others = stage.characters
    for shown in others:
        for part in shown.parts:
            (node,) = nodes_of(part.material_slots[0].material)
            assert key_and_version(node)[0] == PRINCIPLED.key
            roughness = node.inputs["Diffuse Roughness"].default_value
            assert (node.inputs["Model"].default_value, pytest.approx(roughness)) == (
                MODELS["lambert" if shown.look.name == "lambert" else "oren_nayar"].label,
                shown.look.inputs.get("Roughness", 0.0),
            )
            assert node.inputs["Metallic"].default_value == (part.name.startswith("Cube"))
            assert node.inputs["Base Color"].is_linked == part.name.startswith("Sphere")
    cube, ball = specular.parts
    (metal,) = nodes_of(cube.material_slots[0].material)
    assert key_and_version(metal)[0] == PRINCIPLED.key and metal.inputs["Metallic"].default_value == 1.0
    (cloth,) = nodes_of(ball.material_slots[0].material)
    assert key_and_version(cloth)[0] == SPECULAR_GROUP.key and cloth.inputs["Color"].is_linked
    # the reflectance of IOR 1.5 at normal incidence, and Beckmann's alpha^2 = 2 / (n + 2) for alpha = 0.5^2
    assert (cloth.inputs["Specular"].default_value, cloth.inputs["Exponent"].default_value) == pytest.approx((0.04, 30.0))


def test_own_materials_and_groups_stay_as_they_are() -> None:
    """Closures inside the artist's groups get the model in copies alone; a Rough Diffuse of the artist's gets it, too."""
    inner = bpy.data.node_groups.new("Skin", "ShaderNodeTree")
    inner.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    bsdf, end = inner.nodes.new("ShaderNodeBsdfDiffuse"), inner.nodes.new("NodeGroupOutput")
    inner.links.new(bsdf.outputs[0], end.inputs[0])
    material = bpy.data.materials.new("Skin")
    material.node_tree.nodes.remove(material.node_tree.nodes["Principled BSDF"])
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    material.node_tree.links.new(group.outputs[0], material.node_tree.nodes["Material Output"].inputs["Surface"])
    bpy.ops.mesh.primitive_cone_add()
    bpy.context.object.data.materials.append(material)
    figure = subject.character_figure(bpy.context.object, bpy.context.evaluated_depsgraph_get(), pytest.fail)
    stage = five_characters.build_as_is((figure,), SIZE)
    keys = [[key_and_version(node)[0] for node in nodes_of(one.parts[0].material_slots[0].material)] for one in stage.characters]
    assert keys == [[SPECULAR_GROUP.key]] + [[ROUGH_DIFFUSE.key]] * 4
    assert [node.bl_idname for node in inner.nodes] == ["ShaderNodeBsdfDiffuse", "NodeGroupOutput"]
    assert group.node_tree == inner and len(material.node_tree.nodes) == 2


def test_lengths_below_the_surface_grow_with_the_character() -> None:
    material, node = principled("Wax", Subsurface_Weight=1.0, Subsurface_Scale=0.05)
    bpy.ops.mesh.primitive_cube_add(size=0.18)  # a tenth of HEIGHT
    bpy.context.object.data.materials.append(material)
    figure = subject.character_figure(bpy.context.object, bpy.context.evaluated_depsgraph_get(), pytest.fail)
    stage = five_characters.build_as_is((figure,), SIZE)
    (wax,) = nodes_of(stage.characters[1].parts[0].material_slots[0].material)
    assert wax.inputs["Subsurface Scale"].default_value == pytest.approx(500.0, rel=1e-4)  # mm: ten times 0.05 m
    assert node.inputs["Subsurface Scale"].default_value == pytest.approx(0.05)


@pytest.mark.render
def test_pixels_have_their_own_albedo_and_metal_is_not_measured(figure_file: Path) -> None:
    stage = five_characters.build_as_is((load(figure_file),), SIZE)
    only = replace(stage, characters=(stage.characters[1], stage.characters[4]))
    references = five.references(only, PROGRESS)
    for reference in references:
        surface, coverage = reference.surface, reference.probed.coverage
        albedos = {
            tuple(round(value, 5) for value in surface.albedo[3 * pixel : 3 * pixel + 3]) for pixel in reference.expected.pixels
        }
        assert albedos == {LEFT, RIGHT}  # as bytes / 255, exactly
        assert 0.2 < coverage.diffuse / coverage.visible < 0.8  # the ball, not the cube
        assert len(reference.expected.pixels) > 300
    lambert, rough = five.measure(only, references, CYCLES, 1, PROGRESS)
    # Cycles' Diffuse BSDF is Lambert's model; the rest is where in the pixel filter, 0.01 pixels wide, a sample lies: from pixel to
    # pixel of a ball some 25 pixels in radius N turns by 1/25, in the filter so by 1e-4 and more at the rim
    assert lambert.errors.rms < 0.003
    assert rough.errors.rms < 0.01  # the promise for Cycles' lobes on smooth normals, 0.5 %, and the same
    record = five.record(lambert, 0.8)
    assert record["albedo"] is None and record["diffuse_fraction"] == pytest.approx(
        references[0].probed.coverage.diffuse / references[0].probed.coverage.visible
    )


@pytest.mark.render
def test_measured_is_a_surface_without_light_and_alpha() -> None:
    """Of four planes in a row, each a material of its own, that which is diffuse and opaque is measured alone."""
    inputs = [
        {"Base_Color": (0.5, 0.5, 0.5, 1.0)},
        {"Alpha": 0.5},
        {"Emission_Strength": 1.0},
        {"Transmission_Weight": 1.0},
    ]
    for index, values in enumerate(inputs):
        bpy.ops.mesh.primitive_plane_add(location=(2.0 * index, 0.0, 0.0), rotation=(0.0 if index else math.pi / 2, 0.0, 0.0))
        bpy.context.object.data.materials.append(principled(f"Plane {index}", **values)[0])
        bpy.context.object.parent = bpy.data.objects["Plane"] if index else None
    figure = subject.character_figure(bpy.data.objects["Plane"], bpy.context.evaluated_depsgraph_get(), pytest.fail)
    stage = five_characters.build_as_is((figure,), SIZE)
    (reference,) = five.references(replace(stage, characters=stage.characters[1:2]), PROGRESS)
    coverage = reference.probed.coverage
    assert coverage.diffuse / coverage.visible == pytest.approx(0.25, abs=0.03)  # planes some 12 pixels wide
    region = render.region_of(stage.scene, stage.characters[1].subject)
    assert {pixel % region.width < region.width / 2 for pixel in reference.expected.pixels} == {True}


@pytest.mark.render
def test_compare_shows_a_file_as_it_is(figure_file: Path, tmp_path: Path) -> None:
    options = "--engine cycles --samples 1 --resolution 160x60 --save-blend --out own"
    result = compare("--character", figure_file, *options.split(), cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    records = json.loads((tmp_path / "own" / "compare.json").read_text())["records"]
    assert len(records) == 5
    assert all(record["albedo"] is None and 0.0 < record["diffuse_fraction"] < 1.0 for record in records)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "own" / "five.blend"))
    shown = [item for item in bpy.context.scene.objects if item.parent]
    assert len(shown) == 10 and not any("measured" in item.material_slots[0].material.name for item in shown)


@pytest.mark.parametrize("plaster", [False, True])
def test_plaster_is_one_mesh_in_one_color(figure_file: Path, plaster: bool) -> None:
    spec = comparison.JobSpec(
        characters={"figure": str(figure_file)},
        engines=(CYCLES.key,),
        samples={CYCLES.key: 1},
        resolution=SIZE,
        sigmas=(0.33,),
        albedo=0.8,
        full_figure=False,
        plaster=plaster,
        configurations={},
    )
    scene = comparison.Renderer(spec, [CYCLES]).build("figure", (None,))
    shown = [item for item in scene.objects if item.type == "MESH" and item.name != "Backdrop"]
    assert len(shown) == (3 if plaster else 6)
    assert any(ALBEDO_ATTRIBUTE in item.data.color_attributes for item in shown) == plaster


def test_albedo_is_of_plaster(figure_file: Path, tmp_path: Path) -> None:
    assert_bad_input(compare("--character", figure_file, "--albedo", "0.5", cwd=tmp_path), "compare.py: error: ")


@pytest.mark.parametrize("exists", [True, False])
def test_image_beside_a_blend_file_is_found_or_its_lack_is_one_line(figure_file: Path, tmp_path: Path, exists: bool) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(figure_file))
    (paint,) = (one for one in bpy.data.images if one.name == "Paint")
    textures = tmp_path / "textures"
    textures.mkdir()
    paint.file_format = "PNG"
    paint.save(filepath=str(textures / "paint.png"))
    paint.unpack(method="REMOVE")
    paint.source, paint.filepath = "FILE", "//textures/paint.png"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "beside.blend"), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if exists:
        load(tmp_path / "beside.blend")
        (paint,) = (one for one in bpy.data.images if one.name == "Paint")
        assert tuple(paint.size) == (4, 4)  # read from its file
        return
    (textures / "paint.png").unlink()
    with pytest.raises(character.CharacterError, match=r"paint\.png, which does not exist"):
        load(tmp_path / "beside.blend")
