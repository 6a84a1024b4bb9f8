# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure This Material from a button, with its progress, cancelled and finished; and the picture of the manual."""

import bpy

from window import RENDERED, Steps, area, click_button, cube, folder, middle, mouse, picture, point, side_by_side, undo, within


def walk() -> Steps:
    view, editor = side_by_side()
    with within(view):
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="clay")
    bpy.ops.ed.undo_push(message="Clay")
    editor.ui_type = "ShaderNodeTree"
    yield 2.0
    editor.spaces.active.show_region_ui = True
    yield 2.0
    next(region for region in editor.regions if region.type == "UI").active_panel_category = "True Diffuse"
    yield 1.0
    yield from step_by_step(view, editor)


def portrait(view: bpy.types.Area, editor: bpy.types.Area) -> Steps:
    """Leave the picture of the manual: a head in EEVEE, its node, the sidebar after Measure This Material."""
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
    editor.ui_type = "ShaderNodeTree"
    yield 2.0
    editor.spaces.active.show_region_ui = True
    yield 2.0
    next(region for region in editor.regions if region.type == "UI").active_panel_category = "True Diffuse"
    with within(editor):
        bpy.ops.node.view_all()
        assert bpy.ops.true_diffuse.measure("EXEC_DEFAULT", True) == {"FINISHED"}
    yield RENDERED["BLENDER_EEVEE"]
    picture("measured")


def data() -> tuple[object, ...]:
    """What a measurement must not change: the names of all data-blocks, and whether the file counts as changed."""
    images = {image for image in bpy.data.images if image.type == "RENDER_RESULT"}
    return sorted(repr(block) for block in set(bpy.data.user_map()) - images), bpy.data.is_dirty


def step_by_step(view: bpy.types.Area, editor: bpy.types.Area) -> Steps:
    """Click the button; orbit, undo and save while it measures; cancel; open another file meanwhile; measure to the end."""
    bpy.context.scene.render.engine = "CYCLES"
    view.spaces.active.shading.type = "SOLID"
    with within(view):
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="chalk")
    file = str(folder / "measure.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    yield 3.0
    before, orbit = data(), view.spaces.active.region_3d.view_rotation.copy()
    yield from click_button(editor, "UI", "true_diffuse.measure")
    yield 1.0
    x, y = middle(view)
    point(x, y)
    mouse("mousedown", 2)
    for step in range(4):
        mouse("mousemove", x + 24 * step, y - 12 * step)
        yield 0.2
    mouse("mouseup", 2)
    picture("measuring")
    assert not bpy.ops.true_diffuse.measure.poll() and data() == before
    assert view.spaces.active.region_3d.view_rotation.rotation_difference(orbit).angle > 0.1, "the window was frozen"
    mouse("key", "Escape")
    yield 2.0
    picture("cancelled")
    assert data() == before and bpy.ops.true_diffuse.measure.poll()
    for meanwhile in ("undo", "save", "open"):
        yield from click_button(editor, "UI", "true_diffuse.measure")
        yield 0.5
        assert not bpy.ops.true_diffuse.measure.poll(), meanwhile
        if meanwhile == "undo":
            yield from undo()
            assert "Clay" in bpy.context.object.active_material.name
            with within(view):
                bpy.ops.ed.redo()
            yield 0.5
            assert "Chalk" in bpy.context.object.active_material.name
        elif meanwhile == "save":
            bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved.blend"), copy=True)
            with bpy.data.libraries.load(str(folder / "saved.blend")) as (found, _):
                assert list(found.scenes) == ["Scene"] and "Plain" not in found.materials
        else:
            bpy.ops.wm.open_mainfile(filepath=file)
            yield 2.0
            before = data()  # without what nothing used
            assert bpy.data.scenes.keys() == ["Scene"]
            view, editor = (area(kind) for kind in ("VIEW_3D", "NODE_EDITOR"))
        picture(f"measuring_{meanwhile}")
        mouse("key", "Escape")
        yield 2.0
        assert bpy.ops.true_diffuse.measure.poll(), meanwhile
    yield from click_button(editor, "UI", "true_diffuse.measure")
    for _ in range(60):
        yield 1.0
        if bpy.ops.true_diffuse.measure.poll():
            break
    yield 2.0
    picture("finished")
    assert data() == before
