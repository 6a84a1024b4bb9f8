# SPDX-License-Identifier: GPL-3.0-or-later
"""From the default cube to chalk by every way, with the clicks counted, and the gallery of presets as it looks.

The places to click are those of the default layout in a window of 1600 x 1000 at Resolution Scale 1.
"""

from collections.abc import Callable

import bpy

from window import Steps, area, assign, cube, dress, folder, group_of, menu, middle, mouse, node_of, picture, point, say, within

SLOTS_TAB = 1333, 654  # Material, in the Properties editor
PICTURE = 1384, 466  # what opens the gallery, in the material's panel
CHALK = 1094, 578  # in that gallery
OBJECT_MENU = 331, 39
FELT = 1361, 578  # there, too
EMPTY = 900, 700  # nothing in the 3D Viewport, nor in the Shader Editor
F3 = 69  # as a key code: xdotool finds no key for the symbol on a display of its own
at = [0, 0]  # where the mouse is
clicks = 0


def glide(x: int, y: int) -> Steps:
    """Move the mouse as a hand does, so that menus open on the way."""
    steps = 20
    if at == [x, y]:
        point(x, y)
    start = tuple(at)
    for step in range(1, steps + 1):
        at[:] = [a + (b - a) * step // steps for a, b in zip(start, (x, y), strict=True)]
        mouse("mousemove", *at)
        yield 0.02
    yield 1.0


def click(x: int, y: int, button: int = 1) -> Steps:
    global clicks
    yield from glide(x, y)
    mouse("click", button)
    clicks += 1
    yield 1.5


def is_chalk() -> bool:
    """Return whether the cube's material is the preset, and shows in Solid view: its Color is 0.86 in red."""
    material = cube().active_material
    node = node_of(material.name)
    return node is not None and all(
        abs(color[0] - 0.86) < 1e-3 for color in (node.inputs["Color"].default_value, material.diffuse_color)
    )


def by(way: str, walk: Callable[[], Steps]) -> Steps:
    """Take a way to chalk, leave its pictures and count, and undo it in one step."""
    global clicks
    clicks = 0
    yield from walk()
    assert is_chalk(), way
    say(f"{way}: {clicks} clicks")
    mouse("key", "Escape")
    yield 1.0
    picture(way)
    yield from glide(*EMPTY)
    mouse("key", "ctrl+z")
    yield 2.0
    assert cube().active_material.name == "Material" and group_of("Material") == "", f"{way}: not undone in one step"


def material_tab() -> Steps:
    yield from click(*SLOTS_TAB)
    picture("material_tab_panel")
    yield from click(*PICTURE)
    picture("material_tab_gallery")
    yield from click(*CHALK)


def object_menu() -> Steps:
    yield from click(*OBJECT_MENU)
    yield from glide(340, 791)
    picture("object_menu_open")
    yield from glide(540, 791)
    yield from glide(600, 532)
    picture("object_menu_matte")
    yield from glide(740, 532)
    yield from click(793, 554)


def right_click() -> Steps:
    yield from click(*middle(area("VIEW_3D")), button=3)
    yield from click(525, 878)
    picture("right_click_gallery")
    yield from click(302, 594)


def menu_search() -> Steps:
    yield from glide(*middle(area("VIEW_3D")))
    mouse("key", F3)
    yield 1.5
    mouse("type", "--delay", "100", "chalk")
    yield 1.5
    picture("menu_search_found")
    mouse("key", "Return")
    yield 1.5


def sidebar() -> Steps:
    yield from click(1300, 304)
    picture("sidebar_panel")
    yield from click(1069, 123)
    picture("sidebar_gallery")
    yield from click(844, 235)


def shader_right_click() -> Steps:
    yield from click(310, 810, button=3)
    yield from click(221, 954)
    picture("shader_right_click_gallery")
    yield from click(59, 594)


def add_menu() -> Steps:
    """The Add menu gives a node, which has to be placed and linked: this is no way of three clicks."""
    yield from click(260, 40)
    yield from glide(300, 282)
    yield from glide(400, 282)
    picture("add_menu_open")


def keep_links() -> Steps:
    """A preset on a material with a texture: what stays is said in the status bar, and the viewport's color stays, too."""
    tree = bpy.data.materials["Material"].node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.location = (-400.0, 300.0)
    tree.links.new(image.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.ops.ed.undo_push(message="Texture")
    before = tuple(cube().active_material.diffuse_color)
    yield from click(*SLOTS_TAB)
    yield from click(*PICTURE)
    yield from click(*FELT)
    mouse("key", "Escape")
    yield 1.0
    picture("linked")
    node = node_of("Material")
    assert node is not None and node.inputs["Color"].links[0].from_node.type == "TEX_IMAGE"
    assert tuple(cube().active_material.diffuse_color) == before


def look() -> Steps:
    """The panel, the gallery and Solid view, of a preset and without a material, in the light theme and enlarged."""
    view = area("VIEW_3D")
    for theme, scale in (("Blender_Dark", 1.0), ("Blender_Light", 1.0), ("Blender_Light", 1.5), ("Blender_Dark", 1.5)):
        dress(theme, scale)
        name = f"{theme.partition('_')[2].lower()}_{scale:g}"
        for preset in ("felt", "marble", ""):
            if preset:
                assign(cube(), preset)
            else:
                cube().active_material = None
            yield 2.0
            picture(f"look_{name}_{preset or 'none'}")
        with within(area("PROPERTIES")):
            bpy.ops.wm.call_panel("INVOKE_DEFAULT", name="TRUE_DIFFUSE_PT_gallery")
        yield 2.0
        picture(f"look_{name}_gallery")
        mouse("key", "Escape")
        yield 1.0
        menu(view, "TRUE_DIFFUSE_MT_translucent")
        yield 2.0
        picture(f"look_{name}_menu")
        mouse("key", "Escape")
        yield 1.0


def locked() -> Steps:
    """A material of another file: the gallery is greyed, with the reason in its tooltips."""
    path = str(folder / "library.blend")
    bpy.data.libraries.write(path, {bpy.data.materials["Felt"]})
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.materials = ["Felt"]
    cube().active_material = wanted.materials[0]
    yield 2.0
    picture("locked")
    yield from click(*PICTURE)
    yield from glide(1114, 590)
    picture("locked_gallery")
    mouse("key", "Escape")
    yield 1.0


def walk() -> Steps:
    view = area("VIEW_3D")
    for way in (material_tab, right_click, menu_search, object_menu):
        yield from by(way.__name__, way)
    view.ui_type = "ShaderNodeTree"
    yield 2.0
    for way in (sidebar, shader_right_click):
        yield from by(way.__name__, way)
    yield from add_menu()
    mouse("key", "Escape")
    yield 1.0
    view.ui_type = "VIEW_3D"
    yield 1.0
    yield from keep_links()
    yield from look()
    bpy.context.preferences.view.ui_scale = 1.0
    yield from locked()
