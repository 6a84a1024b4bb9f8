# SPDX-License-Identifier: GPL-3.0-or-later
"""shaders/rough_diffuse.osl: compiled, explained, and rendered by Cycles against the formulas."""

import math
import re
from functools import partial

import bpy

import pytest

from support import CountedProgress
from true_diffuse.addon import models
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.osl import SHADERS
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS, directional_albedo
from true_diffuse.addon.models.registry import Osl
from true_diffuse.scenes.sphere import COLOR, sphere_under_sun
from true_diffuse.scripts.fit import ramps
from true_diffuse.scripts.studies import float32_accuracy, osl_values, reference_mpmath, stability_osl
from true_diffuse.scripts.studies.study import run

pytestmark = pytest.mark.usefixtures("empty_file")

# RMS error on a sphere with the light at 60 and at 120 degrees from the viewer. Exact models: the pixel filter's 0.01 pixels, where
# the light ends abruptly. The others: what their ramps leave, most where the surface is darkest, at sigma = 1 or COLOR's albedos.
EXACT_RMS = (0.001, 0.001)
RMS = {"oren_nayar": (0.002, 0.005), "oren_nayar_1994": (0.008, 0.04), "wolff": (0.007, 0.03), "pitted": (0.055, 0.3)}
# How far the albedo under light from everywhere is from the formula's: what the ramps leave, on top of NOISE
ALBEDO = {"oren_nayar": 3e-4, "oren_nayar_1994": 0.004, "wolff": 0.002, "pitted": 0.004}
PRESERVING = ("lambert", "fujii", "eon", "cycles_diffuse", "wolff")
NOISE = 3e-6  # 65536 evenly spread samples of a smooth function, in 32-bit floats


def shaped(model: str) -> list[tuple[str, tuple[float, ...]]]:
    """The model with its parameter's usual value and, if it is a roughness, with 1."""
    parameter = MODELS[model].parameter
    return [(model, ())] if parameter is None else [(model, (x,)) for x in ((0.33, 1.0) if MODELS[model].is_rough else (1.5,))]


EVERY = [case for model in osl_values.drawn() for case in shaped(model)]


def material_of(model: str, shape: tuple[float, ...], **inputs) -> bpy.types.Material:
    parameter = MODELS[model].parameter
    inputs |= {parameter.socket: shape[0]} if parameter else {}
    return osl_values.create_osl("OSL", "rough_diffuse", Model=MODELS[model].number, **inputs)


def script_of(material: bpy.types.Material) -> bpy.types.Node:
    return next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeScript")


def test_osl_compiles_to_sockets_for_every_parameter() -> None:
    sockets = script_of(osl_values.create_osl("OSL", "rough_diffuse")).inputs
    assert [(socket.name, socket.bl_idname) for socket in sockets] == [
        ("Model", "NodeSocketInt"),
        ("Color", "NodeSocketColor"),
        ("Roughness", "NodeSocketFloat"),
        ("IOR", "NodeSocketFloat"),
        ("Normal", "NodeSocketVector"),
    ]
    assert sockets["Color"].default_value[:] == pytest.approx((0.8, 0.8, 0.8, 1.0))
    assert (sockets["Model"].default_value, sockets["IOR"].default_value) == (1, 1.5)
    assert sockets["Roughness"].default_value == pytest.approx(0.33)


def test_osl_explains_every_parameter(tmp_path) -> None:
    bytecode = tmp_path / "rough_diffuse.oso"
    bytecode.write_text(script_of(osl_values.create_osl("OSL", "rough_diffuse")).bytecode)
    render.openimageio()  # the query needs it loaded first
    import oslquery

    parameters = {p.name: {item.name: item.value for item in p.metadata} for p in oslquery.OSLQuery(str(bytecode)).parameters}
    assert list(parameters) == ["Model", "Color", "Roughness", "IOR", "Normal", "BSDF"]
    for name, metadata in parameters.items():
        assert metadata["label"] and metadata["help"] and not metadata["help"].endswith(".")
        assert name == "BSDF" or metadata["min"] < metadata.get(
            "max", metadata.get("slidermax")
        )  # what is typed may exceed a slider
    options = [option.split(":")[1] for option in parameters["Model"]["options"].split("|")]
    assert options == [str(MODELS[key].number) for key in osl_values.drawn()]


def test_osl_has_the_numbers_of_the_fit() -> None:
    text = (SHADERS / "rough_diffuse.osl").read_text()
    arrays = {
        name: [float(number) for number in numbers.split(",")]
        for name, numbers in re.findall(r"float (\w+)\[\d+\] = \{([^}]*)\}", text)
    }
    number = r"(-?\d+\.\d+)"
    pairs = [[float(x) for x in pair] for pair in re.findall(rf"mix\({number}, {number}, mu\)", text)]
    fitted, others = ramps.fit_all()
    assert arrays == {name: pytest.approx(values, rel=1e-3) for name, values in fitted.items()}  # written with 4 digits
    assert pairs == [pytest.approx(pair, rel=1e-3) for pair in others.values()]


@pytest.mark.slow
@pytest.mark.render
def test_osl_is_as_near_its_formulas_over_all_lights_as_it_says() -> None:
    oren_nayar, oren_nayar_1994 = (
        [osl_values.Shown(model, MODELS[model].formula(sigma), sigma) for sigma in (0.2, 0.33, 1.0)]
        for model in ("oren_nayar", "oren_nayar_1994")
    )
    others = [
        osl_values.Shown("wolff", models.Wolff()),
        *(osl_values.Shown("pitted", models.Pitted(), albedo=x) for x in (1.0, 0.8, 0.5, 0.2)),
    ]
    exact = [
        osl_values.Shown(model, MODELS[model].formula(*shape), *shape)
        for model, shape in EVERY
        if MODELS[model].osl is Osl.EXACT and model != "lambert"
    ]
    errors = osl_values.lobe_errors(
        [*oren_nayar, *oren_nayar_1994, *others, *exact, osl_values.Shown("lambert", models.OrenNayar(0.33))]
    )
    said = [0.0004, 0.0008, 0.0016, 0.0026, 0.0047, 0.0096, 0.008, 0.0295, 0.0465, 0.0805, 0.1135]
    assert all(error < limit for error, limit in zip(errors, said, strict=False))
    assert max(errors[len(said) : -1]) < 1e-6
    # fixes the measure itself: as the formulas have it, test_lobes.py
    assert errors[-1] == pytest.approx(0.1261, abs=1e-4)


@pytest.mark.render
@pytest.mark.parametrize(("model", "shape"), EVERY)
def test_osl_renders_as_its_formula(model: str, shape: tuple[float, ...]) -> None:
    sphere = sphere_under_sun(96)  # on 64 pixels the filter alone leaves 0.11 % at 120 degrees
    sphere.scene.cycles.shading_system = True
    material = material_of(model, shape, Color=COLOR)
    for degrees, limit in zip((60.0, 120.0), RMS.get(model, EXACT_RMS), strict=True):
        (result,) = sphere.measure(material, [MODELS[model].formula(*shape)], engines.CYCLES, 4, degrees)[1]
        assert result.rms < limit


@pytest.fixture(scope="module")
def records() -> dict[tuple[str, str], dict]:
    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    return {
        (record["model"], record["case"]): record
        for record in run(stability_osl.stability(reference_mpmath.radiance, quick, 1000), CountedProgress())
    }


@pytest.mark.render
@pytest.mark.parametrize("model", [key for key in osl_values.drawn() if MODELS[key].osl in osl_values.EXACT])
def test_osl_is_as_near_its_formula_as_cycles_own_floats(model: str, records) -> None:
    for case in ("random", "aligned", "albedo", "shape", "normal", "no normal"):
        record = records[model, case]
        # Cycles' own N.L is off by up to 5e-7, which at N.L below 0.025 is more than 2e-5 of it
        assert record["error"] < record["allowed"] + 5e-7 / math.pi, record
    assert records[model, "random"]["share_within"] > 0.97  # one light in 40 is that low
    assert records[model, "random"]["screen_error"] < 0.01  # what 64-bit floats add is nothing beside that
    assert records[model, "light below"]["error"] == 0.0


@pytest.mark.render
@pytest.mark.parametrize("model", osl_values.drawn())
def test_osl_is_never_infinite_or_negative(model: str, records) -> None:
    assert all(record["finite"] for key, record in records.items() if key[0] == model)


@pytest.mark.render
def test_osl_records_have_a_line_each_for_people(records) -> None:
    columns, rows = float32_accuracy.table(list(records.values()))
    assert [row[columns.index("Target")] for row in rows] == ["osl"] * len(records)


@pytest.mark.render
@pytest.mark.parametrize("model", ["oren_nayar", "oren_nayar_1994", "pitted", "wolff"])
def test_osl_without_light_in_the_albedo_is_black(model: str) -> None:
    (sun,) = osl_values.suns([(0.6, 0.0, 0.8)])
    inputs = [osl_values.Inputs(model, sun, osl_values.VIEWER, albedo) for albedo in (0.0, -1.0, math.nan)]
    assert osl_values.evaluate(inputs) == [(0.0, 0.0, 0.0)] * 3


@pytest.mark.render
@pytest.mark.parametrize(("model", "shape"), EVERY)
def test_osl_reflects_its_formulas_albedo_under_a_white_world(model: str, shape: tuple[float, ...]) -> None:
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("White")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    bpy.ops.mesh.primitive_plane_add(size=10.0)
    bpy.context.object.data.materials.append(material_of(model, shape, Color=(1.0, 1.0, 1.0, 1.0)))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.cycles.shading_system = True
    scene.cycles.max_bounces = 0
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    for mu in (0.9, 0.4):
        camera.location = (0.0, -10.0 * math.sqrt(1.0 - mu * mu), 10.0 * mu)
        camera.rotation_euler = (math.acos(mu), 0.0, 0.0)
        _, rgb = render.radiance(scene, engines.CYCLES, 256)
        albedo = sum(rgb) / len(rgb)
        assert albedo == pytest.approx(directional_albedo(MODELS[model].formula(*shape), mu), abs=NOISE + ALBEDO.get(model, 0.0))
        assert albedo <= 1.0 + NOISE or model not in PRESERVING
