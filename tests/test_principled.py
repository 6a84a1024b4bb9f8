# SPDX-License-Identifier: GPL-3.0-or-later
"""The group Principled Rough Diffuse: Blender's Principled BSDF where the model is its own, and with other models its layers."""

import math
from array import array
from collections.abc import Sequence

import bpy

import pytest

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.closures import principled_layers
from true_diffuse.addon.closures.principled_layers import Interface, level_f0, sheen_albedo, specular_albedo
from true_diffuse.addon.material import convert
from true_diffuse.addon.measure import render
from true_diffuse.addon.models.fresnel import boundary
from true_diffuse.addon.models.quadrature import integrate
from true_diffuse.addon.nodes import PRINCIPLED
from true_diffuse.scripts.fit.principled import Cylinder, thinned

pytestmark = pytest.mark.usefixtures("empty_file")

COLOR = (0.8, 0.4, 0.1, 1.0)
BALLS: dict[str, dict[str, float | tuple[float, ...]]] = {
    "plain": {},
    "rough": {"Roughness": 1.0},
    "metal": {"Metallic": 1.0, "Roughness": 0.3},
    "half metal": {"Metallic": 0.5},
    "coat": {"Coat Weight": 1.0, "Coat Tint": (0.9, 0.6, 0.5, 1.0), "Coat Roughness": 0.2},
    "sheen": {"Sheen Weight": 1.0, "Sheen Tint": (0.5, 0.7, 1.0, 1.0)},
    "glass": {"Transmission Weight": 0.7, "Roughness": 0.2},
    "alpha": {"Alpha": 0.5},
    "emission": {"Emission Strength": 0.5, "Emission Color": (0.2, 0.8, 0.3, 1.0)},
    "scattering": {"Subsurface Weight": 0.6, "Subsurface Scale": 0.1},
    "thin film": {"Thin Film Thickness": 400.0, "Roughness": 0.3},
    "tinted": {"Metallic": 0.7, "Anisotropic": 0.8, "Specular Tint": (1.0, 0.5, 0.2, 1.0), "Specular IOR Level": 0.8},
}
COLUMNS, PIXELS = 4, 24  # balls a row, and pixels a ball


class Balls:
    """A picture with a sphere for each of BALLS, under a sun and a sky; `textured`: with an image for Base Color and Roughness."""

    def __init__(self, diffuse_roughness: float = 0.0, textured: bool = False) -> None:
        scene = self.scene = bpy.context.scene
        self.materials = []
        for index, (name, inputs) in enumerate(BALLS.items()):
            bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=0.46)
            bpy.ops.object.shade_smooth()
            bpy.context.object.location = (index % COLUMNS, -(index // COLUMNS), 0.0)
            made = bpy.data.materials.new(name)
            node = made.node_tree.nodes["Principled BSDF"]
            node.inputs["Base Color"].default_value = COLOR
            node.inputs["Diffuse Roughness"].default_value = diffuse_roughness
            for socket, value in inputs.items():
                node.inputs[socket].default_value = value
            if textured:
                checker = made.node_tree.nodes.new("ShaderNodeTexChecker")
                checker.inputs["Scale"].default_value = 2.0
                made.node_tree.links.new(checker.outputs["Color"], node.inputs["Base Color"])
                made.node_tree.links.new(checker.outputs["Fac"], node.inputs["Metallic"])
            bpy.context.object.active_material = made
            self.materials.append(made)
        bpy.ops.object.light_add(type="SUN", rotation=(0.9, 0.2, 0.4))
        rows = math.ceil(len(BALLS) / COLUMNS)
        bpy.ops.object.camera_add(location=(0.5 * (COLUMNS - 1), -0.5 * (rows - 1), 5.0))
        scene.camera = bpy.context.object
        scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", float(COLUMNS)
        scene.world = bpy.data.worlds.new("Sky")
        scene.render.resolution_x, scene.render.resolution_y = COLUMNS * PIXELS, rows * PIXELS
        scene.cycles.max_bounces = 3

    def picture(self, engine: Engine, samples: int) -> array:
        return render.radiance(self.scene, engine, samples)[1]

    def convert(self) -> None:
        """Convert all materials."""
        assert convert.convert_materials(self.materials, 1.0).lines == []

    def set(self, **inputs: str) -> None:
        """Set inputs of all groups."""
        for made in self.materials:
            for name, value in inputs.items():
                made.node_tree.nodes["Principled BSDF"].inputs[name].default_value = value

    def vary(self, name: str) -> None:
        """Link an input of all groups to a 0 of which Blender does not know that it is 0 everywhere."""
        for made in self.materials:
            missing = made.node_tree.nodes.new("ShaderNodeAttribute")
            missing.attribute_name = "none"
            made.node_tree.links.new(missing.outputs["Fac"], made.node_tree.nodes["Principled BSDF"].inputs[name])


def of_ball(picture: Sequence[float], index: int) -> list[float]:
    """The pixels of one ball, all channels."""
    width, left, top = COLUMNS * PIXELS, index % COLUMNS * PIXELS, index // COLUMNS * PIXELS
    rows = range(top, top + PIXELS)
    return [value for row in rows for value in picture[3 * (row * width + left) : 3 * (row * width + left + PIXELS)]]


def rms(one: Sequence[float], other: Sequence[float]) -> float:
    return math.sqrt(sum((a - b) ** 2 for a, b in zip(one, other, strict=True)) / sum(b * b for b in other))


def inlined(made: bpy.types.Material) -> list[tuple[str, list[str]]]:
    """The nodes that engines get of a material and that its output needs."""
    inline = bpy.types.InlineShaderNodes.from_material(made)  # which owns the tree
    tree = inline.node_tree
    waiting, needed = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"], {}
    while waiting:
        node = waiting.pop()
        if node.name not in needed:
            needed[node.name] = (node.bl_idname, [socket.name for socket in node.inputs if socket.is_linked])
            waiting += [link.from_node for socket in node.inputs for link in socket.links]
    return list(needed.values())


def test_sockets_are_those_of_the_principled_in_its_order() -> None:
    made = bpy.data.materials.new("Mine")
    node = made.node_tree.nodes["Principled BSDF"]
    theirs = [socket.name for socket in node.inputs if socket.name != "Weight"]
    menus = {"Model", "Quality", "Distribution", "Subsurface Method"}
    ours = [socket.name for socket in PRINCIPLED.inputs if socket.name not in menus]
    assert ours == theirs
    group = made.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = PRINCIPLED.ensure()
    for socket in node.inputs:
        if socket.name in ours:
            own = group.inputs[socket.name]
            values = [x if isinstance(x, (float, bool)) else tuple(x) for x in (socket.default_value, own.default_value)]
            assert own.hide_value == socket.hide_value and own.type == socket.type
            if socket.name != "Subsurface Scale":  # millimeters
                assert values[0] == values[1], socket.name


def test_lambert_is_one_principled_with_the_values_of_the_group() -> None:
    made = bpy.data.materials.new("Mine")
    convert.convert_materials([made], 1.0)
    thick = [("ShaderNodeOutputMaterial", ["Surface", "Thickness"]), ("ShaderNodeValue", [])]
    assert sorted(inlined(made)) == [("ShaderNodeBsdfPrincipled", []), *thick]


@pytest.mark.render
@pytest.mark.parametrize("textured", [False, True])
@pytest.mark.parametrize("roughness", [0.0, 0.6])
def test_converted_principled_is_equal_in_cycles(roughness: float, textured: bool) -> None:
    balls = Balls(roughness, textured)
    before = balls.picture(CYCLES, 4)
    balls.convert()
    after = balls.picture(CYCLES, 4)
    # the same closures and seed: nothing but rounding, of 5 mm to 0.005 too
    assert {name: rms(of_ball(after, index), of_ball(before, index)) for index, name in enumerate(BALLS)} == pytest.approx(
        dict.fromkeys(BALLS, 0.0), abs=1e-4
    )


@pytest.mark.render
def test_layers_over_another_model_send_back_as_much_light_in_cycles() -> None:
    """At Diffuse Roughness 0 Oren-Nayar's model is Lambert's, but the group adds its own diffuse closure to the layers."""
    balls = Balls()
    before = balls.picture(CYCLES, 64)
    balls.convert()
    balls.set(Model="Oren-Nayar")
    balls.vary("Diffuse Roughness")
    after = balls.picture(CYCLES, 64)
    # 0.15 % of the fit, 0.35 % of the sheen's; the noise is 0.1 % for a ball's 24^2 pixels
    for index, name in enumerate(BALLS):
        one, other = of_ball(after, index), of_ball(before, index)
        assert sum(one) == pytest.approx(sum(other), rel=0.004), name


@pytest.mark.render
@pytest.mark.usefixtures("driver")
def test_converted_principled_and_layers_over_another_model_are_equal_in_eevee() -> None:
    balls = Balls()
    before = balls.picture(EEVEE, 16)
    balls.convert()
    assert rms(balls.picture(EEVEE, 16), before) < 1e-4  # the same closures and noise
    balls.set(Model="Oren-Nayar")
    balls.vary("Diffuse Roughness")
    after = balls.picture(EEVEE, 16)
    for index, name in enumerate(BALLS):
        one, other = of_ball(after, index), of_ball(before, index)
        if name in {"glass", "scattering"}:  # two closures of one kind in a pixel: EEVEE picks one by chance
            assert sum(one) == pytest.approx(sum(other), rel=0.01)
        else:
            assert rms(one, other) < 0.01, name


@pytest.mark.render
@pytest.mark.parametrize("engine", [CYCLES, EEVEE], ids=lambda engine: engine.key)
def test_layers_leave_what_the_engine_leaves(engine: Engine, request: pytest.FixtureRequest) -> None:
    if engine is EEVEE:
        request.getfixturevalue("driver")
    layers = principled_layers.CYCLES if engine is CYCLES else principled_layers.EEVEE
    cylinder = Cylinder(engine, "Roughness")
    for ior in (1.3, 1.5, 2.0):
        interface, points = Interface(level_f0(ior)), thinned(cylinder.points(IOR=ior))
        off = [1.0 - specular_albedo(layers, mu, r, interface) - left for mu, r, left in points]
        assert math.sqrt(sum(x * x for x in off) / len(off)) < (0.0015 if engine is CYCLES else 0.0045)
    sheen = Cylinder(engine, "Sheen Roughness").points(Base_Color=(0.0, 0.0, 0.0, 1.0), Specular_IOR_Level=0.0, Sheen_Weight=1.0)
    off = [sheen_albedo(layers, mu, r) - left for mu, r, left in thinned(sheen)]
    assert math.sqrt(sum(x * x for x in off) / len(off)) < 0.0035


@pytest.mark.parametrize("mu", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("ior", [1.3, 1.5, 2.0])
def test_smooth_layer_reflects_as_fresnel(mu: float, ior: float) -> None:
    expected = 1.0 - boundary(ior).transmittance(mu)
    assert specular_albedo(principled_layers.CYCLES, mu, 0.0, Interface(level_f0(ior))) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("roughness", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("mu", [0.2, 0.5, 0.9])
def test_single_reflection_is_the_mean_over_visible_microfacets(mu: float, roughness: float) -> None:
    """GGX, of whose microfacets Cycles counts those as dark that reflect into the surface (app/cycles_precompute.cpp)."""
    alpha, sine, edge = roughness**2, math.sqrt(1.0 - mu * mu), boundary(1.5)
    f0 = level_f0(1.5)
    masking = 2.0 / (1.0 + math.sqrt(1.0 + alpha * alpha * (1.0 / (mu * mu) - 1.0)))

    def around(w: float) -> float:  # w^2 is uniform
        tangent = alpha * math.sqrt(1.0 - w * w) / w
        z = 1.0 / math.hypot(1.0, tangent)

        def seen(azimuth: float) -> float:
            v_dot_h = mu * z + sine * z * tangent * math.cos(azimuth)
            if v_dot_h <= 0.0 or 2.0 * v_dot_h * z <= mu:
                return 0.0
            return masking * v_dot_h / (mu * z) * (1.0 - edge.transmittance(v_dot_h) - f0) / (1.0 - f0)

        return 2.0 * w * integrate(seen, (0.0, 0.5, 1.0, 2.0, math.pi), 16) / math.pi

    expected = f0 + (1.0 - f0) * integrate(around, (0.0, 0.3, 0.6, 1.0), 16)
    # three times the RMS error that is stated
    assert Interface(f0).single(principled_layers.CYCLES, mu, roughness) == pytest.approx(expected, abs=3.0 * 0.0025)


def test_tint_scales_reflectance_at_normal_incidence() -> None:
    layers = principled_layers.CYCLES
    whole, half = (specular_albedo(layers, 1.0, 0.0, Interface(level_f0(1.5), tint)) for tint in (1.0, 0.5))
    assert whole == pytest.approx(0.04, rel=1e-5) and half == pytest.approx(0.02, rel=1e-5)
