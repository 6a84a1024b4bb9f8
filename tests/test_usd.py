# SPDX-License-Identifier: GPL-3.0-or-later
"""USD: our materials as Blender's exporters write them, read by other programs and imported again."""

import json
import math
import os
import random
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import bpy

import pytest

from support import every_model, show
from true_diffuse.addon import models, usd
from true_diffuse.addon.blender import report
from true_diffuse.addon.material import materials, presets
from true_diffuse.addon.material.expression import Constant
from true_diffuse.addon.material.read import group_node, identifier, plain, read_surface
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.models.color import LUMINANCE
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.addon.nodes.graph import Graph, Value
from true_diffuse.addon.nodes.rough_diffuse import QUALITIES
from true_diffuse.addon.usd import materialx, nearest

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
METHODS = ("Random Walk", "Christensen-Burley", "Random Walk (Skin)", "Random Walk (Legacy)")
SIGMAS = (0.2, 0.33, 1.0)
COLOR = (0.9, 0.5, 0.1, 1.0)
INPUTS = {"Roughness": 0.4, "IOR": 1.4}
COMPENSATED = {"fujii", "eon", "cycles_diffuse", "pitted"}  # EON or made of it; the others become equation (1) or Lambert
FIXED_ROUGHNESS = {"lambert": 0.0, "wolff": 0.0, "pitted": 1.0}
OTHER_KIND = "the node Material Output is of an unknown kind, ShaderNodeOther"
EXACT = ("lambert", "oren_nayar", "eon")  # the models that MaterialX has
# Prints each material's shaders and custom data, with the package usd-core, in a process without bpy.
INSPECT = """
import json, sys
from pxr import Usd, UsdGeom, UsdShade
stage = Usd.Stage.Open(sys.argv[1])
def value(socket):
    sources = socket.GetConnectedSources()[0]
    if sources:
        return f"{sources[0].source.GetPrim().GetName()}.{sources[0].sourceName}"
    result = socket.Get()
    return list(result) if hasattr(result, "__len__") and not isinstance(result, str) else getattr(result, "path", result)
seen = {"metersPerUnit": UsdGeom.GetStageMetersPerUnit(stage), "materials": {}, "bound": {}, "subsets": {}}
for prim in stage.Traverse():
    if prim.IsA(UsdShade.Material):
        shaders = {}
        for child in prim.GetChildren():
            shader = UsdShade.Shader(child)
            shaders[child.GetName()] = {socket.GetBaseName(): value(socket) for socket in shader.GetInputs()}
            shaders[child.GetName()]["id"] = shader.GetShaderId()
        outputs = {output.GetFullName().removeprefix("outputs:"): value(output) for output in UsdShade.Material(prim).GetOutputs()}
        data = prim.GetCustomDataByKey("trueDiffuse") or {}
        nodes = json.loads(data.get("nodes", '{"nodes": []}'))["nodes"]
        group = next((node["group"] for node in nodes if "group" in node), None)
        seen["materials"][prim.GetName()] = {
            "shaders": shaders, "outputs": outputs, "group": group, "notCarried": list(data.get("notCarried", ())),
        }
    elif prim.IsA(UsdGeom.Mesh):
        seen["bound"][prim.GetName()] = UsdShade.MaterialBindingAPI(prim).GetDirectBinding().GetMaterialPath().name
    elif prim.IsA(UsdGeom.Subset):
        name = UsdShade.MaterialBindingAPI(prim).GetDirectBinding().GetMaterialPath().name
        seen["subsets"].setdefault(prim.GetParent().GetName(), {})[name] = list(UsdGeom.Subset(prim).GetIndicesAttr().Get())
print(json.dumps(seen))
"""


pytestmark = pytest.mark.usefixtures("empty_file")


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """What the add-on registers for USD."""
    usd.register()
    report.take()
    yield
    usd.unregister()


def export(path: Path, **options: object) -> Path:
    assert bpy.ops.wm.usd_export(filepath=str(path), **options) == {"FINISHED"}
    return path


def inspect(path: Path) -> dict:
    command = [sys.executable, "-c", INSPECT, str(path)]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def check(path: Path) -> list[dict]:
    """Return the records of scripts/check_usd.py, which runs without bpy."""
    command = [sys.executable, str(SCRIPTS / "check_usd.py"), "--json", str(path)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.stdout, result.stderr
    return json.loads(result.stdout)


def rough(model: str, roughness: float = 0.4, **inputs: object) -> bpy.types.Material:
    name = f"{model} {roughness:g}"
    return materials.create(name, ROUGH_DIFFUSE, **{"Model": model, "Roughness": roughness, "Color": COLOR} | inputs)


def picture(path: Path, name: str = "painted") -> bpy.types.Image:
    """Return a new image that is on disk."""
    image = bpy.data.images.new(name, 4, 4)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    return image


def link_image(material: bpy.types.Material, socket: str, image: bpy.types.Image | None) -> bpy.types.Node:
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], group_node(material)[0].inputs[socket])
    return node


def values(material: bpy.types.Material) -> dict[str, object]:
    node, group, _ = group_node(material)
    return {"group": group.key} | {socket.name: plain(socket.default_value) for socket in node.inputs}


def average(model: models.Model, rho: float) -> float:
    """Return the average albedo by quadrature, to about 1e-5."""
    return models.average_albedo(model, rho, order=16)


def nearest_text(model: str) -> str:
    instead = f"{nearest.Nearest(model, INPUTS).stands_in} stands for it"
    return f"the reflectance model {model} in MaterialX is not supported, {instead}"


def test_validators_find_no_problem_and_generators_make_shaders(tmp_path: Path) -> None:
    made = [rough(model.label, sigma) for key, model in MODELS.items() for sigma in (SIGMAS if key in EXACT else SIGMAS[:1])]
    show(*made)
    show(materials.create("Coated", SUBSURFACE, Subsurface=0.6))
    show(materials.create("Shiny", SPECULAR_GROUP))
    painted = materials.create("Painted", SUBSURFACE)
    for socket in ("Color", "Roughness", "Subsurface Radius", "Specular Roughness"):
        link_image(painted, socket, picture(tmp_path / f"{socket.replace(' ', '')}.png", socket))
    show(painted)
    marked = rough("EON", 0.5)
    materials.paint(marked, group_node(marked)[0].inputs["Color"], "Albedo", 0.7)
    item = show(marked)
    item.data.color_attributes.new("Albedo", "FLOAT_COLOR", "POINT")
    records = check(export(tmp_path / "all.usda"))
    assert [record["problems"] for record in records if record["problems"]] == []
    assert len(records) == 1 + len(made) + 4
    assert all(min(record["lines"].values()) > 10 for record in records[1:])

    by_name = {record["material"]: record for record in records}
    oren_nayar, eon = ([by_name[identifier(f"{name} {sigma:g}")] for sigma in SIGMAS] for name in ("Oren-Nayar", "EON"))
    if "rms" not in oren_nayar[0]:
        pytest.skip("no graphics driver runs the GLSL that MaterialX generates")
    assert max(record["worst"] for record in oren_nayar) < 1e-6
    assert max(record["worst_beside"] for record in eon) < 1e-4
    assert min(record["worst"] for record in eon) > 0.01  # MaterialX clamps L.V at 0; once it does not, this may go
    assert by_name["Shiny"]["rms"] < 0.04
    assert by_name["Fujii_0_2"]["rms"] < 0.04 and by_name["Oren_Nayar_1994_0_2"]["rms"] < 0.04


@every_model
def test_closure_and_preview_have_the_models_albedo(model: models.ReflectanceModel, tmp_path: Path) -> None:
    show(rough(model.label, 0.4, IOR=1.4))
    (material,) = inspect(export(tmp_path / "one.usda"))["materials"].values()
    assert material["outputs"] == {"surface": "Preview_surface.surface", "mtlx:surface": "MaterialX_surface.out"}
    expected = [average(model.reference(INPUTS), rho) for rho in COLOR[:3]]

    preview = material["shaders"]["Preview_surface"]
    assert preview["diffuseColor"] == pytest.approx(expected, rel=1e-4)
    assert (preview["roughness"], preview["ior"], preview["specularColor"]) == (1.0, 1.0, [0.0, 0.0, 0.0])
    assert preview["useSpecularWorkflow"] == 1

    closure = material["shaders"]["MaterialX_diffuse"]
    assert closure["id"] == "ND_oren_nayar_diffuse_bsdf"
    compensated, roughness = model.id in COMPENSATED, FIXED_ROUGHNESS.get(model.id, 0.4)
    assert closure["energy_compensation"] is compensated
    assert closure["roughness"] == pytest.approx(roughness)
    stand_in = models.Eon(roughness) if compensated else models.OrenNayar(roughness)
    assert [average(stand_in, rho) for rho in closure["color"]] == pytest.approx(expected, rel=1e-4)
    messages = [] if model.id in EXACT else [nearest_text(model.label)]
    assert material["notCarried"] == messages
    assert report.take() == [f"True Diffuse: {model.label} 0.4: {message}" for message in messages]


@pytest.mark.parametrize("model", EXACT)
def test_models_that_materialx_has_keep_their_color(model: str, tmp_path: Path) -> None:
    show(rough(MODELS[model].label))
    (material,) = inspect(export(tmp_path / "one.usda"))["materials"].values()
    assert material["shaders"]["MaterialX_diffuse"]["color"] == pytest.approx(COLOR[:3])


@every_model
@pytest.mark.parametrize("roughness", [-1.0, 0.0, 0.5, 1.5, math.inf, math.nan])
def test_colors_stay_in_range_for_any_input(model: models.ReflectanceModel, roughness: float) -> None:
    closure = nearest.Nearest(model.label, {"Roughness": roughness, "IOR": 1.5})
    values = (-1.0, 0.0, 0.5, 1.0, 2.0, math.nan)
    assert all(0.0 <= closure.color(rho) <= 1.0 + 1e-9 and 0.0 <= closure.albedo(rho) <= 1.02 for rho in values)


def test_unregistered_model_raises() -> None:
    with pytest.raises(ValueError):
        nearest.Nearest("Minnaert", INPUTS)


def test_subsurface_network(tmp_path: Path) -> None:
    inputs = {"Subsurface Radius": (1.5, 1.0, 0.5), "Scale": 2.0, "Subsurface": 0.7, "Specular": 0.5, "Specular Roughness": 0.3}
    show(materials.create("Skin", SUBSURFACE, Color=COLOR, IOR=1.5, Model="EON", Roughness=0.4, **inputs))
    shaders = inspect(export(tmp_path / "one.usda"))["materials"]["Skin"]["shaders"]
    assert shaders["MaterialX_subsurface"]["color"] == pytest.approx(COLOR[:3])
    base = shaders["MaterialX_base"]
    assert (base["fg"], base["bg"]) == ("MaterialX_subsurface.out", "MaterialX_diffuse.out")
    assert base["mix"] == pytest.approx(0.7)
    coat = shaders["MaterialX_coat"]
    assert (coat["weight"], coat["ior"]) == pytest.approx((0.5, 1.5))
    assert coat["roughness"] == pytest.approx([0.09, 0.09])  # alpha
    assert shaders["MaterialX_layers"]["top"] == "MaterialX_coat.out"
    assert shaders["MaterialX_layers"]["base"] == "MaterialX_base.out"
    assert shaders["MaterialX_surface"]["bsdf"] == "MaterialX_layers.out"

    preview = shaders["Preview_surface"]
    below = [0.3 * average(models.Eon(0.4), rho) + 0.7 * rho for rho in COLOR[:3]]
    assert preview["diffuseColor"] == pytest.approx(below, rel=1e-4)
    assert preview["roughness"] == pytest.approx(0.3)
    assert preview["specularColor"] == pytest.approx([0.5 * 0.04] * 3)  # half of F0 at 1.5
    assert ((preview["ior"] - 1.0) / (preview["ior"] + 1.0)) ** 2 == pytest.approx(0.5 * 0.04)


@pytest.mark.parametrize(("units", "meters_per_unit"), [("METERS", 1.0), ("CENTIMETERS", 0.01)])
@pytest.mark.parametrize("scale_length", [1.0, 0.01])
def test_subsurface_radius_is_in_the_stages_units(units: str, meters_per_unit: float, scale_length: float, tmp_path: Path) -> None:
    show(materials.create("Skin", SUBSURFACE, Scale=2.0, **{"Subsurface Radius": (1.5, 1.0, 0.5)}))
    bpy.context.scene.unit_settings.scale_length = scale_length
    seen = inspect(export(tmp_path / "one.usda", convert_scene_units=units))
    assert seen["metersPerUnit"] == meters_per_unit
    # Blender writes lengths in its own units, and where the stage has smaller ones a scale on the root
    lengths = [0.001 * mm / scale_length / meters_per_unit for mm in (3.0, 2.0, 1.0)]
    assert seen["materials"]["Skin"]["shaders"]["MaterialX_subsurface"]["radius"] == pytest.approx(lengths)


def single(draw: random.Random, low: float, high: float) -> float:
    """Return a random 32-bit float."""
    return struct.unpack("f", struct.pack("f", draw.uniform(low, high)))[0]


def test_round_trip_is_equal(tmp_path: Path) -> None:
    draw = random.Random(6)
    made = []
    for model in MODELS.values():
        for mode in QUALITIES:
            color = (*(single(draw, 0.0, 1.0) for _ in range(3)), 1.0)
            inputs = {"Model": model.label, "Quality": mode, "Color": color, "Roughness": single(draw, 0.0, 1.5)}
            made.append(materials.create("Rough", ROUGH_DIFFUSE, IOR=single(draw, 1.0, 3.0), **inputs))
    for method in METHODS:
        inputs = {"Subsurface Radius": tuple(single(draw, 0.0, 9.0) for _ in range(3)), "Scale": single(draw, 0.0, 1e-6)}
        made.append(materials.create("Below", SUBSURFACE, Method=method, Subsurface=single(draw, 0.0, 1.0), **inputs))
    for mode in ("Balanced", "Exact for Chosen Lights"):
        inputs = {"Specular": single(draw, 0.0, 1.0), "Exponent": single(draw, 0.0, 900.0)}
        made.append(materials.create("Shiny", SPECULAR_GROUP, Quality=mode, **inputs))
    made.append(materials.create("All", PRINCIPLED, Metallic=single(draw, 0.0, 1.0)))
    made += [materials.create(preset.name, SUBSURFACE, **preset.inputs) for preset in presets.PRESETS.values()]
    for index, material in enumerate(made):
        material.name = f"M{index}"
        show(material)
    expected = {material.name: values(material) for material in made}
    export(tmp_path / "all.usda")
    again = {}
    for _ in range(2):  # once more: what is read can be written again
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.usd_import(filepath=str(tmp_path / "all.usda"))
        again = {material.name: values(material) for material in bpy.data.materials}
        assert again == expected
        export(tmp_path / "all.usda")
    assert len(bpy.data.node_groups) and all(group.trees() for group in GROUPS)


@pytest.mark.parametrize("suffix", ["usda", "usdz"])
def test_textures_are_written_and_read(suffix: str, tmp_path: Path) -> None:
    material = rough("Fujii", 0.4)
    node = link_image(material, "Color", picture(tmp_path / "in.png"))
    node.extension = "MIRROR"
    uv = material.node_tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "Second Map"
    material.node_tree.links.new(uv.outputs["UV"], node.inputs["Vector"])
    data = picture(tmp_path / "sigma.png", "sigma")
    data.colorspace_settings.name = "Non-Color"
    link_image(material, "Roughness", data)
    show(material).data.uv_layers.new(name="Second Map")
    path = export(tmp_path / f"one.{suffix}")
    assert [record["problems"] for record in check(path)] == [[], []]
    shaders = inspect(path)["materials"]["Fujii_0_4"]["shaders"]
    preview, image = shaders["Preview_image_painted"], shaders["MaterialX_image_painted"]
    sigma, gray = shaders["MaterialX_image_sigma"], shaders["MaterialX_dot"]
    assert shaders["Preview_surface"]["diffuseColor"] == "Preview_image_painted.rgb"
    assert (preview["sourceColorSpace"], preview["wrapS"]) == ("sRGB", "mirror")
    usual = MODELS["fujii"].reference({"Roughness": 0.33})  # as the roughness varies
    assert preview["scale"][:3] == pytest.approx([average(usual, 0.5) / 0.5] * 3, rel=1e-4)
    assert image["id"] == "ND_image_color3" and image["uaddressmode"] == "mirror"
    assert shaders[image["texcoord"].partition(".")[0]]["geomprop"] == "Second_Map"
    assert shaders["MaterialX_diffuse"]["roughness"] == "MaterialX_dot.out"
    assert gray["in1"] == "MaterialX_image_sigma.out" and gray["in2"] == pytest.approx(LUMINANCE)
    if suffix == "usda":
        assert (tmp_path / preview["file"]).is_file() and (tmp_path / sigma["file"]).is_file()

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path))
    assert report.take() == [f"True Diffuse: Fujii 0.4: {nearest_text('Fujii')}"]  # of the export
    (back,) = bpy.data.materials
    found, _, _ = group_node(back)
    painted, sigma = (found.inputs[name].links[0].from_node for name in ("Color", "Roughness"))
    if painted.type == "VECT_MATH":
        painted = painted.inputs[0].links[0].from_node
    assert painted.image.size[:] == (4, 4) and painted.extension == "MIRROR"
    assert painted.inputs["Vector"].links[0].from_node.uv_map == "Second_Map"
    assert painted.image.colorspace_settings.name == "sRGB" and sigma.image.colorspace_settings.name == "Non-Color"


def test_color_attribute_is_written_and_read(tmp_path: Path) -> None:
    material = rough("EON")
    materials.paint(material, group_node(material)[0].inputs["Color"], "my color", 0.7)
    show(material).data.color_attributes.new("my color", "FLOAT_COLOR", "POINT")
    shaders = inspect(export(tmp_path / "one.usda"))["materials"]["EON_0_4"]["shaders"]
    assert shaders["MaterialX_attribute"]["geomprop"] == "my_color"
    assert shaders["MaterialX_multiply"]["in2"] == pytest.approx(0.7)
    assert shaders["Preview_attribute"]["varname"] == "my_color"
    what = "what is made of the color attribute my color, in UsdPreviewSurface"
    assert report.take() == [f"True Diffuse: EON 0.4: Base color: {what} is not supported, the attribute alone is written there"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "one.usda"))
    scale = group_node(bpy.data.materials[0])[0].inputs["Color"].links[0].from_node
    assert scale.inputs["Scale"].default_value == pytest.approx(0.7)
    assert scale.inputs["Vector"].links[0].from_node.attribute_name == "my_color"


def test_unsupported_link_is_reported(tmp_path: Path) -> None:
    material = rough("EON")
    tree, node = material.node_tree, group_node(material)[0]
    tree.links.new(tree.nodes.new("ShaderNodeTexVoronoi").outputs["Color"], node.inputs["Color"])
    number = tree.nodes.new("ShaderNodeValue")
    number.outputs[0].default_value = 0.25
    tree.links.new(number.outputs[0], node.inputs["Roughness"])
    show(material)
    material = inspect(export(tmp_path / "one.usda"))["materials"]["EON_0_4"]
    assert material["shaders"]["MaterialX_diffuse"]["roughness"] == pytest.approx(0.25)
    assert material["shaders"]["MaterialX_diffuse"]["color"] == pytest.approx(COLOR[:3])
    assert material["notCarried"] == [
        "Base color: the texture voronoi color (Voronoi Texture) is not supported, the socket's own value is written"
    ]


def test_other_materials_and_other_hooks_are_left_alone(tmp_path: Path) -> None:
    class OtherHook(bpy.types.USDHook):
        bl_idname = "OtherHook"
        bl_label = "Other"

        @staticmethod
        def on_material_export(_context: object, _material: bpy.types.Material, usd_material: object) -> bool:
            from pxr import UsdShade

            path = usd_material.GetPath().AppendChild("Theirs")
            shader = UsdShade.Shader.Define(usd_material.GetPrim().GetStage(), path)
            output = shader.CreateOutput("out", usd_material.CreateSurfaceOutput("ri").GetTypeName())
            usd_material.CreateSurfaceOutput("ri").ConnectToSource(output)
            return True

    bpy.utils.register_class(OtherHook)
    try:
        principled = bpy.data.materials.new("Principled")
        show(principled)
        show(rough("EON"))
        seen = inspect(export(tmp_path / "hook.usda", generate_materialx_network=True))["materials"]
        usd.unregister()
        plain_export = inspect(export(tmp_path / "plain.usda", generate_materialx_network=True))["materials"]
        usd.register()
    finally:
        bpy.utils.unregister_class(OtherHook)
    assert seen["Principled"] == plain_export["Principled"]
    assert "Theirs" in seen["EON_0_4"]["shaders"] and seen["EON_0_4"]["outputs"]["ri:surface"] == "Theirs.out"
    ours = {"MaterialX_surface", "MaterialX_diffuse", "Preview_surface"}
    assert set(seen["EON_0_4"]["shaders"]) == ours | {"Theirs"}  # not what Blender makes of the group


@pytest.mark.parametrize("target", ["ALL", "EEVEE", "CYCLES"])
def test_surface_of_any_engine_is_written(target: str, tmp_path: Path) -> None:
    material = materials.create("Clay", ROUGH_DIFFUSE)
    material.node_tree.get_output_node("ALL").target = target
    show(material)
    assert inspect(export(tmp_path / "one.usda"))["materials"]["Clay"]["group"] == "rough_diffuse"


def test_names_that_usd_changes_or_makes_equal(tmp_path: Path) -> None:
    names = ["a b", "a.b", "1 chalk", "Ölfarbe", "/x", "a_b"]
    kinds = (ROUGH_DIFFUSE, SUBSURFACE, SPECULAR_GROUP, PRINCIPLED, ROUGH_DIFFUSE, SUBSURFACE)
    made = [materials.create(name, group) for name, group in zip(names, kinds, strict=True)]
    for material in made:
        show(material)
    other = bpy.data.materials.new("a/b")
    show(other)
    seen = inspect(export(tmp_path / "names.usda"))
    groups = [seen["materials"][seen["bound"][item.data.name.replace(".", "_")]]["group"] for item in bpy.data.objects[:6]]
    assert groups == [group.key for group in kinds]
    assert seen["materials"][seen["bound"]["Plane_006"]]["group"] is None
    assert len(seen["materials"]) == 7 and report.take() == []
    assert check(tmp_path / "names.usda")[0]["problems"] == []


def painted(name: str, folder: Path) -> bpy.types.Material:
    """Return a material of ours with an image in a file of its own."""
    material = materials.create(name, ROUGH_DIFFUSE)
    link_image(material, "Color", picture(folder / f"{len(bpy.data.materials)}.png"))
    return material


@pytest.mark.parametrize("options", [{}, {"allow_unicode": False}, {"generate_preview_surface": False}], ids=["", "ascii", "mtlx"])
def test_materials_of_equal_names_keep_their_faces_and_images(options: dict[str, bool], tmp_path: Path) -> None:
    """The faces of a mesh, one for each material, and a mesh for each; a material of Blender's is among them."""
    names = ("m²", "m½", "m_", "n")
    made = [painted(names[0], tmp_path), bpy.data.materials.new(names[1]), *(painted(name, tmp_path) for name in names[2:])]
    show(*made)
    for material in made:
        show(material)
    seen = inspect(export(tmp_path / "names.usda", **options))
    bound = [seen["bound"][f"Plane_{index:03}"] for index in range(1, 5)]
    assert len(set(bound)) == 4
    assert [seen["subsets"]["Plane"][name] for name in bound] == [[0], [1], [2], [3]]
    assert [seen["materials"][name]["group"] for name in bound] == ["rough_diffuse", None, "rough_diffuse", "rough_diffuse"]
    for index in (0, 2, 3):
        shaders = seen["materials"][bound[index]]["shaders"].values()
        assert {values["file"] for values in shaders if "file" in values} == {f"./textures/{index + 1}.png"}
    shown = {name: seen["materials"][name]["outputs"]["surface"].partition(".")[0] for name in bound}
    assert {shader == "previewShader" for shader in shown.values()} == {"generate_preview_surface" in options}
    assert report.take() == []


def test_materials_of_equal_names_on_faces_that_modifiers_change_are_reported(tmp_path: Path) -> None:
    item = show(materials.create("a b", ROUGH_DIFFUSE), materials.create("a.b", SUBSURFACE))
    item.modifiers.new("", "TRIANGULATE")
    export(tmp_path / "names.usda")
    (line,) = report.take()
    assert "has the same name as a" in line and line.endswith("in USD, and is replaced by it on Plane")


def test_missing_texture_and_broken_link(tmp_path: Path) -> None:
    material = rough("EON")
    image = picture(tmp_path / "gone.png")
    link_image(material, "Color", image)
    (tmp_path / "gone.png").unlink()
    image.reload()
    empty = rough("Oren-Nayar")
    link_image(empty, "Color", None)
    cut = rough("Lambert")
    cut.node_tree.links.remove(cut.node_tree.get_output_node("ALL").inputs["Surface"].links[0])
    without_group = rough("Fujii")
    group_node(without_group)[0].node_tree = None
    for item in (material, empty, cut, without_group):
        show(item)
    seen = inspect(export(tmp_path / "bad.usda"))["materials"]
    assert seen["EON_0_4"]["shaders"]["MaterialX_diffuse"]["color"] == pytest.approx(COLOR[:3])
    assert "missing image painted" in seen["EON_0_4"]["notCarried"][0]
    assert "without an image" in seen["Oren_Nayar_0_4"]["notCarried"][0]
    assert seen["Lambert_0_4"]["group"] is None and seen["Fujii_0_4"]["group"] is None
    assert check(tmp_path / "bad.usda")[0]["problems"] == []


def test_five_hundred_materials(tmp_path: Path) -> None:
    labels = [model.label for model in MODELS.values()]
    show(*(materials.create(f"M{i}", ROUGH_DIFFUSE, Model=labels[i % len(labels)], Roughness=0.001 * i) for i in range(500)))
    started = time.monotonic()
    seen = inspect(export(tmp_path / "many.usdc"))
    assert time.monotonic() - started < 30.0
    assert sum(material["group"] == "rough_diffuse" for material in seen["materials"].values()) == 500


@pytest.mark.parametrize("kind", [RuntimeError, KeyError, "USD"])
def test_failure_is_reported_and_the_export_goes_on(kind: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_arguments: object) -> None:
        if kind == "USD":
            from pxr import Usd, UsdShade

            UsdShade.Material(Usd.Prim()).CreateSurfaceOutput()
        raise kind("no\nuse")

    monkeypatch.setattr(materialx, "network", fail)
    show(rough("EON"))
    seen = inspect(export(tmp_path / "one.usda"))["materials"]
    assert seen["EON_0_4"]["group"] is None
    (line,) = report.take()
    assert line.startswith("True Diffuse: EON 0.4: is left as Blender has it") and "\n" not in line


@pytest.mark.parametrize(
    ("changes", "messages"),
    [
        (
            {'"Model":"EON"': '"Model":"NOE"', '"IOR"': '"Iron"'},
            ["Model: 'NOE' is not a valid value", "Iron: the group has no such input"],
        ),
        ({'"Roughness":0.4': '"Roughness":"much"'}, ["Roughness: 'much' is not a valid value"]),
        ({"int format =": "int verse ="}, ["is left as Blender has it: 'format'"]),
        ({'{"format":1': '{"format":9'}, ["is left as Blender has it: nodes in format 9, which a newer version has written"]),
        ({'"group":"rough_diffuse"': '"group":"other"'}, ["the group other is unknown"]),
        ({'"kind":"ShaderNodeOutputMaterial"': '"kind":"ShaderNodeOther"'}, [OTHER_KIND]),
    ],
    ids=["inputs", "value", "format", "newer", "group", "kind"],
)
def test_import_of_damaged_custom_data(changes: dict[str, str], messages: list[str], tmp_path: Path) -> None:
    show(rough("EON"))
    path = export(tmp_path / "one.usda")
    text = path.read_text()
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert bpy.ops.wm.usd_import(filepath=str(path)) == {"FINISHED"}
    assert sorted(report.take()) == sorted(f"True Diffuse: EON_0_4: {message}" for message in messages)
    if group_node(bpy.data.materials[0]):
        assert values(bpy.data.materials[0])["Color"] == COLOR


def test_material_keeps_blenders_nodes_where_ours_cannot_be_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def rebuild(material: bpy.types.Material, *_: object) -> list[str]:
        material.node_tree.nodes.clear()
        raise ValueError("half built")

    show(rough("EON"))
    export(tmp_path / "one.usda")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    monkeypatch.setattr("true_diffuse.addon.usd.restore.restore", rebuild)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "one.usda"))
    output = bpy.data.materials[0].node_tree.get_output_node("ALL")
    assert output.inputs["Surface"].links[0].from_node.bl_idname == "ShaderNodeBsdfPrincipled"
    assert report.take() == ["True Diffuse: EON_0_4: is left as Blender has it: half built"]


def test_missing_image_is_reported_on_import(tmp_path: Path) -> None:
    material = rough("EON")
    link_image(material, "Color", picture(tmp_path / "in.png"))
    show(material)
    path = export(tmp_path / "one.usda")
    (tmp_path / "textures" / "in.png").unlink()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path))
    assert report.take() == ["True Diffuse: EON_0_4: the image painted is missing"]


def test_older_groups_are_read_by_the_names_of_this_version() -> None:
    old_names = {"Subsurface Radius": "Mean Free Path"}
    sockets = tuple(
        replace(socket, name=old_names.get(socket.name, socket.name))
        for socket in SUBSURFACE.inputs
        if socket.kind != "NodeSocketMenu"
    )

    def build(graph: Graph) -> dict[str, Value]:
        return {"BSDF": graph.diffuse((1.0, 1.0, 1.0, 1.0), graph.geometry("Normal"))}

    old = replace(SUBSURFACE, version=1, inputs=sockets, build=build)
    material = materials.create("Skin", old, **{"Mean Free Path": (1.5, 1.0, 0.5)})
    assert read_surface(material).surface["subsurface_radius"] == Constant((1.5, 1.0, 0.5))


@pytest.mark.render
@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize(
    ("model", "sigma", "preview"),
    [*((model, sigma, False) for model in ("PAPER", "EON") for sigma in SIGMAS), ("LAMBERT", 0.0, True)],
)
def test_storm_renders_the_model(model: str, sigma: float, preview: bool, tmp_path: Path) -> None:
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import rough
    from true_diffuse.scripts.studies import usd as study

    case = study.Case(getattr(rough, model), sigma)
    assert study.rendered(sphere_under_sun(64), case, 60.0, tmp_path / "one.usdc", preview=preview) < 0.02


def run(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, SCRIPTS / "export_usd.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd, env=os.environ)


def test_script_writes_a_built_scene(tmp_path: Path) -> None:
    result = run("--scene", "five", "--character", "monkey", "--out", "new/five.usda", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "Wrote" in result.stdout and "100%" in result.stdout.replace(" %", "%")
    seen = inspect(tmp_path / "new" / "five.usda")["materials"]
    assert sum(material["group"] is not None for material in seen.values()) == 5
    assert check(tmp_path / "new" / "five.usda")[0]["problems"] == []


def test_script_writes_a_material_of_a_file_also_over_an_older_result(tmp_path: Path) -> None:
    show(materials.create("Chalk", ROUGH_DIFFUSE))
    show(rough("EON"))
    painted = materials.create("Skin", SUBSURFACE)
    link_image(painted, "Color", picture(tmp_path / "in.png"))
    show(painted)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "own.blend"), copy=True)
    for _ in range(2):
        result = run("--scene", "own.blend", "--material", "Skin", "--out", "skin.usdc", cwd=tmp_path)
        assert result.returncode == 0, result.stderr
        assert set(inspect(tmp_path / "skin.usdc")["materials"]) == {"Skin"}
        assert (tmp_path / "textures" / "in.png").is_file() or (tmp_path / "textures" / "painted.png").is_file()
    assert not list(tmp_path.glob(".true_diffuse_*"))


@pytest.mark.parametrize(
    "arguments",
    [
        ("--scene", "theater"),
        ("--scene", "missing.blend"),
        ("--scene", "text.blend"),
        ("--out", "five.obj"),
        ("--out", ".usda"),
        ("--out", "a_file/five.usda"),
        ("--scene", "five", "--character", "monkey", "--material", "Chalk"),
        ("--scene", "face", "--character", "nobody"),
        ("--out", "folder.usda"),
    ],
    ids=" ".join,
)
def test_bad_input_is_one_line_and_status_2(arguments: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "text.blend").write_text("no file of Blender's")
    (tmp_path / "a_file").touch()
    (tmp_path / "folder.usda").mkdir()
    before = sorted(tmp_path.rglob("*"))
    result = run(*arguments, cwd=tmp_path)
    assert result.returncode == 2, result.stdout
    assert len(result.stderr.splitlines()) == 1 and result.stderr.startswith("export_usd.py: error: "), result.stderr
    assert sorted(tmp_path.rglob("*")) == before
