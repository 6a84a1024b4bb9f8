# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF: the EON that is written for each reflectance model, its roughness and color, as factors, textures and animation."""

import math
from pathlib import Path

import bpy

import pytest

from support import show
from test_gltf import COLOR, add, by_name, export, hook, image_node, noise, times  # noqa: F401 - hook is a fixture
from true_diffuse.addon.blender import report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.models import MODELS, Eon, Lambert, average_albedo
from true_diffuse.addon.models.eon import diluted
from true_diffuse.addon.models.fujii import Fujii
from true_diffuse.addon.models.registry import OWN_ROUGHNESS
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.scripts.fit.nearest_eon import eon_error, sphere, sphere_error

EXTENSION = "KHR_materials_diffuse_roughness"
# What scripts/fit/nearest_eon.py prints, in %: at 0.2, 0.33 and 1 of sigma or roughness, or for any
ERRORS = {
    "lambert": (0.0,),
    "oren_nayar": (2.30, 4.17, 8.17),
    "fujii": (1.10, 1.77, 5.02),
    "eon": (0.0, 0.0, 0.0),
    "cycles_diffuse": (0.38, 0.61, 1.73),
    "oren_nayar_1994": (0.90, 1.61, 3.03),
    "wolff": (11.54,),
    "pitted": (17.85,),
}
VALUES = (0.2, 0.33, 1.0)
CASES = [(MODELS[key], value, error) for key, errors in ERRORS.items() for value, error in zip(VALUES, errors, strict=False)]


def rough(name: str, model: str, **inputs: object) -> bpy.types.Material:
    material = materials.create(name, ROUGH_DIFFUSE, **{"Model": model, "Color": COLOR} | inputs)
    show(material)
    return material


def factor(material: dict) -> float:
    """Return the roughness that a reader finds, 0 without the extension."""
    return material.get("extensions", {}).get(EXTENSION, {}).get("diffuseRoughnessFactor", 0.0)


def link_roughness(material: bpy.types.Material, output: bpy.types.NodeSocket, socket: str = "Roughness") -> None:
    material.node_tree.links.new(output, group_node(material)[0].inputs[socket])


def gray(material: bpy.types.Material, name: str, value: float = 0.5) -> bpy.types.Node:
    """Return a new node of an image of numbers."""
    node = image_node(material, name, (value, value, value, 1.0))
    node.image.colorspace_settings.is_data = True
    return node


def test_every_model_has_its_average_albedo_and_the_error_of_the_table(tmp_path: Path) -> None:
    for index, (model, value, _) in enumerate(CASES):
        rough(str(index), model.label, Roughness=value, IOR=1.5)
    document = export(tmp_path / "one.glb")
    written = by_name(document)
    for index, (model, value, error) in enumerate(CASES):
        material = written[str(index)]
        roughness = factor(material)
        formula = model.reference({"Roughness": value, "IOR": 1.5})
        for rho, color in zip(COLOR[:3], material["pbrMetallicRoughness"]["baseColorFactor"], strict=False):
            # 1e-4 of quadrature in the formulas that have no closed form
            assert average_albedo(Eon(roughness), color, 12) == pytest.approx(average_albedo(formula, rho, 12), rel=3e-4)
            assert 0.0 <= color <= 1.0
        # the table has two decimals
        assert 100.0 * eon_error(roughness, formula) == pytest.approx(error, abs=0.006), model.label
        assert (EXTENSION in material["extensions"]) == (roughness > 0.0) == (model.id not in {"lambert", "wolff"})
    assert EXTENSION in document["extensionsUsed"] and EXTENSION not in document.get("extensionsRequired", [])
    assert report.take() == []
    assert {model.id for model, _, _ in CASES} == set(MODELS)


def test_eon_and_models_like_it_keep_their_roughness(tmp_path: Path) -> None:
    same = [model for model in MODELS.values() if model.eon == OWN_ROUGHNESS]
    for model in same:
        rough(model.id, model.label, Roughness=0.4)
    written = by_name(export(tmp_path / "one.glb"))
    assert {model.id: factor(written[model.id]) for model in same} == dict.fromkeys(("fujii", "eon", "cycles_diffuse"), 0.4)
    assert written["eon"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)


def test_the_registered_roughness_is_the_nearest_for_sigma() -> None:
    """No other has an error that is less by more than a hundredth of itself: tested where the fit was not made."""
    for key in ("oren_nayar", "oren_nayar_1994"):
        for sigma in (0.08, 0.22, 0.46, 0.92, 1.4):
            formula, roughness = MODELS[key].formula(sigma), MODELS[key].eon.roughness(sigma)
            others = [eon_error(roughness + step, formula) for step in (-0.03, -0.01, 0.01, 0.03)]
            assert eon_error(roughness, formula) < 1.01 * min(others), (key, sigma)


def test_the_sphere_is_measured_as_a_picture_is() -> None:
    """Lit from the viewer, Lambert's radiance over a disc of radius 1 is the integral of rho / pi cos: 2/3 rho."""
    samples = sphere(0.0)
    area = sum(sample.weight for sample in samples)
    light = sum(sample.weight * Lambert().reflected(sample.geometry, 0.5) for sample in samples)
    assert light / area == pytest.approx(0.5 / math.pi * 2.0 / 3.0, rel=1e-9)
    assert sphere_error(Lambert(), 0.6, Lambert(), 0.5) == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_mix_with_lambert_is_fujii_of_the_diluted_roughness(share: float) -> None:
    for samples in map(sphere, (0.0, 60.0, 120.0)):
        for geometry, _ in samples[::37]:
            mixed = share * Fujii(0.7).reflected(geometry, 0.5) + (1.0 - share) * Lambert().reflected(geometry, 0.5)
            assert Fujii(diluted(0.7, share)).reflected(geometry, 0.5) == pytest.approx(mixed, rel=1e-12)


def test_roughness_0_and_models_without_one_write_no_extension(tmp_path: Path) -> None:
    for model in MODELS.values():
        rough(model.id, model.label, Roughness=0.0, IOR=1.0)
    document = export(tmp_path / "one.glb")
    assert [name for name, material in by_name(document).items() if factor(material)] == ["pitted"]
    metal = materials.create("metal", PRINCIPLED, **{"Model": "EON", "Diffuse Roughness": 0.5, "Metallic": 1.0})
    show(metal)
    assert EXTENSION not in by_name(export(tmp_path / "two.glb"))["metal"].get("extensions", {})


@pytest.mark.parametrize(("given", "expected"), [(-1.0, 0.0), (7.0, 1.0), (math.inf, 1.0), (math.nan, 0.0)])
def test_constants_out_of_range_are_the_nearest_inside(given: float, expected: float, tmp_path: Path) -> None:
    material = rough("EON", "EON")
    value = add(material, "Value")
    value.outputs[0].default_value = given
    link_roughness(material, value.outputs[0])
    assert factor(by_name(export(tmp_path / "one.glb"))["EON"]) == expected


def test_principled_and_subsurface_have_it_too(tmp_path: Path) -> None:
    material = bpy.data.materials.new("principled")
    material.node_tree.nodes["Principled BSDF"].inputs["Diffuse Roughness"].default_value = 0.6
    convert_materials([material], 1.0)
    show(material)
    for name, weight in (("half", 0.5), ("all", 1.0)):
        show(materials.create(name, SUBSURFACE, Model="EON", Roughness=0.6, Color=COLOR, Subsurface=weight))
    written = by_name(export(tmp_path / "one.glb"))
    assert factor(written["principled"]) == pytest.approx(0.6) and factor(written["all"]) == 0.0
    roughness = factor(written["half"])
    assert roughness == pytest.approx(diluted(0.6, 0.5))
    for rho, color in zip(COLOR[:3], written["half"]["pbrMetallicRoughness"]["baseColorFactor"], strict=False):
        # half of what is reflected is EON's, half has the albedo rho
        assert Eon(roughness).average_albedo(color) == pytest.approx(0.5 * Eon(0.6).average_albedo(rho) + 0.5 * rho, rel=1e-6)
    assert written["all"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)


def test_a_texture_goes_along_with_its_factor_place_and_channel(tmp_path: Path) -> None:
    material = rough("EON", "EON")
    bpy.data.objects[-1].data.uv_layers.new(name="Second")
    node = gray(material, "rough")
    place = add(material, "Mapping", add(material, "UVMap", uv_map="Second").outputs["UV"], (0.1, 0.2, 0.0), None, (2.0, 3.0, 1.0))
    material.node_tree.links.new(place.outputs["Vector"], node.inputs["Vector"])
    node.extension = "MIRROR"
    link_roughness(material, add(material, "Math", node.outputs["Color"], 0.7, operation="MULTIPLY").outputs["Value"])
    written = by_name(export(tmp_path / "one.glb"))["EON"]
    extension = written["extensions"][EXTENSION]
    texture = extension["diffuseRoughnessTexture"]
    assert extension["diffuseRoughnessFactor"] == pytest.approx(0.7)
    assert (texture["image"], texture["texCoord"], texture["sampler"]["wrapS"]) == ("rough", 1, 33648)
    assert texture["extensions"]["KHR_texture_transform"]["scale"] == [2.0, 3.0]
    assert written["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert report.take() == []
