# SPDX-License-Identifier: GPL-3.0-or-later
"""The census of assets: what it reads from nodes and files, its verdicts, and that no asset can end it."""

import json
import math
from pathlib import Path
from typing import Any

import bpy

import pytest

from support import assert_bad_input, run_script
from true_diffuse.addon.blender import engines
from true_diffuse.scripts.census import features, gltf_file, table, usd_file
from true_diffuse.scripts.census.pictures import Difference, Stage
from true_diffuse.scripts.census.values import CHANNELS, PLACES, ImageUse, Value, constant, product
from true_diffuse.scripts.census.verdict import Verdict, judge, judge_picture, mentions, poorer
from true_diffuse.scripts.characters.small import skin
from true_diffuse.scripts.characters.small.characters import GLTF_FILES
from true_diffuse.scripts.characters.small.figure import colors, figure
from true_diffuse.scripts.characters.small.gltf import Primitive, glb

ASSETS = Path(__file__).resolve().parent / "assets"
SINE, COSINE = math.sin(0.4), math.cos(0.4)
# Where scale (2, 1.5), then a rotation of 0.4 counter-clockwise, then an offset of (0.1, 0.25) take (0, 0), (1, 0) and (0, 1)
MOVED = ((0.1, 0.25), (0.1 + 2.0 * COSINE, 0.25 + 2.0 * SINE), (0.1 - 1.5 * SINE, 0.25 + 1.5 * COSINE))

empty = pytest.mark.usefixtures("empty_file")


def image_of(name: str, *, channel: str = "rgb", uv_map: str = "", places: Any = PLACES) -> Value:
    return Value(images=frozenset({ImageUse(name, channel, uv_map, places)}))


class Built:
    """A new material with a Principled BSDF, and short words to link nodes to it."""

    def __init__(self) -> None:
        self.material = bpy.data.materials.new("Built")
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.principled = self.add("ShaderNodeBsdfPrincipled")
        self.link(self.principled.outputs[0], self.add("ShaderNodeOutputMaterial").inputs["Surface"])

    def add(self, kind: str, **settings: Any) -> bpy.types.Node:
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        return node

    def link(self, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        self.tree.links.new(source, target)

    def image(self, name: str = "painted") -> bpy.types.Node:
        image = bpy.data.images.get(name) or bpy.data.images.new(name, 4, 4, alpha=True)
        return self.add("ShaderNodeTexImage", image=image)

    def tinted(self, source: bpy.types.NodeSocket, color: tuple[float, ...]) -> bpy.types.NodeSocket:
        """Return a source times a color by a Mix node."""
        mix = self.add("ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
        sockets = {socket.identifier: socket for socket in mix.inputs}
        sockets["Factor_Float"].default_value = 1.0
        sockets["B_Color"].default_value = color
        self.link(source, sockets["A_Color"])
        return next(socket for socket in mix.outputs if socket.identifier == "Result_Color")

    def read(self) -> features.MaterialFacts:
        facts = features.read(self.material)
        assert facts is not None
        return facts

    def rows(self) -> set[str]:
        return {feature.row for feature in self.read().features}


@pytest.fixture
def built(request: pytest.FixtureRequest) -> Built:
    request.getfixturevalue("empty_file")
    features.limits.cache_clear()
    return Built()


def test_principled_alone_has_a_plain_color_and_nothing_else(built: Built) -> None:
    facts = built.read()
    assert facts.channels.keys() == {"base color", "roughness"} and built.rows() == {"Base color: plain"}
    assert facts.channels["base color"].factor == pytest.approx((0.8, 0.8, 0.8))


def test_image_times_two_colors_is_a_product(built: Built) -> None:
    source = built.tinted(built.tinted(built.image().outputs["Color"], (0.5, 0.25, 1.0, 1.0)), (0.5, 1.0, 0.25, 1.0))
    built.link(source, built.principled.inputs["Base Color"])
    assert built.read().channels["base color"] == Value((0.25, 0.25, 0.25), image_of("painted").images)
    assert "Base color: image times a color, or mixed" in built.rows()


def test_mapping_is_applied_as_blender_does(built: Built) -> None:
    node, mapping, uv = built.image(), built.add("ShaderNodeMapping"), built.add("ShaderNodeUVMap", uv_map="Second")
    for name, value in (("Location", (0.1, 0.25, 0.0)), ("Rotation", (0.0, 0.0, 0.4)), ("Scale", (2.0, 1.5, 1.0))):
        mapping.inputs[name].default_value = value
    built.link(uv.outputs[0], mapping.inputs["Vector"])
    built.link(mapping.outputs[0], node.inputs["Vector"])
    built.link(node.outputs["Color"], built.principled.inputs["Base Color"])
    (use,) = built.read().channels["base color"].images
    assert use.uv_map == "Second" and sum(use.places, ()) == pytest.approx(sum(MOVED, ()), abs=1e-6)
    mapping.vector_type = "TEXTURE"  # the inverse: it takes these places back
    (use,) = built.read().channels["base color"].images
    (x, y), (dx, dy) = use.places[0], (use.places[1][0] - use.places[0][0], use.places[1][1] - use.places[0][1])
    ex, ey = use.places[2][0] - x, use.places[2][1] - y
    back = [(x + u * dx + v * ex, y + u * dy + v * ey) for u, v in MOVED]
    assert sum(back, ()) == pytest.approx(sum(PLACES, ()), abs=1e-6)


def test_groups_reroutes_and_muted_nodes_are_followed(built: Built) -> None:
    group = bpy.data.node_groups.new("Tint", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    gamma = group.nodes.new("ShaderNodeGamma")
    gamma.inputs["Gamma"].default_value, gamma.mute = 2.2, True
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], gamma.inputs["Color"])
    group.links.new(gamma.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    node, reroute = built.add("ShaderNodeGroup", node_tree=group), built.add("NodeReroute")
    built.link(built.image().outputs["Color"], reroute.inputs[0])
    built.link(reroute.outputs[0], node.inputs[0])
    built.link(node.outputs[0], built.principled.inputs["Base Color"])
    assert built.read().channels["base color"] == image_of("painted")
    gamma.mute = False
    assert built.read().channels["base color"].operations == {"GAMMA"}


def test_metallic_texture_that_is_black_is_told_from_one_with_metal(built: Built) -> None:
    node, separate = built.image("packed"), built.add("ShaderNodeSeparateColor")
    built.link(node.outputs["Color"], separate.inputs[0])
    built.link(separate.outputs["Blue"], built.principled.inputs["Metallic"])
    built.link(separate.outputs["Green"], built.principled.inputs["Roughness"])
    node.image.pixels.foreach_set((0.5, 0.5, 0.0, 1.0) * 16)
    assert {"Metallic: texture that is 0 everywhere", "Roughness map"} < built.rows()
    assert built.read().same_as["metallic"] == [constant(0.0)]
    assert built.read().channels["roughness"] == image_of("packed", channel="g")
    features.limits.cache_clear()
    node.image.pixels.foreach_set((0.5, 0.5, 0.0, 1.0) * 15 + (0.5, 0.5, 0.5, 1.0))
    assert "Metallic: texture with metal" in built.rows() and "metallic" not in built.read().same_as


def test_alpha_that_is_one_everywhere_is_told_from_holes(built: Built) -> None:
    node = built.image()
    built.link(node.outputs["Alpha"], built.principled.inputs["Alpha"])
    node.image.pixels.foreach_set((0.5, 0.5, 0.5, 1.0) * 16)
    assert "Alpha: image that is 1 everywhere" in built.rows()
    features.limits.cache_clear()
    node.image.pixels.foreach_set((0.5, 0.5, 0.5, 1.0) * 15 + (0.5, 0.5, 0.5, 0.0))
    assert "Alpha: image with holes or blended" in built.rows()


def test_weights_emission_and_specular_are_features_where_used(built: Built) -> None:
    values = {"Coat Weight": 0.5, "Sheen Weight": 0.5, "Transmission Weight": 1.0, "Anisotropic": 0.5, "Metallic": 0.5}
    values |= {
        "Thin Film Thickness": 300.0,
        "Subsurface Weight": 0.2,
        "Emission Strength": 2.0,
        "Alpha": 0.5,
        "Specular IOR Level": 0.0,
    }
    for name, value in values.items():
        built.principled.inputs[name].default_value = value
    rows = {"Coat", "Sheen", "Transmission", "Anisotropy", "Metallic: below 1", "Thin film", "Subsurface", "Emission: value"}
    assert built.rows() == rows | {"Alpha: value", "Specular level or tint", "Base color: plain"}


def test_output_of_an_engine_comes_before_that_of_all(built: Built) -> None:
    for engine, red in (("CYCLES", 0.1), ("EEVEE", 0.2)):
        closure, output = built.add("ShaderNodeBsdfDiffuse"), built.add("ShaderNodeOutputMaterial", target=engine)
        closure.inputs["Color"].default_value = (red, 0.5, 0.5, 1.0)
        built.link(closure.outputs[0], output.inputs["Surface"])
    facts = built.read()
    assert "Several outputs" in built.rows()
    assert facts.channels["base color"].factor == pytest.approx((0.1, 0.5, 0.5))
    assert facts.same_as["base color"][0].factor == pytest.approx((0.2, 0.5, 0.5))


def test_mix_with_transparent_is_alpha_and_other_mixes_are_their_own_feature(built: Built) -> None:
    clear, mix = built.add("ShaderNodeBsdfTransparent"), built.add("ShaderNodeMixShader")
    output = next(node for node in built.tree.nodes if node.type == "OUTPUT_MATERIAL")
    built.link(clear.outputs[0], mix.inputs[1])
    built.link(built.principled.outputs[0], mix.inputs[2])
    built.link(built.image().outputs["Alpha"], mix.inputs[0])
    built.link(mix.outputs[0], output.inputs["Surface"])
    assert built.read().channels["alpha"] == image_of("painted", channel="a") and "Mix or Add Shader" in built.rows()
    built.link(built.add("ShaderNodeBsdfGlossy").outputs[0], mix.inputs[1])
    assert "alpha" not in built.read().channels and "MIX_SHADER" in built.read().channels["base color"].operations


def importer_names(path: Path) -> dict[str, features.MaterialFacts]:
    bpy.ops.import_scene.gltf(filepath=str(path))
    found = {material.name: features.read(material) for material in bpy.data.materials}
    return {name: facts for name, facts in found.items() if facts is not None}


@empty
@pytest.mark.parametrize("name", GLTF_FILES)
def test_gltf_file_holds_what_blender_s_importer_makes_of_it(name: str) -> None:
    """Two ways to read one file: the specification, and Blender's importer and the walk of its nodes."""
    features.limits.cache_clear()
    held = gltf_file.read(ASSETS / name)
    read = importer_names(ASSETS / name)
    layers = [layer.name for layer in bpy.data.meshes[0].uv_layers]
    assert held.keys() == read.keys()
    verdicts = {
        (material, channel): judge(channel, [value], held[material].get(channel), [], [layers[0], *layers])
        for material, facts in read.items()
        for channel, value in facts.channels.items()
    }
    assert set(verdicts.values()) == {Verdict.KEPT}, verdicts


@pytest.mark.parametrize(("red", "attributes"), [(1.0, [set(), {"COLOR_0"}]), (0.5, [{"COLOR_0"}])])
def test_white_vertex_colors_are_as_good_as_none(red: float, attributes: list[set[str]], tmp_path: Path) -> None:
    part = figure()["head"]
    painted = Primitive(part, {"name": "Own", "pbrMetallicRoughness": {}}, colors(part, lambda _u, _v: (red, 1.0, 1.0, 1.0)))
    (tmp_path / "one.glb").write_bytes(glb("One", [painted], {}))
    assert [value.attributes for value in gltf_file.read(tmp_path / "one.glb")["Own"]["base color"]] == attributes


STAGE = """#usda 1.0
def Material "Painted" {
    token outputs:surface.connect = </Painted/Preview.outputs:surface>
    token outputs:mtlx:surface.connect = </Painted/OpenPBR.outputs:surface>
    def Shader "Preview" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Painted/Texture.outputs:rgb>
        float inputs:roughness.connect = </Painted/Texture.outputs:g>
        float inputs:opacity = 0.5
        token outputs:surface
    }
    def Shader "Texture" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @textures/painted.png@
        float2 inputs:st.connect = </Painted/Transform.outputs:result>
        float4 inputs:scale = (0.5, 0.25, 1, 1)
        float3 outputs:rgb
        float outputs:g
    }
    def Shader "Transform" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </Painted/Reader.outputs:result>
        float inputs:rotation = 22.918312
        float2 inputs:scale = (2, 1.5)
        float2 inputs:translation = (0.1, 0.25)
        float2 outputs:result
    }
    def Shader "Reader" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "Second"
        float2 outputs:result
    }
    def Shader "OpenPBR" {
        uniform token info:id = "ND_open_pbr_surface_surfaceshader"
        color3f inputs:base_color.connect = </Painted/Times.outputs:out>
        float inputs:base_metalness = 1
        float inputs:specular_roughness.connect = </Painted/Green.outputs:out>
        token outputs:surface
    }
    def Shader "Times" {
        uniform token info:id = "ND_multiply_color3"
        color3f inputs:in1.connect = </Painted/Image.outputs:out>
        color3f inputs:in2 = (0.5, 0.25, 1)
        color3f outputs:out
    }
    def Shader "Green" {
        uniform token info:id = "ND_extract_color3"
        color3f inputs:in.connect = </Painted/Image.outputs:out>
        int inputs:index = 1
        float outputs:out
    }
    def Shader "Image" {
        uniform token info:id = "ND_image_color3"
        asset inputs:file = @textures/painted.png@
        float2 inputs:texcoord.connect = </Painted/Place.outputs:out>
        color3f outputs:out
    }
    def Shader "Place" {
        uniform token info:id = "ND_place2d_vector2"
        float2 inputs:texcoord.connect = </Painted/Name.outputs:out>
        float2 inputs:scale = (0.5, 0.666666667)
        float inputs:rotate = -22.918312
        float2 inputs:offset = (-0.1, -0.25)
        float2 outputs:out
    }
    def Shader "Name" {
        uniform token info:id = "ND_geompropvalue_vector2"
        string inputs:geomprop = "Second"
        float2 outputs:out
    }
}
def Mesh "Mesh" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </Painted>
    texCoord2f[] primvars:Second = [(0, 0)] ( interpolation = "constant" )
}
"""


@pytest.mark.parametrize("kind", [usd_file.PREVIEW, usd_file.MATERIALX])
def test_usd_networks_are_read_by_their_specifications(kind: str, tmp_path: Path) -> None:
    """UsdTransform2d scales, rotates counter-clockwise and translates; place2d divides, rotates clockwise and subtracts."""
    bpy.utils.expose_bundled_modules()
    (tmp_path / "stage.usda").write_text(STAGE)
    held = usd_file.read(tmp_path / "stage.usda")["Painted"][kind]
    (color,) = held["base color"]
    (use,) = color.images
    assert color.factor == (0.5, 0.25, 1.0) and not color.operations
    assert (use.image, use.channel, use.uv_map) == ("painted", "rgb", "Second")
    assert sum(use.places, ()) == pytest.approx(sum(MOVED, ()), abs=1e-6)
    assert {other.channel for other in held["roughness"][0].images} == ({"g"})
    if kind == usd_file.PREVIEW:
        assert held["alpha"] == [constant(0.5)]
    else:
        assert held["metallic"] == [constant(1.0)]


def test_primvar_that_no_mesh_has_is_black(tmp_path: Path) -> None:
    bpy.utils.expose_bundled_modules()
    text = STAGE.replace("UsdUVTexture", "UsdPrimvarReader_float3")
    text = text.replace("asset inputs:file = @textures/painted.png@", 'string inputs:varname = "displayColor"', 1)
    (tmp_path / "stage.usda").write_text(text)
    assert usd_file.read(tmp_path / "stage.usda")["Painted"][usd_file.PREVIEW]["base color"] == [constant(0.0)]


UV_MAPS = ["UVMap", "UVMap", "Second"]
IMAGE = image_of("painted")
TINTED = Value((0.5, 0.25, 1.0), IMAGE.images)
NORMAL = IMAGE.but("NORMAL_MAP")


@pytest.mark.parametrize(
    ("channel", "expected", "held", "lines", "verdict"),
    [
        ("base color", IMAGE, [image_of("painted", uv_map="TEXCOORD_0")], [], Verdict.KEPT),
        ("base color", IMAGE, [image_of("painted", uv_map="TEXCOORD_1")], [], Verdict.LOST),
        ("base color", image_of("painted", uv_map="Second"), [image_of("painted", uv_map="TEXCOORD_1")], [], Verdict.KEPT),
        ("base color", IMAGE, [image_of("other")], [], Verdict.LOST),
        ("base color", IMAGE, [constant(0.8)], [], Verdict.LOST),
        ("base color", IMAGE, [constant(0.8), IMAGE], [], Verdict.KEPT),
        ("base color", IMAGE, None, ["Base color: the image painted is not supported, 0.8 is written"], Verdict.SAID),
        ("base color", IMAGE, None, ["Roughness: the image painted is not supported"], Verdict.LOST),
        ("base color", IMAGE, [image_of("baked_0")], ["Base color: baked to an image of 512 pixels"], Verdict.BAKED),
        ("base color", TINTED, [IMAGE], [], Verdict.LOST),
        ("base color", TINTED, [Value((0.49, 0.25, 0.98), IMAGE.images)], [], Verdict.KEPT),
        ("base color", image_of("painted", places=MOVED), [IMAGE], [], Verdict.LOST),
        ("base color", image_of("painted", places=MOVED), [image_of("painted", places=MOVED)], [], Verdict.KEPT),
        ("base color", IMAGE, [image_of("painted", places=((2.0, -1.0), (3.0, -1.0), (2.0, 0.0)))], [], Verdict.KEPT),  # repeats
        ("base color", IMAGE.but("GAMMA"), [IMAGE], [], Verdict.LOST),
        ("base color", IMAGE.but("GAMMA"), [IMAGE.but("ND_power_color3FA")], [], Verdict.KEPT),
        ("base color", Value(attributes=frozenset({""})), [constant(0.0)], [], Verdict.LOST),
        ("base color", Value(attributes=frozenset({"my color"})), [Value(attributes=frozenset({"my_color"}))], [], Verdict.KEPT),
        ("base color", IMAGE, [product((IMAGE, Value(attributes=frozenset({"COLOR_0"}))))], [], Verdict.LOST),
        ("roughness", constant(0.5), [constant(0.25)], [], Verdict.KEPT),  # a closure's alpha, the square
        ("roughness", constant(0.5), [constant(0.4)], [], Verdict.LOST),
        ("metallic", constant(1.0), [constant(0.0)], [], Verdict.LOST),
        ("normal", NORMAL, [NORMAL], [], Verdict.KEPT),
        ("normal", NORMAL, None, ["Normal: the node Normal Map is left out"], Verdict.SAID),
        ("alpha", image_of("painted", channel="a").but("MATH"), [image_of("painted", channel="a").but("CUTOFF")], [], Verdict.KEPT),
        ("coat", constant(0.5), [constant(0.0)], [], Verdict.LOST),
        ("emission", constant(2.0), [constant(1.0)], [], Verdict.KEPT),  # targets have units of their own
    ],
)
def test_verdict(channel: str, expected: Value, held: list[Value] | None, lines: list[str], verdict: Verdict) -> None:
    assert judge(channel, [expected], held, lines, UV_MAPS) == verdict


def test_constant_is_as_good_as_an_image_that_is_black_everywhere() -> None:
    image = image_of("packed", channel="b")
    assert judge("metallic", [image, constant(0.0)], [constant(0.0)], [], UV_MAPS) == Verdict.KEPT
    assert judge("metallic", [image, constant(0.0)], [constant(0.5)], [], UV_MAPS) == Verdict.LOST


def test_poorer_is_what_blender_s_own_export_carries_and_ours_does_not() -> None:
    channels = {"base color": [IMAGE], "roughness": [constant(0.5)], "normal": [NORMAL]}
    native = {"base color": [IMAGE], "roughness": [constant(1.0)], "normal": [NORMAL]}
    assert poorer(channels, native, {"base color": [IMAGE], "roughness": [constant(1.0)]}, UV_MAPS) == ["normal"]


@pytest.mark.parametrize(
    ("line", "channels"),
    [
        ("Base color: the node Noise Texture is not supported, 0.8 is written", {"base color"}),
        ("Color: the image painted is not supported", {"base color"}),
        ("Emission color: the node Gamma is not supported", {"emission"}),
        ("Specular roughness: baked to an image", {"roughness", "specular"}),
        ("Principled BSDF lost: tint of the highlight", {"specular"}),
        ("Principled BSDF has metal and transparency and is left alone", {"metallic", "alpha"}),
        ("the mesh has no UV map", set()),
    ],
)
def test_line_is_about_the_channel_it_names(line: str, channels: set[str]) -> None:
    assert {channel for channel in CHANNELS if mentions(line, channel)} == channels


@pytest.mark.parametrize(
    ("rms", "lines", "verdicts"),
    [
        (0.04, [], {"coat": Verdict.KEPT, "sheen": Verdict.KEPT}),
        (0.06, [], {"coat": Verdict.LOST, "sheen": Verdict.LOST}),
        (0.06, ["Coat: is not drawn"], {"coat": Verdict.SAID, "sheen": Verdict.NONE}),
        (None, [], {"coat": Verdict.NONE, "sheen": Verdict.NONE}),  # not in the picture
        (None, ["Coat: is not drawn"], {"coat": Verdict.SAID, "sheen": Verdict.NONE}),
    ],
)
def test_verdict_by_a_picture(rms: float | None, lines: list[str], verdicts: dict[str, str]) -> None:
    difference = None if rms is None else Difference(rms, 100)
    assert judge_picture(["coat", "sheen"], difference, 0.05, lines, False) == verdicts
    assert set(judge_picture(["coat", "sheen"], difference, 0.05, lines, True).values()) == {Verdict.LOST}


@pytest.mark.render
@empty
def test_difference_of_pictures_is_that_of_the_colors() -> None:
    """A Lambertian surface of 0.72 in place of 0.8 is 10 % darker in every pixel; the other material stays as it is."""
    materials = []
    for name, x in (("Changed", -1.2), ("Same", 1.2)):
        bpy.ops.mesh.primitive_uv_sphere_add(location=(x, 0.0, 3.0))
        material = bpy.data.materials.new(name)
        material.node_tree.nodes.clear()
        closure = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
        output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
        material.node_tree.links.new(closure.outputs[0], output.inputs["Surface"])
        closure.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
        bpy.context.object.data.materials.append(material)
        materials.append(material)
    stage = Stage(64)
    before = stage.draw(engines.CYCLES)
    materials[0].node_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (0.72, 0.72, 0.72, 1.0)
    found = stage.compare(stage.draw(engines.CYCLES), before, {item.name: item.pass_index for item in materials})
    assert found["Changed"].rms == pytest.approx(0.1, abs=1e-5) and found["Same"].rms == pytest.approx(0.0, abs=1e-6)
    # two disks of a radius of 1 in a square whose half side is that of a sphere around both boxes, each a pixel smaller
    whole = math.pi * (32.0 / math.hypot(2.2, 1.0, 1.0) - 1.0) ** 2
    assert 0.7 * whole < found["Same"].pixels < whole


def record(file: str, **verdicts: str) -> dict[str, Any]:
    """A record of an asset with one material, which has one feature a channel, all targets alike."""
    rows = [{"row": channel.capitalize(), "channel": channel} for channel in verdicts]
    given = {target: dict(verdicts) for target in table.TARGETS}
    material = {"name": "Own", "converted": True, "features": rows, "verdicts": given}
    material |= {"poorer": {}, "held": {}, "pictures": {}}
    return {"file": file, "failures": {}, "materials": [{**material, "channels": dict.fromkeys(verdicts, "expected")}]}


def test_figures_count_materials_and_whole_assets() -> None:
    records = [record("a.glb", coat="kept"), record("b.glb", coat="said", normal="baked"), record("c.glb", normal="lost")]
    line = next(line for line in table.features(records) if (line["feature"], line["target"]) == ("Coat", "gltf"))
    assert (line["assets"], line["materials"], line["kept"], line["said"], line["lost"]) == (2, 2, 1, 1, 0)
    assert all((line["whole"], line["said"], line["lost"]) == (1, 2, 1) for line in table.shares(records))
    assert {fault[:4] for fault in table.faults(records)} == {
        ("c.glb", "Own", label, "normal lost unsaid") for label in table.TARGETS.values()
    }


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "FOLDER"),
        (("nowhere",), "not a folder"),
        ((".",), "holds no file"),
        ((".", "--limit", "0"), "whole number"),
        ((".", "--match", "/tmp/*"), "pattern"),
    ],
)
def test_wrong_input_is_one_line(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    result = run_script("assets_census.py", *arguments, cwd=tmp_path)
    assert_bad_input(result, "assets_census.py")
    assert words in result.stderr and not list(tmp_path.iterdir())


def test_bad_assets_are_a_line_each_and_end_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "broken.glb").write_bytes(b"glTF\x02\x00\x00\x00")
    (folder / "empty.usda").write_text("#usda 1.0\n")
    (folder / skin.FILE).write_bytes((ASSETS / skin.FILE).read_bytes())
    result = run_script("assets_census.py", folder, "--json", "--processes", "2", "--resolution", "0", cwd=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    document = json.loads((tmp_path / "census" / "census.json").read_text())
    assert [error["file"] for error in document["errors"]] == ["broken.glb", "empty.usda"]
    assert all("\n" not in error["error"] for error in document["errors"])
    (found,) = document["assets"]
    materials = {material["name"]: material for material in found["materials"]}
    assert materials.keys() == {"Skin", "Clothes"}
    rows = {feature["row"] for feature in materials["Skin"]["features"]}
    assert {"Group around a closure", "Subsurface", "Coat", "Alpha: image that is 1 everywhere"} < rows


def test_asset_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / skin.FILE).write_bytes((ASSETS / skin.FILE).read_bytes())
    result = run_script(
        "assets_census.py", folder, "--seconds", "1", "--resolution", "0", cwd=tmp_path
    )  # Blender alone takes longer to start and export
    assert result.returncode == 0 and "took longer than 1 s" in result.stdout
