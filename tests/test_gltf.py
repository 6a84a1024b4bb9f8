# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF: our materials as Blender's exporter writes them."""

import json
import struct
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

import pytest

from support import Layout, show
from true_diffuse.addon import gltf, glTF2ExportUserExtension, models
from true_diffuse.addon.blender import fcurves, properties, report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.scripts.web import WebError, validator

ROOT = Path(__file__).resolve().parent.parent
COLOR = (0.9, 0.5, 0.1, 1.0)


@contextmanager
def empty_with_hook() -> Generator[None]:
    """Have a file with nothing in it, and the extension among the add-ons that the exporter asks."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon = bpy.context.preferences.addons.new()
    addon.module = "true_diffuse"
    properties.register()
    assert sys.modules["true_diffuse"].glTF2ExportUserExtension is glTF2ExportUserExtension
    report.take()
    yield
    properties.unregister()
    bpy.context.preferences.addons.remove(addon)


@pytest.fixture(autouse=True)
def hook() -> Iterator[None]:
    with empty_with_hook():
        yield


def rough(model: str, **inputs: object) -> bpy.types.Material:
    return materials.create(model, ROUGH_DIFFUSE, **{"Model": model, "Roughness": 0.4, "Color": COLOR} | inputs)


def image_node(material: bpy.types.Material, name: str, color: tuple[float, ...] = (0.5, 0.5, 0.5, 1.0)) -> bpy.types.Node:
    """Return a new node in `material` with a new packed image of that name and color."""
    image = bpy.data.images.new(name, 4, 4)
    image.pixels.foreach_set(color * 16)
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def link_image(material: bpy.types.Material, socket: str, name: str) -> bpy.types.Node:
    """Link a new image to `socket` of our group; returns the image node."""
    node = image_node(material, name)
    material.node_tree.links.new(node.outputs["Color"], group_node(material)[0].inputs[socket])
    return node


def occlusion_node(material: bpy.types.Material) -> bpy.types.Node:
    """Add the group, linked to nothing, that Blender's glTF importer adds for an occlusion map or a thickness."""
    from io_scene_gltf2.blender.com.material_helpers import create_settings_group, get_gltf_node_name

    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = bpy.data.node_groups.get(get_gltf_node_name()) or create_settings_group(get_gltf_node_name())
    return node


def export(path: Path, **options: object) -> dict:
    """Return the JSON of a binary glTF file."""
    assert bpy.ops.export_scene.gltf(filepath=str(path), **options) == {"FINISHED"}
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])


def errors(*files: Path) -> list[validator.Message]:
    """Return the errors that Khronos' validator finds; without it the test is skipped, after what it has asserted before."""
    try:
        found = validator.messages(files)
    except WebError as error:
        pytest.skip(f"glTF files are not validated: {error}")
    return [message for of_file in found for message in of_file if message.severity is validator.Severity.ERROR]


def test_the_validator_finds_errors(tmp_path: Path) -> None:
    (tmp_path / "wrong.gltf").write_text('{"asset": {"version": "2.0"}, "materials": [{"alphaMode": "HALF"}], "scene": 3}')
    assert errors(tmp_path / "wrong.gltf")


def by_name(document: dict) -> dict[str, dict]:
    """Return the materials with everything that an index of a texture stands for in its place, and attributes of the mesh."""

    def resolved(value: object, key: str = "") -> object:
        if isinstance(value, list):
            return [resolved(item) for item in value]
        if not isinstance(value, dict):
            return value
        found = {name: resolved(item, name) for name, item in value.items()}
        if key.endswith("Texture"):
            texture = document["textures"][found.pop("index")]
            found["image"] = document["images"][texture["source"]]["name"]
            found["sampler"] = document["samplers"][texture["sampler"]]
        return found

    materials = {material["name"]: resolved(material) for material in document["materials"]}
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            name = document["materials"][primitive["material"]]["name"]
            materials[name]["attributes"] = sorted(primitive["attributes"])
    return materials


type Build = Callable[[bpy.types.Material, bpy.types.Node], None]
BUILDS: dict[str, Build] = {}


def build(function: Build) -> Build:
    """Make a function that links something to a Principled BSDF one of the materials that are exported before and after."""
    BUILDS[function.__name__] = function
    return function


def add(material: bpy.types.Material, kind: str, *inputs: object, **settings: object) -> bpy.types.Node:
    """Return a new node with settings; inputs, by order, are values or outputs, None to leave one alone."""
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    for name, value in settings.items():
        setattr(node, name, value)
    for socket, value in zip([socket for socket in node.inputs if socket.enabled], inputs, strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            material.node_tree.links.new(value, socket)
        elif value is not None:
            socket.default_value = value
    return node


def times(material: bpy.types.Material, first: object, second: object) -> bpy.types.NodeSocket:
    """Return the output of a Mix node that multiplies two colors, as Blender's importer makes them."""
    node = add(material, "Mix", 1.0, first, second, data_type="RGBA", blend_type="MULTIPLY")
    return next(socket for socket in node.outputs if socket.enabled)


def link(principled: bpy.types.Node, socket: str, output: bpy.types.NodeSocket) -> None:
    principled.id_data.links.new(output, principled.inputs[socket])


@build
def plain(_material, principled):
    principled.inputs["Base Color"].default_value = COLOR
    principled.inputs["Roughness"].default_value = 0.3
    principled.inputs["IOR"].default_value = 1.4


@build
def base_color(material, principled):
    link(principled, "Base Color", image_node(material, "base_color").outputs["Color"])


@build
def tint(material, principled):
    link(principled, "Base Color", times(material, image_node(material, "tint").outputs["Color"], COLOR))


@build
def tint_and_named_color(material, principled):
    color = times(material, image_node(material, "tint and color").outputs["Color"], COLOR)
    link(principled, "Base Color", times(material, color, add(material, "VertexColor", layer_name="second").outputs["Color"]))


@build
def unnamed_color(material, principled):
    link(principled, "Base Color", add(material, "VertexColor").outputs["Color"])


@build
def attribute_color(material, principled):
    link(principled, "Base Color", add(material, "Attribute", attribute_name="second").outputs["Color"])


@build
def second_uv_map(material, principled):
    node = image_node(material, "second UV")
    material.node_tree.links.new(add(material, "UVMap", uv_map="Second").outputs["UV"], node.inputs["Vector"])
    link(principled, "Base Color", node.outputs["Color"])


@build
def texture_transform(material, principled):
    node = image_node(material, "transform")
    place = add(
        material,
        "Mapping",
        add(material, "UVMap", uv_map="Second").outputs["UV"],
        (0.1, 0.2, 0.0),
        (0.0, 0.0, 0.5),
        (2.0, 3.0, 1.0),
    )
    material.node_tree.links.new(place.outputs["Vector"], node.inputs["Vector"])
    node.extension, node.interpolation = "MIRROR", "Closest"
    link(principled, "Base Color", node.outputs["Color"])


@build
def roughness_texture(material, principled):
    link(
        principled, "Roughness", add(material, "SeparateColor", image_node(material, "roughness").outputs["Color"]).outputs["Green"]
    )


@build
def roughness_factor(material, principled):
    green = add(material, "SeparateColor", image_node(material, "factor").outputs["Color"]).outputs["Green"]
    link(principled, "Roughness", add(material, "Math", green, 0.7, operation="MULTIPLY").outputs["Value"])


@build
def packed_with_occlusion(material, principled):
    image = image_node(material, "orm", (0.5, 0.4, 0.0, 1.0))
    separate = add(material, "SeparateColor", image.outputs["Color"])
    link(principled, "Roughness", separate.outputs["Green"])
    link(principled, "Metallic", separate.outputs["Blue"])
    material.node_tree.links.new(separate.outputs["Red"], occlusion_node(material).inputs["Occlusion"])


@build
def metal(_material, principled):
    principled.inputs["Metallic"].default_value = 0.7


@build
def normal_map(material, principled):
    image = image_node(material, "normal", (0.5, 0.5, 1.0, 1.0))
    image.image.colorspace_settings.name = "Non-Color"
    link(principled, "Normal", add(material, "NormalMap", 0.6, image.outputs["Color"], uv_map="Second").outputs["Normal"])


@build
def emission(material, principled):
    link(principled, "Emission Color", image_node(material, "emission").outputs["Color"])
    principled.inputs["Emission Strength"].default_value = 3.0


@build
def alpha_blend(material, principled):
    image = image_node(material, "blend")
    link(principled, "Base Color", image.outputs["Color"])
    link(principled, "Alpha", image.outputs["Alpha"])


@build
def alpha_mask(material, principled):
    image = image_node(material, "mask")
    link(principled, "Base Color", image.outputs["Color"])
    below = add(material, "Math", image.outputs["Alpha"], 0.3, operation="LESS_THAN").outputs["Value"]
    link(principled, "Alpha", add(material, "Math", 1.0, below, operation="SUBTRACT").outputs["Value"])


@build
def alpha_value(material, principled):
    principled.inputs["Alpha"].default_value = 0.25
    material.use_backface_culling = True


@build
def specular(_material, principled):
    principled.inputs["Specular IOR Level"].default_value = 0.2
    principled.inputs["Specular Tint"].default_value = (1.0, 0.8, 0.6, 1.0)


@build
def specular_texture(material, principled):
    link(principled, "Specular IOR Level", image_node(material, "specular").outputs["Alpha"])
    link(principled, "Specular Tint", image_node(material, "specular tint").outputs["Color"])


@build
def coat(material, principled):
    principled.inputs["Coat Weight"].default_value = 0.5
    principled.inputs["Coat Roughness"].default_value = 0.2
    image = image_node(material, "coat normal", (0.5, 0.5, 1.0, 1.0))
    link(principled, "Coat Normal", add(material, "NormalMap", None, image.outputs["Color"]).outputs["Normal"])


@build
def coat_texture(material, principled):
    separate = add(material, "SeparateColor", image_node(material, "coat").outputs["Color"])
    link(principled, "Coat Weight", separate.outputs["Red"])
    link(principled, "Coat Roughness", separate.outputs["Green"])


@build
def sheen(material, principled):
    principled.inputs["Sheen Weight"].default_value = 1.0
    link(principled, "Sheen Tint", image_node(material, "sheen").outputs["Color"])


@build
def transmission_and_volume(material, principled):
    principled.inputs["Transmission Weight"].default_value = 0.9
    principled.inputs["IOR"].default_value = 1.33
    absorption = add(material, "VolumeAbsorption", (0.2, 0.5, 0.9, 1.0), 2.0)
    output = material.node_tree.get_output_node("ALL")
    material.node_tree.links.new(absorption.outputs["Volume"], output.inputs["Volume"])
    occlusion_node(material).inputs["Thickness"].default_value = 0.1


@build
def anisotropy(material, principled):
    principled.inputs["Anisotropic"].default_value = 0.4
    principled.inputs["Anisotropic Rotation"].default_value = 0.2
    link(principled, "Tangent", add(material, "Tangent", direction_type="UV_MAP").outputs["Tangent"])


def native(name: str) -> bpy.types.Material:
    """Return a new material of a Principled BSDF that the function of that name has linked."""
    material = bpy.data.materials.new(name)
    BUILDS[name](material, material.node_tree.nodes["Principled BSDF"])
    return material


def detailed(item: bpy.types.Object) -> None:
    """Give an object a second UV map and two color attributes."""
    item.data.uv_layers.new(name="Second")
    for name in ("first", "second"):
        item.data.color_attributes.new(name, "BYTE_COLOR", "CORNER")


def lost(before: object, after: object) -> object:
    """Return what of `before` is not in `after`, without the base color's factor; None where nothing is."""
    if isinstance(before, dict) and isinstance(after, dict):
        parts = {key: lost(value, after.get(key)) for key, value in before.items() if key != "baseColorFactor"}
        return {key: part for key, part in parts.items() if part is not None} or None
    same = before == (pytest.approx(after, abs=1e-6) if isinstance(after, (float, list)) else after)
    return None if same else f"{before} became {after}"


def test_nothing_is_lost_that_the_unconverted_material_has(tmp_path: Path) -> None:
    made = [native(name) for name in BUILDS]
    for material in made:
        detailed(show(material))
    options = {"export_tangents": True}
    before = by_name(export(tmp_path / "before.glb", **options))
    convert_materials(made, 1.0)
    report.take()
    after = by_name(export(tmp_path / "after.glb", **options))
    assert {name: part for name in BUILDS if (part := lost(before[name], after[name]))} == {}


def test_the_validator_finds_no_error_in_converted_materials(tmp_path: Path) -> None:
    made = [native(name) for name in BUILDS]
    convert_materials(made, 1.0)
    for material in made:
        detailed(show(material))
    options = {"export_tangents": True, "export_unused_textures": True, "export_unused_images": True}
    export(tmp_path / "one.glb", export_tangents=True)
    export(tmp_path / "all.glb", **options)
    files = [tmp_path / "one.glb", tmp_path / "all.glb", tmp_path / "parts.gltf"]
    bpy.ops.export_scene.gltf(filepath=str(files[2]), export_format="GLTF_SEPARATE", **options)
    assert errors(*files) == []


def test_the_file_is_as_it_was_after_an_export_and_after_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from io_scene_gltf2.blender.exp import export as exporter
    from io_scene_gltf2.blender.exp.material import materials as gathered

    material = rough("EON")
    link_image(material, "Color", "base")
    show(material)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))

    def state() -> tuple:
        nodes = [(node.name, node.bl_idname, len(node.inputs)) for node in material.node_tree.nodes]
        links = [(link.from_socket.path_from_id(), link.to_socket.path_from_id()) for link in material.node_tree.links]
        functions = exporter.save, gathered.BlenderMaterialIndentifier
        return list(bpy.data.materials), list(bpy.data.node_groups), bpy.data.is_dirty, nodes, links, functions

    before = state()
    export(tmp_path / "one.glb")
    assert state() == before

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(exporter.gltf2_blender_gather, "gather_gltf2", fail)
    with pytest.raises((KeyboardInterrupt, RuntimeError)):
        export(tmp_path / "two.glb")
    assert state() == before


@pytest.mark.parametrize("unused", [False, True])
def test_what_is_inside_our_groups_is_no_emission(unused: bool, tmp_path: Path) -> None:
    for quality in ("Balanced", "Precise"):
        for has_occlusion in (False, True):
            material = rough("EON", Quality=quality)
            material.name = f"{quality} {has_occlusion}"
            link_image(material, "Color", "base")
            if has_occlusion:
                output = image_node(material, "occlusion").outputs["Color"]
                material.node_tree.links.new(output, occlusion_node(material).inputs["Occlusion"])
            show(material)
    document = export(tmp_path / "one.glb", export_unused_textures=unused)
    assert len(document["materials"]) == 4
    for written in document["materials"]:
        assert "emissiveFactor" not in written and "emissiveTexture" not in written
        assert "KHR_materials_emissive_strength" not in written["extensions"]
        assert "baseColorTexture" in written["pbrMetallicRoughness"]
        assert ("occlusionTexture" in written) == written["name"].endswith("True")


@pytest.mark.parametrize("albedo", [1.0, 0.7])
def test_a_color_attribute_is_written_with_its_factor(albedo: float, tmp_path: Path) -> None:
    material = rough("Lambert")
    materials.paint(material, group_node(material)[0].inputs["Color"], "second", albedo)
    detailed(show(material))
    written = by_name(export(tmp_path / "one.glb"))["Lambert"]
    assert "COLOR_0" in written["attributes"] and report.take() == []
    assert written["pbrMetallicRoughness"].get("baseColorFactor", [1.0] * 4) == pytest.approx([albedo] * 3 + [1.0])


def test_animation_is_said_or_written_and_stays(tmp_path: Path) -> None:
    material = bpy.data.materials.new("Moving")
    convert_materials([material], 1.0)
    node = group_node(material)[0]
    for frame, metallic in ((1, 0.25), (11, 0.75)):
        node.inputs["Metallic"].default_value = metallic
        node.inputs["Metallic"].keyframe_insert("default_value", frame=frame)
    show(material)
    bpy.context.scene.frame_set(1)
    curve = fcurves.of_node(material.node_tree, node)[0]
    before = curve.data_path
    written = by_name(export(tmp_path / "still.glb", export_animations=False, export_current_frame=True))["Moving"]
    assert written["pbrMetallicRoughness"]["metallicFactor"] == pytest.approx(0.25)
    assert report.take() == [
        "True Diffuse: Moving: Metallic: animation (Principled BSDF) is not supported, the value at frame 1 is written"
    ]
    options = {"export_animation_mode": "SCENE", "export_pointer_animation": True}
    document = export(tmp_path / "moving.glb", **options)
    targets = [channel["target"] for animation in document["animations"] for channel in animation["channels"]]
    pointers = [target["extensions"]["KHR_animation_pointer"]["pointer"] for target in targets if target["path"] == "pointer"]
    assert pointers == ["/materials/0/pbrMetallicRoughness/metallicFactor"]
    assert report.take() == []
    assert curve.data_path == before and fcurves.of_node(material.node_tree, node) == [curve]


def albedos(material: dict) -> list[float]:
    """Return the average albedo of each channel of a written material's diffuse reflection, EON, by quadrature."""
    roughness = material["extensions"].get("KHR_materials_diffuse_roughness", {}).get("diffuseRoughnessFactor", 0.0)
    colors = material["pbrMetallicRoughness"]["baseColorFactor"][:3]
    return [models.average_albedo(models.Eon(roughness), rho, order=16) for rho in colors]


def test_a_tinted_image_is_scaled_by_the_average_albedo(tmp_path: Path) -> None:
    material = rough("Oren-Nayar")
    color = times(material, image_node(material, "base").outputs["Color"], (0.5, 0.25, 1.0, 1.0))
    material.node_tree.links.new(color, group_node(material)[0].inputs["Color"])
    show(material)
    written = by_name(export(tmp_path / "one.glb"))["Oren-Nayar"]
    red, green, blue, _ = written["pbrMetallicRoughness"]["baseColorFactor"]
    assert albedos(written)[0] == pytest.approx(models.average_albedo(models.OrenNayar(0.4), 0.5, order=16), rel=1e-4)
    assert (green, blue) == (pytest.approx(0.5 * red), pytest.approx(2.0 * red))


def test_a_group_of_ours_inside_the_artist_s_group_is_written(tmp_path: Path) -> None:
    inner = bpy.data.node_groups.new("Artist", "ShaderNodeTree")
    inner.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    node = materials.add_group(inner, ROUGH_DIFFUSE)
    node.inputs["Model"].default_value = "Lambert"
    inner.links.new(start.outputs["Tint"], node.inputs["Color"])
    inner.links.new(node.outputs["BSDF"], end.inputs["Surface"])
    for name, has_image in (("Image", True), ("Value", False)):
        material = bpy.data.materials.new(name)
        outer = add(material, "Group", node_tree=inner)
        outer.inputs["Tint"].default_value = COLOR
        if has_image:
            material.node_tree.links.new(image_node(material, "base").outputs["Color"], outer.inputs["Tint"])
        material.node_tree.links.new(outer.outputs["Surface"], material.node_tree.get_output_node("ALL").inputs["Surface"])
        show(material)
    written = by_name(export(tmp_path / "one.glb"))
    assert written["Image"]["pbrMetallicRoughness"]["baseColorTexture"]["image"] == "base"
    assert written["Value"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert report.take() == [] and list(bpy.data.node_groups).count(inner) == 1
    assert len([group for group in bpy.data.node_groups if group.name.startswith("Artist")]) == 1


def mix_shader(material: bpy.types.Material, kind: str, factor: object) -> None:
    """Put a mix of a new closure and what was the surface at the output of `material`."""
    output = material.node_tree.get_output_node("ALL").inputs["Surface"]
    other = add(material, kind).outputs["BSDF"]
    material.node_tree.links.new(add(material, "MixShader", factor, other, output.links[0].from_socket).outputs["Shader"], output)


def test_a_mix_of_closures_is_said(tmp_path: Path) -> None:
    material = rough("Lambert")
    mix_shader(material, "BsdfGlossy", 0.5)
    show(material)
    written = by_name(export(tmp_path / "one.glb"))["Lambert"]
    assert written["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert report.take() == [
        "True Diffuse: Lambert: the node Mix Shader (Mix Shader) is not supported, Rough Diffuse alone is written"
    ]


def test_a_mix_with_a_transparent_bsdf_is_alpha(tmp_path: Path) -> None:
    for name, factor in (("value", 0.25), ("image", None)):
        material = rough("Lambert")
        material.name = name
        mix_shader(material, "BsdfTransparent", factor or image_node(material, "holes").outputs["Alpha"])
        show(material)
    written = by_name(export(tmp_path / "one.glb"))
    assert [written[name]["alphaMode"] for name in ("value", "image")] == ["BLEND", "BLEND"]
    assert written["value"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([*COLOR[:3], 0.25])
    assert written["image"]["pbrMetallicRoughness"]["baseColorTexture"]["image"] == "holes"
    assert report.take() == []


def at_output(material: bpy.types.Material, closure: bpy.types.Node) -> None:
    material.node_tree.links.new(closure.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])


def in_group(material: bpy.types.Material, opacity: float) -> None:
    """Put what is at the output of `material`, one of our groups, into the artist's group with a mix around it."""
    inner = bpy.data.node_groups.new("Artist", "ShaderNodeTree")
    inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    node = materials.add_group(inner, ROUGH_DIFFUSE)
    node.inputs["Model"].default_value, node.inputs["Color"].default_value = "Lambert", COLOR
    mix, clear = inner.nodes.new("ShaderNodeMixShader"), inner.nodes.new("ShaderNodeBsdfTransparent")
    mix.inputs[0].default_value = opacity
    inner.links.new(clear.outputs[0], mix.inputs[1])
    inner.links.new(node.outputs[0], mix.inputs[2])
    inner.links.new(mix.outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
    at_output(material, add(material, "Group", node_tree=inner))


BLUE = (0.1, 0.2, 0.7, 1.0)


@pytest.fixture
def mixed_file() -> None:
    """A file with one material for each way in which two of ours, or one and something else, come to the output."""
    for factor in (0.0, 1.0):
        material = rough("Lambert")
        material.name = f"factor {factor:g}"
        second = materials.add_group(material.node_tree, ROUGH_DIFFUSE)
        second.inputs["Model"].default_value, second.inputs["Color"].default_value = "Lambert", BLUE
        at_output(material, add(material, "MixShader", factor, group_node(material)[0].outputs[0], second.outputs[0]))
        show(material)
    for name, kind in (("same", "MixShader"), ("alone", "AddShader")):
        material = rough("Lambert")
        material.name = name
        own = group_node(material)[0].outputs[0]
        at_output(material, add(material, kind, *((0.3, own, own) if kind == "MixShader" else (own,))))
        show(material)
    material = rough("Lambert")
    material.name = "inside"
    in_group(material, 0.25)
    show(material)
    material = rough("Lambert")
    material.name = "muted"
    own = group_node(material)[0]
    at_output(material, add(material, "MixShader", 0.5, own.outputs[0], add(material, "BsdfDiffuse").outputs[0]))
    own.mute = True
    show(material)
    material = rough("Lambert")
    material.name = "cycles"
    material.node_tree.get_output_node("ALL").target = "CYCLES"
    other = add(material, "OutputMaterial", target="EEVEE")
    material.node_tree.links.new(add(material, "BsdfDiffuse").outputs[0], other.inputs["Surface"])
    show(material)


@pytest.mark.usefixtures("mixed_file")
def test_a_group_of_ours_counts_wherever_it_comes_to_the_output(tmp_path: Path) -> None:
    """What a mix or sum does not change is written, in groups, too; what glTF cannot hold is said."""
    written = by_name(export(tmp_path / "one.glb"))
    colors = {name: material.get("pbrMetallicRoughness", {}).get("baseColorFactor") for name, material in written.items()}
    for name, expected in {"factor 0": COLOR, "factor 1": BLUE, "same": COLOR, "alone": COLOR, "cycles": COLOR}.items():
        assert colors[name] == pytest.approx(expected), name
    assert colors["inside"] == pytest.approx([*COLOR[:3], 0.25]) and written["inside"]["alphaMode"] == "BLEND"
    assert sorted(report.take()) == [
        "True Diffuse: cycles: another engine's output (Material Output.001) is not supported, Material Output is written",
        "True Diffuse: muted: the node Diffuse BSDF (Diffuse BSDF) is not supported, glTF's default is written",
        "True Diffuse: muted: the node Mix Shader (Mix Shader) is not supported, Diffuse BSDF alone is written",
    ]


def keyed_value(material: bpy.types.Material, node: bpy.types.Node) -> None:
    value = add(material, "Value")
    value.outputs[0].keyframe_insert("default_value", frame=1)
    material.node_tree.links.new(value.outputs[0], node.inputs["Roughness"])


def driven_mapping(material: bpy.types.Material, node: bpy.types.Node) -> None:
    image, mapping = image_node(material, "moved"), add(material, "Mapping", add(material, "UVMap").outputs[0])
    mapping.inputs["Location"].driver_add("default_value", 0).driver.expression = "0.25"
    material.node_tree.links.new(mapping.outputs[0], image.inputs["Vector"])
    material.node_tree.links.new(image.outputs["Color"], node.inputs["Base Color"])


def glowing(material: bpy.types.Material, node: bpy.types.Node) -> None:
    emission = add(material, "Emission", add(material, "ObjectInfo").outputs["Color"], 2.0)
    at_output(material, add(material, "AddShader", node.outputs[0], emission.outputs[0]))


def whole_numbers(material: bpy.types.Material, node: bpy.types.Node) -> None:
    attribute = add(material, "Attribute", attribute_name="number")
    material.node_tree.links.new(attribute.outputs["Color"], node.inputs["Base Color"])


def elsewhere(material: bpy.types.Material, node: bpy.types.Node) -> None:
    for socket, uv_map in (("Base Color", "UVMap"), ("Alpha", "second")):
        image = image_node(material, socket)
        image.image.colorspace_settings.is_data = socket == "Alpha"
        material.node_tree.links.new(add(material, "UVMap", uv_map=uv_map).outputs[0], image.inputs["Vector"])
        material.node_tree.links.new(image.outputs["Color"], node.inputs[socket])


LOST = {
    keyed_value: "animation (Value.001) is not supported, the value at frame 0 is written",
    driven_mapping: "animation (Mapping) is not supported, the value at frame 0 is written",
    glowing: "Emission color: the node Object Info (Object Info) is not supported, the socket's own value is written",
    whole_numbers: "Base color: the attribute number, which is no color, (Attribute) is not supported, "
    "the socket's own value is written",
    elsewhere: "Alpha: an image in other places than that of Base Color (Image Texture.001) is not supported, "
    "the places of that are written",
}


def test_what_lies_behind_is_said(tmp_path: Path) -> None:
    for arrange in LOST:
        material = materials.create(arrange.__name__, PRINCIPLED)
        arrange(material, group_node(material)[0])
        mesh = show(material).data
        mesh.attributes.new("number", "INT", "POINT")
        mesh.uv_layers.new(name="second")
    export(tmp_path / "one.glb")
    lines = [*LOST.items(), (whole_numbers, "an import will find no UV map or attribute number")]
    assert sorted(report.take()) == sorted(f"True Diffuse: {arrange.__name__}: {line}" for arrange, line in lines)


def test_an_emission_beside_our_group_is_written(tmp_path: Path) -> None:
    material = rough("Lambert", Quality="Precise")
    output = material.node_tree.get_output_node("ALL").inputs["Surface"]
    glow = add(material, "Emission", (1.0, 0.5, 0.25, 1.0), 2.0).outputs["Emission"]
    material.node_tree.links.new(add(material, "AddShader", output.links[0].from_socket, glow).outputs["Shader"], output)
    show(material)
    written = by_name(export(tmp_path / "one.glb"))["Lambert"]
    assert written["emissiveFactor"] == pytest.approx([1.0, 0.5, 0.25])
    assert written["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] == pytest.approx(2.0)
    assert report.take() == []


def test_materials_of_variants_and_of_several_meshes_are_written_once(tmp_path: Path) -> None:
    first, second = rough("Lambert"), rough("EON")
    item, _ = show(first), show(first)
    preferences = bpy.context.preferences.addons["io_scene_gltf2"].preferences
    preferences.KHR_materials_variants_ui = True
    try:
        bpy.context.scene.gltf2_KHR_materials_variants_variants.add().name = "Rough"
        choice = item.data.gltf2_variant_mesh_data.add()
        choice.material_slot_index, choice.material = 0, second
        choice.variants.add().variant.variant_idx = 0
        document = export(tmp_path / "one.glb")
    finally:
        preferences.KHR_materials_variants_ui = False
    assert sorted(material["name"] for material in document["materials"]) == ["EON", "Lambert"]
    assert by_name(document)["EON"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert errors(tmp_path / "one.glb") == []


@pytest.mark.parametrize("is_override", [False, True])
def test_a_material_linked_from_another_file_is_written(is_override: bool, tmp_path: Path) -> None:
    material = rough("Lambert")
    link_image(material, "Color", "base")
    show(material)
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {material})
    for block in (*bpy.data.materials, *bpy.data.meshes, *bpy.data.images):
        bpy.data.batch_remove([block])
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.materials = ["Lambert"]
    show(wanted.materials[0].override_create() if is_override else wanted.materials[0])
    before = list(bpy.data.materials)
    written = by_name(export(tmp_path / "one.glb"))["Lambert"]
    assert written["pbrMetallicRoughness"]["baseColorTexture"]["image"] == "base"
    assert list(bpy.data.materials) == before and report.take() == []


def noise(material: bpy.types.Material) -> bpy.types.NodeSocket:
    return add(material, "TexNoise").outputs["Color"]


def ramped(material: bpy.types.Material) -> bpy.types.NodeSocket:
    return add(material, "ValToRGB", image_node(material, "below").outputs["Color"]).outputs["Color"]


def non_color(material: bpy.types.Material) -> bpy.types.NodeSocket:
    node = image_node(material, "data")
    node.image.colorspace_settings.is_data = True
    return node.outputs["Color"]


def wide(material: bpy.types.Material) -> bpy.types.NodeSocket:
    node = image_node(material, "wide")
    node.image.colorspace_settings.name = "Linear Rec.2020"
    return node.outputs["Color"]


def boxed(material: bpy.types.Material) -> bpy.types.NodeSocket:
    node = image_node(material, "box")
    node.projection = "BOX"
    return node.outputs["Color"]


def generated(material: bpy.types.Material) -> bpy.types.NodeSocket:
    node = image_node(material, "generated")
    material.node_tree.links.new(add(material, "TexCoord").outputs["Generated"], node.inputs["Vector"])
    return node.outputs["Color"]


NOT_HELD = {
    noise: "the node Noise Texture (Noise Texture) is not supported, the socket's own value is written",
    ramped: "the node Color Ramp (Color Ramp) is not supported, the image below is written without it",
    non_color: "the image data, which is an image of numbers, but glTF reads it as sRGB, (Image Texture) is not supported, "
    "the image data is written without it",
    wide: "the color space Linear Rec.2020 of the image wide (Image Texture) is not supported, "
    "the image wide is written without it",
    boxed: "Box projection of the image box (Image Texture) is not supported, the image box is written without it",
    generated: "an image mapped by the output Generated of the node Texture Coordinate (Texture Coordinate) is not supported, "
    "the image generated is written without it",
}


@pytest.mark.parametrize("bake", [False, True])
def test_what_gltf_cannot_hold_is_said_or_baked(bake: bool, tmp_path: Path) -> None:
    for make in NOT_HELD:
        material = rough("Lambert")
        material.name = make.__name__
        material.node_tree.links.new(make(material), group_node(material)[0].inputs["Color"])
        show(material)
    settings = bpy.context.scene.true_diffuse
    settings.bake, settings.bake_resolution = bake, 16
    before = list(bpy.data.images), list(bpy.data.scenes), list(bpy.data.objects)
    written = by_name(export(tmp_path / "one.glb"))
    said = [] if bake else [f"True Diffuse: {make.__name__}: Base color: {text}" for make, text in NOT_HELD.items()]
    assert sorted(report.take()) == sorted(said)
    images = {name: material["pbrMetallicRoughness"].get("baseColorTexture", {}).get("image") for name, material in written.items()}
    kept = {"noise": None, "ramped": "below", "non_color": "data", "wide": "wide", "boxed": "box", "generated": "generated"}
    assert images == ({name: f"{name} Base Color" for name in kept} if bake else kept)
    assert bake or written["noise"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert (list(bpy.data.images), list(bpy.data.scenes), list(bpy.data.objects)) == before
    assert errors(tmp_path / "one.glb") == []


def test_a_baked_alpha_below_a_cutoff_stays_a_mask(tmp_path: Path) -> None:
    material = bpy.data.materials.new("Holes")
    principled = material.node_tree.nodes["Principled BSDF"]
    above = add(material, "Math", add(material, "TexNoise").outputs["Factor"], 0.3, operation="GREATER_THAN")
    link(principled, "Alpha", above.outputs["Value"])
    convert_materials([material], 1.0)
    show(material)
    bpy.context.scene.true_diffuse.bake, bpy.context.scene.true_diffuse.bake_resolution = True, 16
    written = by_name(export(tmp_path / "one.glb"))["Holes"]
    assert (written["alphaMode"], written["alphaCutoff"]) == ("MASK", pytest.approx(0.3))
    assert "baseColorTexture" in written["pbrMetallicRoughness"] and report.take() == []


def test_factors_are_folded_and_a_gray_made_of_colors_is_said(tmp_path: Path) -> None:
    material = rough("Lambert")
    material.name = "part"
    mix = add(
        material,
        "Mix",
        0.5,
        image_node(material, "in part").outputs["Color"],
        (0.2, 0.4, 0.6, 1.0),
        data_type="RGBA",
        blend_type="MULTIPLY",
    )
    color = next(socket for socket in mix.outputs if socket.enabled)
    material.node_tree.links.new(times(material, color, (0.5, 0.5, 0.5, 1.0)), group_node(material)[0].inputs["Color"])
    show(material)
    gray = rough("Lambert")
    gray.name = "gray"
    half = add(gray, "Math", image_node(gray, "colors").outputs["Color"], 0.5, operation="MULTIPLY")
    gray.node_tree.links.new(half.outputs["Value"], group_node(gray)[0].inputs["Color"])
    show(gray)
    written = by_name(export(tmp_path / "one.glb"))
    part = written["part"]["pbrMetallicRoughness"]
    assert part["baseColorFactor"] == pytest.approx([0.3, 0.35, 0.4, 1.0]) and part["baseColorTexture"]["image"] == "in part"
    assert report.take() == [
        "True Diffuse: gray: Base color: the node Math (Math) is not supported, the image colors is written without it"
    ]


def test_images_of_the_same_file_name_stay_two(tmp_path: Path) -> None:
    for folder, color in (("first", (1.0, 0.0, 0.0, 1.0)), ("second", (0.0, 1.0, 0.0, 1.0))):
        image = bpy.data.images.new(folder, 4, 4)
        image.pixels.foreach_set(color * 16)
        (tmp_path / folder).mkdir()
        image.filepath_raw, image.file_format = str(tmp_path / folder / "skin.png"), "PNG"
        image.save()
        material = rough("Lambert")
        node = add(material, "TexImage", image=image)
        material.node_tree.links.new(node.outputs["Color"], group_node(material)[0].inputs["Color"])
        show(material)
    document = export(tmp_path / "one.glb")
    used = [material["pbrMetallicRoughness"]["baseColorTexture"]["index"] for material in document["materials"]]
    assert len({document["textures"][index]["source"] for index in used}) == 2


@pytest.mark.parametrize("path", sorted((ROOT / "tests" / "assets").glob("*.*")), ids=lambda path: path.stem)
def test_characters_lose_nothing(path: Path, tmp_path: Path) -> None:
    if path.suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
        bpy.context.preferences.addons.new().module = "true_diffuse"
    else:
        bpy.ops.import_scene.gltf(filepath=str(path))
    before = by_name(export(tmp_path / "before.glb"))
    convert_materials(list(bpy.data.materials), 1.0)
    after = by_name(export(tmp_path / "after.glb"))
    assert {name: part for name in before if (part := lost(before[name], after[name]))} == {}
    assert errors(tmp_path / "after.glb") == []


def test_what_cannot_be_baked_is_said_with_the_reason(tmp_path: Path) -> None:
    material = rough("Lambert")
    material.node_tree.links.new(add(material, "LayerWeight").outputs["Facing"], group_node(material)[0].inputs["Color"])
    show(material)
    bpy.context.scene.true_diffuse.bake = True
    export(tmp_path / "one.glb")
    assert report.take() == [
        "True Diffuse: Lambert: Base color: the node Layer Weight (Layer Weight) is not supported, "
        "the socket's own value is written and not baked, as Layer Weight depends on the view"
    ]


def test_outputs_besides_the_surface_are_said(tmp_path: Path) -> None:
    material = rough("Lambert")
    output = material.node_tree.get_output_node("ALL")
    material.node_tree.links.new(add(material, "Displacement").outputs[0], output.inputs["Displacement"])
    material.node_tree.links.new(add(material, "VolumeScatter").outputs[0], output.inputs["Volume"])
    show(material)
    export(tmp_path / "one.glb", export_apply=True)
    assert report.take() == [
        "True Diffuse: Lambert: displacement (Material Output) is not supported, the mesh is written as it is",
        "True Diffuse: Lambert: the volume (Material Output) is not supported, the surface alone is written",
    ]


def test_layers_without_a_place_in_gltf_are_said(tmp_path: Path) -> None:
    material = bpy.data.materials.new("Layers")
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    for name, value in {"Subsurface Weight": 1.0, "Thin Film Thickness": 400.0, "Coat Weight": 1.0, "Coat IOR": 1.7}.items():
        inputs[name].default_value = value
    convert_materials([material], 1.0)
    show(material)
    export(tmp_path / "one.glb")
    assert report.take() == [
        "True Diffuse: Layers: Subsurface weight: the layer (Principled BSDF) is not supported, what lies below is written",
        "True Diffuse: Layers: Thin film thickness: the layer (Principled BSDF) is not supported, what lies below is written",
        "True Diffuse: Layers: Coat IOR: another value than glTF's (Principled BSDF) is not supported, 1.5 is meant",
    ]


def test_options_are_drawn_in_the_exporter_s_dialog() -> None:
    from io_scene_gltf2 import exporter_extension_layout_draw

    gltf.register()
    try:
        layout = Layout()
        exporter_extension_layout_draw["True Diffuse"](bpy.context, layout)
    finally:
        gltf.unregister()
    assert layout.texts == ["True Diffuse", "", ""] and "True Diffuse" not in exporter_extension_layout_draw


def test_has_color_and_roughness(tmp_path: Path) -> None:
    show(rough("Oren-Nayar"))
    show(materials.create("Coated", SUBSURFACE, Color=COLOR))
    show(materials.create("Shiny", SPECULAR_GROUP, Color=COLOR))
    painted = rough("EON")
    link_image(painted, "Color", "base")
    show(painted)
    bpy.data.materials.new("Other")
    document = export(tmp_path / "all.glb")
    seen = {material["name"]: material for material in document["materials"]}
    base = seen["Oren-Nayar"]["pbrMetallicRoughness"]
    expected = [models.average_albedo(models.OrenNayar(0.4), rho, order=16) for rho in COLOR[:3]]
    assert albedos(seen["Oren-Nayar"]) == pytest.approx(expected, rel=1e-4)
    assert (base["metallicFactor"], base.get("roughnessFactor", 1)) == (0, 1)
    assert seen["Oren-Nayar"]["extensions"]["KHR_materials_specular"] == {"specularFactor": 0}
    assert seen["Coated"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert seen["Coated"]["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.4)
    assert seen["Coated"]["extensions"]["KHR_materials_ior"]["ior"] == pytest.approx(1.4)
    assert seen["Shiny"]["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.5)
    assert "baseColorTexture" in seen["EON"]["pbrMetallicRoughness"] and len(document["images"]) == 1


def test_material_with_an_output_for_each_engine_is_what_eevee_shows(tmp_path: Path) -> None:
    """As files from before Blender 2.80 became; the exporter by itself writes nothing of such a material."""
    material = rough("Lambert")
    tree = material.node_tree
    shown = tree.get_output_node("ALL")
    shown.target = "EEVEE"
    other, closure = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    other.target, other.is_active_output = "CYCLES", True
    tree.links.new(closure.outputs[0], other.inputs["Surface"])
    show(material)
    (written,) = export(tmp_path / "two.glb")["materials"]
    assert written["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx(COLOR[:3], rel=1e-6)
    (line,) = report.take()
    assert "another engine's output" in line and shown.name in line
    assert shown.target == "EEVEE" and len([node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]) == 2
