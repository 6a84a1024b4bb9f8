# SPDX-License-Identifier: GPL-3.0-or-later
"""Color spaces and views by what they compute: in Blender's configuration of OpenColorIO, and in a studio's with other names."""

import json
import os
import subprocess
import sys
from pathlib import Path

import bpy

import pytest

from true_diffuse.addon.blender import color_spaces

# No names of Blender's, and no roles for exchange. The view that renders first maps tones; "work" is taken for linear Rec. 709.
STUDIO = """
ocio_profile_version: 2
roles: {scene_linear: work, data: numbers, default_byte: paint, default_float: work, color_picking: paint, texture_paint: paint}
file_rules: [!<Rule> {name: Default, colorspace: default_byte}]
displays:
  Monitor: [!<View> {name: Film, colorspace: film}, !<View> {name: Plain, colorspace: paint}]
colorspaces:
  - !<ColorSpace> {name: work, isdata: false}
  - !<ColorSpace>
    name: paint
    to_scene_reference: !<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0]}
  - !<ColorSpace>
    name: film
    to_scene_reference: !<ExponentWithLinearTransform> {gamma: [1.8, 1.8, 1.8, 1], offset: [0.02, 0.02, 0.02, 0]}
  - !<ColorSpace>
    name: wide
    to_scene_reference: !<MatrixTransform>
      matrix: [1.70505, -0.62179, -0.08326, 0, -0.13026, 1.14080, -0.01055, 0, -0.02400, -0.12897, 1.15297, 0, 0, 0, 0, 1]
  - !<ColorSpace> {name: numbers, isdata: true}
  - !<ColorSpace> {name: Raw, isdata: true}
"""
# Prints what is made in the studio's configuration, in a process of its own: Blender reads it when it starts
IN_STUDIO = """
import json, sys
sys.path.insert(0, sys.argv[1])
import bpy, checkout, true_diffuse
from pathlib import Path
from true_diffuse.addon.blender import color_spaces, report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.read import group_node, read_surface
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.scripts.characters import face
folder = Path(sys.argv[2])
bpy.ops.wm.read_factory_settings(use_empty=True)
true_diffuse.register()
found = {"spaces": {name: color_spaces.name(name) for name in ("work", "paint", "film", "wide")}}
bpy.ops.mesh.primitive_cone_add(radius1=1.0, depth=3.0)
bpy.context.object.data.materials.append(None)
bpy.ops.true_diffuse.build_comparison()
bpy.context.window.scene = bpy.data.scenes["Scene"]
bpy.ops.true_diffuse.build_comparison(plaster=True)
mesh = bpy.data.objects["Cone"].data
for _ in range(2): mesh.materials.append(None)
face.build(mesh, False, (64, 64))
found["views"] = [scene.view_settings.view_transform for scene in bpy.data.scenes[1:]] + [len(bpy.data.scenes)]
bpy.ops.wm.read_factory_settings(use_empty=True)
for name in ("paint", "wide", "film", "Raw", "numbers"):
    material = materials.create(name, ROUGH_DIFFUSE)
    image = bpy.data.images.new(name, 4, 4)
    image.filepath_raw, image.file_format = str(folder / f"{name}.png"), "PNG"
    image.save()
    image.colorspace_settings.name = name
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs["Color"], group_node(material)[0].inputs["Color"])
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(material)
found["data"] = [name for name, image in bpy.data.images.items() if color_spaces.is_data(image)]
report.take()
bpy.ops.wm.usd_export(filepath=str(folder / "studio.usda"))
found["usd"] = report.take()
bpy.context.preferences.addons.new().module = "true_diffuse"  # among the add-ons that the exporter asks
bpy.ops.export_scene.gltf(filepath=str(folder / "studio.glb"))
found["gltf"] = report.take()
from pxr import Usd, UsdShade
stage = Usd.Stage.Open(str(folder / "studio.usda"))
for prim in stage.Traverse():
    shader = UsdShade.Shader(prim)
    if prim.GetName().startswith("MaterialX_image"):
        found.setdefault("written", {})[prim.GetParent().GetName()] = shader.GetInput("file").GetAttr().GetColorSpace()
    if prim.GetName().startswith("Preview_image"):
        found.setdefault("preview", {})[prim.GetParent().GetName()] = str(shader.GetInput("sourceColorSpace").Get())
for file in (folder / "studio.usda", Path(sys.argv[3])):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(file))
    spaces = {material.name: [node.image.colorspace_settings.name for node in material.node_tree.nodes if node.type == "TEX_IMAGE"]
        for material in bpy.data.materials}
    found[file.name] = spaces, report.take()
print(json.dumps(found))
"""
SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
OLD_FILE = Path(__file__).resolve().parent / "data" / "version_0_1_0.usda"

pytestmark = pytest.mark.usefixtures("empty_file")


@pytest.mark.parametrize(
    ("space", "name"),
    [
        *(("sRGB", "srgb_texture"), ("Linear Rec.709", "lin_rec709"), ("ACEScg", "acescg"), ("Display P3", "srgb_displayp3")),
        *(("Gamma 2.2 Encoded Rec.709", "g22_rec709"), ("Linear Adobe RGB", "lin_adobergb")),
    ],
)
def test_color_space_has_its_name_in_materialx(space: str, name: str) -> None:
    assert color_spaces.name(space) == (name, True)


@pytest.mark.parametrize(
    ("space", "name"),
    [
        ("sRGB", ("srgb_texture", True)),
        ("Linear Rec.709", ("lin_rec709", True)),
        ("ACEScg", ("acescg", True)),
        ("AgX Log", ("srgb_texture", False)),
    ],
)
def test_color_spaces_without_opencolorio_are_known_by_their_names(
    space: str, name: tuple[str, bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy.data.images.new("Image", 1, 1).colorspace_settings.name = space  # the name is Blender's, or this raises
    monkeypatch.setitem(sys.modules, "PyOpenColorIO", None)
    assert color_spaces.name(space) == name and color_spaces.interop_id(space) == ""


def test_plain_view_is_the_one_without_tone_mapping() -> None:
    color_spaces.show_plainly(bpy.context.scene)
    assert bpy.context.scene.view_settings.view_transform == "Standard"


def test_a_studios_configuration_serves_as_blenders_does(tmp_path: Path) -> None:
    """It has none of Blender's names: scenes, exports and imports go by what its color spaces compute."""
    (tmp_path / "studio.ocio").write_text(STUDIO)
    command = [sys.executable, "-c", IN_STUDIO, str(SCRIPTS), str(tmp_path), str(OLD_FILE)]
    environment = os.environ | {"OCIO": str(tmp_path / "studio.ocio")}
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert result.returncode == 0 and "Traceback" not in result.stderr, result.stderr
    found = json.loads(result.stdout.splitlines()[-1])
    assert found["views"] == ["Plain", "Plain", "Plain", 4]
    spaces = {name: found["spaces"][name] for name in ("work", "paint", "wide")}
    assert spaces == {"work": ["lin_rec709", True], "paint": ["srgb_texture", True], "wide": ["acescg", True]}
    assert not found["spaces"]["film"][1]
    assert sorted(found["data"]) == ["Raw", "numbers"]
    assert {name: space for name, space in found["written"].items() if name != "film"} == {
        "paint": "srgb_texture", "wide": "acescg", "Raw": "", "numbers": "",
    }  # fmt: skip
    assert {name: space for name, space in found["preview"].items() if name != "film"} == {
        "paint": "sRGB", "wide": "raw", "Raw": "raw", "numbers": "raw",
    }  # fmt: skip
    assert [line for line in found["usd"] if "True Diffuse: film: the color space film of the image film is not" in line]
    assert [line for line in found["usd"] if "True Diffuse: wide: the color space wide" in line and "UsdPreviewSurface" in line]
    assert not [line for line in found["usd"] if "paint" in line or "Raw" in line or "numbers" in line]
    assert {line.split(": ")[1] for line in found["gltf"]} == {"wide", "film", "Raw", "numbers"}
    spaces, lines = found["studio.usda"]
    assert spaces == {name: [name] for name in ("paint", "wide", "film", "Raw", "numbers")} and lines == []
    spaces, lines = found["version_0_1_0.usda"]
    assert spaces and lines == []
