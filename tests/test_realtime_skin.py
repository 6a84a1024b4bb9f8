# SPDX-License-Identifier: GPL-3.0-or-later
"""Light through thin matter and from out of sight, in the realtime engine, against the integral equation of radiative transfer."""

import math
import random
from statistics import fmean

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.realtime.scene_cache import SceneCache
from true_diffuse.scenes.elements import add, uniform_world
from true_diffuse.scenes.slab import slab
from true_diffuse.scripts.studies import thin
from true_diffuse.scripts.studies.slab_light import half_plane
from true_diffuse.scripts.studies.slab_transmittance import transmittance


def walked(albedo: float, thickness: float, mu: float, paths: int) -> float:
    """Return the fraction of random walks that come out on the other side."""
    roll, count = random.Random(5).random, 0
    for _ in range(paths):
        z, direction = -math.log(1.0 - roll()) * mu, mu
        while 0.0 < z < thickness and roll() < albedo:
            direction = 2.0 * roll() - 1.0
            z -= math.log(1.0 - roll()) * direction
        count += z >= thickness
    return count / paths


@pytest.mark.parametrize(("albedo", "thickness"), ((0.5, 0.7), (0.95, 2.0), (1.0, 4.0)))
def test_transmittance_is_that_of_random_walks(albedo: float, thickness: float) -> None:
    """Within three standard errors of 20 000 walks."""
    share = walked(albedo, thickness, 0.8, 20_000)
    assert transmittance(albedo, thickness, 0.8) == pytest.approx(share, abs=3.0 * math.sqrt(share * (1.0 - share) / 20_000))


def test_transmittance_without_scattering_is_the_beam() -> None:
    assert transmittance(0.0, 1.5, 0.5) == pytest.approx(math.exp(-3.0), rel=1e-12)


@pytest.mark.parametrize("preset", thin.SKINS)
@pytest.mark.parametrize("thickness", (0.5, 2.0))
@pytest.mark.usefixtures("empty_file", "registered", "driver")
@pytest.mark.render
def test_slab_lit_from_behind_lets_through_what_theory_says(preset: str, thickness: float) -> None:
    """To 4 %: 1.5 of the fit, and 2 of the samples' noise and of light from farther than their points. Red alone is above 1 %."""
    red, *_ = thin.through(thickness, thin.skin(preset), engines.REALTIME, 32)
    assert red == pytest.approx(thin.expected(preset, thickness)[0], rel=0.04)


@pytest.mark.usefixtures("empty_file", "registered", "driver")
@pytest.mark.render
def test_light_without_shadows_comes_through_whatever_is_before_it() -> None:
    """To the same 4 %, through the slab and past a board between it and the sun."""
    scene, body, sun = thin.lit_from_behind(2.0, thin.skin("fair_skin"))
    board = bpy.data.meshes.new("Board")
    board.from_pydata([(-1.0, -1.0, -0.1), (1.0, -1.0, -0.1), (1.0, 1.0, -0.1), (-1.0, 1.0, -0.1)], [], [(0, 1, 2, 3)])
    before = add(scene, "Board", board)
    for shadows, wanted in ((False, thin.expected("fair_skin", 2.0)[0]), (True, 0.0)):
        with render.measurement_scene(scene, body, sun, shadows=shadows) as measured:
            measured.collection.objects.link(before)
            _, rgb = render.radiance(measured, engines.REALTIME, 32)
        assert fmean(rgb[::3]) == pytest.approx(wanted, rel=0.04)


def lines(scene: bpy.types.Scene) -> list[str]:
    """Return what a picture of `scene` lacks."""
    cache = SceneCache()
    cache.update(scene.view_layers[0].depsgraph)
    return list(map(str, cache.warnings))


@pytest.mark.usefixtures("empty_file", "registered")
def test_what_does_not_come_through_is_said() -> None:
    scene, body, sun = thin.lit_from_behind(2.0, thin.skin("fair_skin"))
    layer = scene.view_layers[0]
    assert not lines(scene)
    scene.world = uniform_world()
    layer.update()
    assert not lines(scene)  # it comes through where the sun shines
    sun.hide_viewport = True
    layer.update()
    assert lines(scene) == ["the world's light comes through thin matter only where a light shines"]
    body.data.materials[0] = materials.create("Rough", ROUGH_DIFFUSE)
    layer.update()
    assert not lines(scene)
    body.data.materials[0] = bpy.data.materials["fair_skin"]
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    layer.update()
    assert lines(scene) == ["of the world's light, only that of its suns comes through thin matter"]


@pytest.mark.usefixtures("empty_file", "registered")
def test_curves_of_a_medium_are_said() -> None:
    scene, *_ = thin.lit_from_behind(2.0, thin.skin("fair_skin"))
    curves = bpy.data.hair_curves.new("Hair")
    curves.add_curves([3])
    curves.materials.append(thin.skin("deep_skin"))
    add(scene, "Hair", curves)
    scene.view_layers[0].update()
    assert lines(scene) == ["deep_skin: no light comes through curves"]


@pytest.mark.usefixtures("empty_file", "registered", "driver")
@pytest.mark.render
def test_plane_that_the_camera_sees_has_no_light_twice() -> None:
    """A slab of 20 mm under a sun, its shadow map in use: 4e-5 of the light comes through so much of it."""
    body = slab(20.0)
    color = (0.7, 0.4, 0.2)
    material = materials.create(
        "Skin", SUBSURFACE, Color=(*color, 1.0), **{"Subsurface Radius": (1.0, 0.5, 0.3), "Subsurface": 1.0, "Specular": 0.0}
    )
    for got, wanted in zip(body.picture([material], engines.REALTIME, 4, (32, 32), 8.0), color, strict=True):
        assert list(got) == pytest.approx([wanted] * len(got), rel=2e-3)


@pytest.mark.usefixtures("empty_file", "registered", "driver")
@pytest.mark.render
def test_light_comes_from_beside_the_picture() -> None:
    """The dark side of a shadow's edge alone is as bright as in a picture that shows the lit side, too.

    To 10 %: the weights of what is seen are summed on a disk of pixels, the others along the light.
    """
    material = thin.skin("skin_2")
    body = slab(100.0)
    wide, _, _ = body.picture([material], engines.REALTIME, 32, (64, 64), 32.0, half_plane(body))
    camera = body.scene.camera
    with render.measurement_scene(body.scene, body.body, body.sun, shadows=True) as scene:
        mask = half_plane(body)
        scene.collection.objects.link(mask)
        camera.data.ortho_scale = body.units(32.0)
        scene.render.resolution_x = scene.render.resolution_y = 64
        render.crop(scene, render.Region(0, 0, 31, 64))  # to half a millimeter from the edge
        _, rgb = render.radiance(scene, engines.REALTIME, 32)
    inner = range(16, 48)
    for column in (24, 28, 30):
        whole = fmean(wide[64 * y + column] for y in inner)
        assert whole > 0.01
        assert fmean(rgb[3 * (31 * y + column)] for y in inner) == pytest.approx(whole, rel=0.1)
