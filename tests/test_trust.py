# SPDX-License-Identifier: GPL-3.0-or-later
"""A character's file never runs a program of its own, whatever preferences say and however it asks."""

from pathlib import Path

import bpy

import pytest

from support import run_script
from true_diffuse.scripts.characters import character

pytestmark = pytest.mark.usefixtures("empty_file")

OSL = 'shader evil(output color Out = color(1, 0, 0)) {{ fprintf("{}", "ran\\n"); Out = color(0, 1, 0); }}'


def marks(marker: Path) -> str:
    """A driver's expression that writes a file."""
    return f"__import__('pathlib').Path({str(marker)!r}).touch() or 0.0"


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A .blend file that tries to write files in the folder "ran"."""
    ran = tmp_path / "ran"
    bpy.ops.mesh.primitive_cone_add()
    bpy.context.object.name = "Linked"
    bpy.context.object.driver_add("scale", 0).driver.expression = marks(ran / "linked")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)

    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, target):
        target.objects = ["Linked"]
    bpy.context.scene.collection.objects.link(target.objects[0])
    bpy.ops.mesh.primitive_cube_add(location=(0.0, 0.0, 1.0))
    cube = bpy.context.object
    drive = cube.driver_add("location", 2).driver
    drive.expression = marks(ran / "object")
    in_namespace = cube.driver_add("location", 0).driver
    in_namespace.expression = "evil()"
    variable = cube.driver_add("location", 1).driver
    variable.variables.new().name = "x"
    variable.expression = f"x + ({marks(ran / 'variable')})"
    basis = cube.shape_key_add(name="Basis")
    key = cube.shape_key_add(name="Key")
    assert basis != key
    key.driver_add("value").driver.expression = marks(ran / "shape_key")
    material = bpy.data.materials.new("Hostile")
    tree = material.node_tree
    surface = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    surface.inputs["Roughness"].driver_add("default_value").driver.expression = marks(ran / "material")
    (tmp_path / "evil.osl").write_text(OSL.format(ran / "osl"))
    for owner in (tree, bpy.data.node_groups.new("Group", "ShaderNodeTree")):
        script = owner.nodes.new("ShaderNodeScript")
        script.mode, script.filepath = "EXTERNAL", str(tmp_path / "evil.osl")
        if owner is tree and script.outputs:
            tree.links.new(script.outputs[0], surface.inputs["Base Color"])
        elif owner is not tree:
            tree.nodes.new("ShaderNodeGroup").node_tree = owner
    cube.data.materials.append(material)
    for name, code in {
        "module.py": f"open({str(ran / 'text')!r}, 'w')",
        "handlers.py": "import bpy\n@bpy.app.handlers.persistent\ndef evil(*_):\n"
        f"    open({str(ran / 'handler')!r}, 'w')\nbpy.app.handlers.depsgraph_update_post.append(evil)",
    }.items():
        text = bpy.data.texts.new(name)
        text.from_string(code)
        text.use_module = True
    path = tmp_path / "hostile.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    ran.mkdir()
    return path


def allow_scripts(folder: Path) -> None:
    """Have Blender run scripts, as with -y and with the preference."""
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "trusted.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "trusted.blend"), use_scripts=True)
    bpy.context.preferences.filepaths.use_scripts_auto_execute = True


def test_hostile_file_would_run_where_it_may(hostile: Path, tmp_path: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(hostile), use_scripts=True)
    bpy.context.view_layer.update()
    try:
        ran = {path.name for path in (tmp_path / "ran").iterdir()}
        assert {"linked", "object", "variable", "shape_key", "material", "text"} <= ran
    finally:
        bpy.app.handlers.depsgraph_update_post.clear()
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "library.blend"), use_scripts=False)


@pytest.mark.parametrize("plaster", [False, True])
def test_character_runs_nothing_of_its_own(plaster: bool, hostile: Path, tmp_path: Path) -> None:
    allow_scripts(tmp_path)
    bpy.app.driver_namespace["evil"] = (tmp_path / "ran" / "namespace").touch
    lines: list[str] = []
    try:
        if plaster:
            character.load_frames(str(hostile), (1, 2), lines.append)
        else:
            figure = character.load_figures(hostile, (1, 2), lines.append)[2]
            trees = [material.node_tree for material in figure.materials if material] + list(bpy.data.node_groups)
            assert not [node for tree in trees for node in tree.nodes if node.bl_idname == "ShaderNodeScript"]
        bpy.context.view_layer.update()
        assert not list((tmp_path / "ran").iterdir())
        assert any("Script node" in line for line in lines) and any("driver" in line for line in lines)
    finally:
        del bpy.app.driver_namespace["evil"]
        bpy.context.preferences.filepaths.use_scripts_auto_execute = False


@pytest.mark.render
def test_scripts_run_nothing_of_a_character(hostile: Path, tmp_path: Path) -> None:
    small = ("--engine", "cycles", "--resolution", "96x36", "--samples", "1")
    for name, arguments in (
        ("compare.py", ("--character", hostile, *small, "--sigma", "0.2", "--frames", "1-2")),
        ("export_usd.py", ("--scene", hostile)),
        ("export_usd.py", ("--character", hostile)),
    ):
        result = run_script(name, *arguments, cwd=tmp_path)
        assert result.returncode == 0, result.stderr
        assert not list((tmp_path / "ran").iterdir())
