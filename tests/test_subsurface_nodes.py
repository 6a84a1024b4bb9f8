# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group Subsurface: its layers one by one, its units, and what it does to the material around it."""

import bpy

import pytest

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.nodes.graph import GROUP_ID
from true_diffuse.addon.nodes.subsurface import METHOD
from true_diffuse.scenes.sphere import COLOR, SphereUnderSun, sphere_under_sun

pytestmark = pytest.mark.usefixtures("empty_file")


def difference(sphere: SphereUnderSun, ours: bpy.types.Material, reference: bpy.types.Material, engine: Engine) -> float:
    """The RMS difference of two materials under the sun, relative to the reference's RMS."""
    (_, got), (_, expected) = (sphere.radiance(shown, [sphere.sun], None, engine, 4, shadows=False) for shown in (ours, reference))
    measurable = [pixel for pixel, good in enumerate(sphere.surface().measurable) if good]
    return error.difference(got, expected, measurable)


@pytest.mark.render
@pytest.mark.parametrize("model", ["Oren-Nayar", "EON"])
def test_without_subsurface_and_coat_it_is_rough_diffuse(engine, model: str) -> None:
    sphere = sphere_under_sun(48)
    bare = {"Subsurface": 0.0, "Specular": 0.0}
    ours = materials.create("Ours", SUBSURFACE, Model=model, Color=COLOR, Roughness=0.5, **bare)
    rough = materials.create("Rough", ROUGH_DIFFUSE, Model=model, Quality="Fast", Color=COLOR, Roughness=0.5)
    # Cycles picks one closure of two by chance, and does so by another number here; EEVEE's colors have 10 bits
    assert difference(sphere, ours, rough, engine) < 0.01


@pytest.mark.render
def test_specular_coat_of_ior_1_changes_nothing(engine) -> None:
    bare, coated = (
        materials.create(f"Coat {weight}", SUBSURFACE, Color=COLOR, Subsurface=0.0, IOR=1.0, Specular=weight)
        for weight in (0.0, 1.0)
    )
    assert difference(sphere_under_sun(48), coated, bare, engine) < 0.01


@pytest.mark.parametrize(("unit", "meter"), [(1.0, 1.0), (0.01, 100.0), (0.001, 1000.0), (1000.0, 1e-3)])
def test_lengths_follow_the_scenes_unit(unit: float, meter: float) -> None:
    bpy.ops.mesh.primitive_plane_add()  # drivers run in what a scene uses
    bpy.context.object.data.materials.append(materials.create("Skin", SUBSURFACE))
    bpy.context.scene.unit_settings.scale_length = unit
    bpy.context.view_layer.update()
    evaluated = bpy.data.node_groups[SUBSURFACE.name].evaluated_get(bpy.context.evaluated_depsgraph_get())
    (value,) = (node.outputs[0].default_value for node in evaluated.nodes if node.label == "Meter")
    assert value == pytest.approx(meter, rel=1e-6)


def thickness_of(material: bpy.types.Material) -> bpy.types.NodeSocket:
    """Return what the thickness of `material` is linked to."""
    (link,) = material.node_tree.get_output_node("EEVEE").inputs["Thickness"].links
    return link.from_socket


def test_thickness_is_the_medium_s() -> None:
    """What is translucent must not be taken for thick, nor for as thin as shadows of another object's say."""
    material = materials.create("Skin", SUBSURFACE)
    socket = thickness_of(material)
    assert (socket.node.node_tree.name, socket.name) == (SUBSURFACE.name, "Thickness")
    assert socket.node.outputs.keys() == ["BSDF", "Thickness"]
    materials.set_thickness(material)
    assert thickness_of(material) == socket


def test_older_version_of_the_group_is_still_translucent() -> None:
    tree = SUBSURFACE.ensure()
    tree[GROUP_ID] = f"{SUBSURFACE.key}/0"
    tree.interface.remove(tree.interface.items_tree["Thickness"])  # as before version 6
    material = materials.create("Old", ROUGH_DIFFUSE)
    added = material.node_tree.nodes.new("ShaderNodeGroup")
    added.node_tree = tree
    material.node_tree.links.new(added.outputs["BSDF"], material.node_tree.get_output_node("EEVEE").inputs["Surface"])
    materials.set_thickness(material)
    assert not material.node_tree.get_output_node("EEVEE").inputs["Thickness"].is_linked


def test_method_offers_what_cycles_has() -> None:
    node = materials.create("Skin", SUBSURFACE).node_tree.nodes[SUBSURFACE.name]
    closure = bpy.data.materials.new("Plain").node_tree.nodes.new("ShaderNodeSubsurfaceScattering")
    theirs = {item.name for item in closure.bl_rna.properties["falloff"].enum_items}
    for name in theirs:
        node.inputs[METHOD.name].default_value = name
        assert node.inputs[METHOD.name].default_value == name
