# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF: the EON that is written for each reflectance model, its roughness and color, as factors, textures and animation."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy

import pytest

from support import show
from test_gltf import COLOR, add, empty_with_hook, export, noise
from true_diffuse.addon.blender import report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.models import MODELS, Eon, Lambert, OrenNayar, average_albedo
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
CASES = [(key, value, error) for key, errors in ERRORS.items() for value, error in zip(VALUES, errors, strict=False)]
STEP = 1.0 / 255  # of an image of 8 bits
RESOLUTION = 16

# ---- Formulas


def test_the_registered_roughness_is_the_nearest_for_sigma() -> None:
    """No other has an error that is less by more than a hundredth of itself: tested where the fit was not made."""
    for key in ("oren_nayar", "oren_nayar_1994"):
        for sigma in (0.08, 0.46, 1.4):
            formula, roughness = MODELS[key].formula(sigma), MODELS[key].eon.roughness(sigma)
            others = [eon_error(roughness + step, formula) for step in (-0.02, 0.02)]
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


# ---- One file with every material, exported once as it is and once with what cannot be carried baked

type Build = Callable[[str], None]
BUILDS: dict[str, Build] = {}


def build(function: Build) -> Build:
    """Make a function, which makes a material of the given name, part of the file."""
    BUILDS[function.__name__] = function
    return function


def rough(name: str, model: str, **inputs: object) -> bpy.types.Material:
    """Return a new material on a new mesh."""
    material = materials.create(name, ROUGH_DIFFUSE, **{"Model": MODELS[model].label, "Color": COLOR} | inputs)
    show(material)
    return material


def link_roughness(material: bpy.types.Material, output: bpy.types.NodeSocket) -> None:
    material.node_tree.links.new(output, group_node(material)[0].inputs["Roughness"])


def numbers(material: bpy.types.Material, name: str, values: tuple[float, ...]) -> bpy.types.Node:
    """Return a new node of an image of numbers, RGBA."""
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new(name, 4, 4, alpha=True, is_data=True)
    node.image.pixels.foreach_set(values * 16)
    node.image.pack()
    return node


def gray(material: bpy.types.Material, name: str, value: float) -> bpy.types.Node:
    return numbers(material, name, (value, value, value, 1.0))


CHANNELS = {"Red": 0.2, "Green": 0.4, "Blue": 0.6, "Alpha": 0.8}
for each in CHANNELS:

    def channel(name: str, wanted: str = each) -> None:
        material = rough(name, "eon")
        node = numbers(material, name, tuple(CHANNELS.values()))
        split = add(material, "SeparateColor", node.outputs["Color"])
        link_roughness(material, node.outputs["Alpha"] if wanted == "Alpha" else split.outputs[wanted])

    BUILDS[each] = channel

OUTSIDE = {"negative": (-1.0, 0.0), "seven": (7.0, 1.0), "inf": (math.inf, 1.0), "nan": (math.nan, 0.0)}
for each, (given, _) in OUTSIDE.items():

    def outside(name: str, value: float = given) -> None:
        material = rough(name, "eon")
        node = add(material, "Value")
        node.outputs[0].default_value = value
        link_roughness(material, node.outputs[0])

    BUILDS[each] = outside


@build
def placed(name: str) -> None:
    """An image times a factor, mapped by the second UV map."""
    material = rough(name, "eon")
    bpy.data.objects[-1].data.uv_layers.new(name="Second")
    node = gray(material, name, 0.5)
    place = add(material, "Mapping", add(material, "UVMap", uv_map="Second").outputs["UV"], (0.1, 0.2, 0.0), None, (2.0, 3.0, 1.0))
    material.node_tree.links.new(place.outputs["Vector"], node.inputs["Vector"])
    node.extension = "MIRROR"
    link_roughness(material, add(material, "Math", node.outputs["Color"], 0.7, operation="MULTIPLY").outputs["Value"])


@build
def sigma(name: str) -> None:
    material = rough(name, "oren_nayar")
    link_roughness(material, gray(material, name, 0.2).outputs["Color"])


@build
def tripled(name: str) -> None:
    """EON's roughness min(1, 3 t), which is not in proportion to t."""
    material = rough(name, "eon")
    tripled = add(material, "Math", gray(material, name, 0.5).outputs["Color"], 3.0, operation="MULTIPLY")
    link_roughness(material, tripled.outputs["Value"])


@build
def noise_of_sigma(name: str) -> None:
    material = rough(name, "oren_nayar", Roughness=0.3)
    link_roughness(material, noise(material))


@build
def tiled(name: str) -> None:
    material = rough(name, "eon", Roughness=0.3)
    node = gray(material, name, 0.5)
    link_roughness(material, node.outputs["Color"])
    node.image.source = "TILED"


@build
def places(name: str) -> None:
    """A UV map that is not at the same place on both meshes."""
    material = rough(name, "eon")
    node = gray(material, name, 0.5)
    link_roughness(material, node.outputs["Color"])
    first = bpy.data.objects[-1]
    second = first.copy()
    second.data = first.data.copy()
    bpy.context.scene.collection.objects.link(second)
    for mesh, names in ((first.data, ("A", "B")), (second.data, ("B", "A"))):
        mesh.uv_layers[0].name = names[0]
        mesh.uv_layers.new(name=names[1])
    material.node_tree.links.new(add(material, "UVMap", uv_map="B").outputs["UV"], node.inputs["Vector"])


@build
def attribute(name: str) -> None:
    """An image mapped by an attribute of points, which is no UV map."""
    material = rough(name, "eon")
    bpy.data.objects[-1].data.attributes.new("flat", "FLOAT2", "POINT")
    node = gray(material, name, 0.5)
    link_roughness(material, node.outputs["Color"])
    material.node_tree.links.new(add(material, "Attribute", attribute_name="flat").outputs["Vector"], node.inputs["Vector"])


@build
def converted(name: str) -> None:
    material = bpy.data.materials.new(name)
    material.node_tree.nodes["Principled BSDF"].inputs["Diffuse Roughness"].default_value = 0.6
    convert_materials([material], 1.0)
    show(material)


@build
def metal(name: str) -> None:
    show(materials.create(name, PRINCIPLED, **{"Model": "EON", "Diffuse Roughness": 0.5, "Metallic": 1.0, "Base Color": COLOR}))


@build
def half(name: str) -> None:
    show(materials.create(name, SUBSURFACE, Model="EON", Roughness=0.6, Color=COLOR, Subsurface=0.5))


@build
def subsurface(name: str) -> None:
    show(materials.create(name, SUBSURFACE, Model="EON", Roughness=0.6, Color=COLOR, Subsurface=1.0))


@dataclass(frozen=True)
class Exported:
    """A written file and what was said."""

    path: Path
    document: dict
    lines: list[str]

    def material(self, name: str) -> dict:
        return next(material for material in self.document["materials"] if material["name"] == name)

    def extension(self, name: str) -> dict:
        return self.material(name).get("extensions", {}).get(EXTENSION, {})

    def factor(self, name: str) -> float:
        """Return the roughness that a reader finds, 0 without the extension."""
        return self.extension(name).get("diffuseRoughnessFactor", 0.0)

    def colors(self, name: str) -> list[float]:
        return self.material(name)["pbrMetallicRoughness"]["baseColorFactor"][:3]

    def said(self, name: str) -> list[str]:
        """Return what is said of a material's reflection."""
        start = f"True Diffuse: {name}: "
        found = [line.removeprefix(start) for line in self.lines if line.startswith(start)]
        return [line for line in found if line.startswith(("Diffuse roughness:", "Base color:"))]

    def texture(self, name: str) -> tuple[list[float], str]:
        """Return the pixels of the roughness's texture, 0 to 1, RGBA, and the image's name."""
        texture = self.document["textures"][self.extension(name)["diffuseRoughnessTexture"]["index"]]
        image = self.document["images"][texture["source"]]
        view, data = self.document["bufferViews"][image["bufferView"]], self.path.read_bytes()
        start = 28 + int.from_bytes(data[12:16], "little") + view.get("byteOffset", 0)
        (self.path.parent / "image.png").write_bytes(data[start : start + view["byteLength"]])
        loaded = bpy.data.images.load(str(self.path.parent / "image.png"))
        loaded.colorspace_settings.is_data = True
        values = list(loaded.pixels)
        bpy.data.images.remove(loaded)
        return values, image["name"]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, Exported]:
    """The file as it is, and with what cannot be carried baked."""
    folder = tmp_path_factory.mktemp("gltf")
    found = {}
    with empty_with_hook():
        for index, (key, value, _) in enumerate(CASES):
            rough(str(index), key, Roughness=value, IOR=1.5)
        for key in MODELS:
            rough(f"smooth {key}", key, Roughness=0.0, IOR=1.0)
            rough(f"own {key}", key, Roughness=0.4)
        for name, make in BUILDS.items():
            make(name)
        settings = bpy.context.scene.true_diffuse
        settings.bake_resolution = RESOLUTION
        report.take()
        before = [list(blocks) for blocks in (bpy.data.images, bpy.data.node_groups, bpy.data.materials)]
        for settings.bake in (False, True):
            path = folder / f"{settings.bake}.glb"
            found[settings.bake] = Exported(path, export(path), report.take())
        assert [list(blocks) for blocks in (bpy.data.images, bpy.data.node_groups, bpy.data.materials)] == before
    return found


@pytest.fixture
def written(files: dict[bool, Exported]) -> Exported:
    return files[False]


@pytest.fixture
def baked(files: dict[bool, Exported]) -> Exported:
    return files[True]


@pytest.mark.parametrize("index", range(len(CASES)), ids=[f"{key} {value}" for key, value, _ in CASES])
def test_a_model_has_its_average_albedo_and_the_error_of_the_table(index: int, written: Exported) -> None:
    key, value, error = CASES[index]
    roughness, formula = written.factor(str(index)), MODELS[key].reference({"Roughness": value, "IOR": 1.5})
    for rho, color in zip(COLOR[:3], written.colors(str(index)), strict=True):
        # 12 points leave 1e-4 where a formula has creases
        assert average_albedo(Eon(roughness), color, 12) == pytest.approx(average_albedo(formula, rho, 12), rel=3e-4)
        assert 0.0 <= color <= 1.0
    assert 100.0 * eon_error(roughness, formula) == pytest.approx(error, abs=0.006)  # the table has two decimals
    assert (written.extension(str(index)) == {}) == (key in {"lambert", "wolff"})
    assert written.said(str(index)) == []


def test_every_model_is_in_the_table_and_the_extension_is_not_required(written: Exported) -> None:
    assert set(ERRORS) == set(MODELS)
    assert EXTENSION in written.document["extensionsUsed"] and EXTENSION not in written.document.get("extensionsRequired", [])


def test_eon_and_models_like_it_keep_their_roughness(written: Exported) -> None:
    same = [key for key, model in MODELS.items() if model.eon == OWN_ROUGHNESS]
    assert {key: written.extension(f"own {key}") for key in same} == {
        key: {"diffuseRoughnessFactor": 0.4} for key in ("fujii", "eon", "cycles_diffuse")
    }
    assert written.colors("own eon") == pytest.approx(COLOR[:3])


def test_a_smooth_surface_and_metal_have_no_extension(written: Exported) -> None:
    assert [key for key in MODELS if written.extension(f"smooth {key}")] == ["pitted"]
    assert written.extension("metal") == {} and written.colors("metal") == pytest.approx(COLOR[:3])


def test_constants_out_of_range_are_the_nearest_inside(written: Exported) -> None:
    assert {name: written.factor(name) for name in OUTSIDE} == {name: expected for name, (_, expected) in OUTSIDE.items()}


def test_principled_and_subsurface_have_it_too(written: Exported) -> None:
    assert written.factor("converted") == pytest.approx(0.6)
    assert written.extension("subsurface") == {} and written.colors("subsurface") == pytest.approx(COLOR[:3])
    roughness = written.factor("half")
    assert roughness == pytest.approx(diluted(0.6, 0.5))
    for rho, color in zip(COLOR[:3], written.colors("half"), strict=True):
        # half of what is reflected is EON's, half has the albedo rho
        assert Eon(roughness).average_albedo(color) == pytest.approx(0.5 * Eon(0.6).average_albedo(rho) + 0.5 * rho, rel=1e-6)


def test_a_texture_goes_along_with_its_factor_and_place(written: Exported) -> None:
    texture = written.extension("placed")["diffuseRoughnessTexture"]
    sampler = written.document["samplers"][written.document["textures"][texture["index"]]["sampler"]]
    assert written.factor("placed") == pytest.approx(0.7)
    assert (texture["texCoord"], sampler["wrapS"]) == (1, 33648)  # mirrored repeat
    assert texture["extensions"]["KHR_texture_transform"]["scale"] == [2.0, 3.0]
    assert written.colors("placed") == pytest.approx(COLOR[:3]) and written.said("placed") == []
    values, name = written.texture("placed")
    assert name == "placed" and values[0] == pytest.approx(0.5, abs=STEP)


@pytest.mark.parametrize("name", CHANNELS)
def test_the_channel_is_put_into_red(name: str, written: Exported) -> None:
    values, _ = written.texture(name)
    assert written.factor(name) == 1.0 and written.said(name) == []
    assert values[0::4] == pytest.approx([CHANNELS[name]] * 16, abs=STEP)


ALBEDO = "Base color: what feeds the roughness of Oren-Nayar (Rough Diffuse) is not supported, the average albedo of {} is written"
OWN, MEAN = ALBEDO.format("the socket's own value"), ALBEDO.format("its mean, 0.2,")


def test_an_image_of_sigma_is_scaled_and_said_or_baked(written: Exported, baked: Exported) -> None:
    wanted = MODELS["oren_nayar"].eon.roughness(round(0.2 * 255) / 255)
    values, name = baked.texture("sigma")
    assert name == "sigma Diffuse Roughness" and baked.factor("sigma") == 1.0 and baked.said("sigma") == [MEAN]
    assert values[0] == pytest.approx(wanted, abs=STEP)
    values, name = written.texture("sigma")
    start = "Diffuse roughness: an image of the roughness of Oren-Nayar (Rough Diffuse) is not supported, "
    start += "EON's roughness in proportion to it, up to "
    first, second = sorted(written.said("sigma"), reverse=True)
    assert name == "sigma" and first.startswith(start) and second == MEAN
    for exported in (written, baked):  # the color is that of the mean, also where the roughness is off
        for rho, color in zip(COLOR[:3], exported.colors("sigma"), strict=True):
            assert Eon(wanted).average_albedo(color) == pytest.approx(OrenNayar(0.2).average_albedo(rho), rel=1e-3)
    off = float(first.removeprefix(start).split()[0])
    assert 0.001 < abs(written.factor("sigma") * values[0] - wanted) <= 1.1 * off  # two digits are said


def test_a_factor_above_1_is_cut_off_as_the_model_does(written: Exported, baked: Exported) -> None:
    assert written.factor("tripled") == 1.0 and "in proportion to it" in written.said("tripled")[0]
    values, _ = baked.texture("tripled")
    assert (baked.factor("tripled"), values[0]) == (1.0, pytest.approx(1.0)) and baked.said("tripled") == []


def test_what_else_varies_is_said_or_baked(written: Exported, baked: Exported) -> None:
    lost = "Diffuse roughness: the node Noise Texture (Noise Texture) is not supported, the socket's own value is written"
    assert written.said("noise_of_sigma") == [lost, OWN]
    (line,) = baked.said("noise_of_sigma")  # which knows the mean of what is baked
    assert line.startswith(ALBEDO.split("{}")[0] + "its mean, 0.")
    assert written.extension("noise_of_sigma") == {
        "diffuseRoughnessFactor": pytest.approx(MODELS["oren_nayar"].eon.roughness(0.3), rel=1e-6)
    }
    values, _ = baked.texture("noise_of_sigma")
    assert 0.0 < min(values[0::4]) < max(values[0::4]) < MODELS["oren_nayar"].eon.roughness(1.0)


def test_tiled_images_and_uv_maps_at_other_places_are_said(written: Exported) -> None:
    assert written.extension("tiled") == {"diffuseRoughnessFactor": pytest.approx(0.3)}
    assert written.said("tiled") == [
        "Diffuse roughness: the image tiled (Image Texture) is not supported, the socket's own value is written"
    ]
    assert written.extension("places")["diffuseRoughnessTexture"].get("texCoord", 0) == 1
    (line,) = written.said("places")
    assert line.startswith("Diffuse roughness: a UV map that is not at the same place on all meshes (Image Texture)")
    assert written.said("attribute") == [
        "Diffuse roughness: the attribute flat, which is no UV map, (Image Texture) is not supported, "
        "the UV map that renders is written"
    ]


# ---- Animation


def test_an_animated_roughness_is_written_or_said(tmp_path: Path) -> None:
    with empty_with_hook():
        for key in ("eon", "oren_nayar"):
            socket = group_node(rough(key, key))[0].inputs["Roughness"]
            for frame, value in ((1, 0.0), (11, 0.75)):
                socket.default_value = value
                socket.keyframe_insert("default_value", frame=frame)
        textured = rough("textured", "fujii")
        node = gray(textured, "image", 0.5)
        place = add(textured, "Mapping", add(textured, "UVMap").outputs["UV"])
        textured.node_tree.links.new(place.outputs["Vector"], node.inputs["Vector"])
        product = add(textured, "Math", node.outputs["Color"], 0.5, operation="MULTIPLY")
        link_roughness(textured, product.outputs["Value"])
        for frame, value in ((1, 0.25), (11, 0.75)):
            product.inputs[1].default_value = place.inputs["Location"].default_value[0] = value
            for socket in (product.inputs[1], place.inputs["Location"]):
                socket.keyframe_insert("default_value", frame=frame)
        document = export(tmp_path / "one.glb", export_animation_mode="SCENE", export_pointer_animation=True)
        lines = report.take()
    targets = [channel["target"] for animation in document["animations"] for channel in animation["channels"]]
    names = [material["name"] for material in document["materials"]]
    place, other = names.index("eon"), names.index("textured")
    texture = f"/materials/{other}/extensions/{EXTENSION}/diffuseRoughnessTexture/extensions/KHR_texture_transform/offset"
    assert sorted(target["extensions"]["KHR_animation_pointer"]["pointer"] for target in targets) == sorted(
        [*(f"/materials/{index}/extensions/{EXTENSION}/diffuseRoughnessFactor" for index in (place, other)), texture]
    )
    assert document["materials"][place]["extensions"][EXTENSION] == {"diffuseRoughnessFactor": 0.0}
    said = [line for line in lines if "the average albedo" not in line]
    start = "True Diffuse: oren_nayar: Roughness: animation (Rough Diffuse) is not supported, the value at frame"
    assert len(said) == 1 and said[0].startswith(start)
