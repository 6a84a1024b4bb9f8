# SPDX-License-Identifier: GPL-3.0-or-later
"""The eight small characters in tests/assets: they are what their script builds, and each has its kind of material in Blender."""

from pathlib import Path
from typing import Any

import bpy

import pytest

from true_diffuse.scripts.characters.small import skin
from true_diffuse.scripts.characters.small.characters import GLTF_FILES

pytestmark = pytest.mark.usefixtures("empty_file")

FOLDER = Path(__file__).resolve().parent / "assets"
LARGEST = 400_000  # bytes, of all together


def open_character(name: str) -> dict[str, bpy.types.Material]:
    """Open a character in place of the file; return its materials by name."""
    if name.endswith(".blend"):
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / name), load_ui=False, use_scripts=False)
    else:
        bpy.ops.import_scene.gltf(filepath=str(FOLDER / name))
    return {material.name: material for material in bpy.data.materials}


def path_to(material: bpy.types.Material, socket: str) -> list[str]:
    """The nodes from an input of the Principled BSDF to an image or attribute, along the first linked input of each."""
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    link = next(iter(node.inputs[socket].links), None)
    found: list[str] = []
    while link:
        operation = getattr(link.from_node, "operation", "") or getattr(link.from_node, "blend_type", "")
        found.append(f"{link.from_node.type} {operation} {link.from_socket.name}".replace("  ", " "))
        link = next((item.links[0] for item in link.from_node.inputs if item.links), None)
    return found


def content(path: Path) -> dict[str, Any]:
    """What a .blend file holds, whatever its bytes: geometry, nodes, links, values, pixels."""
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)

    def plain(value: Any) -> Any:
        return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value

    def nodes(tree: bpy.types.NodeTree) -> list[Any]:
        sockets = [(n.bl_idname, s.identifier, plain(getattr(s, "default_value", None))) for n in tree.nodes for s in n.inputs]
        links = [(k.from_node.name, k.from_socket.identifier, k.to_node.name, k.to_socket.identifier) for k in tree.links]
        return [sorted(map(repr, sockets)), sorted(links)]

    return {
        "trees": {tree.name: nodes(tree) for tree in bpy.data.node_groups}
        | {material.name: nodes(material.node_tree) for material in bpy.data.materials},
        "images": {image.name: (tuple(image.size), image.filepath, tuple(image.pixels)) for image in bpy.data.images},
        "meshes": {
            mesh.name: (
                [tuple(vertex.co) for vertex in mesh.vertices],
                [(tuple(face.vertices), face.material_index, face.use_smooth) for face in mesh.polygons],
                {layer.name: [tuple(item.vector) for item in layer.uv] for layer in mesh.uv_layers},
                [material.name for material in mesh.materials],
            )
            for mesh in bpy.data.meshes
        },
    }


def test_files_are_all_that_is_built_and_small() -> None:
    files = {path.name: path.stat().st_size for path in FOLDER.iterdir()}
    assert set(files) == {*GLTF_FILES, skin.FILE} and len(files) == 8
    assert sum(files.values()) < LARGEST


@pytest.mark.parametrize("name", GLTF_FILES)
def test_gltf_file_is_what_the_script_builds(name: str) -> None:
    assert (FOLDER / name).read_bytes() == GLTF_FILES[name]()


def test_blend_file_holds_what_the_script_builds(tmp_path: Path) -> None:
    skin.write(tmp_path / "built.blend")
    assert content(FOLDER / skin.FILE) == content(tmp_path / "built.blend")


# Material, input of the Principled BSDF, nodes from there on
KINDS: dict[str, list[tuple[str, str, list[str]]]] = {
    "packed_orm.glb": [
        ("Suit", "Metallic", ["SEPARATE_COLOR Blue", "TEX_IMAGE Color"]),
        ("Suit", "Roughness", ["SEPARATE_COLOR Green", "TEX_IMAGE Color"]),
        ("Face", "Roughness", ["MATH MULTIPLY Value", "SEPARATE_COLOR Green", "TEX_IMAGE Color"]),
    ],
    "metal_in_parts.glb": [("Armor", "Metallic", ["SEPARATE_COLOR Blue", "TEX_IMAGE Color"]), ("Helmet", "Metallic", [])],
    "tint_times_image.glb": [
        ("Shirt", "Base Color", ["MIX MULTIPLY Result", "TEX_IMAGE Color"]),
        ("Boots", "Base Color", []),
    ],
    "vertex_color.glb": [
        ("Paint", "Base Color", ["VERTEX_COLOR Color"]),
        ("Tattoo", "Base Color", ["MIX MULTIPLY Result", "MIX MULTIPLY Result", "TEX_IMAGE Color"]),
    ],
    "normal_and_roughness.glb": [
        ("Hide", "Normal", ["NORMAL_MAP Normal", "TEX_IMAGE Color"]),
        ("Hide", "Roughness", ["SEPARATE_COLOR Green", "TEX_IMAGE Color"]),
    ],
    "alpha.glb": [
        ("Face", "Alpha", ["TEX_IMAGE Alpha"]),
        ("Mail", "Alpha", ["MATH SUBTRACT Value", "MATH LESS_THAN Value", "TEX_IMAGE Alpha"]),
        ("Veil", "Alpha", ["MATH MULTIPLY Value", "TEX_IMAGE Alpha"]),
        ("Boots", "Alpha", []),
    ],
    "emission_and_texture_transform.glb": [
        ("Glowing Face", "Emission Color", ["MIX MULTIPLY Result", "TEX_IMAGE Color"]),
        ("Shirt", "Base Color", ["TEX_IMAGE Color", "MAPPING Vector", "UVMAP UV"]),
        ("Boots", "Base Color", ["TEX_IMAGE Color", "MAPPING Vector", "UVMAP UV"]),
    ],
    skin.FILE: [("Clothes", "Alpha", ["TEX_IMAGE Alpha"])],
}


@pytest.mark.parametrize("name", KINDS)
def test_character_has_its_kind_of_material_in_blender(name: str) -> None:
    materials = open_character(name)
    assert [(who, socket, path_to(materials[who], socket)) for who, socket, _ in KINDS[name]] == KINDS[name]


def image_values(name: str, channel: int) -> list[float]:
    """The values of a channel of an image of the open file."""
    return list(bpy.data.images[name].pixels[channel :: bpy.data.images[name].channels])


def test_packed_texture_has_no_metal_and_the_armor_has_both() -> None:
    open_character("packed_orm.glb")
    assert set(image_values("suit_orm", 2)) == {0.0} and len(set(image_values("suit_orm", 1))) > 50
    open_character("metal_in_parts.glb")
    assert set(image_values("armor_mr", 2)) == {0.0, 1.0}


def test_vertex_color_node_has_no_name_and_the_mesh_has_colors() -> None:
    materials = open_character("vertex_color.glb")
    node = next(node for node in materials["Paint"].node_tree.nodes if node.type == "VERTEX_COLOR")
    assert node.layer_name == ""
    assert len({tuple(item.color) for item in bpy.data.meshes[0].color_attributes.active_color.data}) > 100


def test_texture_of_one_half_is_mirrored_on_the_other() -> None:
    """Where x is opposite, UVs are the same; so the tangents' handedness differs."""
    open_character("normal_and_roughness.glb")
    mesh = bpy.data.meshes[0]
    uvs: dict[tuple[float, ...], set[tuple[float, ...]]] = {}
    areas = []
    for face in mesh.polygons:
        corners = [mesh.uv_layers[0].uv[loop].vector for loop in face.loop_indices]
        areas.append((corners[1] - corners[0]).cross(corners[2] - corners[0]) > 0.0)
        for loop in face.loop_indices:
            x, y, z = mesh.vertices[mesh.loops[loop].vertex_index].co
            place, uv = (abs(x), y, z), mesh.uv_layers[0].uv[loop].vector
            uvs.setdefault(tuple(round(c, 3) for c in place), set()).add(tuple(round(c, 3) for c in uv))
    head = [found for place, found in uvs.items() if 1.5 < place[2] < 1.75]
    assert head and all(len(found) == 1 for found in head)
    assert sum(areas) == len(areas) // 2


def test_alpha_is_one_everywhere_has_holes_and_is_between() -> None:
    materials = open_character("alpha.glb")
    assert set(image_values("face", 3)) == {1.0}
    assert {0.0, 1.0} < set(image_values("mail", 3))
    assert min(image_values("veil", 3)) > 0.2 and max(image_values("veil", 3)) < 1.0
    assert {name: material.surface_render_method for name, material in materials.items()} == {
        "Face": "BLENDED",
        "Veil": "BLENDED",
        "Mail": "DITHERED",
        "Boots": "DITHERED",
    }


def test_texture_transform_becomes_a_mapping_of_the_second_uv_map() -> None:
    materials = open_character("emission_and_texture_transform.glb")
    nodes = {node.type: node for node in materials["Shirt"].node_tree.nodes}
    assert nodes["UVMAP"].uv_map == bpy.data.meshes[0].uv_layers[1].name
    # KHR_texture_transform has v down and rotates the other way round: scale stays, rotation 0.4 too in Blender's axes
    assert tuple(nodes["MAPPING"].inputs["Scale"].default_value) == pytest.approx((2.0, 1.5, 1.0))
    assert tuple(nodes["MAPPING"].inputs["Rotation"].default_value) == pytest.approx((0.0, 0.0, 0.4))
    identity = {node.type: node for node in materials["Boots"].node_tree.nodes}["MAPPING"]
    assert [tuple(identity.inputs[name].default_value) for name in ("Location", "Rotation", "Scale")] == [
        (0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (1.0, 1.0, 1.0),
    ]
    strength = {node.type: node for node in materials["Glowing Face"].node_tree.nodes}["BSDF_PRINCIPLED"].inputs[
        "Emission Strength"
    ]
    assert strength.default_value == pytest.approx(2.0)


def test_skin_is_one_group_around_a_principled_bsdf() -> None:
    nodes = [node for node in open_character(skin.FILE)["Skin"].node_tree.nodes if node.type != "OUTPUT_MATERIAL"]
    assert [node.type for node in nodes] == ["GROUP"]
    inner = {node.type: node for node in nodes[0].node_tree.nodes}
    assert inner["BSDF_PRINCIPLED"].inputs["Alpha"].links[0].from_node == inner["TEX_IMAGE"]
    assert inner["BSDF_PRINCIPLED"].inputs["Subsurface Weight"].is_linked
    assert bpy.data.images["skin"].packed_file
