# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender makes of our groups: the closures that the engine needs, and none that a known weight makes needless."""

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.material import materials
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group, chosen_lights
from true_diffuse.scenes.sphere import SphereUnderSun, sphere_under_sun

pytestmark = pytest.mark.usefixtures("empty_file")
LAMBERT = ["BsdfDiffuse"]
PAIR = ["BsdfDiffuse", "BsdfTranslucent", "SubsurfaceScattering"]
COAT = ["BsdfAnisotropic"]
# What scatters, and what Shader to RGB is asked of light from behind
MEDIUM = ["BsdfDiffuse"] * 2 + ["BsdfTranslucent"] + ["SubsurfaceScattering"] * 3
MIXED = sorted([*COAT, *LAMBERT, *MEDIUM])


def shown(group: Group, **inputs: materials.Setting) -> tuple[SphereUnderSun, bpy.types.Node]:
    """Return a small sphere of a new material, and the material's node."""
    sphere = sphere_under_sun(16)
    material = materials.create("Shown", group, **inputs)
    sphere.sphere.data.materials[0] = material
    return sphere, material.node_tree.nodes[group.name]


def inlined(scene: bpy.types.Scene) -> bpy.types.InlineShaderNodes:
    """Return the material as Blender hands it to the engine of `scene`; its tree lives as long as what is returned."""
    layer = scene.view_layers[0]
    layer.update()
    return bpy.types.InlineShaderNodes.from_material(bpy.data.materials["Shown"].evaluated_get(layer.depsgraph))


def closures(scene: bpy.types.Scene) -> list[str]:
    """Return the types of the closures that the engine of `scene` gets of the material, sorted."""
    tree = inlined(scene)
    names = (node.bl_idname.removeprefix("ShaderNode") for node in tree.node_tree.nodes)
    return sorted(name for name in names if name.startswith(("Bsdf", "Sub", "Script", "Emission")))


@pytest.mark.parametrize(
    ("engine", "group", "inputs", "whole", "lean"),
    [
        (engines.EEVEE, ROUGH_DIFFUSE, {"Roughness": 0.0}, PAIR, LAMBERT),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Roughness": 0.5}, PAIR, PAIR),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Quality": "Fast", "Roughness": 0.5}, LAMBERT, LAMBERT),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Quality": "Exact for Chosen Lights", "Roughness": 0.5}, LAMBERT, LAMBERT),
        (engines.CYCLES, ROUGH_DIFFUSE, {"Model": "Lambert"}, LAMBERT, LAMBERT),
        (engines.CYCLES, ROUGH_DIFFUSE, {"Model": "Cycles Diffuse", "Roughness": 0.5}, LAMBERT, LAMBERT),
        (engines.CYCLES, ROUGH_DIFFUSE, {"Model": "EON", "Roughness": 0.0}, LAMBERT * 3, LAMBERT),
        (engines.EEVEE, SUBSURFACE, {"Specular": 0.0, "Subsurface": 1.0}, MIXED, MEDIUM),
        (engines.EEVEE, SUBSURFACE, {"Subsurface": 0.0}, MIXED, [*COAT, *LAMBERT]),
        (engines.EEVEE, SUBSURFACE, {"Subsurface": 0.0, "Specular": 0.0}, MIXED, LAMBERT),
        (engines.EEVEE, SPECULAR_GROUP, {"Specular": 0.0}, [*COAT, *LAMBERT], LAMBERT),
        (
            engines.CYCLES,
            PRINCIPLED,
            {"Metallic": 0.0, "Transmission Weight": 0.0, "Subsurface Weight": 0.0, "Diffuse Roughness": 0.0},
            [*LAMBERT * 2, *["BsdfPrincipled"] * 2],
            ["BsdfPrincipled"],
        ),
        (engines.CYCLES, PRINCIPLED, {"Model": "Lambert", "Metallic": 0.0}, ["BsdfPrincipled"], ["BsdfPrincipled"]),
    ],
)
def test_engine_gets_only_the_closures_needed(
    engine: engines.Engine, group: Group, inputs: dict[str, materials.Setting], whole: list[str], lean: list[str]
) -> None:
    sphere, node = shown(group, **inputs)
    engines.use(sphere.scene, engine, 1)
    assert closures(sphere.scene) == lean
    for name in inputs:
        if node.inputs[name].type == "VALUE":
            materials.paint(bpy.data.materials["Shown"], node.inputs[name], "none", 1.0)
    assert closures(sphere.scene) == whole


def test_driven_weight_is_known() -> None:
    sphere, node = shown(ROUGH_DIFFUSE, Roughness=0.5)
    node.inputs["Roughness"].driver_add("default_value").driver.expression = "frame - 1"
    found = []
    for frame in (1, 2):
        sphere.scene.frame_set(frame)
        found.append(closures(sphere.scene))
    assert found == [LAMBERT, PAIR]


@pytest.mark.parametrize(
    ("osl", "model", "expected"),
    [
        (True, "Oren-Nayar", ["Script"]),
        (True, "Cycles Diffuse", LAMBERT),  # Cycles has it
        (True, "Lambert", LAMBERT),
        (False, "Fujii", LAMBERT),
    ],
)
def test_osl_is_used_where_the_scene_uses_it_and_closures_are_not_exact(osl: bool, model: str, expected: list[str]) -> None:
    if not compiles_osl():
        pytest.skip("this Blender cannot compile OSL")
    sphere, _ = shown(ROUGH_DIFFUSE, Model=model, Roughness=0.3)
    engines.use(sphere.scene, engines.CYCLES, 1)
    sphere.scene.cycles.shading_system = osl
    assert closures(sphere.scene) == expected


def test_material_serves_scenes_of_several_engines() -> None:
    sphere, _ = shown(ROUGH_DIFFUSE, Roughness=0.3)
    other = sphere.scene.copy()
    other.render.engine = "CYCLES"
    assert [len(closures(scene)) for scene in (sphere.scene, other, sphere.scene)] == [3, 2, 3]


def test_only_lights_that_are_chosen_count() -> None:
    sphere, _ = shown(ROUGH_DIFFUSE, Quality="Exact for Chosen Lights", Roughness=0.3)
    sizes = []
    for lights in ([], [sphere.sun], [sphere.sun] * 2, [sphere.sun] * 4):
        chosen_lights.choose(lights)
        tree = inlined(sphere.scene)
        sizes.append(len(tree.node_tree.nodes))
    none, one, two, four = sizes
    assert none < one < two < four and four - two == 2 * (two - one)
