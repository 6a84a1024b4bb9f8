# SPDX-License-Identifier: GPL-3.0-or-later
"""Pick Settings for Error and Measure This Material by their buttons, cancelled and finished; and the picture of the manual."""

import bpy

from window import (
    RENDERED,
    Steps,
    area,
    click_button,
    cube,
    dress,
    folder,
    head_in_eevee,
    mouse,
    orbit,
    picture,
    point,
    point_at_button,
    side_by_side,
    undo,
    window,
    within,
)


def walk() -> Steps:
    view, editor = side_by_side()
    yield from portrait(view, editor)
    for item in bpy.context.scene.objects:
        item.hide_set(item is not cube())
    bpy.context.view_layer.objects.active = cube()
    cube().select_set(True)
    bpy.context.scene.render.engine = "CYCLES"
    view.spaces.active.shading.type = "SOLID"
    with within(view):
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="clay")
    yield 3.0
    yield from pick(view, editor)
    yield from step_by_step(view, editor)


def orbit_alive(view: bpy.types.Area) -> Steps:
    """Turn the view by the mouse, and see that the window hears it."""
    before = view.spaces.active.region_3d.view_rotation.copy()
    yield from orbit(view, 8)
    yield 0.1
    assert view.spaces.active.region_3d.view_rotation.rotation_difference(before).angle > 0.1, "the window was frozen"


def scroll(editor: bpy.types.Area) -> Steps:
    """Turn the wheel down to the end of the sidebar."""
    sidebar = next(region for region in editor.regions if region.type == "UI")
    point(sidebar.x + sidebar.width // 2, window().height - (sidebar.y + sidebar.height // 2))
    yield 1.0
    for _ in range(40):
        mouse("click", 5)
    yield 2.0
    sidebar.tag_redraw()
    yield 1.0


def finished() -> Steps:
    """Wait until nothing is measured any more."""
    for _ in range(90):
        yield 1.0
        if bpy.ops.true_diffuse.measure.poll():
            yield 2.0
            return
    raise AssertionError("the measurement has no end")


def portrait(view: bpy.types.Area, editor: bpy.types.Area) -> Steps:
    """Leave the picture of the manual: a head in EEVEE, its node, the sidebar after Measure This Material."""
    yield from head_in_eevee(view, editor)
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
    with within(view):
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="chalk")
    file = str(folder / "measure.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    yield 3.0
    before = data()
    yield from click_button(editor, "UI", "true_diffuse.measure")
    yield 1.0
    yield from orbit_alive(view)
    picture("measuring")
    assert not bpy.ops.true_diffuse.measure.poll() and data() == before
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
    yield from finished()
    picture("finished")
    assert data() == before
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    yield from point_at_button(editor, "UI", "true_diffuse.measure")
    yield 2.0
    picture("greyed")
    bpy.context.scene.render.engine = "CYCLES"
    dress("Blender_Light", 1.5)
    yield 2.0
    yield from scroll(editor)
    with within(editor):
        bpy.ops.true_diffuse.measure("INVOKE_DEFAULT")
    yield 1.0
    picture("light")
    mouse("key", "Escape")
    yield 1.0


def pick(view: bpy.types.Area, editor: bpy.types.Area) -> Steps:
    """Pick Settings from a fresh install: cancelled, then to its end, then undone."""
    for index, preset in enumerate(("chalk", "plaster", "skin_2")):
        with within(view):
            bpy.ops.mesh.primitive_uv_sphere_add(location=(2.5 * index - 2.5, 3.0, 0.0))
            bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key=preset)
        bpy.context.object.select_set(False)
    bpy.context.view_layer.objects.active = cube()
    cube().select_set(True)
    bpy.ops.ed.undo_push(message="Spheres")
    yield 2.0
    scene, before = bpy.context.scene, data()
    samples = scene.cycles.samples
    yield from click_button(editor, "UI", "true_diffuse.pick_settings")
    yield 1.0
    yield from orbit_alive(view)
    picture("picking")
    assert not bpy.ops.true_diffuse.pick_settings.poll()
    mouse("key", "Escape")
    yield 2.0
    picture("picking_cancelled")
    assert data() == before and scene.cycles.samples == samples
    yield from click_button(editor, "UI", "true_diffuse.pick_settings")
    yield from finished()
    area("PROPERTIES").spaces.active.context = "SCENE"  # which has the section Error as a panel
    yield 1.0
    yield from scroll(editor)
    picture("picked")
    assert 1 < scene.cycles.samples < samples
    yield from undo()
    scene = bpy.context.scene
    assert scene.cycles.samples == samples
    yield from click_button(editor, "UI", "true_diffuse.pick_settings")
    yield 1.0  # measured already
    assert 1 < scene.cycles.samples < samples
    mouse("key", "Escape")
    yield 2.0
