# SPDX-License-Identifier: GPL-3.0-or-later
"""The characters' meshes from every source, and the framing of the five characters."""

import base64
import json
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

import bmesh
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

from true_diffuse.scenes import five_characters
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters import character

pytestmark = pytest.mark.usefixtures("empty_file")


def check_mesh(mesh: bpy.types.Mesh) -> None:
    zs = [vertex.co.z for vertex in mesh.vertices]
    assert min(zs) == pytest.approx(0.0, abs=0.01) and max(zs) == pytest.approx(1.8, abs=0.05)
    colors = [tuple(item.color) for item in mesh.color_attributes[ALBEDO_ATTRIBUTE].data]
    assert len(colors) == len(mesh.vertices) and all(0.0 <= value <= 1.0 for color in colors for value in color)
    assert len(mesh.materials) == 1
    assert all(math.isfinite(component) for item in mesh.corner_normals for component in item.vector)


def test_human_is_a_valid_mesh() -> None:
    mesh = character.load("human")
    check_mesh(mesh)
    shape = bmesh.new()
    shape.from_mesh(mesh)
    assert not [v for v in shape.verts if not v.link_faces]
    assert min(face.calc_area() for face in shape.faces) > 0.0
    assert all(len(edge.link_faces) <= 2 for edge in shape.edges)
    shape.free()


def test_human_is_the_same_every_time() -> None:
    first, second = ([tuple(v.co) for v in character.load("human").vertices] for _ in range(2))
    assert first == second


def test_human_is_the_published_one() -> None:
    """The figures in scripts/studies/README.md hold for this mesh alone."""
    mesh = character.load("human")
    assert (len(mesh.vertices), len(mesh.edges), len(mesh.polygons)) == (60505, 117695, 59231)
    low, high = ([limit(vertex.co[axis] for vertex in mesh.vertices) for axis in range(3)] for limit in (min, max))
    assert low == pytest.approx([-0.289073, -0.373118, 0.0], abs=1e-6)
    assert high == pytest.approx([0.281251, 0.105376, 1.799748], abs=1e-6)
    colors = [item.color for item in mesh.color_attributes[ALBEDO_ATTRIBUTE].data]
    assert [sum(color[channel] for color in colors) / len(colors) for channel in range(4)] == pytest.approx(
        [0.349977, 0.224297, 0.176414, 1.0], abs=1e-6
    )


def test_monkey_is_a_valid_mesh() -> None:
    check_mesh(character.load("monkey"))


@pytest.fixture
def cones(tmp_path: Path) -> dict[str, Path]:
    """The same two cones in every format that can be read; in the .blend also a light and a hidden cube."""
    for x in (0.0, 3.0):
        bpy.ops.mesh.primitive_cone_add(location=(x, 0.0, 5.0))
    files = {suffix: tmp_path / f"cones.{suffix}" for suffix in ("usdc", "glb", "obj", "blend")}
    bpy.ops.wm.usd_export(filepath=str(files["usdc"]))
    bpy.ops.export_scene.gltf(filepath=str(files["glb"]))
    bpy.ops.wm.obj_export(filepath=str(files["obj"]))
    bpy.ops.object.light_add()
    bpy.ops.mesh.primitive_cube_add(size=50.0)
    bpy.context.object.hide_render = True
    widgets = bpy.data.collections.new("Widgets")  # as rigs keep the shapes of their bones
    widgets.hide_render = True
    bpy.context.scene.collection.children.link(widgets)
    widgets.objects.link(bpy.data.objects.new("WGT", bpy.context.object.data))
    bpy.ops.wm.save_as_mainfile(filepath=str(files["blend"]), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return files


@pytest.mark.parametrize("suffix", ["usdc", "glb", "obj", "blend"])
def test_file_gives_its_visible_meshes_as_one(suffix: str, cones: dict[str, Path]) -> None:
    mesh = character.load(str(cones[suffix]))
    check_mesh(mesh)
    xs = [vertex.co.x for vertex in mesh.vertices]
    # 2 cones of radius 1 and height 2, their axes 3 apart: 5 wide and 2 high, scaled to 1.8 high and put around the middle
    assert (min(xs), max(xs)) == pytest.approx((-2.25, 2.25), abs=1e-3)
    assert not bpy.data.objects and len(bpy.data.meshes) == 1 and len(bpy.data.scenes) == 1


def test_blend_file_gives_instances_and_modifiers_as_rendered(tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    bpy.context.object.modifiers["Subdivision"].levels = 0
    parts = bpy.data.collections.new("Parts")
    parts.objects.link(bpy.context.object)
    bpy.context.scene.collection.objects.unlink(bpy.context.object)
    for x in (0.0, 4.0, 8.0):
        bpy.ops.object.collection_instance_add(collection=parts.name, location=(x, 0.0, 0.0))
    path = tmp_path / "instances.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert len(character.load(str(path)).polygons) == 3 * 24  # a cube subdivided once, three times


def test_frames_of_a_file_keep_the_place_and_scale_of_the_first(tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add()
    ball = bpy.context.object
    ball.shape_key_add(name="Basis")
    tall = ball.shape_key_add(name="Tall")
    for point in tall.data:
        point.co.z *= 2.0
    for frame, value in ((1, 0.0), (11, 1.0)):
        tall.value, ball.location.z = value, 3.0 * value
        tall.keyframe_insert("value", frame=frame)
        ball.keyframe_insert("location", frame=frame)
    path = tmp_path / "ball.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    meshes = character.load_frames(str(path), (1, 6, 11))
    spans = {frame: sorted(vertex.co.z for vertex in mesh.vertices) for frame, mesh in meshes.items()}
    # a ball of radius 1 that gets twice as tall and rises by 3; 2 high at first, which becomes 1.8: 0.9 m a unit. Half-way, keys
    # ease in and out evenly.
    for frame, (low, high) in {1: (-1.0, 1.0), 6: (0.0, 3.0), 11: (1.0, 5.0)}.items():
        assert (spans[frame][0], spans[frame][-1]) == pytest.approx((0.9 * (low + 1.0), 0.9 * (high + 1.0)), abs=1e-5)
    assert not bpy.data.objects and len(bpy.data.meshes) == 3 and len(bpy.data.scenes) == 1


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("gone.blend", None, "does not exist"),
        ("empty.glb", b"", "is empty"),
        ("broken.blend", b"BLENDER17-01v0502" + bytes(40), "cannot read|damaged"),
        ("broken.glb", b"glTF\x02\x00\x00\x00", "cannot read|damaged"),
        ("broken.usdc", b"PXR-USDC" + bytes(20), "cannot read|damaged"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\n", "no mesh"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", "flat"),
        ("picture.png", b"?", "known kind"),
    ],
)
def test_unusable_file_is_refused_in_one_line(name: str, content: bytes | None, message: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(character.CharacterError, match=message) as caught:
        character.load(str(path))
    assert "\n" not in str(caught.value)


def with_json(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the JSON of a .glb file, its binary chunk stays."""
    content = path.read_bytes()
    (size,) = struct.unpack_from("<I", content, 12)
    document = json.loads(content[20 : 20 + size])
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + size :]
    path.write_bytes(b"glTF" + struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)


def test_gltf_with_an_empty_default_scene_shows_the_other(cones: dict[str, Path]) -> None:
    with_json(cones["glb"], lambda gltf: gltf.update(scenes=[{"name": "Empty"}, {**gltf["scenes"][0], "name": "Full"}], scene=0))
    lines: list[str] = []
    check_mesh(character.load(str(cones["glb"]), lines.append))
    assert len(lines) == 1 and "2 scenes" in lines[0] and "Full" in lines[0]
    assert not bpy.data.objects and len(bpy.data.meshes) == 1 and len(bpy.data.scenes) == 1


def test_blend_file_of_several_scenes_shows_the_one_with_a_mesh(tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_cone_add()
    bpy.context.scene.name = "With a cone"
    bpy.data.scenes.new("An empty one")  # comes first
    path = tmp_path / "scenes.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    lines: list[str] = []
    check_mesh(character.load(str(path), lines.append))
    assert len(lines) == 1 and "With a cone" in lines[0]
    assert len(bpy.data.scenes) == 1


CORNERS = ((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 1.0, 1.0))
MESH = f"""
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 1, 3]
    point3f[] points = [{", ".join(map(str, CORNERS))}]
"""


@pytest.mark.parametrize(
    ("scenes", "parts", "shown"),
    [
        ({"scenes": [{"nodes": [0]}, {"name": "Full", "nodes": [1]}]}, 1, "2 scenes: Full"),  # there is no default
        ({"scenes": [{}, {"name": "Full", "nodes": [1]}], "scene": 0}, 1, "2 scenes: Full"),
        ({"scenes": [{"name": "A", "nodes": [0]}, {"name": "B"}, {"name": "C", "nodes": [1, 2]}], "scene": 1}, 2, "3 scenes: C"),
        ({"scenes": [{"name": "A", "nodes": [0]}, {"name": "B", "nodes": [0, 2]}], "scene": 0}, 1, "2 scenes: B"),
        ({"scenes": [{"nodes": [1]}]}, 1, ""),
        ({}, 2, ""),  # a library of nodes: all are shown
    ],
)
def test_gltf_shows_the_scene_with_a_mesh(scenes: dict[str, Any], parts: int, shown: str, tmp_path: Path) -> None:
    content = struct.pack("<12f6I", *(number for corner in CORNERS for number in corner), 0, 1, 2, 0, 1, 3)
    data = f"data:application/octet-stream;base64,{base64.b64encode(content).decode()}"
    limits = {"min": [-1.0, 0.0, 0.0], "max": [1.0, 2.0, 1.0]}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(content), "uri": data}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", **limits},
            {"bufferView": 1, "componentType": 5125, "count": 6, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"name": "Empty"}, {"name": "One", "mesh": 0}, {"name": "Two", "mesh": 0, "translation": [5, 0, 0]}],
    }
    path = tmp_path / "scenes.gltf"
    path.write_text(json.dumps(document | scenes))
    lines: list[str] = []
    assert len(character.load_figures(path, (None,), lines.append)[None].parts) == parts
    assert len(lines) == bool(shown) and all(shown in line for line in lines)


@pytest.mark.parametrize(
    "text",
    [
        'def Xform "Empty"\n{\n}\ndef Mesh "Figure"\n{MESH}\n',  # no default prim
        '(\n    defaultPrim = "Gone"\n)\ndef Mesh "Figure"\n{MESH}\n',
        '(\n    defaultPrim = "Empty"\n)\ndef Xform "Empty"\n{\n}\ndef Mesh "Figure"\n{MESH}\n',
        'class "Model"\n{\n    def Mesh "Figure"\n    {MESH}\n}\ndef Xform "Instance" (\n    inherits = </Model>\n)\n{\n}\n',
    ],
)
def test_usd_shows_its_meshes_whatever_its_default_is(text: str, tmp_path: Path) -> None:
    path = tmp_path / "figure.usda"
    path.write_text("#usda 1.0\n" + text.replace("{MESH}", f"{{{MESH}}}"))
    assert len(character.load(str(path)).polygons) == 2


def test_file_to_export_shows_the_scene_with_a_mesh(tmp_path: Path) -> None:
    bpy.ops.mesh.primitive_cone_add()
    bpy.context.scene.name = "With a cone"
    bpy.context.window.scene = bpy.data.scenes.new("An empty one")
    path = tmp_path / "scenes.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    lines: list[str] = []
    assert character.open_blend(path, lines.append).name == "With a cone" == bpy.context.window.scene.name
    assert len(lines) == 1 and "2 scenes: With a cone" in lines[0]


def test_blend_file_does_not_run_its_drivers_python(tmp_path: Path) -> None:
    marker = tmp_path / "ran"
    bpy.ops.mesh.primitive_cone_add()
    bpy.context.object.driver_add("location", 2).driver.expression = f"open({str(marker)!r}, 'w').close() or 0.0"
    path = tmp_path / "driven.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    marker.unlink(missing_ok=True)
    preferences = bpy.context.preferences.filepaths
    preferences.use_scripts_auto_execute = True  # as by the user, or by blender -y
    try:
        check_mesh(character.load(str(path)))
        assert not marker.exists()
    finally:
        preferences.use_scripts_auto_execute = False


def test_compressed_gltf_without_the_library_is_one_clear_line(cones: dict[str, Path]) -> None:
    from io_scene_gltf2 import is_draco_available

    if is_draco_available():
        pytest.skip("this Blender reads Draco")

    def compress(gltf: dict[str, Any]) -> None:
        name = "KHR_draco_mesh_compression"
        gltf["extensionsUsed"] = gltf["extensionsRequired"] = [name]
        for mesh in gltf["meshes"]:
            mesh["primitives"][0]["extensions"] = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}

    with_json(cones["glb"], compress)
    with pytest.raises(character.CharacterError, match="compressed with Draco") as caught:
        character.load(str(cones["glb"]))
    assert "\n" not in str(caught.value) and not bpy.data.meshes


def test_importer_that_fails_is_one_line_without_its_traceback(cones: dict[str, Path]) -> None:
    with_json(cones["glb"], lambda gltf: gltf["accessors"][0].update(bufferView=99))
    with pytest.raises(character.CharacterError, match="its importer failed") as caught:
        character.load(str(cones["glb"]))
    assert "\n" not in str(caught.value) and "Traceback" not in str(caught.value)


@pytest.mark.parametrize("suffix", ["usdc", "glb", "blend"])
def test_truncated_file_is_refused(suffix: str, cones: dict[str, Path]) -> None:
    whole = cones[suffix].read_bytes()
    cones[suffix].write_bytes(whole[: len(whole) // 2])
    with pytest.raises(character.CharacterError):
        character.load(str(cones[suffix]))


@pytest.mark.parametrize(("who", "bust"), [("human", True), ("human", False), ("monkey", False)])
@pytest.mark.parametrize("resolution", [(1280, 480), (300, 600)])
def test_all_characters_are_in_the_frame(who: str, bust: bool, resolution: tuple[int, int]) -> None:
    stage = five_characters.build(character.load(who), 0.8, bust, resolution)
    names = [shown.look.name for shown in stage.characters]
    assert names == ["specular", "lambert", "oren_nayar_0", "oren_nayar_0.2", "oren_nayar_0.33"]
    for shown in stage.characters:
        matrix = shown.subject.matrix_world
        corners = [
            world_to_camera_view(stage.scene, stage.scene.camera, matrix @ Vector(corner)) for corner in shown.subject.bound_box
        ]
        assert 0.0 < sum(corner.x for corner in corners) / 8 < 1.0
        assert max(corner.y for corner in corners) <= 1.0 and (bust or min(corner.y for corner in corners) >= 0.0)
