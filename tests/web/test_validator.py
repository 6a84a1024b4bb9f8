# SPDX-License-Identifier: GPL-3.0-or-later
"""Khronos' validator has no errors and no warnings for what we export, beside those that Blender's own exporter has without us."""

from collections import Counter
from pathlib import Path

import bpy

import pytest

from support import show
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.scripts.characters.small import skin
from true_diffuse.scripts.web import WebError
from true_diffuse.scripts.web.validator import Severity, messages

pytestmark = [pytest.mark.web, pytest.mark.usefixtures("exporter")]

ASSETS = Path(__file__).resolve().parent.parent / "assets"
COLOR = (0.8, 0.5, 0.2, 1.0)


@pytest.fixture(scope="module", autouse=True)
def validator(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Skip the tests where the validator cannot be had; fail where it finds nothing."""
    wrong = tmp_path_factory.mktemp("wrong") / "wrong.gltf"
    wrong.write_text('{"asset": {"version": "2.0"}, "materials": [{"alphaMode": "HALF"}], "scene": 3}')
    try:
        (found,) = messages([wrong])
    except WebError as error:
        pytest.skip(str(error))
    assert {Severity.ERROR, Severity.WARNING} == {message.severity for message in found if message.severity <= Severity.WARNING}


def exported(path: Path) -> Path:
    assert bpy.ops.export_scene.gltf(filepath=str(path)) == {"FINISHED"}
    return path


def serious(*files: Path) -> list[Counter[tuple[Severity, str]]]:
    """The errors and warnings of each file: how many of each kind."""
    return [Counter((each.severity, each.code) for each in found if each.severity <= Severity.WARNING) for found in messages(files)]


def image(name: str) -> bpy.types.Image:
    """A new packed image of 4 by 4 different pixels."""
    made = bpy.data.images.new(name, 4, 4)
    made.pixels.foreach_set([value for i in range(16) for value in (i / 15.0, 1.0 - i / 15.0, 0.5, 1.0)])
    made.pack()
    return made


def link_image(material: bpy.types.Material, *sockets: str) -> None:
    """Link an image, another for each, to sockets of the only group in a material."""
    tree = material.node_tree
    group = next(node for node in tree.nodes if node.type == "GROUP")
    for socket in sockets:
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image(socket)
        tree.links.new(node.outputs["Color"], group.inputs[socket])


def test_file_of_every_model_is_valid(tmp_path: Path) -> None:
    shown = []
    for model in MODELS.values():
        plain, textured = (materials.create(model.id, ROUGH_DIFFUSE, Model=model.label, Color=COLOR) for _ in range(2))
        link_image(textured, "Color", *([model.parameter.socket] if model.parameter else []))
        inputs = {"Model": model.label, "Base Color": COLOR, "Diffuse Roughness": 0.4}
        shown += [plain, textured, materials.create(model.id, PRINCIPLED, **inputs)]
    show(*shown)
    assert serious(exported(tmp_path / "models.glb")) == [Counter()]


def test_file_of_layers_is_valid(tmp_path: Path) -> None:
    skin = materials.create("Skin", SUBSURFACE, Color=COLOR, Subsurface=1.0, Specular=0.5)
    part = materials.create("Part", SUBSURFACE, Color=COLOR, Subsurface=0.5)
    textured = materials.create("Textured", SUBSURFACE, Subsurface=1.0)
    link_image(textured, "Color", "Roughness")
    specular = materials.create("Specular", SPECULAR_GROUP, Color=COLOR)
    layers = {"Coat Weight": 0.7, "Sheen Weight": 0.3, "Transmission Weight": 0.4, "Subsurface Weight": 0.3, "Anisotropic": 0.5}
    layered = materials.create("Layered", PRINCIPLED, **{"Base Color": COLOR, "Diffuse Roughness": 0.4}, **layers)
    show(skin, part, textured, specular, layered)
    assert serious(exported(tmp_path / "layers.glb")) == [Counter()]


def test_file_of_the_small_characters_has_what_blenders_has(tmp_path: Path) -> None:
    """The same characters as they come, in Blender's Principled BSDFs, are held beside them."""
    for path in sorted(ASSETS.glob("*.glb")):
        bpy.ops.import_scene.gltf(filepath=str(path))
    with bpy.data.libraries.load(str(ASSETS / skin.FILE)) as (there, target):
        target.objects = there.objects
    for item in target.objects:
        bpy.context.scene.collection.objects.link(item)
    before = exported(tmp_path / "before.glb")
    assert len(convert_materials(list(bpy.data.materials), 1.0).converted) > 15
    after = exported(tmp_path / "after.glb")
    as_blender_has_it, ours = serious(before, after)
    assert not ours - as_blender_has_it
    assert not any(severity is Severity.ERROR for severity, _ in ours)
