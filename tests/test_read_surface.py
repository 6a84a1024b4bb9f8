# SPDX-License-Identifier: GPL-3.0-or-later
"""How materials of Blender's closures and of our groups are read into a surface."""

import bpy

import pytest

from true_diffuse.addon.material.expression import Apply, Constant, apply
from true_diffuse.addon.material.materials import add_group, create
from true_diffuse.addon.material.read import group_node, read_surface
from true_diffuse.addon.material.surface import PARAMETERS, Surface
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE


class Material:
    """A material without nodes but its output, and what tests do with it."""

    def __init__(self) -> None:
        self.material = bpy.data.materials.new("Test")
        self.tree = self.material.node_tree
        for node in list(self.tree.nodes):
            if node.type != "OUTPUT_MATERIAL":
                self.tree.nodes.remove(node)
        self.output = self.tree.nodes["Material Output"]

    def node(self, kind: str, **inputs: object) -> bpy.types.Node:
        node = self.tree.nodes.new(kind)
        for name, value in inputs.items():
            socket = node.inputs[name.replace("_", " ")]
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node

    def mix(self, kind: str, first: bpy.types.Node, second: bpy.types.Node, factor: float | None = None) -> bpy.types.Node:
        node = self.tree.nodes.new(kind)
        shaders = [socket for socket in node.inputs if socket.type == "SHADER"]
        for closure, socket in zip((first, second), shaders, strict=True):
            self.tree.links.new(closure.outputs[0], socket)
        if factor is not None:
            node.inputs["Factor"].default_value = factor
        return node

    def read(self, node: bpy.types.Node, unit: float = 1.0) -> tuple[Surface, list[str]]:
        self.tree.links.new(node.outputs[0], self.output.inputs["Surface"])
        reading = read_surface(self.material, unit)
        return reading.surface, [str(loss) for loss in reading.losses]


@pytest.fixture
def material() -> Material:
    return Material()


def test_surface_of_a_principled_bsdf_has_openpbr_parameters_and_millimeters(material):
    node = material.node(
        "ShaderNodeBsdfPrincipled",
        Metallic=0.25,
        Specular_IOR_Level=0.25,
        Subsurface_Weight=0.5,
        Subsurface_Scale=0.5,
        Subsurface_Radius=(1.0, 0.5, 0.25),
        Alpha=0.75,
    )
    surface, losses = material.read(node, unit=0.01)  # a unit is a centimeter
    assert not losses and surface.model == "lambert"
    values = {name: expression.value for name, expression in surface.inputs.items()}
    assert values == {
        "metallic": 0.25,
        "specular_weight": 0.5,  # Specular IOR Level 0.5 leaves the reflectance of the index as it is
        "subsurface_weight": 0.5,
        "subsurface_radius": (5.0, 2.5, 1.25),  # half a centimeter
        "opacity": 0.75,
    }


def test_surface_of_a_rough_principled_bsdf_has_the_model_of_cycles(material):
    surface, _ = material.read(material.node("ShaderNodeBsdfPrincipled", Diffuse_Roughness=0.5))
    assert surface.model == "cycles_diffuse" and surface["diffuse_roughness"] == Constant(0.5)


def test_surface_leaves_out_what_has_no_weight(material):
    node = material.node("ShaderNodeBsdfPrincipled", Coat_Roughness=0.7, Emission_Color=(1, 0, 0, 1), Specular_IOR_Level=0.0)
    surface, losses = material.read(node)
    assert surface.inputs == {} and not losses


def test_links_to_inputs_without_weight_are_no_loss(material):
    ray = material.node("ShaderNodeObjectInfo")
    node = material.node("ShaderNodeBsdfPrincipled", Coat_Roughness=ray.outputs["Random"])
    assert material.read(node)[1] == []
    node.inputs["Coat Weight"].default_value = 1.0
    (line,) = material.read(node)[1]
    assert line.startswith("Coat roughness: ") and "Object Info" in line


@pytest.mark.parametrize(("first", "factor"), [(True, 0.25), (False, 0.75)])
def test_mix_with_a_transparent_bsdf_is_opacity(material, first, factor):
    diffuse, clear = material.node("ShaderNodeBsdfDiffuse", Color=(0.5, 0.25, 0.125, 1)), material.node("ShaderNodeBsdfTransparent")
    closures = (diffuse, clear) if first else (clear, diffuse)
    surface, losses = material.read(material.mix("ShaderNodeMixShader", *closures, factor))
    assert surface.inputs == {"base_color": Constant((0.5, 0.25, 0.125)), "opacity": Constant(0.75)} and not losses


def test_mix_of_diffuse_bsdfs_is_the_mixed_color(material):
    red, blue = (material.node("ShaderNodeBsdfDiffuse", Color=color) for color in ((1, 0, 0, 1), (0, 0, 1, 1)))
    surface, losses = material.read(material.mix("ShaderNodeMixShader", red, blue, 0.25))
    assert surface.inputs == {"base_color": Constant((0.75, 0.0, 0.25))} and not losses


def test_mix_of_diffuse_and_metal_says_that_it_is_one_surface(material):
    diffuse, metal = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeBsdfMetallic")
    surface, losses = material.read(material.mix("ShaderNodeMixShader", diffuse, metal, 0.25))
    assert surface["metallic"] == Constant(0.25)
    assert len(losses) == 1 and losses[0].startswith("a mix of closures that differ in ") and "metallic" in losses[0]


@pytest.mark.parametrize("factor", [0.0, 1.0])
def test_mix_by_a_factor_at_its_end_is_one_closure(material, factor):
    diffuse, metal = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeBsdfMetallic")
    surface, losses = material.read(material.mix("ShaderNodeMixShader", diffuse, metal, factor))
    assert surface.uses("metallic") == bool(factor) and not losses


def test_mix_through_transparency_keeps_the_share_of_each_closure(material):
    """A mix at 1/2 of a closure of opacity 1/2 and an opaque one has the opacity 3/4, two thirds of it the second's."""
    red = material.node("ShaderNodeBsdfPrincipled", Base_Color=(1, 0, 0, 1), Alpha=0.5, Specular_IOR_Level=0.0)
    blue = material.node("ShaderNodeBsdfDiffuse", Color=(0, 0, 1, 1))
    surface, _ = material.read(material.mix("ShaderNodeMixShader", red, blue, 0.5))
    assert surface["opacity"] == Constant(0.75)
    assert surface["base_color"].value == pytest.approx((1 / 3, 0.0, 2 / 3), abs=1e-12)


def test_sum_with_an_emission_emits(material):
    diffuse, light = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeEmission", Color=(1, 0.5, 0, 1), Strength=2.0)
    surface, losses = material.read(material.mix("ShaderNodeAddShader", diffuse, light))
    radiance = apply("multiply", surface["emission_color"], surface["emission_strength"])
    assert radiance == Constant((2.0, 1.0, 0.0)) and surface["base_color"] == Constant((0.8, 0.8, 0.8)) and not losses


def test_mix_with_an_emission_takes_its_part_of_each(material):
    diffuse, light = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeEmission", Color=(1, 1, 1, 1), Strength=2.0)
    surface, losses = material.read(material.mix("ShaderNodeMixShader", diffuse, light, 0.25))
    assert surface["base_color"].value == pytest.approx((0.6, 0.6, 0.6)) and not losses
    assert apply("multiply", surface["emission_color"], surface["emission_strength"]) == Constant((0.5, 0.5, 0.5))


def test_sum_of_diffuse_bsdfs_adds_their_colors(material):
    red, blue = (material.node("ShaderNodeBsdfDiffuse", Color=color) for color in ((0.5, 0, 0, 1), (0, 0, 0.25, 1)))
    surface, losses = material.read(material.mix("ShaderNodeAddShader", red, blue))
    assert surface.inputs == {"base_color": Constant((0.5, 0.0, 0.25))} and not losses


def test_sum_with_a_highlight_has_it_over_what_is_no_metal_and_opaque(material):
    """The highlight of half of the surface, seen through at 1/4, weighs 1 / (1/2 3/4) as much as part of the surface."""
    half = material.node("ShaderNodeBsdfPrincipled", Metallic=0.5, Alpha=0.75, Specular_IOR_Level=0.0)
    highlight = add_group(material.tree, SPECULAR_GROUP)
    highlight.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    highlight.inputs["Specular"].default_value, highlight.inputs["Exponent"].default_value = 0.03, 12.0
    surface, losses = material.read(material.mix("ShaderNodeAddShader", half, highlight))
    assert surface["highlight_weight"].value == pytest.approx(0.08) and surface["highlight_exponent"] == Constant(12.0)
    assert (surface["metallic"], surface["opacity"], surface["base_color"].value) == (
        Constant(0.5),
        Constant(0.75),
        (0.8, 0.8, 0.8),
    )
    assert not losses


def test_closure_that_a_surface_lacks_is_said(material):
    surface, losses = material.read(material.node("ShaderNodeBsdfToon", Color=(0.5, 0, 0, 1)))
    assert surface["base_color"] == Constant((0.5, 0.0, 0.0)) and len(losses) == 1 and "Toon BSDF" in losses[0]


def test_output_without_a_closure_is_black(material):
    reading = read_surface(material.material)
    assert reading.surface.inputs == {"base_color": Constant((0.0, 0.0, 0.0))} and not reading.losses


def test_material_without_an_output_is_said(material):
    material.tree.nodes.remove(material.output)
    (loss,) = read_surface(material.material).losses
    assert str(loss) == "a material without an output is not supported, black takes its place"


def test_displacement_is_said(material):
    closure, displacement = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeDisplacement")
    material.tree.links.new(displacement.outputs[0], material.output.inputs["Displacement"])
    assert any("Displacement" in line for line in material.read(closure)[1])


def test_principled_in_the_artists_own_group_is_read_through(material):
    """As MakeHuman's skins are."""
    group = bpy.data.node_groups.new("Skin", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor").default_value = (1, 0.5, 0.25, 1)
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end, inner = (group.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeBsdfPrincipled"))
    group.links.new(start.outputs["Tint"], inner.inputs["Base Color"])
    group.links.new(inner.outputs[0], end.inputs[0])
    node = material.tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    surface, losses = material.read(node)
    assert surface["base_color"] == Constant((1.0, 0.5, 0.25)) and not losses


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_groups_are_read_with_their_model(model):
    surface = read_surface(create("Rough", ROUGH_DIFFUSE, Model=model.label, Color=(0.5, 0.5, 0.5, 1.0))).surface
    assert surface.model == model.id and surface["base_color"] == Constant((0.5, 0.5, 0.5))
    assert set(surface.inputs) - {"base_color"} <= {surface.model_parameter}


def test_subsurface_group_is_a_coat_over_a_mix():
    surface = read_surface(create("Skin", SUBSURFACE, Scale=2.0, Subsurface=0.5, Method="Random Walk (Skin)")).surface
    assert surface["subsurface_radius"].value == pytest.approx((2.6, 1.9, 1.34)) and surface["subsurface_weight"] == Constant(0.5)
    assert surface["coat_weight"] == Constant(1.0) and surface["coat_roughness"] == Constant(0.4)
    assert surface.subsurface_method == "RANDOM_WALK_SKIN" and not surface.uses("specular_weight")


def test_standard_specular_group_has_a_highlight():
    surface = read_surface(create("Shiny", SPECULAR_GROUP, Specular=0.5, Exponent=20.0)).surface
    assert surface.inputs == {"highlight_weight": Constant(0.5), "highlight_exponent": Constant(20.0)}


def test_group_behind_a_mix_is_found_and_read(material):
    node, clear = add_group(material.tree, ROUGH_DIFFUSE), material.node("ShaderNodeBsdfTransparent")
    surface, losses = material.read(material.mix("ShaderNodeMixShader", clear, node, 0.5))
    assert surface.model == "oren_nayar" and surface["opacity"] == Constant(0.5) and not losses
    assert group_node(material.material)[0] == node


def test_mix_by_a_linked_factor_is_an_expression(material):
    layer = material.node("ShaderNodeVertexColor")
    diffuse, clear = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeBsdfTransparent")
    mix = material.mix("ShaderNodeMixShader", clear, diffuse)
    material.tree.links.new(layer.outputs["Alpha"], mix.inputs["Factor"])
    surface, losses = material.read(mix)
    assert isinstance(surface["opacity"], Apply) and surface["base_color"] == Constant((0.8, 0.8, 0.8)) and not losses


def test_surface_refuses_an_unknown_parameter():
    with pytest.raises(ValueError, match="shininess"):
        Surface("lambert", {"shininess": Constant(1.0)})
    with pytest.raises(KeyError):
        Surface("lambert")["shininess"]
    assert Surface("lambert")["opacity"] == Constant(PARAMETERS["opacity"])


def test_mix_by_the_light_path_is_what_the_camera_sees(material):
    rays = material.node("ShaderNodeLightPath")
    diffuse, light = material.node("ShaderNodeBsdfDiffuse"), material.node("ShaderNodeEmission")
    mix = material.mix("ShaderNodeMixShader", light, diffuse)
    material.tree.links.new(rays.outputs["Is Camera Ray"], mix.inputs["Factor"])
    surface, _ = material.read(mix)
    assert surface.inputs == {} and len(read_surface(material.material).notes) == 1


def test_keyed_input_is_noted(material):
    node = material.node("ShaderNodeBsdfPrincipled")
    node.inputs["Roughness"].keyframe_insert("default_value", frame=1)
    material.read(node)
    (note,) = read_surface(material.material).notes
    assert note == "keyed or driven: its value at this frame counts (Principled BSDF)"


def test_output_of_eevee_is_read_before_that_of_cycles_and_that_of_all(material):
    """What EEVEE shows is what its own output has; Cycles shows its own; one for all engines serves neither."""
    outputs = {"ALL": material.output}
    for target, color in (("ALL", 0.25), ("EEVEE", 0.5), ("CYCLES", 0.75)):
        if target not in outputs:
            outputs[target] = material.tree.nodes.new("ShaderNodeOutputMaterial")
        closure = material.node("ShaderNodeBsdfDiffuse", Color=(color, color, color, 1.0))
        outputs[target].target = target
        material.tree.links.new(closure.outputs[0], outputs[target].inputs["Surface"])
    reading = read_surface(material.material)
    assert reading.surface["base_color"] == Constant((0.5, 0.5, 0.5))
    assert [loss.what for loss in reading.losses] == ["another engine's output"]
    assert read_surface(material.material, target="CYCLES").surface["base_color"] == Constant((0.75, 0.75, 0.75))
    material.tree.nodes.remove(outputs["EEVEE"])
    assert read_surface(material.material).surface["base_color"] == Constant((0.25, 0.25, 0.25))
