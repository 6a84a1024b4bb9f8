# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewer's file without a browser: the character in it, and the GLSL. What it draws: tests/web/test_viewer.py."""

import gzip
import itertools
import json
import math
from base64 import b64decode
from pathlib import Path

import bpy

import pytest
from mathutils import Matrix, Vector

from true_diffuse.addon.blender import glsl
from true_diffuse.scenes import five_characters
from true_diffuse.scripts.characters import character
from true_diffuse.scripts.characters.small.characters import BLUE, OCHER, cloth, wave
from true_diffuse.scripts.viewer import albedo, geometry, page

MOST = 65535
ASSETS = Path(__file__).parent / "assets"


def unpacked(mesh: dict) -> tuple[list[tuple[int, ...]], list[int]]:
    """The vertices, as whole numbers, and the indices of what `geometry.pack` made, read as its docstrings say."""
    data, count = gzip.decompress(b64decode(mesh["data"])), mesh["vertices"]
    columns = []
    for column in range(10):
        low = data[2 * column * count :][:count]
        high = data[(2 * column + 1) * count :][:count]
        values, value = [], 0
        for code in (a + 256 * b for a, b in zip(low, high, strict=True)):
            value = (value + (code // 2 if code % 2 == 0 else -(code + 1) // 2)) % 65536
            values.append(value)
        columns.append(values)
    planes = [data[20 * count + k * mesh["indices"] :][: mesh["indices"]] for k in range(3)]
    indices, following = [], 0
    for a, b, c in zip(*planes, strict=True):
        indices.append(following - a - 256 * b - 65536 * c)
        following += indices[-1] == following
    return list(zip(*columns, strict=True)), indices


def direction(x: int, y: int) -> Vector:
    """A direction of a place on the octahedron's square."""
    a, b = 2.0 * x / MOST - 1.0, 2.0 * y / MOST - 1.0
    c = 1.0 - abs(a) - abs(b)
    if c < 0.0:
        a, b = math.copysign(1.0 - abs(b), a), math.copysign(1.0 - abs(a), b)
    return Vector((a, b, c)).normalized()


@pytest.fixture
def monkey() -> bpy.types.Mesh:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return character.load("monkey")


@pytest.mark.parametrize("mirrored", [False, True])
def test_character_is_packed_within_its_bits(monkey: bpy.types.Mesh, mirrored: bool) -> None:
    mesh = monkey
    mesh.polygons.foreach_set("use_smooth", [k % 2 == 0 for k in range(len(mesh.polygons))])  # corners of a vertex differ
    mesh.update()
    colors = [(k % 7) / 6 for k in range(3 * len(mesh.loops))]
    matrix = Matrix.Diagonal((-0.5 if mirrored else 0.5, 1.0, 2.0, 1.0))
    packed = geometry.pack([geometry.Piece(mesh, matrix, colors=colors)])
    vertices, indices = unpacked(packed)
    assert packed["runs"] == [{"first": 0, "count": len(indices), "image": None}] and len(indices) == 3 * len(mesh.loop_triangles)
    low, high = packed["low"], packed["high"]
    turned = matrix.to_3x3().inverted().transposed()
    bits = max(b - a for a, b in zip(low, high, strict=True)) / MOST

    def is_corner(index: int, k: int) -> bool:
        x, y, z, *rest = vertices[index]
        place = Vector(a + (b - a) * t / MOST for a, b, t in zip(low, high, (x, y, z), strict=True))
        off = (place - matrix @ mesh.vertices[mesh.loops[k].vertex_index].co).length
        # a step of the square is at most 3 steps of the direction; half of one each way
        bent = (direction(rest[0], rest[1]) - (turned @ mesh.corner_normals[k].vector).normalized()).length
        color = [t / MOST for t in rest[2:5]]
        return (
            off < bits and bent < 3.0 * math.sqrt(2.0) / MOST and color == pytest.approx(colors[3 * k : 3 * k + 3], abs=0.5 / MOST)
        )

    for first, triangle in zip(range(0, len(indices), 3), mesh.loop_triangles, strict=True):
        a, b, c = reversed(triangle.loops) if mirrored else triangle.loops  # seen from outside in the same sense
        three = indices[first : first + 3]
        assert any(all(map(is_corner, three, order)) for order in ((a, b, c), (b, c, a), (c, a, b)))


def test_page_holds_the_shaders_as_they_are(monkey: bpy.types.Mesh) -> None:
    stage = five_characters.build(monkey, 0.8, False, (1280, 480))
    text, lost = page.html(stage, "<monkey>", 0.8)
    assert lost == [] and "<monkey>" not in text and "&lt;monkey&gt;" in text
    start = text.index('id="data">') + len('id="data">')
    data = json.loads(text[start : text.index("</script>", start)])
    for stem in ("geometry", "lambert", "oren_nayar", "blinn_phong", "eon"):
        assert glsl.own_text(stem) in data["shaders"]["surface"][1]
    assert [look["label"] for look in data["looks"]] == [look.label for look in five_characters.looks()]


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_character_as_it_is_has_its_images_and_holes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = 64
    monkeypatch.setattr(albedo, "RESOLUTION", size)
    monkeypatch.setattr(albedo, "MARGIN", 1)
    figure = character.load_figures(ASSETS / "alpha.glb", (None,), print)[None]
    stage = five_characters.build_as_is([figure], (1280, 480))
    before = [slot.material for each in stage.characters for part in each.parts for slot in part.material_slots]
    baked = albedo.baked(stage)
    assert before == [slot.material for each in stage.characters for part in each.parts for slot in part.material_slots]
    mail = next(piece for piece in baked.pieces if piece.mesh.materials[piece.slot].name == "Mail")
    assert mail.image is not None
    path = tmp_path / "mail.webp"
    path.write_bytes(b64decode(baked.images[mail.image].removeprefix("data:image/webp;base64,")))
    image = bpy.data.images.load(str(path))
    rgba = list(image.pixels)
    seen = 0
    for across, down in itertools.product(range(4), repeat=2):
        u, v = (across + 0.5) / 4, (down + 0.5) / 4
        start = 4 * (size * int((1.0 - v) * size) + int(u * size))  # glTF's images begin at the top
        if rgba[start + 3] > 0.5:
            seen += 1
            assert rgba[start : start + 3] == pytest.approx(cloth(BLUE, OCHER)(u, v), abs=0.04)  # WebP's loss, 8 bits
    assert seen >= 8
    # the asset cuts off what is below 0.4 of its alpha; where that is near, its texels and ours decide otherwise
    wrong = clear = 0
    for k in range(size * size):
        y, x = divmod(k, size)
        opacity = 2.0 * wave((x + 0.5) / size, 1.0 - (y + 0.5) / size, 3, 4) - 0.2
        if abs(opacity - 0.4) > 0.25:
            clear += 1
            wrong += (opacity > 0.4) != (rgba[4 * k + 3] > 0.5)
    assert clear > 0.6 * size * size and wrong < 0.01 * clear
