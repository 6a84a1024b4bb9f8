# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension: its manifest by Blender's own tool, its package, its life in a Blender of its own."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import bpy

import pytest
import true_diffuse
from true_diffuse.addon.nodes.lamps import LAMPS
from true_diffuse.addon.presets import PRESETS
from true_diffuse.addon.ui import menus

ROOT = Path(__file__).resolve().parent.parent
SCRIPTS = Path(bpy.utils.system_resource("SCRIPTS"))
TOOL = SCRIPTS / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
TAGS = SCRIPTS / "modules" / "_bpy_internal" / "extensions" / "tags.py"


def tool(*arguments: str) -> str:
    result = subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("package")
    tool("build", f"--source-dir={ROOT}", f"--output-dir={folder}")
    return next(folder.glob("*.zip"))


def test_manifest_is_valid() -> None:
    assert "Error" not in tool("validate", f"--valid-tags={TAGS}", str(ROOT))


def test_package_holds_only_what_the_extension_runs(package: Path) -> None:
    names = zipfile.ZipFile(package).namelist()
    assert {"__init__.py", "blender_manifest.toml", "addon/__init__.py"} <= set(names)
    assert {name.split("/")[0] for name in names} <= {
        "__init__.py",
        "blender_manifest.toml",
        "LICENSE",
        "addon",
        "shaders",
        "scenes",
    }
    assert not [name for name in names if name.endswith((".oso", ".pyc"))]
    assert {name for name in names if name.endswith(".png")} == {f"addon/previews/{key}.png" for key in PRESETS}


def blender_state() -> tuple[set[str], int, list[str]]:
    """All registered types, the entries of the Add and the Object menu, the open handlers."""
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    handlers = [f"{name}:{len(value)}" for name, value in lists.items() if isinstance(value, list)]
    entries = sum(len(menu._dyn_ui_initialize()) for menu in (bpy.types.NODE_MT_add, bpy.types.VIEW3D_MT_object))
    return set(dir(bpy.types)), entries, handlers


def test_registering_twice_leaves_blender_as_it_was() -> None:
    before = blender_state()
    for _ in range(2):
        true_diffuse.register()
        during = blender_state()
        assert "TRUE_DIFFUSE_MT_add" in during[0] - before[0] and during[1] == before[1] + 2 and len(menus.pictures) == len(PRESETS)
        true_diffuse.unregister()
        assert blender_state() == before and not menus.pictures


def test_add_group_needs_a_shader_editor() -> None:
    true_diffuse.register()
    try:
        assert not bpy.ops.true_diffuse.add_group.poll()
    finally:
        true_diffuse.unregister()


def test_choose_lamps_takes_the_selected_lights() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    true_diffuse.register()
    try:
        assert not bpy.ops.true_diffuse.choose_lamps.poll()  # no light
        for _ in range(5):
            bpy.ops.object.light_add(type="POINT")
        bpy.ops.object.select_all(action="DESELECT")
        assert not bpy.ops.true_diffuse.choose_lamps.poll()  # too many
        chosen = bpy.context.object
        chosen.select_set(True)
        assert bpy.ops.true_diffuse.choose_lamps() == {"FINISHED"}
        drivers = LAMPS.ensure().animation_data.drivers
        followed = {target.id for curve in drivers for variable in curve.driver.variables for target in variable.targets}
        assert followed == {chosen, chosen.data}
    finally:
        true_diffuse.unregister()


def test_extension_installs_and_works(package: Path, tmp_path: Path) -> None:
    code = f"""
import bpy
bpy.ops.extensions.package_install_files(filepath={str(package)!r}, repo="user_default", enable_on_install=True)
from bl_ext.user_default.true_diffuse.addon.nodes import GROUPS
assert [group.ensure().name for group in GROUPS]
assert hasattr(bpy.types, "TRUE_DIFFUSE_OT_add_group")
bpy.ops.preferences.addon_disable(module="bl_ext.user_default.true_diffuse")
assert not hasattr(bpy.types, "TRUE_DIFFUSE_OT_add_group")
"""
    profile = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path)}
    result = subprocess.run([sys.executable, "-c", code], env=profile, capture_output=True, text=True, check=False)
    assert result.returncode == 0 and "Traceback" not in result.stderr, result.stdout + result.stderr
