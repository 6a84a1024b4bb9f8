# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Sky Texture in the realtime engine, and its sun as a light, against Cycles' own render of the world."""

import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import replace

import bpy

import pytest

from true_diffuse.addon.material.expression import Coordinate, Image, ImageTexture, SkyTexture, apply, walk
from true_diffuse.addon.material.links import Place
from true_diffuse.addon.material.read_nodes import NodeReader, UnsupportedInput
from true_diffuse.addon.material.sky import Atmosphere, Sky, Sun, SunDisc
from true_diffuse.addon.material.suns import DIRECTION, is_sky_alone, without_suns
from true_diffuse.addon.measure.error import difference
from true_diffuse.addon.models.vector import from_polar
from true_diffuse.addon.usd.expressions import Writer
from true_diffuse.addon.usd.files import Unsupported
from true_diffuse.addon.usd.network import Network
from true_diffuse.scripts.studies import skies
from true_diffuse.scripts.studies.glsl_values import evaluate
from true_diffuse.scripts.studies.skies import SKIES, SUNS, Settings, add_sky, sky_of

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("registered", "driver", "empty_file")]


def of(names: Mapping[str, Settings], quick: Sequence[str]) -> list:
    """Return all `names` as parameters, of which the default tests take those that are `quick`."""
    return [pytest.param(name, marks=() if name in quick else pytest.mark.slow) for name in names]


@pytest.mark.parametrize("name", of(SKIES, ["new", "sunset", "mountain", "sunset once", "preetham"]))
def test_sky_is_that_of_cycles(name: str) -> None:
    """Both look up a table of 32-bit floats of the same texels, of which the driver's functions have errors of some 1e-5."""
    settings = {**SKIES[name], "sun_disc": False}
    assert difference(skies.realtime(settings), skies.cycles(settings), range(skies.WIDTH * skies.HEIGHT)) < 5e-4


@pytest.mark.parametrize("name", of(SUNS, ["new", "rising once"]))
def test_sun_is_that_of_cycles(name: str) -> None:
    """Its light, of which the pixels at the edge of the disc leave 0.2 % uncertain, and its picture, where they may be off."""
    sky = sky_of(SUNS[name])
    sun = sky.sun()
    assert sun and sky.disc
    shown = skies.around(sun)
    expected = skies.disc(SUNS[name], shown)
    assert sun.irradiance == pytest.approx(skies.irradiance(expected, shown), rel=3e-3)
    place = (sky.atmosphere.sun_elevation, sky.disc.diameter, sky.lowest_elevation)
    numbers = ", ".join(f"vec3{value}" for value in (place, *sky.disc_ends))
    rows = [(from_polar(math.sin(latitude), math.pi / 2.0 - longitude),) for longitude, latitude in skies.directions(shown)]
    drawn = evaluate("realtime/sky", f"rgb_of_xyz(sun_xyz(a.xyz, {sky.sun_rotation}, {numbers}))", rows)
    got = array("f", (value for color in drawn for value in color))
    assert difference(got, expected, range(len(rows))) < 1e-3


def test_sun_that_does_not_show_is_no_light() -> None:
    below = {"sun_elevation": -0.03}
    assert sky_of(below).sun() is None
    assert sky_of({"sun_disc": False}).sun() is None
    assert sky_of(below | {"altitude": 20000.0}).sun()  # from where the ground begins at -0.08
    assert sky_of(below | {"altitude": 20000.0, "sky_type": "SINGLE_SCATTERING"}).sun() is None  # as Blender has it


def test_sun_is_placed_as_blender_wraps_its_angles() -> None:
    for elevation in (-7.0, -3.0, -1.6, 0.3, 1.6, 3.0, 5.0, 9.0):
        sky = sky_of({"sun_elevation": elevation, "sun_rotation": 0.4})
        assert -math.pi / 2.0 <= sky.atmosphere.sun_elevation <= math.pi / 2.0
        flat = math.cos(elevation)
        expected = flat * math.sin(0.4), flat * math.cos(0.4), math.sin(elevation)
        assert sky.sun_direction == pytest.approx(expected, abs=1e-6)


def test_mapping_turns_a_sky_without_its_sun() -> None:
    """Blender takes the sky's direction from nobody while it shows the sun."""
    tree = bpy.data.materials.new("Mapped").node_tree
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 1.0)
    for has_sun in (False, True):
        node = add_sky(tree, {"sun_disc": False})
        tree.links.new(mapping.outputs[0], node.inputs[0])
        node.sun_disc = has_sun
        expression = NodeReader().expression(Place(node.outputs["Color"]))
        assert isinstance(expression, SkyTexture)
        assert (expression.direction == Coordinate("generated")) == has_sun


def test_hosek_and_wilkie_is_refused() -> None:
    with pytest.raises(UnsupportedInput, match="Hosek/Wilkie"):
        NodeReader().expression(Place(add_sky(bpy.data.materials.new("Read").node_tree, {"sky_type": "HOSEK_WILKIE"}).outputs[0]))


def test_materialx_has_no_sky() -> None:
    texture = SkyTexture(sky_of({}), Coordinate("position"), "My Sky")
    with pytest.raises(Unsupported, match="sky") as problem:
        Writer(Network("MaterialX_"), {}).color(texture)
    assert problem.value.node == "My Sky"


# ---- the suns of a world's radiance

SUNNY = SkyTexture(Sky(Atmosphere(True, 0.3, 100.0, 1.0, 1.0, 1.0), 0.5, SunDisc(0.01, 1.0)), DIRECTION)
SUNLESS = SkyTexture(replace(SUNNY.sky, disc=None), DIRECTION)


def sun_of(texture: SkyTexture) -> Sun:
    found = texture.sky.sun()
    assert found
    return found


def test_sun_of_a_radiance_is_scaled_as_its_sky() -> None:
    tinted = apply("add", apply("multiply", SUNNY, (0.5, 0.25, 2.0)), (3.0, 3.0, 3.0))
    rest, (sun,) = without_suns(tinted)
    assert rest == apply("add", apply("multiply", SUNLESS, (0.5, 0.25, 2.0)), (3.0, 3.0, 3.0))
    own = sun_of(SUNNY)
    assert (sun.direction, sun.diameter) == (own.direction, own.diameter)
    expected = [a * b for a, b in zip(own.radiance, (0.5, 0.25, 2.0), strict=True)]
    assert sun.radiance == pytest.approx(expected)


def test_suns_of_two_skies_are_two_lights() -> None:
    other = replace(SUNNY, sky=replace(SUNNY.sky, sun_rotation=2.0))
    rest, suns = without_suns(apply("mix", SUNNY, other, 0.25))
    assert not [one for one in walk(rest) if isinstance(one, SkyTexture) and one.sky.disc]
    assert [sun.radiance for sun in suns] == [
        pytest.approx([share * value for value in sun_of(texture).radiance]) for texture, share in ((SUNNY, 0.75), (other, 0.25))
    ]


def test_sun_behind_what_depends_on_direction_is_seen_in_its_own() -> None:
    upper = apply("multiply", SUNNY, apply("greater_than", apply("z", DIRECTION), 0.0))
    assert without_suns(upper)[1] == [sun_of(SUNNY)]
    lower = apply("multiply", SUNNY, apply("less_than", apply("z", DIRECTION), 0.0))
    assert without_suns(lower) == (apply("multiply", SUNLESS, apply("less_than", apply("z", DIRECTION), 0.0)), [])


def test_sun_behind_an_image_stays() -> None:
    image = ImageTexture(Image("Clouds", "sRGB", is_data=False), DIRECTION)
    clouds = apply("multiply", SUNNY, image)
    assert without_suns(clouds) == (clouds, [])
    rest, (sun,) = without_suns(apply("add", SUNNY, image))
    assert rest == apply("add", SUNLESS, image)
    assert sun.radiance == pytest.approx(sun_of(SUNNY).radiance)


def test_sky_without_its_sun_is_alone_unless_something_else_varies() -> None:
    rest, _ = without_suns(apply("add", apply("multiply", SUNNY, 2.0), (0.1, 0.1, 0.1)))
    assert is_sky_alone(rest)
    assert not is_sky_alone(SUNNY)
    assert not is_sky_alone(apply("add", SUNLESS, apply("z", DIRECTION)))
    assert is_sky_alone(replace(SUNNY, sky=replace(SUNNY.sky, atmosphere=replace(SUNNY.sky.atmosphere, sun_elevation=-1.0))))
