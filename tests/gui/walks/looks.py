# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes, the Surface panel and the plots as an artist sees them: in the dark and the light theme, at Resolution Scale 1 and 1.5."""

import bpy

from window import Steps, area, cube, dress, mouse, nodes, picture, window, within

SPACING = 230.0  # between nodes, in units of the editor
ROUGHNESS = (120.0, -122.0)  # the slider of Rough Diffuse, from the corner of its node
LONGEST = {  # entries, by socket
    "Model": "Pitted (Koenderink)",
    "Quality": "Exact for Chosen Lights",
    "Method": "Random Walk (Skin)",
    "Subsurface Method": "Random Walk (Skin)",
}
AWAY = (800, 995)  # in the status bar, where the mouse opens no tooltip
HIGH = 1.3  # typed; the slider ends at 1
FRACTION = 0.325  # of the Shader Editor at Resolution Scale 1.5: the width of Properties on a screen that is made for that scale


def walk() -> Steps:
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    with bpy.context.temp_override(window=window(), area=area("DOPESHEET_EDITOR")):
        bpy.ops.screen.area_close()
    area("VIEW_3D").ui_type = "ShaderNodeTree"
    area("PROPERTIES").spaces.active.context = "MATERIAL"
    yield 2.0
    editor().spaces.active.show_region_ui = False
    yield from add_groups()
    yield from type_above_the_slider()
    open_panels()
    for scale in (1.0, 1.5):
        if scale > 1.0:
            yield from scale_up(scale)
        yield from look_at_nodes()
        yield from look_at_plots()
    yield from change_engines()
    yield from build_while_a_preview_renders()


def editor() -> bpy.types.Area:
    return area("NODE_EDITOR")


def tree() -> bpy.types.ShaderNodeTree:
    return cube().active_material.node_tree


def add_groups() -> Steps:
    """Add our groups, one of them by Blender's Add > Group too, and paste a copy: all look alike."""
    cube().active_material = bpy.data.materials.new("Looks")
    yield 1.0
    with within(editor()):
        for key in ("rough_diffuse", "principled", "subsurface", "specular"):
            assert bpy.ops.true_diffuse.add_group(key=key) == {"FINISHED"}
        bpy.ops.node.add_group(name="Rough Diffuse", show_datablock_in_node=False)
        bpy.ops.node.clipboard_copy()
        bpy.ops.node.clipboard_paste()
    ours = [node for node in nodes() if node.type == "GROUP"]
    assert len(ours) == 6 and {(node.width, node.show_options) for node in ours} == {(200.0, False)}
    for node in ours[4:]:
        nodes().remove(node)
    for place, node in enumerate(node for node in nodes() if node.type in {"GROUP", "BSDF_PRINCIPLED"}):
        node.location = (SPACING * place - (40.0 if node.type == "BSDF_PRINCIPLED" else 0.0), 0.0)
    tree().get_output_node("ALL").location = (SPACING * 5, 0.0)
    show("Rough Diffuse")
    yield from frame()
    picture("added")


def show(name: str) -> None:
    """Make a node the surface."""
    tree().links.new(nodes()[name].outputs["BSDF"], tree().get_output_node("ALL").inputs["Surface"])
    nodes().active = nodes()[name]


def frame(*names: str) -> Steps:
    """Zoom to some nodes, else to all, which stay without the outline of selected ones."""
    for node in nodes():
        node.select = not names or node.name in names
    with within(editor()):
        bpy.ops.node.view_selected()
    yield 1.0
    for node in nodes():
        node.select = False
    yield 1.0


def type_above_the_slider() -> Steps:
    """Type a roughness by the keyboard that is higher than the slider shows."""
    rough = nodes()["Rough Diffuse"]
    rough.inputs["Roughness"].default_value = 1.0
    yield from frame("Rough Diffuse", "Principled BSDF")
    picture("slider_is_full_at_1")
    region = next(region for region in editor().regions if region.type == "WINDOW")
    scale = bpy.context.preferences.system.ui_scale
    corner = (scale * (a + b) for a, b in zip(rough.location, ROUGHNESS, strict=True))
    x, y = region.view2d.view_to_region(*corner, clip=False)
    mouse("mousemove", region.x + x - 3, window().height - region.y - y)
    mouse("mousemove", region.x + x, window().height - region.y - y)
    yield 1.0
    mouse("click", "--repeat", 2, "--delay", 60, 1)
    yield 1.0
    mouse("key", "ctrl+a")
    mouse("type", HIGH)
    yield 0.5
    mouse("key", "Return")
    yield 1.0
    assert abs(rough.inputs["Roughness"].default_value - HIGH) < 1e-6, rough.inputs["Roughness"].default_value
    picture("typed_above_1")
    rough.inputs["Roughness"].default_value = 0.5


def change_engines() -> Steps:
    """Blender dims inputs that it finds unused; none may stay so that the next engine needs."""
    show("Subsurface")
    nodes()["Subsurface"].inputs["Subsurface"].default_value = 0.6
    for engine in ("CYCLES", "BLENDER_EEVEE", "TRUE_DIFFUSE_REALTIME", "CYCLES"):
        while bpy.app.is_job_running("RENDER_PREVIEW"):  # Blender hangs where a script changes the engine meanwhile
            yield 0.5
        bpy.context.scene.render.engine = engine
        yield 1.5
        inactive = {
            node.name: [socket.name for socket in node.inputs if socket.is_inactive] for node in nodes() if node.type == "GROUP"
        }
        assert not any(inactive.values()), (engine, inactive)
    nodes()["Principled Rough Diffuse"].inputs["Model"].default_value = "Lambert"  # one Principled, whatever the quality
    yield 1.0
    assert nodes()["Principled Rough Diffuse"].inputs["Quality"].is_inactive
    picture("quality_of_lambert")


def build_while_a_preview_renders() -> Steps:
    """Build a scene of another engine while Cycles renders the material's preview: it waits for that, and Blender goes on."""
    nodes()["Subsurface"].inputs["Subsurface"].default_value = 0.4
    for _ in range(50):
        if bpy.app.is_job_running("RENDER_PREVIEW"):
            break
        yield 0.1
    assert bpy.app.is_job_running("RENDER_PREVIEW")
    with within(editor()):
        assert bpy.ops.true_diffuse.build_comparison("EXEC_DEFAULT", True) == {"FINISHED"}
    yield 2.0
    picture("built")


def open_panels() -> None:
    """Put nodes with all panels open and their longest entries chosen in place of those that were added."""
    for group in bpy.data.node_groups:
        for panel in (item for item in group.interface.items_tree if item.item_type == "PANEL"):
            panel.default_closed = False
    for old in [node for node in nodes() if node.type == "GROUP"]:
        new = nodes().new("ShaderNodeGroup")
        new.node_tree, new.width, new.show_options, new.location, name = old.node_tree, old.width, False, old.location, old.name
        nodes().remove(old)
        new.name = name
        for socket, entry in LONGEST.items():
            if socket in new.inputs:
                new.inputs[socket].default_value = entry


def scale_up(scale: float) -> Steps:
    """Set the Resolution Scale, with a second Properties editor that is as wide as it is by default on a screen for that scale."""
    bpy.context.preferences.view.ui_scale = scale
    editor().spaces.active.show_region_ui = False
    yield 1.0
    with within(editor()):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=1.0 - FRACTION)
    yield 1.0
    right = max((place for place in window().screen.areas if place.type == "NODE_EDITOR"), key=lambda place: place.x)
    right.ui_type = "PROPERTIES"
    yield 1.0
    right.spaces.active.context = "MATERIAL"
    yield 1.0


def look_at_nodes() -> Steps:
    """Look at all nodes, and at the Surface panel of the one with the most inputs."""
    show("Principled Rough Diffuse")
    yield from in_all_looks("nodes")


def look_at_plots() -> Steps:
    """Look at the plots in the sidebar."""
    editor().spaces.active.show_region_ui = True
    below = nodes()["Subsurface"]
    below.inputs["Subsurface"].default_value = 0.5
    below.inputs["Model"].default_value = "Oren-Nayar"
    below.inputs["Color"].default_value = (0.8, 0.5, 0.4, 1.0)
    show("Subsurface")
    yield 1.0
    next(region for region in editor().regions if region.type == "UI").active_panel_category = "True Diffuse"
    yield from in_all_looks("plots", "Subsurface")


def in_all_looks(step: str, *names: str) -> Steps:
    """Leave pictures of some nodes in both themes, named after the Resolution Scale too."""
    yield from frame(*names)
    mouse("mousemove", *AWAY)
    for theme in ("Dark", "Light"):
        dress(f"Blender_{theme}", bpy.context.preferences.view.ui_scale)
        yield 1.0
        picture(f"{step}_{theme.lower()}_{bpy.context.preferences.view.ui_scale:g}")
    bpy.ops.preferences.reset_default_theme()
