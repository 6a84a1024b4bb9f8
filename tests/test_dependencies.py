# SPDX-License-Identifier: GPL-3.0-or-later
"""What a character's file needs beside itself: all of it is named to a farm, and without it nothing is rendered."""

import json
import shlex
import shutil
import wave
from collections.abc import Callable
from pathlib import Path

import bpy

import pytest

from support import assert_bad_input, run_script
from true_diffuse.scripts.characters import character

pytestmark = pytest.mark.usefixtures("empty_file")

TRIANGLES = "v -1 0 0\nv 1 0 0\nv 0 0 2\nv 0 1 1\nf 1 2 3\nf 1 2 4\n"


def png(path: Path) -> Path:
    """Write a small picture."""
    image = bpy.data.images.new("written", 4, 4)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
    return path


def showing(*images: bpy.types.Image) -> bpy.types.Material:
    """A material with nodes of these images."""
    material = bpy.data.materials.new("Showing")
    for image in images:
        material.node_tree.nodes.new("ShaderNodeTexImage").image = image
    return material


def loaded(path: Path, source: str = "FILE", name: str | None = None) -> bpy.types.Image:
    image = bpy.data.images.load(str(path))
    image.source, image.filepath = source, name or str(path)
    return image


def save(path: Path) -> Path:
    bpy.ops.wm.save_as_mainfile(filepath=str(path), relative_remap=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def link(path: Path, kind: str, name: str) -> bpy.types.ID:
    with bpy.data.libraries.load(str(path), link=True) as (_, target):
        setattr(target, kind, [name])
    return getattr(target, kind)[0]


def in_scene(item: bpy.types.Object) -> bpy.types.Object:
    bpy.context.scene.collection.objects.link(item)
    return item


@pytest.fixture
def blend(tmp_path: Path) -> Path:
    """A character in a .blend file that needs files of every kind; those in the folder "needed" and in "spared"."""
    needed, spared = tmp_path / "needed", tmp_path / "spared"
    for folder in (needed, spared):
        folder.mkdir()
    showing(loaded(png(needed / "of_deep.png"))).use_fake_user = True
    save(needed / "deep.blend")
    bpy.ops.mesh.primitive_cone_add()
    bpy.context.object.name = "Linked"
    bpy.context.object.data.materials.append(link(needed / "deep.blend", "materials", "Showing"))
    bpy.context.object.data.materials.append(showing(loaded(png(needed / "of_library.png"))))
    save(needed / "library.blend")
    bpy.ops.mesh.primitive_cone_add()
    bpy.ops.wm.alembic_export(filepath=str(needed / "cache.abc"), as_background_job=False)
    bpy.ops.wm.read_factory_settings(use_empty=True)

    in_scene(link(needed / "library.blend", "objects", "Linked"))
    bpy.ops.wm.alembic_import(
        filepath=str(needed / "cache.abc"), as_background_job=False, set_frame_range=False, always_add_cache_reader=True
    )
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    packed = loaded(png(tmp_path / "packed.png"))
    packed.pack()
    (tmp_path / "packed.png").unlink()
    tiles = loaded(png(needed / "tile.1001.png"), "TILED", str(needed / "tile.<UDIM>.png"))
    png(needed / "tile.1012.png")
    tiles.tiles.new(1012)
    film = loaded(png(needed / "film_0001.png"), "SEQUENCE")
    png(needed / "film_0002.png")
    cube.data.materials.append(showing(loaded(png(needed / "color.png")), packed, tiles, film))
    cube.modifiers.new("Displace", "DISPLACE").texture = bpy.data.textures.new("Height", "IMAGE")
    bpy.data.textures["Height"].image = loaded(png(needed / "height.png"))
    text = bpy.data.curves.new("Text", "FONT")
    fonts = Path(bpy.utils.system_resource("DATAFILES"), "fonts")
    font = next(path for path in sorted(fonts.iterdir()) if path.suffix in (".woff2", ".ttf"))
    text.font = bpy.data.fonts.load(str(shutil.copy(font, needed / f"font{font.suffix}")))
    text.body = "text"
    in_scene(bpy.data.objects.new("Text", text))

    world = bpy.data.worlds.new("World")
    world.node_tree.nodes.new("ShaderNodeTexEnvironment").image = loaded(png(spared / "sky.png"))
    bpy.context.scene.world = world
    with wave.open(str(spared / "noise.wav"), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(1600))
    speaker = bpy.data.speakers.new("Speaker")
    speaker.sound = bpy.data.sounds.load(str(spared / "noise.wav"))
    in_scene(bpy.data.objects.new("Speaker", speaker))
    volume = bpy.data.volumes.new("Smoke")
    (spared / "smoke.vdb").write_bytes(b"smoke")
    volume.filepath = str(spared / "smoke.vdb")
    in_scene(bpy.data.objects.new("Smoke", volume))
    return save(tmp_path / "main.blend")


def in_folders(path: Path) -> list[Path]:
    """All files in the folders beside a file, without Blender's backups."""
    return sorted(file for file in path.parent.glob("*/*") if file.suffix != ".blend1")


def test_blend_file_needs_what_blender_says(blend: Path) -> None:
    assert sorted(character.needs(str(blend))) == in_folders(blend)
    assert not bpy.data.objects and len(bpy.data.scenes) == 1


def test_each_file_that_is_needed_is_missed_and_no_other(blend: Path) -> None:
    for file in in_folders(blend):
        hidden = file.rename(blend.with_name("hidden"))
        if file.parent.name == "needed" and not file.name.startswith("film_"):  # which frames it has is what there is
            with pytest.raises(character.CharacterError, match="which does not exist") as caught:
                character.load(str(blend))
            assert str(file) in str(caught.value) and "\n" not in str(caught.value)
        else:
            lines: list[str] = []
            character.load(str(blend), lines.append)
            assert file.parent.name == "needed" or any(str(file) in line for line in lines)
        hidden.rename(file)


def test_images_of_which_no_tile_or_frame_is_there_are_missed(blend: Path) -> None:
    for pattern in ("tile.*", "film_*"):
        for file in blend.parent.glob(f"needed/{pattern}"):
            file.unlink()
        with pytest.raises(character.CharacterError, match="which does not exist"):
            character.load(str(blend))


def test_library_that_is_packed_is_not_needed(blend: Path) -> None:
    with bpy.data.libraries.load(str(blend.parent / "needed" / "library.blend"), link=True, pack=True) as (_, target):
        target.objects = ["Linked"]
    in_scene(target.objects[0])
    path = save(blend.parent / "packed.blend")
    for library in blend.parent.glob("needed/*.blend"):
        library.unlink()
    images = [blend.parent / "needed" / name for name in ("of_deep.png", "of_library.png")]
    assert sorted(character.needs(str(path))) == images and character.load(str(path)).polygons


def gltf(folder: Path) -> Path:
    """A .gltf file with its buffer and images beside it, of names that URIs encode; one image is in the file."""
    for name in ("base color.png", "normal.png"):
        png(folder / name)
    bpy.ops.mesh.primitive_cone_add()
    bpy.ops.export_scene.gltf(filepath=str(folder / "figure.gltf"), export_format="GLTF_SEPARATE")
    path = folder / "figure.gltf"
    document = json.loads(path.read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    encoded = "data:image/png;base64,iVBORw0KGgo="
    document["images"] = [{"uri": "base%20color.png"}, {"uri": "./normal.png"}, {"uri": encoded}]
    path.write_text(json.dumps(document))
    return path


def usda(folder: Path) -> Path:
    """A .usda file with a sublayer, a reference with a payload, variants, tiles of a texture, and a shader of no use to Blender."""
    for name in ("color.png", "tile.1001.png", "tile.1002.png"):
        png(folder / name)
    (folder / "layer.usda").write_text('#usda 1.0\nover "Figure"\n{\n}\n')
    (folder / "red.usda").write_text('#usda 1.0\n(\n  defaultPrim = "Red"\n)\ndef Scope "Red"\n{\n}\n')
    (folder / "shape.usda").write_text(
        '#usda 1.0\n(\n  defaultPrim = "Shape"\n)\ndef Xform "Shape"\n{\n  asset inputs:file = @./color.png@\n'
        "  asset tiles = @./tile.<UDIM>.png@\n  asset unread = @OmniPBR.mdl@\n}\n"
    )
    (folder / "reference.usda").write_text(
        '#usda 1.0\n(\n  defaultPrim = "Figure"\n)\ndef Xform "Figure" (\n  payload = @./shape.usda@\n)\n{\n}\n'
    )
    path = folder / "figure.usda"
    path.write_text(
        '#usda 1.0\n(\n  subLayers = [@layer.usda@]\n)\ndef "Figure" (\n  references = @reference.usda@\n  variants = {\n'
        '    string paint = "red"\n  }\n  prepend variantSets = "paint"\n)\n{\n  variantSet "paint" = {\n    "red" (\n'
        "      references = @red.usda@\n    ) {\n    }\n  }\n}\n"
    )
    return path


def obj(folder: Path) -> Path:
    """An .obj file with a material library of a name with a space, whose images are elsewhere and written with options."""
    (folder / "maps").mkdir()
    for name in ("red paint.png", "bump.png"):
        png(folder / "maps" / name)
    (folder / "my paint.mtl").write_text("newmtl Paint\nmap_Kd -s 2 2 1 maps/red paint.png\nmap_Bump -bm 0.5 maps/bump.png\n")
    path = folder / "figure.obj"
    path.write_text("mtllib my paint.mtl\n" + TRIANGLES.replace("f 1 2 3", "usemtl Paint\nf 1 2 3"))
    return path


@pytest.mark.parametrize("write", [gltf, usda, obj])
def test_other_formats_need_all_files_beside_them(write: Callable[[Path], Path], tmp_path: Path) -> None:
    path = write(tmp_path)
    others = sorted(file for file in tmp_path.rglob("*.*") if file != path)
    assert sorted(character.needs(str(path))) == others and len(others) >= 3
    for file in others:
        hidden = file.rename(tmp_path / "hidden")
        if not file.name.startswith("tile."):  # a USD file does not say which tiles there are
            with pytest.raises(character.CharacterError, match="which does not exist") as caught:
                character.load(str(path))
            assert file.name in str(caught.value) and "\n" not in str(caught.value)
        hidden.rename(file)
    assert not bpy.data.objects


def test_obj_file_is_content_with_a_library_of_its_own_name(tmp_path: Path) -> None:
    (tmp_path / "figure.mtl").write_text("newmtl Paint\n")
    (tmp_path / "figure.obj").write_text("mtllib lost.mtl\n" + TRIANGLES)
    lines: list[str] = []
    character.load(str(tmp_path / "figure.obj"), lines.append)
    assert len(lines) == 1 and "lost.mtl" in lines[0]


def test_job_names_all_files_and_how_to_run_it(blend: Path, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    path = gltf(tmp_path / "other")
    needed = in_folders(blend)
    job, results = 'it\'s a "job"', "my results"
    result = run_script("compare.py", "--character", blend, path, "--job", job, "--out", results, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    references = json.loads((tmp_path / job / "asset_references.json").read_text())["assetReferences"]
    assert sorted(references["inputs"]["filenames"]) == sorted(map(str, (blend, *needed)))
    command = result.stdout.splitlines()[-1].partition("To run it here: ")[2]
    assert shlex.split(command) == ["openjd", "run", f"{job}/template.json", "-p", f"OutputDir={tmp_path / results}"]


@pytest.mark.parametrize("name", ["compare.py", "report.py", "export_usd.py"])
def test_missing_file_is_one_line_and_status_2_before_anything_is_written(name: str, tmp_path: Path) -> None:
    (tmp_path / "figure.obj").write_text("mtllib lost.mtl\n" + TRIANGLES)
    before = sorted(tmp_path.rglob("*"))
    result = run_script(name, "--character", "figure.obj", cwd=tmp_path)
    assert_bad_input(result, f"{name}: error: ")
    assert "lost.mtl, which does not exist" in result.stderr and sorted(tmp_path.rglob("*")) == before


def test_scene_to_export_that_lacks_a_file_is_one_line_and_status_2(blend: Path, tmp_path: Path) -> None:
    (tmp_path / "needed" / "library.blend").unlink()
    result = run_script("export_usd.py", "--scene", blend, "--out", tmp_path / "new" / "scene.usda", cwd=tmp_path)
    assert_bad_input(result, "export_usd.py: error: ")
    assert "library.blend, which does not exist" in result.stderr and not (tmp_path / "new").exists()
