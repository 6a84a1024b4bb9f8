# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library: what is in it, that adding it leaves the open file alone, and that its materials share one group."""

import re
import uuid
from collections.abc import Iterator
from pathlib import Path

import bpy

import pytest

from true_diffuse.addon.blender import asset_library
from true_diffuse.addon.blender.asset_library import CATALOG_FILE, FILE, VERSION_FILE
from true_diffuse.addon.blender.id_properties import GROUP_ID
from true_diffuse.addon.material import assets
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.nodes import GROUPS, ROUGH_DIFFUSE

pytestmark = pytest.mark.usefixtures("empty_file")


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("library") / "assets"
    assets.add(folder)
    assert asset_library.entry(folder).name == "True Diffuse"
    yield folder
    assets.remove(folder)


def append(library: Path, kind: str, name: str) -> None:
    assert bpy.ops.wm.append(directory=str(library / FILE / kind), filename=name) == {"FINISHED"}


def test_holds_a_material_of_each_preset_and_group_and_no_node_group(library: Path) -> None:
    """Blender lists node groups that are assets in the Shader Editor's Add menu, where ours are already."""
    with bpy.data.libraries.load(str(library / FILE), assets_only=True) as (source, _):
        assert set(source.materials) == {*(preset.name for preset in PRESETS.values()), *(group.label for group in GROUPS)}
        assert not source.node_groups


def test_assets_have_catalog_tags_description_and_picture(library: Path) -> None:
    lines = (library / CATALOG_FILE).read_text().splitlines()
    paths = dict(line.split(":")[:2] for line in lines if re.match(r"[0-9a-f-]{36}:", line))
    assert lines[0] == "VERSION 1" and all(uuid.UUID(identity).version == 4 for identity in paths)
    with bpy.data.libraries.load(str(library / FILE), link=True, assets_only=True) as (source, target):
        target.materials = source.materials
    kinds = {preset.name: preset.kind for preset in PRESETS.values()}
    for item in target.materials:
        about = item.asset_data
        assert paths[about.catalog_id] == f"True Diffuse/{kinds.get(item.name, 'Basic')}"
        assert "True Diffuse" in about.tags and len(about.description) > 10 and about.author and about.license
        assert min(item.preview.image_size) >= 128 and len(set(item.preview.image_pixels)) > 100  # neither empty nor of one color


def test_adding_it_leaves_the_open_file_alone_and_registers_once(library: Path) -> None:
    bpy.data.materials.new("Marble")
    names = [item.name for item in bpy.data.user_map()]
    libraries = bpy.context.preferences.filepaths.asset_libraries
    libraries.new(name="True Diffuse", directory=str(library))
    before = len(libraries)
    assets.add(library)
    assert len(libraries) == before
    assert [item.name for item in bpy.data.user_map()] == names
    assert {path.name for path in library.iterdir()} == {FILE, CATALOG_FILE, VERSION_FILE} and asset_library.is_current(library)
    (library / VERSION_FILE).write_text("0.1.0")
    assert not asset_library.is_current(library)
    (library / VERSION_FILE).unlink()  # as in a library of 0.1.0
    assert not asset_library.is_current(library)


def test_removing_it_takes_its_entry_and_its_files(tmp_path: Path) -> None:
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / FILE).write_bytes(b"")
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = len(libraries)
    libraries.new(name="True Diffuse", directory=str(folder))
    assets.remove(folder)
    assert len(libraries) == before and asset_library.entry(folder) is None and not folder.exists()


def test_disabling_takes_the_entry_and_enabling_brings_it_back_as_it_was(tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(b"")
    libraries = bpy.context.preferences.filepaths.asset_libraries
    before = len(libraries)
    library = asset_library.add_entry(tmp_path)
    library.name, library.import_method = "Mine", "LINK"
    asset_library.disable(tmp_path)
    assert len(libraries) == before
    asset_library.enable(tmp_path)
    library = asset_library.entry(tmp_path)
    assert (library.name, library.import_method) == ("Mine", "LINK") and len(libraries) == before + 1
    libraries.remove(library)  # by the user, in Blender's preferences
    asset_library.disable(tmp_path)
    asset_library.enable(tmp_path)
    assert asset_library.entry(tmp_path) is None and [path.name for path in tmp_path.iterdir()] == [FILE]


def test_disabling_without_its_folder_leaves_nothing(tmp_path: Path) -> None:
    """As where the extension was uninstalled by another Blender."""
    folder = tmp_path / "gone"
    asset_library.add_entry(folder)
    asset_library.disable(folder)
    assert asset_library.entry(folder) is None and not folder.exists()
    asset_library.enable(folder)
    assert asset_library.entry(folder) is None


def test_folder_that_cannot_be_written_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(assets.AssetError, match="Cannot write"):
        assets.add(tmp_path / "file" / "assets")


@pytest.mark.usefixtures("registered")
def test_appended_materials_are_local_and_share_the_file_s_group(library: Path, tmp_path: Path) -> None:
    own = ROUGH_DIFFUSE.ensure()
    for name in ("Clay", "Chalk", "Moon"):
        append(library, "Material", name)
    for made in bpy.data.materials:
        assert made.is_editable and made.node_tree.nodes[ROUGH_DIFFUSE.name].node_tree == own
    sigma = PRESETS["clay"].inputs["Roughness"]
    assert bpy.data.materials["Clay"].node_tree.nodes[ROUGH_DIFFUSE.name].inputs["Roughness"].default_value == pytest.approx(sigma)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    keys = [tree[GROUP_ID] for tree in bpy.data.node_groups if GROUP_ID in tree]
    assert len(keys) == len(set(keys)) > 5  # one tree for each group, no copies


@pytest.mark.usefixtures("registered")
def test_a_group_that_the_user_changed_stays_its_own(library: Path) -> None:
    own = ROUGH_DIFFUSE.ensure()
    own.nodes.new("ShaderNodeValue")
    append(library, "Material", "Clay")
    assert bpy.data.materials["Clay"].node_tree.nodes[ROUGH_DIFFUSE.name].node_tree != own


@pytest.mark.usefixtures("registered")
def test_group_asset_can_be_appended_beside_one_of_the_user_s_with_its_name(library: Path) -> None:
    theirs = bpy.data.node_groups.new("Subsurface", "ShaderNodeTree")
    append(library, "NodeTree", "Subsurface")
    assert not theirs.nodes and [tree for tree in bpy.data.node_groups if tree.get(GROUP_ID, "").startswith("subsurface/")]
