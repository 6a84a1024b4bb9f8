# SPDX-License-Identifier: GPL-3.0-or-later
"""USD: all inputs of a surface in both networks, held against Blender's own export of the same nodes before they were converted."""

import json
import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy

import pytest

from true_diffuse.addon import usd
from true_diffuse.addon.blender import report
from true_diffuse.addon.material import materials, node_record
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.addon.material.expression import Apply, Constant, Image, ImageTexture, UvMap, apply, evaluate
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE
from true_diffuse.addon.usd import affine, lookups

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
# Prints what UsdPreviewSurface and MaterialX hold, with the package usd-core, in a process without bpy: for each input of the
# surface the value, or what feeds it, down to the primvars
INSPECT = """
import json, sys
from pxr import Usd, UsdGeom, UsdShade
def plain(value):
    if hasattr(value, "path"): return value.path.rpartition("/")[2]
    return [round(float(x), 6) for x in value] if hasattr(value, "__len__") and not isinstance(value, str) else value
def of(socket):
    sources = socket.GetConnectedSources()[0]
    if not sources: return plain(socket.Get())
    shader = UsdShade.Shader(sources[0].source.GetPrim())
    inputs = {one.GetBaseName(): of(one) for one in shader.GetInputs()}
    return {"id": shader.GetShaderId(), "output": str(sources[0].sourceName), **inputs}
found = {}
stage = Usd.Stage.Open(sys.argv[1])
for prim in stage.Traverse():
    if prim.IsA(UsdShade.Material):
        material = UsdShade.Material(prim)
        outputs = {str(one.GetBaseName()): of(one) for one in material.GetOutputs()}
        count = sum(1 for child in prim.GetChildren() if child.GetName().startswith("MaterialX"))
        lines = list((prim.GetCustomDataByKey("trueDiffuse") or {}).get("notCarried", ()))
        found[prim.GetName()] = {"outputs": outputs, "nodes": count, "lines": lines}
    elif prim.IsA(UsdGeom.Mesh):
        found[prim.GetName()] = [one.GetPrimvarName() for one in UsdGeom.PrimvarsAPI(prim).GetPrimvars()]
print(json.dumps(found))
"""

pytestmark = pytest.mark.usefixtures("empty_file")


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """What the add-on registers for USD."""
    usd.register()
    report.take()
    yield
    usd.unregister()


def export(path: Path, **options: object) -> dict[str, Any]:
    """Export the scene and return what INSPECT prints of it."""
    assert bpy.ops.wm.usd_export(filepath=str(path), convert_world_material=False, **options) == {"FINISHED"}
    command = [sys.executable, "-c", INSPECT, str(path)]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def show(material: bpy.types.Material, *uv_maps: str) -> bpy.types.Mesh:
    """Return the mesh of a new plane with a material and UV maps, the first of which renders."""
    bpy.ops.mesh.primitive_plane_add()
    mesh = bpy.context.object.data
    mesh.materials.append(material)
    for name in uv_maps[1:]:
        mesh.uv_layers.new(name=name)
    if uv_maps:
        mesh.uv_layers[0].name = uv_maps[0]
    return mesh


def principled(name: str, **values: object) -> tuple[bpy.types.Material, bpy.types.Node]:
    """Return a new material and its Principled BSDF, with values by the sockets' names with underscores."""
    material = bpy.data.materials.new(name)
    node = material.node_tree.nodes["Principled BSDF"]
    for socket, value in values.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    return material, node


def image_node(
    material: bpy.types.Material, folder: Path, name: str, color: tuple[float, ...] = (0.5, 0.4, 0.3, 1.0), is_data: bool = False
) -> bpy.types.Node:
    """Return a new image node; the image is a file in `folder`, of one color but for a black corner."""
    image = bpy.data.images.new(name, 4, 4, alpha=True)
    image.pixels = [0.0, 0.0, 0.0, color[3], *color * 15]
    image.filepath_raw, image.file_format = str(folder / f"{name}.png"), "PNG"
    image.save()
    image.colorspace_settings.is_data = is_data
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def new(material: bpy.types.Material, kind: str, **properties: object) -> bpy.types.Node:
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    for name, value in properties.items():
        setattr(node, name, value)
    return node


def link(source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
    target.id_data.links.new(source, target)


# --- the kinds of materials that characters have


def base_color_image(folder: Path) -> bpy.types.Material:
    material, node = principled("Image")
    link(image_node(material, folder, "color").outputs["Color"], node.inputs["Base Color"])
    return material


def clamped_image(folder: Path) -> bpy.types.Material:
    material, node = principled("Clamped")
    source = image_node(material, folder, "color")
    source.extension = "EXTEND"
    link(source.outputs["Color"], node.inputs["Base Color"])
    return material


def mapped_image(folder: Path) -> bpy.types.Material:
    material, node = principled("Mapped")
    source, mapping, uv = image_node(material, folder, "color"), new(material, "Mapping"), new(material, "UVMap", uv_map="second")
    mapping.inputs["Location"].default_value = (0.25, -0.5, 0.0)
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.3)
    mapping.inputs["Scale"].default_value = (2.0, 3.0, 1.0)
    link(uv.outputs["UV"], mapping.inputs["Vector"])
    link(mapping.outputs["Vector"], source.inputs["Vector"])
    link(source.outputs["Color"], node.inputs["Base Color"])
    return material


def packed(folder: Path) -> bpy.types.Material:
    material, node = principled("Packed")
    source, parts = image_node(material, folder, "orm", is_data=True), new(material, "SeparateColor")
    link(source.outputs["Color"], parts.inputs["Color"])
    link(parts.outputs["Green"], node.inputs["Roughness"])
    link(parts.outputs["Blue"], node.inputs["Metallic"])
    return material


def gray_roughness(folder: Path) -> bpy.types.Material:
    material, node = principled("Gray")
    link(image_node(material, folder, "gray", (0.4, 0.4, 0.4, 1.0), is_data=True).outputs["Color"], node.inputs["Roughness"])
    return material


def normal_map(folder: Path) -> bpy.types.Material:
    material, node = principled("Normal")
    source, bump = image_node(material, folder, "normal", (0.5, 0.6, 0.9, 1.0), is_data=True), new(material, "NormalMap")
    link(source.outputs["Color"], bump.inputs["Color"])
    link(bump.outputs["Normal"], node.inputs["Normal"])
    return material


def cut_out(folder: Path) -> bpy.types.Material:
    material, node = principled("CutOut")
    source, compare = image_node(material, folder, "holes", (0.5, 0.4, 0.3, 0.5)), new(material, "Math", operation="GREATER_THAN")
    compare.inputs[1].default_value = 0.25
    link(source.outputs["Color"], node.inputs["Base Color"])
    link(source.outputs["Alpha"], compare.inputs[0])
    link(compare.outputs[0], node.inputs["Alpha"])
    return material


def cut_out_like_gltf(folder: Path) -> bpy.types.Material:
    material, node = principled("GltfCut")
    source = image_node(material, folder, "holes", (0.5, 0.4, 0.3, 0.5))
    less, rest = new(material, "Math", operation="LESS_THAN"), new(material, "Math", operation="SUBTRACT")
    less.inputs[1].default_value, rest.inputs[0].default_value = 0.25, 1.0
    link(source.outputs["Alpha"], less.inputs[0])
    link(less.outputs[0], rest.inputs[1])
    link(rest.outputs[0], node.inputs["Alpha"])
    return material


def blended(folder: Path) -> bpy.types.Material:
    material, node = principled("Blended")
    source = image_node(material, folder, "veil", (0.5, 0.4, 0.3, 0.5))
    link(source.outputs["Color"], node.inputs["Base Color"])
    link(source.outputs["Alpha"], node.inputs["Alpha"])
    return material


def emission_image(folder: Path) -> bpy.types.Material:
    material, node = principled("Glow", Emission_Strength=1.0)
    link(image_node(material, folder, "glow").outputs["Color"], node.inputs["Emission Color"])
    return material


def plain_metal(_folder: Path) -> bpy.types.Material:
    return principled("Metal", Base_Color=(0.9, 0.6, 0.2, 1.0), Metallic=1.0, Roughness=0.3)[0]


def coated(_folder: Path) -> bpy.types.Material:
    return principled("Coated", Coat_Weight=0.5, Coat_Roughness=0.1, IOR=1.4, Emission_Strength=2.0)[0]


KINDS: tuple[Callable[[Path], bpy.types.Material], ...] = (
    *(base_color_image, clamped_image, mapped_image, packed, gray_roughness, normal_map),
    *(cut_out, cut_out_like_gltf, blended, emission_image, plain_metal, coated),
)


def numbers(value: object) -> list[float]:
    """Return all numbers of an input's value."""
    if isinstance(value, (int, float)):
        return [float(value)]
    return [float(one) for one in value] if isinstance(value, list) else []


def assert_holds(ours: object, theirs: object, name: str) -> None:
    """Assert that an input of ours holds what Blender's has: value or texture, of which file, where, scaled and wrapped how."""
    if not isinstance(theirs, dict):
        assert not isinstance(ours, dict), name
        assert numbers(ours) == pytest.approx(numbers(theirs), abs=1e-6), name
        return
    assert isinstance(ours, dict) and ours["id"] == theirs["id"] == "UsdUVTexture", name
    neutral: dict[str, object] = {"scale": [1.0] * 4, "bias": [0.0] * 4}
    for key in ("file", "output", "sourceColorSpace", "wrapS", "wrapT"):
        assert ours.get(key) == theirs.get(key), f"{name}.{key}"
    width = {"rgb": slice(3), "r": slice(1), "g": slice(1, 2), "b": slice(2, 3), "a": slice(3, 4)}[theirs["output"]]
    for key in ("scale", "bias"):
        assert ours.get(key, neutral[key])[width] == pytest.approx(theirs.get(key, neutral[key])[width]), f"{name}.{key}"
    place, own = theirs["st"], ours["st"]
    while place["id"] == "UsdTransform2d":
        assert own["id"] == place["id"], name
        for key in ("scale", "rotation", "translation"):
            assert numbers(own[key]) == pytest.approx(numbers(place[key]), abs=1e-5), f"{name}.st.{key}"
        place, own = place["in"], own["in"]
    assert (own["id"], own["varname"]) == (place["id"], place["varname"]), name


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_preview_holds_all_that_blender_writes_of_the_unconverted_material(
    kind: Callable[[Path], bpy.types.Material], tmp_path: Path
) -> None:
    material = kind(tmp_path)
    show(material, "UVMap", "second")
    usd.unregister()
    theirs = export(tmp_path / "blender.usda")[material.name]["outputs"]["surface"]
    usd.register()
    assert convert_materials([material], 1.0).converted == [material.name]
    found = export(tmp_path / "ours.usda")[material.name]
    ours = found["outputs"]["surface"]
    assert found["lines"] == []
    # what UsdPreviewSurface takes for an input that is not there (https://openusd.org/release/spec_usdpreviewsurface.html)
    defaults = {"clearcoat": 0.0, "clearcoatRoughness": 0.01, "opacity": 1.0, "emissiveColor": [0.0] * 3, "metallic": 0.0}
    for name, value in theirs.items():
        if name in ("id", "output", "specular"):  # specular is no input of UsdPreviewSurface
            continue
        if name == "clearcoatRoughness" and theirs.get("clearcoat") == 0.0:
            continue
        assert_holds(ours.get(name, defaults.get(name)), value, name)


def test_lean_material_has_few_nodes(tmp_path: Path) -> None:
    material = base_color_image(tmp_path)
    show(material)
    convert_materials([material], 1.0)
    assert export(tmp_path / "one.usda")["Image"]["nodes"] == 6  # uv, image, diffuse, specular, layer, surface


def test_all_layers_are_valid_in_materialx_and_generate_shaders(tmp_path: Path) -> None:
    everything = {
        **{"Base Color": (0.8, 0.5, 0.2, 1.0), "Metallic": 0.3, "Roughness": 0.4, "Alpha": 0.9, "Diffuse Roughness": 0.6},
        **{
            "Subsurface Weight": 0.4,
            "Subsurface Anisotropy": 0.2,
            "Specular IOR Level": 0.3,
            "Specular Tint": (1.0, 0.9, 0.8, 1.0),
        },
        **{"Anisotropic": 0.5, "Anisotropic Rotation": 0.25, "Transmission Weight": 0.3, "Thin Film Thickness": 400.0},
        **{"Coat Weight": 0.5, "Coat Tint": (0.9, 1.0, 0.9, 1.0), "Sheen Weight": 0.5, "Emission Strength": 2.0},
    }
    show(materials.create("Everything", PRINCIPLED, Model="EON", **everything))
    for kind in (mapped_image, normal_map, cut_out, packed):
        material = kind(tmp_path)
        show(material, "UVMap", "second")
        convert_materials([material], 1.0)
    found = export(tmp_path / "all.usda")
    surface = found["Everything"]["outputs"]["surface" if "mtlx:surface" not in found["Everything"]["outputs"] else "mtlx:surface"]
    assert surface["id"] in ("ND_surface", "UsdPreviewSurface")
    command = [sys.executable, str(SCRIPTS / "check_usd.py"), "--json", str(tmp_path / "all.usda")]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.stdout, result.stderr
    records = json.loads(result.stdout)
    assert [record["problems"] for record in records] == [[]] * 6
    assert all(min(record["lines"].values()) > 10 for record in records[1:])


# --- names


def read_by(found: object, key: str) -> set[str]:
    """Return the names of primvars that a network reads."""
    if not isinstance(found, dict):
        return set()
    own = {found[key]} if key in found else set()
    return own.union(*(read_by(value, key) for value in found.values()))


@pytest.mark.parametrize("options", [{}, {"rename_uvmaps": False}, {"allow_unicode": False}], ids=["default", "as is", "ascii"])
def test_uv_maps_and_attributes_have_the_names_of_the_mesh(options: dict[str, bool], tmp_path: Path) -> None:
    names = ("UVMap", "größe ½", "e\N{COMBINING ACUTE ACCENT}²", "1/x")
    material = materials.create("Named", ROUGH_DIFFUSE)
    node = group_node(material)[0]
    total = node.inputs["Color"]
    for name in names:
        source, uv, mix = image_node(material, tmp_path, "color"), new(material, "UVMap", uv_map=name), new(material, "Mix")
        mix.data_type, mix.inputs[0].default_value = "RGBA", 0.5
        link(uv.outputs["UV"], source.inputs["Vector"])
        link(source.outputs["Color"], mix.inputs[6])
        link(mix.outputs[2], total)
        total = mix.inputs[7]
    link(new(material, "VertexColor").outputs["Color"], total)  # without a name, the active one
    mesh = show(material, *names)
    mesh.color_attributes.new("Farbe ½", "BYTE_COLOR", "CORNER")
    found = export(tmp_path / "names.usda", **options)
    (there,) = (value for value in found.values() if isinstance(value, list))
    read = read_by(found["Named"]["outputs"], "geomprop")
    assert read <= set(there) and len(read) == 5
    assert not [line for line in found["Named"]["lines"] if "lacks" in line]


def reading(material_name: str, folder: Path, uv_map: str) -> bpy.types.Material:
    """Return a material of ours whose color is an image on the UV map of a name."""
    material = materials.create(material_name, ROUGH_DIFFUSE)
    source, uv = image_node(material, folder, "color"), new(material, "UVMap", uv_map=uv_map)
    link(uv.outputs["UV"], source.inputs["Vector"])
    link(source.outputs["Color"], group_node(material)[0].inputs["Color"])
    return material


@pytest.mark.parametrize(
    ("options", "uv_maps", "expected"),
    [
        ({}, ("UVMap",), ("st",)),
        ({}, ("a²", "a½"), ("st", "a_")),
        ({}, ("Zoë", "Zo_"), ("st", "Zo_")),
        ({}, ("²a", "\N{ARABIC-INDIC DIGIT THREE}", "1a"), ("st", "_", "_1a")),
        ({"allow_unicode": False}, ("st", "Zoë", "e\N{COMBINING ACUTE ACCENT}"), ("st", "Zo_", "e_")),
        ({"rename_uvmaps": False}, ("UVMap", "st"), ("UVMap", "st")),
        ({"rename_uvmaps": False}, ("Zoë", "Zo_"), ("Zoë", "Zo_")),
        ({"rename_uvmaps": False, "allow_unicode": False}, ("Zoë", "a½"), ("Zo_", "a_")),
    ],
)
def test_each_uv_map_is_read_by_the_name_that_it_has_in_the_stage(
    options: dict[str, bool], uv_maps: tuple[str, ...], expected: tuple[str, ...], tmp_path: Path
) -> None:
    """Materials that read one map each, on meshes that have all; what is in no identifier (XID) is an underscore."""
    for index, name in enumerate(uv_maps):
        show(reading(f"M{index}", tmp_path, name), *uv_maps)
    found = export(tmp_path / "names.usda", **options)
    for index, name in enumerate(expected):
        assert read_by(found[f"M{index}"]["outputs"], "geomprop") == {name}
        assert read_by(found[f"M{index}"]["outputs"], "varname") == {name}
        assert found[f"M{index}"]["lines"] == []


def test_uv_maps_that_have_one_name_in_usd_are_said(tmp_path: Path) -> None:
    """Blender writes the second over the first."""
    show(reading("First", tmp_path, "a²"), "UVMap", "a²", "a½")
    show(reading("Second", tmp_path, "a½"), "UVMap", "a²", "a½")
    found = export(tmp_path / "names.usda")
    (line,) = found["First"]["lines"]
    assert line == "the UV map a², which has the name of a½ in USD on Plane, is not supported, a½ is read there"
    assert found["Second"]["lines"] == []


def test_unnamed_color_attribute_is_the_one_that_renders_and_never_the_viewports_color(tmp_path: Path) -> None:
    """A mesh without one is black, although Blender writes the viewport's color as displayColor."""
    for name, attributes in (("Own", ("Color", "Other")), ("None", ())):
        material = materials.create(name, ROUGH_DIFFUSE)
        link(new(material, "VertexColor").outputs["Color"], group_node(material)[0].inputs["Color"])
        mesh = show(material)
        for attribute in attributes:
            mesh.color_attributes.new(attribute, "BYTE_COLOR", "CORNER")
    bpy.data.meshes[0].color_attributes.render_color_index = 1
    found = export(tmp_path / "colors.usda")
    for key in ("geomprop", "varname"):
        assert read_by(found["Own"]["outputs"], key) == {"Other"}
        assert read_by(found["None"]["outputs"], key) == {"Color"}
    lacks = "the active color attribute, which Plane_001 lacks, is not supported, black or zero is read there"
    assert lacks in found["None"]["lines"] and lacks not in found["Own"]["lines"]


def test_instances_of_one_prototype_have_their_names(tmp_path: Path) -> None:
    show(reading("M²", tmp_path, "UVMap"))
    collection = bpy.data.collections.new("Planes")
    collection.objects.link(bpy.context.object)
    bpy.context.scene.collection.objects.unlink(bpy.context.object)
    for name in "ab":
        empty = bpy.data.objects.new(name, None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        bpy.context.scene.collection.objects.link(empty)
    show(reading("M½", tmp_path, "UVMap"))
    found = export(tmp_path / "instances.usda", use_instancing=True)
    for name in ("M_", "M__001"):
        assert read_by(found[name]["outputs"], "geomprop") == {"st"} and found[name]["lines"] == []


def test_missing_uv_map_is_said(tmp_path: Path) -> None:
    material = mapped_image(tmp_path)
    show(material)
    convert_materials([material], 1.0)
    (line,) = export(tmp_path / "one.usda")["Mapped"]["lines"]
    assert line == "the UV map second, which Plane lacks, is not supported, black or zero is read there"


@pytest.mark.parametrize("overwrites", [False, True])
def test_images_of_equal_file_names_stay_two(overwrites: bool, tmp_path: Path) -> None:
    made = []
    for index, color in enumerate(((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0))):
        folder = tmp_path / str(index)
        folder.mkdir()
        material = materials.create(f"M{index}", ROUGH_DIFFUSE)
        link(image_node(material, folder, "color", color).outputs["Color"], group_node(material)[0].inputs["Color"])
        show(material)
        made.append(folder / "color.png")
    for _ in range(2):  # the second export finds the files of the first
        found = export(tmp_path / "two.usda", overwrite_textures=overwrites)
        files = [found[f"M{index}"]["outputs"]["surface"]["diffuseColor"]["file"] for index in range(2)]
        assert len(set(files)) == 2
        assert [(tmp_path / "textures" / file).read_bytes() for file in files] == [path.read_bytes() for path in made]
        assert len(list((tmp_path / "textures").iterdir())) == 2


def test_preview_surface_is_left_to_blender_where_it_is_not_asked_for(tmp_path: Path) -> None:
    material = base_color_image(tmp_path)
    show(material)
    convert_materials([material], 1.0)
    outputs = export(tmp_path / "one.usda", generate_preview_surface=False)["Image"]["outputs"]
    assert "file" not in json.dumps(outputs["surface"]) and outputs["mtlx:surface"]["id"] == "ND_surface"


# --- color spaces


def test_color_space_that_materialx_lacks_is_said(tmp_path: Path) -> None:
    material = base_color_image(tmp_path)
    material.node_tree.nodes["Image Texture"].image.colorspace_settings.name = "Linear Rec.2020"
    show(material)
    convert_materials([material], 1.0)
    lines = export(tmp_path / "one.usda")["Image"]["lines"]
    assert lines[0] == "the color space Linear Rec.2020 of the image color is not supported, acescg is written"


# --- what UsdPreviewSurface can hold


def texture(output: str = "color", name: str = "a") -> ImageTexture:
    image = Image(name, "sRGB", is_data=False)
    return ImageTexture(image, UvMap(), output)  # ty: ignore[invalid-argument-type] - color or alpha


def test_tint_inversion_and_channels_are_one_scaled_image() -> None:
    tinted = lookups.lookup(apply("multiply", texture(), (0.5, 1.0, 0.25)), "triple", lambda _: False)
    assert tinted and (tinted.output, tinted.scale, tinted.bias) == ("rgb", (0.5, 1.0, 0.25), (0.0, 0.0, 0.0)) and tinted.is_exact
    inverted = lookups.lookup(apply("subtract", 1.0, apply("x", texture())), "number", lambda _: False)
    assert inverted and (inverted.output, inverted.scale, inverted.bias) == ("r", (-1.0,), (1.0,))
    alpha = lookups.lookup(apply("multiply", texture("alpha"), 0.5), "number", lambda _: False)
    assert alpha and (alpha.output, alpha.scale, alpha.is_exact) == ("a", (0.5,), True)
    gray = lookups.lookup(apply("luminance", texture()), "number", lambda _: True)
    assert gray and gray.output == "r" and gray.scale == pytest.approx((1.0,)) and gray.is_exact


@pytest.mark.parametrize(
    "expression",
    [
        apply("power", texture(), 2.0),
        apply("multiply", texture(), texture(name="b")),
        apply("luminance", texture()),
    ],
    ids=["power", "two images", "luminance of a color"],
)
def test_more_than_a_scaled_image_is_not_exact(expression: Apply) -> None:
    found = lookups.lookup(expression, expression.kind, lambda _: False)
    assert found and not found.is_exact


@pytest.mark.parametrize(
    ("opacity", "threshold"),
    [
        (apply("greater_than", texture("alpha"), 0.3), 0.3),
        (apply("less_than", 0.3, texture("alpha")), 0.3),
        (apply("subtract", 1.0, apply("less_than", texture("alpha"), 0.3)), 0.3),
        (apply("clamp", apply("greater_than", texture("alpha"), 0.3), 0.0, 1.0), 0.3),
        (apply("round", texture("alpha")), 0.5),
    ],
)
def test_clipped_opacity_is_recognized(opacity: Apply, threshold: float) -> None:
    assert lookups.clipped(opacity) == (texture("alpha"), threshold)
    assert lookups.clipped(texture("alpha")) is None


@pytest.mark.parametrize(
    "operations",
    [
        (("multiply", (2.0, 3.0, 1.0)), ("rotate", (0.0, 0.0, 0.7)), ("add", (0.1, 0.2, 0.0))),
        (("subtract", (0.1, 0.2, 0.0)), ("rotate_back", (0.0, 0.0, 0.7)), ("divide", (2.0, 3.0, 1.0))),  # Mapping of type Texture
        (("multiply", (-1.0, 1.0, 1.0)), ("add", (1.0, 0.0, 0.0))),
        (("rotate", (0.4, 0.0, 0.0)),),
    ],
    ids=["point", "texture", "mirrored", "tilted"],
)
def test_mappings_are_steps_of_transform2d(operations: tuple[tuple[str, tuple[float, ...]], ...]) -> None:
    coordinates = UvMap("map")
    for operation, value in operations:
        coordinates = apply(operation, coordinates, value)
    found = affine.transformed(coordinates)
    assert found and found[0] == "map" and 1 <= len(found[1]) <= 2
    for u, v in ((0.2, 0.9), (-1.5, 3.25)):
        x, y = u, v
        for step in found[1]:
            x, y = x * step.scale[0], y * step.scale[1]
            sine, cosine = math.sin(math.radians(step.rotation)), math.cos(math.radians(step.rotation))
            x, y = x * cosine - y * sine + step.translation[0], x * sine + y * cosine + step.translation[1]
        exact = evaluate(coordinates, affine._Uv(u, v))
        assert (x, y) == pytest.approx(exact[:2])


def test_identity_and_what_is_no_mapping() -> None:
    assert affine.transformed(UvMap("map")) == ("map", [])
    assert affine.transformed(apply("fraction", UvMap("map"))) is None
    assert affine.transformed(Constant((0.0, 0.0, 0.0))) is None


# --- the way back


def test_nodes_come_back_as_they_were(tmp_path: Path) -> None:
    material = materials.create("Nodes", PRINCIPLED, Model="EON", Roughness=0.3)
    tree, node = material.node_tree, group_node(material)[0]
    ramp, curves, mapping = new(material, "ValToRGB"), new(material, "RGBCurve"), new(material, "Mapping", vector_type="TEXTURE")
    ramp.color_ramp.interpolation = "EASE"
    ramp.color_ramp.elements.new(0.25).color = (0.1, 0.6, 0.3, 1.0)
    curves.mapping.curves[3].points.new(0.4, 0.7)
    curves.mapping.update()
    source = image_node(material, tmp_path, "color")
    source.extension, source.interpolation = "CLIP", "Closest"
    frame = tree.nodes.new("NodeFrame")
    frame.label = "Paint"
    group = bpy.data.node_groups.new("Own", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor").default_value = (0.1, 0.2, 0.3, 1.0)
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, gamma, end = (group.nodes.new(kind) for kind in ("NodeGroupInput", "ShaderNodeGamma", "NodeGroupOutput"))
    gamma.inputs["Gamma"].default_value = 2.0
    group.links.new(start.outputs[0], gamma.inputs["Color"])
    group.links.new(gamma.outputs[0], end.inputs[0])
    own = tree.nodes.new("ShaderNodeGroup")
    own.node_tree, own.parent = group, frame
    for first, second in (
        (mapping.outputs[0], source.inputs["Vector"]),
        (source.outputs["Color"], curves.inputs["Color"]),
        (curves.outputs["Color"], own.inputs[0]),
        (own.outputs[0], ramp.inputs["Fac"]),
        (ramp.outputs["Color"], node.inputs["Base Color"]),
    ):
        link(first, second)
    show(material)
    kept = node_record.record(tree)
    assert node_record.image_names(kept) == ["color"]
    assert json.loads(json.dumps(kept)) == kept
    export(tmp_path / "one.usda")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "one.usda"))
    (back,) = bpy.data.materials
    again = node_record.record(back.node_tree)
    image = next(one for one in again["nodes"] if one["name"] == "Image Texture")["properties"]["image"]
    assert image["image"] == "color.png" and image["color_space"] == "sRGB"
    image["image"] = "color"
    assert again == kept


def test_what_cannot_be_carried_is_baked_for_the_network_that_lacks_it(tmp_path: Path) -> None:
    from true_diffuse.addon.usd.baking import baking

    material = materials.create("Marble", ROUGH_DIFFUSE)
    noise = new(material, "TexNoise")
    link(noise.outputs["Color"], group_node(material)[0].inputs["Color"])
    show(material)
    before = len(bpy.data.images)
    with baking([(material, "ALL")], 1.0, 16):
        found = export(tmp_path / "one.usda")["Marble"]
    assert found["outputs"]["surface"]["diffuseColor"]["file"] == found["outputs"]["mtlx:surface"]["bsdf"]["color"]["file"]
    assert [line for line in found["lines"] if "baked" in line and line.startswith("Base color")]
    assert len(bpy.data.images) == before
    assert group_node(material)[0].inputs["Color"].links[0].from_node == noise


def test_active_color_attribute_is_named_on_the_way_back(tmp_path: Path) -> None:
    material = materials.create("Painted", ROUGH_DIFFUSE, Model="Lambert")
    link(new(material, "VertexColor").outputs["Color"], group_node(material)[0].inputs["Color"])
    mesh = show(material)
    for name in ("a", "my paint"):
        mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    mesh.color_attributes.render_color_index = 1
    found = export(tmp_path / "one.usda")["Painted"]
    assert read_by(found["outputs"], "geomprop") == read_by(found["outputs"], "varname") == {"my_paint"}
    assert found["lines"] == []
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "one.usda"))
    assert bpy.data.materials[0].node_tree.nodes["Color Attribute"].layer_name == "my_paint"


def test_normal_map_with_other_tangents_is_said(tmp_path: Path) -> None:
    material = normal_map(tmp_path)
    material.node_tree.nodes["Normal Map"].uv_map = "second"
    show(material, "UVMap", "second")
    convert_materials([material], 1.0)
    (line,) = export(tmp_path / "one.usda")["Normal"]["lines"]
    assert line.startswith("Normal: a normal map with the tangents of the UV map second is not supported")


def test_directx_normal_map_and_its_strength_are_scale_and_bias(tmp_path: Path) -> None:
    material = normal_map(tmp_path)
    node = material.node_tree.nodes["Normal Map"]
    node.convention, node.inputs["Strength"].default_value = "DIRECTX", 0.5
    show(material, "UVMap")
    convert_materials([material], 1.0)
    found = export(tmp_path / "one.usda")["Normal"]
    # in Cycles x and y are times the strength, z goes from 1 to its value: 1 + 0.5 (2 c - 1 - 1) = c
    texture = found["outputs"]["surface"]["normal"]
    assert texture["scale"][:3] == pytest.approx([1.0, -1.0, 1.0]) and texture["bias"][:3] == pytest.approx([-0.5, 0.5, 0.0])
    bsdf = json.dumps(found["outputs"]["mtlx:surface"])
    assert '"scale": [1.0, -1.0]' in bsdf and '"mix": 0.5' in bsdf and found["lines"] == []


def test_attribute_of_numbers_is_a_number(tmp_path: Path) -> None:
    material = materials.create("Worn", PRINCIPLED)
    source = new(material, "Attribute", attribute_name="wear")
    link(source.outputs["Fac"], group_node(material)[0].inputs["Roughness"])
    show(material).attributes.new("wear", "FLOAT", "POINT")
    found = export(tmp_path / "one.usda")["Worn"]
    assert found["outputs"]["surface"]["roughness"] == {"id": "UsdPrimvarReader_float", "output": "result", "varname": "wear"}
    assert "ND_geompropvalue_float" in json.dumps(found["outputs"]["mtlx:surface"])
    assert not [line for line in found["lines"] if "wear" in line]


def emitted_in_storm(path: Path, size: int, is_preview: bool) -> list[float]:
    """Return the picture of the file's camera in Hydra Storm, of one of its networks."""
    from pxr import Usd, UsdGeom, UsdShade

    from true_diffuse.scripts.studies import storm

    stage = Usd.Stage.Open(str(path))
    prims = list(stage.Traverse())
    for prim in prims:
        if is_preview and prim.IsA(UsdShade.Material):
            prim.RemoveProperty("outputs:mtlx:surface")
    camera = next(UsdGeom.Camera(prim) for prim in prims if prim.IsA(UsdGeom.Camera))
    return list(storm.radiance(stage, camera, size))


@pytest.mark.render
@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize("is_preview", [False, True], ids=["MaterialX", "UsdPreviewSurface"])
def test_storm_shows_images_where_cycles_does(is_preview: bool, tmp_path: Path) -> None:
    size = 32
    material = materials.create("Lit", PRINCIPLED, **{"Base Color": (0.0, 0.0, 0.0, 1.0), "Specular IOR Level": 0.0})
    image = bpy.data.images.new("steps", 8, 8)
    # smooth, so that filters count for little, and of no symmetry
    image.pixels = [one for y in range(8) for x in range(8) for one in (0.3 + 0.08 * x, 0.3 + 0.08 * y, 0.3 + 0.01 * x * y, 1.0)]
    image.filepath_raw, image.file_format = str(tmp_path / "steps.png"), "PNG"
    image.save()
    source, mapping = new(material, "TexImage", image=image, extension="EXTEND"), new(material, "Mapping")
    mapping.inputs["Location"].default_value = (0.35, 0.1, 0.0)
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.4)
    mapping.inputs["Scale"].default_value = (0.6, 0.4, 1.0)
    tint = new(material, "Mix", data_type="RGBA", blend_type="MULTIPLY")
    tint.inputs[0].default_value, tint.inputs[7].default_value = 1.0, (0.9, 0.5, 0.7, 1.0)
    link(new(material, "UVMap", uv_map="UVMap").outputs["UV"], mapping.inputs["Vector"])
    link(mapping.outputs["Vector"], source.inputs["Vector"])
    link(source.outputs["Color"], tint.inputs[6])
    node = group_node(material)[0]
    link(tint.outputs[2], node.inputs["Emission Color"])
    node.inputs["Emission Strength"].default_value = 1.0
    show(material, "UVMap")
    bpy.ops.object.camera_add(location=(0.0, 0.0, 4.0))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    scene.camera.data.angle = 2.0 * math.atan(0.2)  # the inner 1.6 of the plane, which has 2
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 16, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", str(tmp_path / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    made = bpy.data.images.load(str(tmp_path / "cycles.exr"))
    pixels = list(made.pixels)
    expected = [pixels[4 * ((size - 1 - y) * size + x) + channel] for y in range(size) for x in range(size) for channel in range(3)]
    assert max(expected) - min(expected) > 0.3
    export(tmp_path / "one.usda")
    shown = emitted_in_storm(tmp_path / "one.usda", size, is_preview)
    off = [abs(a - b) for a, b in zip(shown, expected, strict=True)]
    mirrored = [expected[3 * (size * y + size - 1 - x) + channel] for y in range(size) for x in range(size) for channel in range(3)]
    # A texel's step is 0.05 of radiance, and filters differ by a part of it; a wrong place, tint or color space by several
    assert sum(off) / len(off) < 0.01 < 0.05 < sum(abs(a - b) for a, b in zip(mirrored, expected, strict=True)) / len(off)


def fed_by(kind: str, output: str, socket: str, **values: object) -> Callable[[bpy.types.Material, bpy.types.Node], None]:
    """Return a function that links an output of a new node to a socket of our group, whose values are set first."""

    def feed(material: bpy.types.Material, node: bpy.types.Node) -> None:
        for name, value in values.items():
            node.inputs[name.replace("_", " ")].default_value = value
        link(new(material, kind).outputs[output], node.inputs[socket])

    return feed


def emission_beside(material: bpy.types.Material, node: bpy.types.Node) -> None:
    emission, total = new(material, "Emission"), new(material, "AddShader")
    emission.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    link(new(material, "ObjectInfo").outputs["Color"], emission.inputs["Color"])
    link(node.outputs[0], total.inputs[0])
    link(emission.outputs[0], total.inputs[1])
    link(total.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])


def bumped(material: bpy.types.Material, node: bpy.types.Node) -> None:
    fed_by("Bump", "Normal", "Normal")(material, node)
    link(new(material, "Attribute", attribute_name="height").outputs["Fac"], material.node_tree.nodes["Bump"].inputs["Height"])


def numbered(material: bpy.types.Material, node: bpy.types.Node) -> None:
    link(new(material, "Attribute", attribute_name="number").outputs["Color"], node.inputs["Base Color"])


def keyed(_material: bpy.types.Material, node: bpy.types.Node) -> None:
    node.inputs["Roughness"].keyframe_insert("default_value", frame=1)


def muted(material: bpy.types.Material, node: bpy.types.Node) -> None:
    mix, diffuse = new(material, "MixShader"), new(material, "BsdfDiffuse")
    link(node.outputs[0], mix.inputs[1])
    link(diffuse.outputs[0], mix.inputs[2])
    link(mix.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])
    node.mute = True


BLACK = (0.0, 0.0, 0.0, 1.0)
INFO = "the output Color of the node Object Info (Object Info) is not supported, the socket's own value takes its place"
LOST = {
    "Emission": (
        fed_by("ObjectInfo", "Color", "Emission Color", Emission_Color=BLACK, Emission_Strength=2.0),
        f"Emission color: {INFO}",
    ),
    "Beside": (emission_beside, f"Emission color: {INFO}"),
    "Dark": (fed_by("ObjectInfo", "Color", "Emission Color", Emission_Strength=0.0), None),
    "Bump": (bumped, "a bump by lengths in MaterialX is not supported, its height is over the UV map's unit there"),
    "Number": (numbered, "Base color: the attribute number of the type Int is not supported, the socket's own value is written"),
    "Keyed": (keyed, "keyed or driven: its value at this frame counts (Principled Rough Diffuse)"),
    "Muted": (muted, "the muted node Principled Rough Diffuse is not supported, the material is written as Blender has it"),
}


def test_what_is_lost_is_said_in_one_line(tmp_path: Path) -> None:
    for name, (arrange, _) in LOST.items():
        material = materials.create(name, PRINCIPLED)
        arrange(material, group_node(material)[0])
        mesh = show(material)
        mesh.attributes.new("number", "INT", "POINT")
        mesh.attributes.new("height", "FLOAT", "POINT")
    image, _ = principled("Closest")
    source = image_node(image, tmp_path, "pixels")
    source.interpolation = "Closest"
    link(source.outputs["Color"], image.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
    convert_materials([image], 1.0)
    show(image)
    export(tmp_path / "lost.usda")
    said = [line.removeprefix("True Diffuse: ").partition(": ")[::2] for line in report.take()]
    for name, (_, line) in LOST.items():
        own = [text for material, text in said if material == name and "UsdPreviewSurface" not in text]
        assert own == ([line] if line else []), name
    closest = "Closest interpolation of the image pixels in UsdPreviewSurface is not supported, it is interpolated there"
    assert ("Closest", closest) in said
