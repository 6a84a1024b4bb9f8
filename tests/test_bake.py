# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking what feeds an input: values by closed forms, nothing of the file changed, and why not where it cannot be."""

import math

import bpy

import pytest

from true_diffuse.addon.material.bake import CannotBake, bake_input
from true_diffuse.addon.material.links import Place

pytestmark = [pytest.mark.usefixtures("empty_file"), pytest.mark.render]
SIZE = 16
STEP = 0.5 / 255.0 + 1e-4  # half a step of 8 bits, and the noise of samples spread over a pixel below


def plane(material: bpy.types.Material, left: float = 0.0, right: float = 1.0) -> bpy.types.Object:
    """Return a new plane whose UV map has u from `left` to `right`."""
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(x, y, 0.0) for y in (0.0, 1.0) for x in (0.0, 1.0)], [], [(0, 1, 3, 2)])
    layer = mesh.uv_layers.new(name="UVMap")
    for loop, (u, v) in zip(layer.data, ((left, 0.0), (right, 0.0), (right, 1.0), (left, 1.0)), strict=True):
        loop.uv = (u, v)
    mesh.materials.append(material)
    item = bpy.data.objects.new("Plane", mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def ramp(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> None:
    """Link half of u, a number, to `socket`."""
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeUVMap").outputs["UV"], split.inputs[0])
    half = tree.nodes.new("ShaderNodeMath")
    half.operation = "MULTIPLY"
    half.inputs[1].default_value = 0.5
    tree.links.new(split.outputs["X"], half.inputs[0])
    tree.links.new(half.outputs[0], socket)


def surface(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    material = bpy.data.materials.new(name)
    return material, material.node_tree.nodes["Principled BSDF"]


def row(image: bpy.types.Image) -> list[float]:
    """Return the first channel along u, in the middle of v."""
    start = 4 * SIZE * (SIZE // 2)
    return [image.pixels[start + 4 * column] for column in range(SIZE)]


def encoded(value: float) -> float:
    """The sRGB curve (IEC 61966-2-1)."""
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1.0 / 2.4) - 0.055


@pytest.mark.parametrize("name", ["Roughness", "Base Color"])
def test_an_image_has_the_values_of_the_nodes(name: str) -> None:
    material, node = surface("Ramp")
    ramp(material.node_tree, node.inputs[name])
    plane(material)
    is_color = name == "Base Color"
    image = bake_input(material, Place(node.inputs[name]), SIZE, is_color=is_color)
    expected = [0.5 * (column + 0.5) / SIZE for column in range(SIZE)]
    # of samples spread evenly over a pixel's width of 0.5 / SIZE the mean of SAMPLES is off by its deviation, 1 / sqrt(12), over 4
    noise = 3.0 * 0.5 / SIZE / math.sqrt(12.0) / 4.0
    assert row(image) == pytest.approx(
        [encoded(value) for value in expected] if is_color else expected, abs=0.5 / 255.0 + 2.0 * noise
    )
    assert image.colorspace_settings.is_data is not is_color


def test_objects_share_the_image_and_margins_cover_no_neighbor() -> None:
    material, node = surface("Shared")
    info = material.node_tree.nodes.new("ShaderNodeObjectInfo")
    material.node_tree.links.new(info.outputs["Object Index"], node.inputs["Roughness"])
    plane(material, 0.0, 0.5).pass_index = 0
    plane(material, 0.5, 1.0).pass_index = 1
    image = bake_input(material, Place(node.inputs["Roughness"]), SIZE, is_color=False)
    assert row(image) == [0.0] * (SIZE // 2) + [1.0] * (SIZE // 2)


def test_an_input_inside_groups_is_baked() -> None:
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    node, end = inner.nodes.new("ShaderNodeBsdfPrincipled"), inner.nodes.new("NodeGroupOutput")
    inner.links.new(node.outputs[0], end.inputs[0])
    material, _ = surface("Outer")
    ramp(inner, node.inputs["Roughness"])
    group = material.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    material.node_tree.links.new(group.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])
    plane(material)
    image = bake_input(material, Place(node.inputs["Roughness"], (group,)), SIZE, is_color=False)
    assert row(image)[0] < 0.1 and row(image)[-1] > 0.4
    assert list(bpy.data.node_groups) == [inner] and len(inner.interface.items_tree) == 1


def test_a_bump_becomes_a_normal_map() -> None:
    material, node = surface("Bump")
    bump = material.node_tree.nodes.new("ShaderNodeBump")
    ramp(material.node_tree, bump.inputs["Height"])
    bump.inputs["Distance"].default_value = 1.0
    material.node_tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])
    plane(material)
    image = bake_input(material, Place(node.inputs["Normal"]), SIZE, is_color=False)
    pixel = [2.0 * value - 1.0 for value in image.pixels[4 * SIZE * (SIZE // 2) + 4 * (SIZE // 2) :][:3]]
    # a height that grows by 0.5 along the tangent tilts the normal the other way
    length = math.sqrt(1.25)
    assert pixel == pytest.approx([-0.5 / length, 0.0, 1.0 / length], abs=2.0 * STEP)


def test_nothing_of_the_file_changes() -> None:
    material, node = surface("Kept")
    ramp(material.node_tree, node.inputs["Roughness"])
    item = plane(material)
    other = bpy.data.materials.new("Other Slot")
    item.data.materials.append(other)
    before = [
        [block.name for block in blocks]
        for blocks in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.scenes, bpy.data.node_groups)
    ]
    scene, engine = bpy.context.scene, bpy.context.scene.render.engine
    image = bake_input(material, Place(node.inputs["Roughness"]), SIZE, is_color=False)
    after = [
        [block.name for block in blocks]
        for blocks in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.scenes, bpy.data.node_groups)
    ]
    assert after == before and list(bpy.data.images) == [image]
    assert bpy.context.scene == scene and scene.render.engine == engine
    assert [slot.material for slot in item.material_slots] == [material, other]
    assert [slot.link for slot in item.material_slots] == ["DATA", "DATA"]


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ("unused", "no mesh uses the material"),
        ("no map", "its meshes have no UV map"),
        ("view", "Fresnel depends on the view"),
    ],
)
def test_what_cannot_be_baked_says_why(case: str, message: str) -> None:
    material, node = surface("Not")
    if case != "unused":
        item = plane(material)
        if case == "no map":
            item.data.uv_layers.remove(item.data.uv_layers[0])
    if case == "view":
        material.node_tree.links.new(material.node_tree.nodes.new("ShaderNodeFresnel").outputs[0], node.inputs["Roughness"])
    with pytest.raises(CannotBake, match=message):
        bake_input(material, Place(node.inputs["Roughness"]), SIZE, is_color=False)
    assert not bpy.data.images
