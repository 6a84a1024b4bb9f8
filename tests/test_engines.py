# SPDX-License-Identifier: GPL-3.0-or-later
"""What the engines themselves do, as far as the project builds on it: to be measured again with every new Blender."""

import bpy

import pytest

from support import USUAL, every_model
from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.models import CyclesDiffuse, Eon, Lambert, ReflectanceModel
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.scenes.sphere import COLOR, sphere_under_sun

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("empty_file")]


def blenders_own_diffuse(roughness: float) -> bpy.types.Material:
    material, node = materials.create_plain("Diffuse BSDF")
    node.inputs["Color"].default_value = COLOR
    node.inputs["Roughness"].default_value = roughness
    return material


@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_diffuse_bsdf_of_cycles_is_its_own_model_not_eon(degrees: float) -> None:
    sphere = sphere_under_sun(64)
    cycles, eon = sphere.measure(blenders_own_diffuse(1.0), [CyclesDiffuse(1.0), Eon(1.0)], engines.CYCLES, 4, degrees)[1]
    assert cycles.rms < 0.002  # the pixel filter's 0.01 pixels
    assert eon.rms > 0.01


@pytest.mark.usefixtures("driver")
def test_diffuse_bsdf_of_eevee_ignores_roughness() -> None:
    sphere = sphere_under_sun(64)
    (result,) = sphere.measure(blenders_own_diffuse(1.0), [Lambert()], engines.EEVEE, 4, 60.0)[1]
    assert result.rms < 0.004  # colors of 10 bits


@every_model
@pytest.mark.usefixtures("driver", "registered")
def test_realtime_draws_every_model_itself(model: ReflectanceModel) -> None:
    material = materials.create(model.label, ROUGH_DIFFUSE, Model=model.label, Color=COLOR, **USUAL)
    (result,) = sphere_under_sun(64).measure(material, [model.reference(USUAL)], engines.REALTIME, 1, 60.0)[1]
    # From pixel to pixel the sphere's normal turns by 1/32: by 1e-4 in the standard deviation, 0.003 pixels, of the filter through
    # which Cycles renders its normals.
    assert result.rms <= 1e-4
