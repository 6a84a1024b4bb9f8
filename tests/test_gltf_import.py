# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF: our materials as Blender's importer brings them back, and rough diffuse materials of other programs."""

import base64
import json
import math
import struct
import zlib
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import bpy

import pytest

from support import show
from true_diffuse.addon.blender import properties, report
from true_diffuse.addon.blender.engines import CYCLES
from true_diffuse.addon.blender.id_properties import MATERIAL_MARKS
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.node_record import Record
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.material.restore import kept
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.models.eon import Eon
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.addon.nodes.principled import DISTRIBUTIONS, METHODS
from true_diffuse.addon.nodes.rough_diffuse import QUALITIES
from true_diffuse.scenes.sphere import sphere_under_sun


@pytest.fixture(scope="module", autouse=True)
def addon() -> Iterator[None]:
    """The extension among the add-ons that exporter and importer ask, in a file with nothing in it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    enable()
    properties.register()
    yield
    properties.unregister()
    bpy.context.preferences.addons.remove(bpy.context.preferences.addons["true_diffuse"])


@pytest.fixture(autouse=True)
def new_file() -> None:
    empty()
    report.take()


def enable() -> None:
    bpy.context.preferences.addons.new().module = "true_diffuse"


def empty() -> None:
    """Remove all but our node groups, which take longest to make, from the file."""
    data = bpy.data
    blocks = (data.objects, data.meshes, data.materials, data.images, data.lights, data.cameras, data.actions)
    data.batch_remove([block for kind in blocks for block in kind])


def load(path: Path) -> dict[str, Record]:
    """Import a file into an empty one; returns what it has of each material."""
    empty()
    assert bpy.ops.import_scene.gltf(filepath=str(path)) == {"FINISHED"}
    return {material.name: kept(material) for material in bpy.data.materials}


def save(path: Path, **options: object) -> dict[str, Record]:
    """Export the file; returns what it has of each material."""
    assert bpy.ops.export_scene.gltf(filepath=str(path), **options) == {"FINISHED"}
    return {material.name: kept(material) for material in bpy.data.materials}


def document(path: Path) -> dict[str, Any]:
    """Return the JSON of a .glb or .gltf file."""
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]] if path.suffix == ".glb" else data)


def image(name: str, color: tuple[float, ...] = (0.2, 0.6, 0.4, 1.0)) -> bpy.types.Image:
    """Return a new packed image."""
    made = bpy.data.images.new(name, 16, 16)
    made.pixels.foreach_set(color * 256)
    made.pack()
    return made


def link(material: bpy.types.Material, source: bpy.types.NodeSocket, socket: str) -> None:
    material.node_tree.links.new(source, group_node(material)[0].inputs[socket])


def test_every_entry_of_every_menu_and_every_preset_comes_back_as_it_was(tmp_path: Path) -> None:
    made = [materials.create(preset.name, preset.group, **preset.inputs) for preset in PRESETS.values()]
    for model, quality in product(MODELS.values(), QUALITIES):
        made.append(materials.create(f"{model.label} {quality}", ROUGH_DIFFUSE, Model=model.label, Quality=quality))
    for model, (label, _) in product(MODELS.values(), METHODS.values()):
        made.append(materials.create(f"{model.label} {label}", SUBSURFACE, Model=model.label, Method=label, Roughness=0.3))
        options = {"Model": model.label, "Subsurface Method": label, "Diffuse Roughness": 0.7, "Metallic": 0.25}
        made.append(materials.create(f"Principled {model.label} {label}", PRINCIPLED, **options))
    for label, _ in DISTRIBUTIONS.values():
        made.append(materials.create(f"Principled {label}", PRINCIPLED, Distribution=label, IOR=1.7))
    made.append(materials.create("Standard Specular", SPECULAR_GROUP))
    for group, name in ((ROUGH_DIFFUSE, "Roughness"), (SUBSURFACE, "Roughness"), (PRINCIPLED, "Diffuse Roughness")):
        made.append(materials.create(f"{group.name} above the slider", group, **{name: 1.3}))
    made[0].use_backface_culling, made[1].surface_render_method = True, "BLENDED"
    assert {group_node(material)[1] for material in made} == set(GROUPS)
    show(*made)
    before = save(tmp_path / "all.glb")
    assert load(tmp_path / "all.glb") == before
    assert len(before) == len(made) and all(not material.keys() for material in bpy.data.materials)


@pytest.mark.parametrize(
    "options", [{}, {"export_format": "GLTF_SEPARATE", "export_extras": False}, {"export_image_format": "WEBP"}]
)
def test_textured_materials_come_back_with_the_imported_mesh_s_names(options: dict[str, Any], tmp_path: Path) -> None:
    first = materials.create("Mapped", ROUGH_DIFFUSE, Model="EON", Roughness=0.4)
    nodes, links = first.node_tree.nodes, first.node_tree.links
    uv, mapping, texture, ramp = (nodes.new(f"ShaderNode{kind}") for kind in ("UVMap", "Mapping", "TexImage", "ValToRGB"))
    uv.uv_map, texture.image, texture.extension = "Second", image("wood.png"), "MIRROR"
    texture.image.colorspace_settings.name = "Linear Rec.709"
    mapping.inputs["Scale"].default_value, mapping.inputs["Rotation"].default_value = (2.0, 3.0, 1.0), (0.0, 0.0, 0.3)
    ramp.color_ramp.elements.new(0.3).color = (0.1, 0.8, 0.3, 1.0)
    for source, target in ((uv, mapping), (mapping, texture), (texture, ramp)):
        links.new(source.outputs[0], target.inputs[0])
    link(first, ramp.outputs["Color"], "Color")
    link(first, texture.outputs["Color"], "Roughness")
    second = materials.create("Painted", PRINCIPLED, Model="Oren-Nayar")
    nodes = second.node_tree.nodes
    paint, rough = nodes.new("ShaderNodeVertexColor"), nodes.new("ShaderNodeTexImage")
    paint.layer_name, rough.image = "Paint", image("rough")
    rough.image.colorspace_settings.name = "Non-Color"
    link(second, paint.outputs["Color"], "Base Color")
    link(second, rough.outputs["Color"], "Diffuse Roughness")
    mesh = show(first, second).data
    mesh.uv_layers.new(name="Second")
    mesh.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    path = tmp_path / ("two.gltf" if "export_format" in options else "two.glb")
    before = save(path, **options)
    file = document(path)
    assert sorted(one["name"] for one in file["images"]) == ["rough", "wood"]
    after = load(path)
    assert len(bpy.data.images) == 2
    (mesh,) = bpy.data.meshes
    expected = json.dumps(before).replace('"Second"', f'"{mesh.uv_layers[1].name}"')
    assert after == json.loads(expected.replace('"Paint"', f'"{mesh.color_attributes[0].name}"'))
    for name in ("wood.png", "rough"):
        assert bpy.data.images[name].pixels[:3] == pytest.approx((0.2, 0.6, 0.4), abs=0.02 if "WEBP" in str(options) else 0.5 / 255)


# files from elsewhere, by the text of the extension: EON's roughness is diffuseRoughnessFactor times the red of its texture

TEXELS = 4
"""Of a row of the test's texture; red is a texel's number over 15, green and blue say something else."""


def png(rows: list[list[tuple[int, int, int]]]) -> bytes:
    """Return an RGB image as a PNG file, rows from the top."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    lines = b"".join(b"\0" + bytes(value for pixel in row for value in pixel) for row in rows)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")


def data_uri(kind: str, data: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def foreign(path: Path, *made: dict[str, Any], **changes: object) -> Path:
    """Write a .gltf file with materials, each on a triangle; TEXCOORD_1 is half of TEXCOORD_0, texture 0 is TEXELS squared."""
    corners = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    uv = ((0.0, 1.0), (1.0, 1.0), (0.0, 0.0))  # v goes down
    arrays = [*corners, *((u, v) for u, v in uv), *((u / 2.0, v / 2.0) for u, v in uv)]
    buffer = b"".join(struct.pack(f"<{len(one)}f", *one) for one in arrays)
    rows = [[(17 * (TEXELS * row + column), 200, 100) for column in range(TEXELS)] for row in range(TEXELS)]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2}
    used = sorted({name for material in made for name in material.get("extensions", {})} | {"KHR_texture_transform"})
    file: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": used,
        "buffers": [{"uri": data_uri("application/octet-stream", buffer), "byteLength": len(buffer)}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": size} for start, size in ((0, 36), (36, 24), (60, 24))],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "images": [{"uri": data_uri("image/png", png(rows))}],
        "samplers": [{"magFilter": 9728, "minFilter": 9728}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": list(made),
        "meshes": [{"primitives": [{"attributes": attributes, "material": index} for index in range(len(made))]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    path.write_text(json.dumps(file | changes))
    return path


def rough(factor: object = 0.6, **more: object) -> dict[str, Any]:
    """Return the extension."""
    return {"KHR_materials_diffuse_roughness": {"diffuseRoughnessFactor": factor} | more}


def transformed(**values: object) -> dict[str, Any]:
    """Return the texture of the file with KHR_texture_transform."""
    return {"index": 0, "extensions": {"KHR_texture_transform": values}}


CHALK = {
    "name": "Chalk",
    "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.5, 0.2, 1.0], "metallicFactor": 0.0},
    "extensions": rough() | {"KHR_materials_specular": {"specularFactor": 0.0}},
}
LAYERED = {
    "name": "Layered",
    "pbrMetallicRoughness": {"baseColorFactor": [0.3, 0.4, 0.5, 1.0], "metallicFactor": 0.5, "roughnessFactor": 0.25},
    "extensions": rough(0.75)
    | {
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.25},
        "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 0.5], "sheenRoughnessFactor": 0.5},
    },
}


def inputs(material: bpy.types.Material) -> dict[str, Any]:
    """Return the values of our group, or of Blender's Principled BSDF."""
    found = group_node(material)
    node = found[0] if found else next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    values = {socket.name: getattr(socket, "default_value", None) for socket in node.inputs}
    return {name: value if isinstance(value, (str, int, float)) else list(value or ()) for name, value in values.items()}


@pytest.mark.render
def test_a_factor_makes_rough_diffuse_of_that_eon(tmp_path: Path) -> None:
    sphere = sphere_under_sun(64)
    required = {"extensionsRequired": ["KHR_materials_diffuse_roughness"]}
    assert bpy.ops.import_scene.gltf(filepath=str(foreign(tmp_path / "one.gltf", CHALK, **required))) == {"FINISHED"}
    material = bpy.data.materials["Chalk"]
    assert group_node(material)[1] is ROUGH_DIFFUSE and inputs(material)["Model"] == "EON"
    assert inputs(material)["Roughness"] == pytest.approx(0.6) and inputs(material)["Color"] == pytest.approx([0.8, 0.5, 0.2, 1.0])
    for degrees in (0.0, 60.0, 120.0):
        (exact,) = sphere.measure(material, [Eon(0.6)], CYCLES, 4, degrees)[1]
        assert exact.rms < 0.002  # the pixel filter's width, where the light ends
    assert report.take() == []


@pytest.mark.render
def test_a_texture_s_red_times_the_factor_is_the_roughness(tmp_path: Path) -> None:
    info = transformed(offset=[0.125, 0.5], scale=[2.0, 1.0], texCoord=1)
    chalk = CHALK | {"extensions": CHALK["extensions"] | rough(0.5, diffuseRoughnessTexture=info)}
    bpy.ops.import_scene.gltf(filepath=str(foreign(tmp_path / "one.gltf", chalk)))
    assert report.take() == []
    material = bpy.data.materials["Chalk"]
    socket, tree = group_node(material)[0].inputs["Roughness"], material.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(socket.links[0].from_socket, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    scene = bpy.context.scene
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    scene.camera.location, scene.camera.rotation_euler = (0.5, -2.0, 0.5), (math.pi / 2.0, 0.0, 0.0)
    scene.collection.objects.link(scene.camera)
    size = scene.render.resolution_x = scene.render.resolution_y = 64
    (shape,) = (item for item in bpy.data.objects if item.type == "MESH")
    scene.view_layers[0].update()
    with render.measurement_scene(scene, shape) as one:
        rgb = render.radiance(one, CYCLES, 1)[1]
    assert len(rgb) == 3 * size * size
    seen = set()
    for row in range(size):  # from below
        for column in range(size - row - 2):  # where the triangle is
            x, y = (column + 0.5) / size, (row + 0.5) / size
            u, v = 2.0 * (x / 2.0) + 0.125, (1.0 - y) / 2.0 + 0.5  # the transform of TEXCOORD_1
            texel = 17 * (TEXELS * math.floor(TEXELS * v) + math.floor(TEXELS * (u % 1.0)))
            seen.add(texel)
            # red is a whole number of 255ths
            assert rgb[3 * (size * (size - 1 - row) + column)] == pytest.approx(0.5 * texel / 255, abs=1e-5), (x, y)
    assert len(seen) == 7


def test_other_layers_stay_as_blender_imports_them(tmp_path: Path) -> None:
    path = foreign(tmp_path / "one.gltf", LAYERED, CHALK | {"name": "Glossy", "extensions": rough()})
    load(path)
    ours = {material.name: inputs(material) for material in bpy.data.materials}
    assert all(group_node(material)[1] is PRINCIPLED for material in bpy.data.materials)
    bpy.context.preferences.addons.remove(bpy.context.preferences.addons["true_diffuse"])
    assert bpy.ops.import_scene.gltf(filepath=str(path)) == {"FINISHED"}
    enable()
    for name, factor in (("Layered", 0.75), ("Glossy", 0.6)):
        expected = inputs(bpy.data.materials[f"{name}.001"])
        expected["Subsurface Scale"] *= 1000.0  # mm
        expected |= {"Diffuse Roughness": factor, "Model": "EON"}
        del expected["Weight"]  # of a socket that no interface shows
        assert {key: ours[name][key] for key in expected} == {key: pytest.approx(value) for key, value in expected.items()}
    assert ours["Layered"]["Coat Weight"] == 0.75 and ours["Layered"]["Metallic"] == 0.5 and ours["Layered"]["Sheen Weight"] > 0.0


def test_materials_that_no_mesh_has_become_ours_too(tmp_path: Path) -> None:
    path = foreign(tmp_path / "one.gltf", CHALK, LAYERED)
    file = json.loads(path.read_text())
    del file["meshes"][0]["primitives"][1]
    path.write_text(json.dumps(file))
    assert bpy.ops.import_scene.gltf(filepath=str(path), import_unused_materials=True) == {"FINISHED"}
    assert [inputs(bpy.data.materials[name])["Model"] for name in ("Chalk", "Layered")] == ["EON", "EON"]


def test_a_file_without_the_extension_is_left_alone(tmp_path: Path) -> None:
    load(foreign(tmp_path / "one.gltf", CHALK | {"extensions": {}}))
    assert group_node(bpy.data.materials["Chalk"]) is None and report.take() == []


NO_TEXTURE = "diffuseRoughnessTexture is no valid texture of the file, and is left out"
WRONG = {
    "3.5": (rough(3.5), 1.0, "diffuseRoughnessFactor is 3.5, not in 0 to 1, and is clamped"),
    "-1": (rough(-1), 0.0, "diffuseRoughnessFactor is -1, not in 0 to 1, and is clamped"),
    "NaN": (rough("NaN"), 0.0, "diffuseRoughnessFactor is 'NaN', and no number: 0 is used"),
    "true": (rough(True), 0.0, "diffuseRoughnessFactor is True, and no number: 0 is used"),
    "null": (rough(None), 0.0, "diffuseRoughnessFactor is None, and no number: 0 is used"),
    "list": (rough([1]), 0.0, "diffuseRoughnessFactor is [1], and no number: 0 is used"),
    "texture": (rough(0.5, diffuseRoughnessTexture={"index": 7}), 0.5, NO_TEXTURE),
    "word": (rough(0.5, diffuseRoughnessTexture="red"), 0.5, NO_TEXTURE),
    "UV map": (rough(0.5, diffuseRoughnessTexture={"index": 0, "texCoord": "x"}), 0.5, NO_TEXTURE),
    "extensions": (rough(0.5, diffuseRoughnessTexture={"index": 0, "extensions": 1}), 0.5, NO_TEXTURE),
    "scale": (rough(0.5, diffuseRoughnessTexture=transformed(scale="big")), 0.5, NO_TEXTURE),
    "rotation": (rough(0.5, diffuseRoughnessTexture=transformed(rotation=[])), 0.5, NO_TEXTURE),
}


def test_wrong_values_are_said_in_one_line_each(tmp_path: Path) -> None:
    made = [CHALK | {"name": name, "extensions": CHALK["extensions"] | extension} for name, (extension, *_) in WRONG.items()]
    load(foreign(tmp_path / "one.gltf", *made))
    assert report.take() == [f"True Diffuse: {name}: {line}" for name, (*_, line) in WRONG.items()]
    for name, (_, roughness, _) in WRONG.items():
        assert inputs(bpy.data.materials[name])["Roughness"] == roughness


# our own files after other programs or accidents had them


def separate(tmp_path: Path, **options: object) -> tuple[Path, dict[str, Any]]:
    """Export as text with files beside it; returns the path and what is in it."""
    path = tmp_path / "one.gltf"
    save(path, export_format="GLTF_SEPARATE", **options)
    return path, json.loads(path.read_text())


def is_eon(material: bpy.types.Material, color: tuple[float, ...]) -> bool:
    """Return whether a material is Rough Diffuse with the model EON, of a color."""
    return group_node(material)[1] is ROUGH_DIFFUSE and inputs(material)["Color"] == pytest.approx([*color, 1.0])


def remake(kind: str, extras: dict[str, Any], material: dict[str, Any]) -> str:
    """Change a glTF material as `kind` says; returns what an import says of it. Extras count for "odd" and "script"."""
    nodes, damaged = extras["nodes"], "its extras are damaged, and glTF's values are used: "
    match kind:
        case "edited":
            material["pbrMetallicRoughness"]["baseColorFactor"] = [0.25, 0.5, 0.75, 1.0]
            return "another program has changed its base color: its nodes are made of that"
        case "coat":
            material["extensions"]["KHR_materials_clearcoat"]["clearcoatFactor"] = 0.25
            return "another program has changed its KHR_materials_clearcoat.clearcoatFactor: its nodes are made of that"
        case "newer":
            extras["format"] += 1
            return f"{damaged}a newer True Diffuse has written them"
        case "newer nodes":
            nodes["format"] = 99
            return f"{damaged}nodes in format 99, which a newer version has written"
        case "text":
            material["extras"]["trueDiffuse"] = "{}"
            return f"{damaged}they are no object"
        case "no nodes":
            del extras["nodes"]
            return f"{damaged}nodes is missing"
        case "no list":
            nodes["nodes"] = 3
            return f"{damaged}'int' object is not iterable"
        case "odd":
            nodes["nodes"].append({"kind": "ShaderNodeOfAnother", "name": "Odd", "location": [0, 0]})
            return "the node Odd is of an unknown kind, ShaderNodeOfAnother"
        case "script":
            nodes["nodes"].append({"kind": "ShaderNodeScript", "name": "Bad", "location": [0, 0], "properties": {"bytecode": "x"}})
            return "the node Bad is left out, as it would run a program of the file"
    return ""


def test_changed_and_damaged_extras_are_said_in_one_line_each(tmp_path: Path) -> None:
    kinds = ("edited", "newer", "newer nodes", "text", "no nodes", "no list", "odd", "script", "whole")
    coated = materials.create("coat", PRINCIPLED, **{"Coat Weight": 0.5, "Model": "EON"})
    show(coated, *(materials.create(kind, ROUGH_DIFFUSE, Model="EON", Color=(0.5, 0.5, 0.5, 1.0), Roughness=0.4) for kind in kinds))
    path, file = separate(tmp_path, export_extras=True)
    lines = []
    for material in file["materials"]:
        assert material["extras"].keys() == {"trueDiffuse"}  # without our marks
        material["extras"]["mine"] = 3
        line = remake(material["name"], material["extras"]["trueDiffuse"], material)
        lines += [f"True Diffuse: {material['name']}: {line}"] if line else []
    path.write_text(json.dumps(file))
    load(path)
    assert sorted(report.take()) == sorted(lines)
    assert inputs(bpy.data.materials["coat"])["Coat Weight"] == 0.25
    for kind in kinds:
        material = bpy.data.materials[kind]
        assert is_eon(material, (0.25, 0.5, 0.75) if kind == "edited" else (0.5, 0.5, 0.5))
        assert inputs(material)["Roughness"] == pytest.approx(0.4)
        assert {key: value for key, value in material.items() if key not in MATERIAL_MARKS} == {"mine": 3}


def textured(name: str, *images: bpy.types.Image) -> bpy.types.Material:
    """Return a material with images that nothing in glTF uses, beside one in Color."""
    material = materials.create(name, ROUGH_DIFFUSE, Model="EON", Roughness=0.4)
    for one in images:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = one
    link(material, node.outputs["Color"], "Color")
    return material


def found_images(material: str) -> list[str]:
    nodes = bpy.data.materials[material].node_tree.nodes
    return [node.image.name for node in nodes if node.bl_idname == "ShaderNodeTexImage" and node.image]


def test_images_are_found_where_another_program_has_moved_or_removed_them(tmp_path: Path) -> None:
    show(textured("One", *map(image, ("unused", "removed", "file", "color"))))
    path, file = separate(tmp_path)
    order = ("color", "file", "unused")
    old = [one["name"] for one in file["images"]]
    for texture in file["textures"]:
        texture["source"] = order.index(old[texture["source"]])
    by_name = {one["name"]: one for one in file["images"]}
    file["images"] = [by_name[name] for name in order]
    path.write_text(json.dumps(file))
    gone = tmp_path / by_name["file"]["uri"]
    gone.unlink()
    load(path)
    assert sorted(found_images("One")) == ["color", "file", "unused"]
    assert sorted(report.take()) == [
        f"True Diffuse: One: the image file {gone} is missing",
        "True Diffuse: One: the image removed is missing",
    ]


def test_images_are_written_once_and_not_at_all_where_none_are_wanted(tmp_path: Path) -> None:
    show(textured("One", image("a"), image("b")), textured("Two", image("b"), bpy.data.images["a"]))
    save(tmp_path / "one.glb")
    assert report.take() == []
    assert sorted(one["name"] for one in document(tmp_path / "one.glb")["images"]) == ["a", "b", "b"]
    save(tmp_path / "one.glb", export_image_format="NONE")
    assert "images" not in document(tmp_path / "one.glb")
    assert [line for line in report.take() if "not in the file" in line] == [
        f"True Diffuse: {material}: the image {name} is not in the file"
        for material, names in (("One", ("a", "b")), ("Two", ("b.001", "a")))
        for name in names
    ]


def test_images_without_a_file_are_said_and_the_rest_goes_on(tmp_path: Path) -> None:
    names = ("gone.png", "reloaded.png")
    for name in names:
        image("new").save(filepath=str(tmp_path / name))
        bpy.data.images.remove(bpy.data.images["new"])
    show(*(textured(name, bpy.data.images.load(str(tmp_path / name))) for name in names), textured("Whole", image("there")))
    for name in names:
        (tmp_path / name).unlink()
    bpy.data.images["reloaded.png"].reload()
    save(tmp_path / "one.glb")
    assert report.take() == [f"True Diffuse: {name}: the image {name} is not in the file" for name in names]
    load(tmp_path / "one.glb")
    assert report.take() == [f"True Diffuse: {name}: the image {name} is missing" for name in names]
    assert found_images("gone.png") == found_images("reloaded.png") == [] and found_images("Whole") == ["there"]


def test_a_material_on_meshes_with_and_without_colors_comes_back_once(tmp_path: Path) -> None:
    material = materials.create("One", ROUGH_DIFFUSE, Model="EON", Color=(0.5, 0.5, 0.5, 1.0))
    for name in ("", "Paint", "Other"):
        mesh = show(material).data
        if name:
            mesh.color_attributes.new(name, "BYTE_COLOR", "CORNER")
    before = save(tmp_path / "one.glb")
    assert load(tmp_path / "one.glb") == before
    assert all(mesh.materials[:] == bpy.data.materials[:] for mesh in bpy.data.meshes) and len(bpy.data.meshes) == 3


def test_an_import_is_one_step_to_undo_and_leaves_what_is_there(tmp_path: Path) -> None:
    show(materials.create("One", ROUGH_DIFFUSE, Model="EON", Color=(0.5, 0.5, 0.5, 1.0)))
    save(tmp_path / "one.glb")
    empty()
    there = materials.create("One", ROUGH_DIFFUSE, Model="Fujii")
    there.use_fake_user = True
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.import_scene.gltf(filepath=str(tmp_path / "one.glb")) == {"FINISHED"}
    bpy.ops.ed.undo_push(message="import")
    assert inputs(bpy.data.materials["One"])["Model"] == "Fujii" and is_eon(bpy.data.materials["One.001"], (0.5, 0.5, 0.5))
    assert bpy.ops.ed.undo() == {"FINISHED"}
    assert bpy.data.materials.keys() == ["One"] and not bpy.data.meshes
    assert bpy.ops.ed.redo() == {"FINISHED"}
    assert is_eon(bpy.data.materials["One.001"], (0.5, 0.5, 0.5))


def test_animated_materials_come_back_without_animation(tmp_path: Path) -> None:
    material = materials.create("One", PRINCIPLED, Model="EON", Metallic=0.5)
    node = group_node(material)[0]
    for frame, value in ((1, 0.25), (20, 0.75)):
        node.inputs["Roughness"].default_value = value
        node.inputs["Roughness"].keyframe_insert("default_value", frame=frame)
        node.inputs["Diffuse Roughness"].default_value = value
        node.inputs["Diffuse Roughness"].keyframe_insert("default_value", frame=frame)
    show(material)
    save(tmp_path / "one.glb", export_animation_mode="SCENE", export_pointer_animation=True)
    pointers = json.dumps(document(tmp_path / "one.glb"))
    assert "pbrMetallicRoughness/roughnessFactor" in pointers
    report.take()
    load(tmp_path / "one.glb")
    assert group_node(bpy.data.materials["One"])[1] is PRINCIPLED and inputs(bpy.data.materials["One"])["Metallic"] == 0.5
    assert report.take() == ["True Diffuse: One: its animation is not restored"]


def test_nodes_without_a_name_take_what_rendered_and_meshes_that_disagree_are_said(tmp_path: Path) -> None:
    material = materials.create("One", ROUGH_DIFFUSE, Model="EON")
    nodes = material.node_tree.nodes
    nodes.new("ShaderNodeUVMap").name = "rendered"
    nodes.new("ShaderNodeTexImage").name = "without"
    for name in ("Second", "_wear", "gone"):
        node = nodes.new("ShaderNodeAttribute")
        node.name = node.attribute_name = name
    link(material, nodes.new("ShaderNodeVertexColor").outputs["Color"], "Color")
    for order in (("First", "Second"), ("Second", "First")):
        mesh = show(material).data
        mesh.uv_layers.remove(mesh.uv_layers[0])
        for name in order:
            mesh.uv_layers.new(name=name)
        mesh.uv_layers["Second"].active_render = True
        for name in ("a", "b"):
            mesh.color_attributes.new(name, "BYTE_COLOR", "CORNER")
        mesh.color_attributes.render_color_index = 1
        mesh.attributes.new("_wear", "FLOAT", "POINT")
    save(tmp_path / "one.glb", export_attributes=True)
    disagree = "is TEXCOORD_{} in the mesh Plane.001, an import takes TEXCOORD_{} for all meshes"
    assert [line.removeprefix("True Diffuse: One: ") for line in report.take()] == [
        f"what renders {disagree.format(0, 1)}",
        f"Second {disagree.format(0, 1)}",
        "an import will find no UV map or attribute gone",
        "the UV map that renders is not the first: an import will take the first",
    ]
    load(tmp_path / "one.glb")
    nodes = bpy.data.materials["One"].node_tree.nodes
    assert nodes["rendered"].uv_map == "UVMap.001" and nodes["Second"].attribute_name == "UVMap.001"
    assert nodes["_wear"].attribute_name in bpy.data.meshes[0].attributes and nodes["gone"].attribute_name == "gone"
    assert nodes["Color Attribute"].layer_name in ("", bpy.data.meshes[0].color_attributes[0].name)  # b is COLOR_0


def test_values_that_json_has_not_and_tiles_are_said(tmp_path: Path) -> None:
    odd, tiled = (materials.create(name, ROUGH_DIFFUSE, Model="EON") for name in ("Odd", "Tiled"))
    odd.node_tree.nodes.new("ShaderNodeValue").outputs[0].default_value = math.nan
    made = bpy.data.images.new("Tiles", 4, 4, tiled=True)
    tiled.node_tree.nodes.new("ShaderNodeTexImage").image = made
    show(odd, tiled)
    save(tmp_path / "one.glb")
    assert report.take() == [
        "True Diffuse: Odd: a value is not a number: an import will not make the nodes again",
        "True Diffuse: Tiled: an image has tiles: an import will not make the nodes again",
    ]
    assert not [material for material in document(tmp_path / "one.glb")["materials"] if "extras" in material]
    load(tmp_path / "one.glb")
    assert all(inputs(material)["Model"] == "EON" for material in bpy.data.materials) and report.take() == []
