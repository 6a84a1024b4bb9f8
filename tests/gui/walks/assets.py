# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences, the asset library, and a material dragged from it."""

import bpy

from window import Steps, close_other_windows, cube, middle, mouse, picture, point, show_preferences, side_by_side, window


def walk() -> Steps:
    yield from show_preferences()
    picture("preferences")
    bpy.ops.true_diffuse.add_assets()
    yield 2.0
    close_other_windows()
    yield 1.0
    view, browser = side_by_side()
    yield 1.0
    browser.ui_type = "ASSETS"
    yield 2.0
    browser.spaces.active.params.asset_library_reference = "True Diffuse"
    yield 5.0
    shown = next(region for region in browser.regions if region.type == "WINDOW")
    x, y = shown.x + 60, window().height - (shown.y + shown.height - 60)
    target = middle(view)
    point(x, y)
    yield 1.0
    mouse("mousemove", x + 1, y + 1)
    mouse("mousedown", 1)
    yield 0.5
    for step in range(1, 21):
        mouse("mousemove", x + (target[0] - x) * step // 20, y + (target[1] - y) * step // 20)
        yield 0.1
    picture("dragged")
    before = cube().active_material
    mouse("mouseup", 1)
    yield 4.0
    assert cube().active_material != before, "the drop gave the cube no material"
    picture("dropped")
