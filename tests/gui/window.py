# SPDX-License-Identifier: GPL-3.0-or-later
"""What the walks share: Blender's window, the mouse, pictures of the screen, and the log. Runs inside Blender."""

import subprocess
import sys
from collections.abc import Generator
from pathlib import Path

import bpy

package, folder = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 2 :])
REPOSITORY = "walk"
MODULE = f"bl_ext.{REPOSITORY}.true_diffuse"
RENDERED = {"CYCLES": 10.0, "BLENDER_EEVEE": 30.0}  # seconds until a software driver has compiled and drawn the viewport
DRAWN = 8.0  # the same for the realtime engine

type Steps = Generator[float]
"""A walk: it yields the seconds until it goes on, in which Blender handles events and draws."""


def say(text: str) -> None:
    with (folder / "log.txt").open("a", encoding="utf-8") as log:
        log.write(text + "\n")


def picture(step: str) -> None:
    subprocess.run(["import", "-window", "root", str(folder / f"{step}.png")], check=True)


def mouse(*arguments: object) -> None:
    subprocess.run(["xdotool", *map(str, arguments)], check=True)


def point(x: int, y: int) -> None:
    """Move the mouse so that Blender notices."""
    mouse("mousemove", x - 4, y)
    mouse("mousemove", x, y)


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def area(kind: str) -> bpy.types.Area:
    return next(area for area in window().screen.areas if area.type == kind)


def middle(place: bpy.types.Area) -> tuple[int, int]:
    return place.x + place.width // 2, window().height - (place.y + place.height // 2)


def side_by_side() -> tuple[bpy.types.Area, bpy.types.Area]:
    """Split the 3D viewport; returns the left half and the right half."""
    with within(area("VIEW_3D")):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    left, right = sorted((place for place in window().screen.areas if place.type == "VIEW_3D"), key=lambda place: place.x)
    return left, right


def within(place: bpy.types.Area) -> "bpy.types.ContextTempOverride":
    region = next(region for region in place.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window(), area=place, region=region)


def close_other_windows() -> None:
    for other in bpy.context.window_manager.windows[1:]:
        with bpy.context.temp_override(window=other):
            bpy.ops.wm.window_close()


def menu(place: bpy.types.Area, name: str) -> None:
    with within(place):
        bpy.ops.wm.call_menu(name=name)


def dress(theme: str, scale: float) -> None:
    """Give Blender a theme of its own, Blender_Dark or Blender_Light, and a Resolution Scale."""
    path = next(path for path in bpy.utils.preset_paths("interface_theme") if (Path(path) / f"{theme}.xml").is_file())
    bpy.ops.script.execute_preset(filepath=str(Path(path) / f"{theme}.xml"), menu_idname="USERPREF_MT_interface_theme_presets")
    bpy.context.preferences.view.ui_scale = scale


def point_at_button(place: bpy.types.Area, kind: str, operator: str) -> Steps:
    """Point at the button of `operator`, as "object.delete": look in the middle of a region of type `kind` from the top down."""
    region = next(region for region in place.regions if region.type == kind)
    x, top = region.x + region.width // 2, region.y + region.height - 10
    for y in range(top, region.y, -10):
        point(x, window().height - y)
        yield 1.0 if y == top else 0.1  # the first time away from the button that was pointed at before
        bpy.context.window_manager.clipboard = ""
        with bpy.context.temp_override(window=window(), area=place, region=region):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
        if bpy.context.window_manager.clipboard.startswith(f"bpy.ops.{operator}("):
            return
    raise AssertionError(f"{operator} has no button here")


def orbit(view: bpy.types.Area, steps: int) -> Steps:
    """Turn a 3D Viewport by dragging the mouse."""
    x, y = middle(view)
    point(x, y)
    mouse("mousedown", 2)
    for step in range(steps):
        mouse("mousemove", x + 12 * step, y - 6 * step)
        yield 0.3
    mouse("mouseup", 2)


def open_sidebar(editor: bpy.types.Area) -> Steps:
    """Make an editor a Shader Editor with our tab of the sidebar open."""
    editor.ui_type = "ShaderNodeTree"
    yield 2.0
    editor.spaces.active.show_region_ui = True
    yield 2.0
    next(region for region in editor.regions if region.type == "UI").active_panel_category = "True Diffuse"


def show_preferences() -> Steps:
    """Open the Preferences at the extension's page."""
    bpy.ops.screen.userpref_show()
    yield 2.0
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "True Diffuse"
    bpy.ops.preferences.addon_expand(module=MODULE)
    yield 2.0


def head_in_eevee(view: bpy.types.Area, editor: bpy.types.Area) -> Steps:
    """Show a head of clay in EEVEE, and its node with the sidebar."""
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    cube().hide_set(True)
    with within(view):
        bpy.ops.mesh.primitive_monkey_add(rotation=(0.0, 0.0, 0.6))
        bpy.ops.object.shade_smooth()
        bpy.ops.object.modifier_add(type="SUBSURF")
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="clay")
        bpy.ops.view3d.view_selected()
    view.spaces.active.overlay.show_overlays = False
    view.spaces.active.shading.type = "RENDERED"
    yield from open_sidebar(editor)


def click_button(place: bpy.types.Area, kind: str, operator: str) -> Steps:
    """Click the button of `operator`, as `point_at_button` finds it."""
    yield from point_at_button(place, kind, operator)
    mouse("click", 1)


def cube() -> bpy.types.Object:
    return bpy.data.objects["Cube"]


def nodes() -> bpy.types.Nodes:
    return cube().active_material.node_tree.nodes


def node_of(material: str) -> bpy.types.Node | None:
    """Return the True Diffuse node of a material; None where it has none."""
    groups = (node for node in bpy.data.materials[material].node_tree.nodes if node.type == "GROUP")
    return next((node for node in groups if "true_diffuse" in node.node_tree), None)


def group_of(material: str) -> str:
    """Return the name of a material's True Diffuse group; empty where it has none."""
    node = node_of(material)
    return node.node_tree.name if node else ""


def assign(item: bpy.types.Object, preset: str) -> None:
    """Give `item` a new material of a preset."""
    with within(area("VIEW_3D")), bpy.context.temp_override(selected_objects=[item]):
        assert bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key=preset) == {"FINISHED"}


def undo() -> Steps:
    """Undo the last step by the keyboard."""
    point(*middle(area("VIEW_3D")))
    yield 0.5
    mouse("key", "ctrl+z")
    yield 2.0


def install() -> Steps:
    """Install the package as from a repository on disk."""
    bpy.context.preferences.extensions.repos.new(name=REPOSITORY, module=REPOSITORY, custom_directory=str(folder / "repository"))
    bpy.ops.extensions.package_install_files(filepath=str(package), repo=REPOSITORY, enable_on_install=True)
    assert MODULE in bpy.context.preferences.addons
    yield 1.0
