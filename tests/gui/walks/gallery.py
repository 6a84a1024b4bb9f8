# SPDX-License-Identifier: GPL-3.0-or-later
"""From the default cube to chalk by every way, with the clicks counted, and the gallery of presets as it looks.

The places to click are those of the default layout in a window of 1600 x 1000 at Resolution Scale 1.
"""

from collections.abc import Callable

from window import Steps, area, cube, group_of, middle, mouse, node_of, picture, point, say

SLOTS_TAB = 1333, 654  # Material, in the Properties editor
PICTURE = 1384, 466  # what opens the gallery, in the material's panel
CHALK, FELT = (1094, 578), (1361, 578)  # in that gallery
OBJECT_MENU = 331, 39
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
    picture(way)
    assert is_chalk(), way
    say(f"{way}: {clicks} clicks")
    mouse("key", "Escape")
    yield 1.0
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
    yield from click(793, 554)


def shader_right_click() -> Steps:
    yield from click(310, 810, button=3)
    yield from click(221, 954)
    picture("shader_right_click_gallery")
    yield from click(310, 594)


def walk() -> Steps:
    view = area("VIEW_3D")
    for way in (material_tab, right_click, menu_search, object_menu):
        yield from by(way.__name__, way)
    view.ui_type = "ShaderNodeTree"
    yield 2.0
    for way in (sidebar, shader_right_click):
        yield from by(way.__name__, way)
