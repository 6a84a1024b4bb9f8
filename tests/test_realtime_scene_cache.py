# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine reads, sends and compiles again after an edit: what changed, and nothing else."""

import math
import re
from array import array
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import bpy

import bmesh
import gpu
import pytest
from mathutils import Matrix, Vector

from true_diffuse.addon.blender.glsl import includes, source
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.expression import Attribute, Constant, Expression, Image, ImageTexture, NormalMap, UvMap
from true_diffuse.addon.material.surface import Surface
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.realtime import (
    driver,
    driver_scene,
    meshes,
    objects,
    program,
    renderer,
    scene_bounds,
    scene_cache,
    shadow_maps,
    shadows,
)
from true_diffuse.addon.realtime.lights import Light, lights_to_bytes
from true_diffuse.addon.realtime.materials import RenderMaterial, surface_material, values_to_bytes
from true_diffuse.addon.realtime.view import View

WIDTH, HEIGHT = 48, 32
# From above, 12 m across. The world and the lamps are in meters.
ABOVE = View(Matrix.Diagonal((1.0 / 6.0, 1.0 / 4.0, -0.01, 1.0)), Vector((0.0, 0.0, 1.0)), False, WIDTH, HEIGHT)
BLACK = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture(autouse=True)
def driver_to_render(request) -> None:
    if request.node.get_closest_marker("render"):
        request.getfixturevalue("driver")
        gpu.init()


def add(x: float, z: float = 0.0, size: float = 1.5) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata([(-size, -size, 0.0), (size, -size, 0.0), (size, size, 0.0), (-size, size, 0.0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="UVMap")
    item = bpy.data.objects.new("Square", mesh)
    item.location = (x, 0.0, z)
    bpy.context.scene.collection.objects.link(item)
    return item


@pytest.fixture(scope="module")
def blend(tmp_path_factory) -> str:
    """A file of three squares under a sun: a material's groups take long to make."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    for k, x in enumerate((-4.0, 0.0, 4.0)):
        add(x).data.materials.append(materials.create(f"Material {k}", ROUGH_DIFFUSE, Roughness=0.1 * k))
    materials.create("Coated", SUBSURFACE, Specular=0.5).use_fake_user = True
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = 1.0
    sun.rotation_euler = (0.3, 0.2, 0.0)
    bpy.context.scene.collection.objects.link(sun)
    bpy.context.scene.world = bpy.data.worlds.new("World")
    path = str(tmp_path_factory.mktemp("stage") / "stage.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    return path


class Stage:
    """The file, and what a viewport would keep of it: `read` is done at each update, as Blender has it."""

    def __init__(self, blend: str) -> None:
        bpy.ops.wm.open_mainfile(filepath=blend)
        self.scene = bpy.context.scene
        self.objects = sorted((item for item in bpy.data.objects if item.type == "MESH"), key=lambda item: item.location.x)
        self.materials = [bpy.data.materials[f"Material {k}"] for k in range(3)]
        self.sun = bpy.data.objects["Sun"]
        self.background("Color", (0.0, 0.0, 0.0, 1.0))
        self.kept = scene_cache.SceneCache()
        self.renderer = renderer.Renderer(self.kept)

    def background(self, socket: str, value: object) -> None:
        self.scene.world.node_tree.nodes["Background"].inputs[socket].default_value = value

    def group(self, number: int) -> bpy.types.Node:
        return next(node for node in self.materials[number].node_tree.nodes if node.type == "GROUP")

    def read(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        self.kept.update(depsgraph)
        self.renderer.refresh()

    def edit(self, change: Callable[[], object]) -> None:
        """Change something, and tell Blender."""
        change()
        bpy.context.view_layer.update()

    def assert_as_new(self) -> list[float]:
        """Assert that the picture is that of a viewport which has just been opened; return its pixels' red."""
        now = scene_cache.SceneCache()
        now.update(bpy.context.evaluated_depsgraph_get())
        opened = renderer.Renderer(now)
        opened.refresh()
        pixels = picture(self.renderer)
        assert pixels == picture(opened)
        return pixels[::4]


def picture(painter: renderer.Renderer) -> list[float]:
    painter.begin(ABOVE)
    painter.add(ABOVE, 0, 0.0, BLACK)
    return painter.read().to_list()


def column(pixels: list[float], x: float) -> float:
    """Return the radiance at a place on the x axis."""
    return pixels[WIDTH * (HEIGHT // 2) + round((x + 6.0) * WIDTH / 12.0 - 0.5)]


@pytest.fixture
def stage(blend: str, monkeypatch) -> Iterator[Stage]:
    monkeypatch.setattr(shadows, "MAP_SIZE", 256)  # a graphics driver in software is slow with more
    made = Stage(blend)
    handlers = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post)
    for handler in handlers:
        handler.append(made.read)
    made.sun.update_tag()  # so that there is a first update
    bpy.context.view_layer.update()
    yield made
    for handler in handlers:
        handler.remove(made.read)


@pytest.fixture
def sent(monkeypatch) -> dict[str, int]:
    """How many meshes, blocks of numbers and programs have been sent to the driver, and shadow maps drawn."""
    counts = dict.fromkeys(("meshes", "blocks", "programs"), 0)

    def counted(name: str, real: Callable) -> Callable:
        def counting(*arguments: object) -> object:
            counts[name] += 1
            return real(*arguments)

        return counting

    monkeypatch.setattr(scene_cache, "Mesh", counted("meshes", scene_cache.Mesh))
    for user in (driver_scene, shadow_maps, renderer):
        monkeypatch.setattr(user, "uniform_buffer", counted("blocks", driver.uniform_buffer))
    monkeypatch.setattr(driver, "compile_program", counted("programs", driver.compile_program))
    return counts


# ---- what is read again


def moved(stage: Stage) -> None:
    stage.objects[1].location.x = 0.5


def turned_away(stage: Stage) -> None:
    stage.objects[1].scale.z = -1.0


def sigma(stage: Stage) -> None:
    stage.group(1).inputs["Roughness"].default_value = 0.9


def model(stage: Stage) -> None:
    stage.group(1).inputs["Model"].default_value = "Lambert"


def mesh_edited(stage: Stage) -> None:
    stage.objects[1].data.vertices[0].co.x = -1.0
    stage.objects[1].data.update()


def lamp_changed(stage: Stage) -> None:
    stage.sun.data.energy = 2.0


def lamp_turned(stage: Stage) -> None:
    stage.sun.rotation_euler.x = 0.9


def shadows_off(stage: Stage) -> None:
    stage.sun.data.use_shadow = False


def world_changed(stage: Stage) -> None:
    stage.background("Color", (0.2, 0.4, 0.6, 1.0))


def added(stage: Stage) -> None:
    stage.objects.append(add(2.0, 1.0, 0.5))


def deleted(stage: Stage) -> None:
    bpy.data.objects.remove(stage.objects.pop(1))


def hidden_from_camera(stage: Stage) -> None:
    stage.objects[1].visible_camera = False


def hidden_from_camera_with_sigma(stage: Stage) -> None:
    sigma(stage)
    stage.objects[1].visible_camera = False


def other_material(stage: Stage) -> None:
    stage.objects[1].material_slots[0].material = stage.materials[2]


def other_material_of_the_object(stage: Stage) -> None:
    stage.objects[1].material_slots[0].link = "OBJECT"
    bpy.context.view_layer.update()
    other_material(stage)


def color_from_attribute(stage: Stage) -> None:
    mesh = stage.objects[1].data
    for corner in mesh.color_attributes.new("Color", "FLOAT_COLOR", "CORNER").data:
        corner.color = (0.5, 0.25, 0.125, 1.0)
    tree = stage.materials[1].node_tree
    attribute = tree.nodes.new("ShaderNodeVertexColor")
    attribute.layer_name = "Color"
    tree.links.new(attribute.outputs["Color"], stage.group(1).inputs["Color"])


def color_no_longer_from_attribute(stage: Stage) -> None:
    color_from_attribute(stage)
    bpy.context.view_layer.update()
    tree = stage.materials[1].node_tree
    tree.links.remove(stage.group(1).inputs["Color"].links[0])


def normals_mapped(stage: Stage) -> None:
    image = bpy.data.images.new("Normals", 1, 1, float_buffer=True, is_data=True)
    image.pixels[:] = (0.75, 0.625, 0.875, 1.0)
    tree = stage.materials[1].node_tree
    texture, node = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    texture.image = image
    tree.links.new(texture.outputs["Color"], node.inputs["Color"])
    tree.links.new(node.outputs["Normal"], stage.group(1).inputs["Normal"])


def normals_mapped_less(stage: Stage) -> None:
    normals_mapped(stage)
    bpy.context.view_layer.update()
    next(node for node in stage.materials[1].node_tree.nodes if node.type == "NORMAL_MAP").inputs["Strength"].default_value = 0.3


def normals_mapped_in_edit_mode(stage: Stage) -> None:
    normals_mapped(stage)
    in_edit_mode(stage)


def driven(stage: Stage) -> None:
    """Sigma by an object's place."""
    driver = stage.group(1).inputs["Roughness"].driver_add("default_value").driver
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = stage.objects[2], "location.y"
    bpy.context.view_layer.update()
    stage.objects[2].location.y = 0.7


def another_frame(stage: Stage) -> None:
    socket, light = stage.group(1).inputs["Roughness"], stage.sun.data
    for frame, value in ((1, 0.1), (11, 1.1)):
        socket.default_value, light.energy = value, 1.0 + value
        socket.keyframe_insert("default_value", frame=frame)
        light.keyframe_insert("energy", frame=frame)
    bpy.context.view_layer.update()
    stage.scene.frame_set(6)


def in_edit_mode(stage: Stage) -> None:
    bpy.context.view_layer.objects.active = stage.objects[1]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.view_layer.update()
    stage.assert_as_new()
    mesh = bmesh.from_edit_mesh(stage.objects[1].data)
    mesh.verts.ensure_lookup_table()
    mesh.verts[0].co.x = 0.5
    bmesh.update_edit_mesh(stage.objects[1].data)


def after_edit_mode(stage: Stage) -> None:
    in_edit_mode(stage)
    bpy.context.view_layer.update()
    stage.assert_as_new()
    bpy.ops.object.mode_set(mode="OBJECT")


def curve_edited(stage: Stage) -> None:
    """Blender makes its mesh on demand, in the same place each time."""
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.fill_mode = "2D", "BOTH"
    spline = curve.splines.new("POLY")
    spline.points.add(2)
    for point, (x, y) in zip(spline.points, ((1.0, 2.0), (3.0, 2.0), (2.0, 3.5)), strict=True):
        point.co = (x, y, 0.0, 1.0)
    spline.use_cyclic_u = True
    stage.scene.collection.objects.link(bpy.data.objects.new("Curve", curve))
    bpy.context.view_layer.update()
    stage.assert_as_new()
    spline.points[2].co.y = 2.5


def instanced(stage: Stage) -> None:
    """Another object's mesh is edited, of which a collection's instance stands elsewhere."""
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(stage.objects[1])
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", collection, 2.0
    stage.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    mesh_edited(stage)


def override(stage: Stage) -> None:
    bpy.context.view_layer.material_override = stage.materials[2]


def world_override(stage: Stage) -> None:
    world = bpy.data.worlds.new("Other")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.1, 0.5, 0.3, 1.0)
    stage.scene.view_layers[0].world_override = world


def selected(stage: Stage) -> None:
    stage.objects[1].select_set(True)
    bpy.context.view_layer.objects.active = stage.objects[2]


def hidden(stage: Stage) -> None:
    stage.objects[1].hide_set(True)


def shown_in_the_place_of_another(stage: Stage) -> None:
    """As many objects as before, in the same places."""
    stage.objects.append(add(4.0, size=0.7))
    stage.objects[-1].hide_set(True)
    bpy.context.view_layer.update()
    stage.objects[-1].hide_set(False)
    stage.objects[2].hide_set(True)


def collected(stage: Stage) -> bpy.types.LayerCollection:
    """Return the layer's own of a collection that has the object in the middle."""
    collection = bpy.data.collections.new("Few")
    stage.scene.collection.children.link(collection)
    collection.objects.link(stage.objects[1])
    stage.scene.collection.objects.unlink(stage.objects[1])
    bpy.context.view_layer.update()
    return bpy.context.view_layer.layer_collection.children["Few"]


def collection_hidden(stage: Stage) -> None:
    collected(stage).hide_viewport = True


def collection_holds_out(stage: Stage) -> None:
    collected(stage).holdout = True


def collection_is_indirect(stage: Stage) -> None:
    collected(stage).indirect_only = True


def holds_out(stage: Stage) -> None:
    stage.objects[1].is_holdout = True


def attribute_edited(stage: Stage) -> None:
    color_from_attribute(stage)
    bpy.context.view_layer.update()
    stage.assert_as_new()
    for item in stage.objects[1].data.color_attributes[0].data:
        item.color = (0.9, 0.1, 0.4, 1.0)


def shape_key_moved(stage: Stage) -> None:
    stage.objects[1].shape_key_add(name="Basis")
    key = stage.objects[1].shape_key_add(name="Wide")
    key.points[0].co.x = -2.5
    bpy.context.view_layer.update()
    stage.assert_as_new()
    key.value = 0.5


def posed(stage: Stage) -> None:
    """A bone takes all of the mesh with it."""
    armature = bpy.data.objects.new("Armature", bpy.data.armatures.new("Armature"))
    stage.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.new("Bone").tail = (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    stage.objects[1].vertex_groups.new(name="Bone").add(range(4), 1.0, "ADD")
    stage.objects[1].modifiers.new("Armature", "ARMATURE").object = armature
    bpy.context.view_layer.update()
    stage.assert_as_new()
    armature.pose.bones["Bone"].location.x = 0.5


def text_edited(stage: Stage) -> None:
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.size = "\u2588", 2.0
    stage.scene.collection.objects.link(bpy.data.objects.new("Text", text))
    bpy.context.view_layer.update()
    stage.assert_as_new()
    text.body = "\u2588\u2588"


def metaball_edited(stage: Stage) -> None:
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new().radius = 0.7
    stage.scene.collection.objects.link(bpy.data.objects.new("Ball", ball))
    bpy.context.view_layer.update()
    stage.assert_as_new()
    ball.elements[0].radius = 1.2


def instances_moved(stage: Stage) -> None:
    instanced(stage)
    bpy.context.view_layer.update()
    stage.assert_as_new()
    bpy.data.objects["Instance"].location.x = -2.0


def image_made_of_floats(stage: Stage) -> None:
    """Floats are linear where bytes are sRGB: this is part of the shader."""
    image = bpy.data.images.new("Paint", 2, 2)
    image.generated_color = (0.2, 0.4, 0.6, 1.0)
    tree = stage.materials[1].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs["Color"], stage.group(1).inputs["Color"])
    bpy.context.view_layer.update()
    stage.assert_as_new()
    image.use_generated_float = True


# For each edit: how many meshes are read again.
EDITS = {
    moved: 0,
    turned_away: 0,
    sigma: 0,
    model: 0,
    mesh_edited: 1,
    lamp_changed: 0,
    lamp_turned: 0,
    shadows_off: 0,
    world_changed: 0,
    added: 1,
    deleted: 0,
    hidden_from_camera: 0,
    hidden_from_camera_with_sigma: 0,
    other_material: None,
    other_material_of_the_object: None,
    color_no_longer_from_attribute: None,
    color_from_attribute: 1,  # the mesh has a new attribute
    normals_mapped: 0,
    normals_mapped_less: 0,
    normals_mapped_in_edit_mode: None,
    driven: 0,
    another_frame: 0,
    override: 0,
    world_override: 0,
    selected: 0,
    hidden: 0,
    shown_in_the_place_of_another: 1,
    collection_hidden: 0,
    collection_holds_out: 0,
    collection_is_indirect: 0,
    holds_out: 0,
    attribute_edited: None,
    shape_key_moved: None,
    posed: None,
    text_edited: None,
    metaball_edited: None,
    instances_moved: None,
    image_made_of_floats: None,
    curve_edited: None,
    in_edit_mode: None,
    after_edit_mode: None,
    instanced: 1,  # for both
}


@pytest.mark.render
@pytest.mark.parametrize("change", EDITS, ids=lambda change: change.__name__)
def test_edit_reads_what_changed_alone(stage: Stage, sent: dict[str, int], change: Callable[[Stage], None]) -> None:
    before = {part.mesh for part in stage.kept.groups}
    stage.assert_as_new()
    sent["meshes"] = 0
    stage.edit(lambda: change(stage))
    if EDITS[change] is not None:
        assert sent["meshes"] == EDITS[change]
        assert len({part.mesh for part in stage.kept.groups} - before) == EDITS[change]
    stage.assert_as_new()


@pytest.mark.render
def test_scale_of_the_scene_scales_radii_of_scattering(stage: Stage) -> None:
    """A unit of 0.01 m makes 1 mm, 0.001 units before, 0.1 units."""
    stage.edit(lambda: setattr(stage.objects[1].material_slots[0], "material", bpy.data.materials["Coated"]))
    uid = bpy.data.materials["Coated"].session_uid
    before = stage.kept.materials[uid].code.values
    stage.edit(lambda: setattr(stage.scene.unit_settings, "scale_length", 0.01))
    ratios = [now / then for then, now in zip(before, stage.kept.materials[uid].code.values, strict=True) if now != then]
    assert ratios == [pytest.approx(100.0)] * 3


@pytest.mark.render
def test_edits_show(stage: Stage) -> None:
    """Lambert's model in closed form, edit for edit: 0.8 / pi of the irradiance, and of the world's light 0.8."""
    stage.sun.rotation_euler = (0.5, 0.0, 0.0)
    for number in range(3):
        stage.group(number).inputs["Model"].default_value = "Lambert"
        stage.group(number).inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
    stage.edit(lambda: None)
    lit = 0.8 / math.pi * math.cos(0.5)

    def at(*places: float) -> list[float]:
        pixels = stage.assert_as_new()
        return [column(pixels, place) for place in places]

    near = pytest.approx  # 1e-6 of it: numbers of 32 bits
    assert at(-4.0, 0.0, 4.0, -2.0) == near([lit, lit, lit, 0.0])
    stage.edit(lambda: setattr(stage.sun.data, "energy", 2.0))
    assert at(0.0) == near([2.0 * lit])
    stage.edit(lambda: setattr(stage.group(0).inputs["Color"], "default_value", (0.4, 0.4, 0.4, 1.0)))
    assert at(-4.0, 0.0) == near([lit, 2.0 * lit])
    stage.edit(lambda: setattr(stage.objects[1], "location", (0.0, 50.0, 0.0)))
    assert at(0.0) == [0.0]
    stage.edit(lambda: stage.background("Color", (0.5, 0.5, 0.5, 1.0)))
    assert at(4.0) == near([2.0 * lit + 0.4])
    stage.edit(lambda: bpy.data.objects.remove(stage.sun))
    assert at(-4.0, 4.0) == near([0.2, 0.4])


@pytest.mark.render
def test_meshes_in_the_place_of_others_are_read(stage: Stage) -> None:
    """Blender may give a new mesh the memory of one that is gone."""
    places, reused = set(), 0
    for k in range(200):
        gone = stage.objects.pop()
        mesh = gone.data
        bpy.data.objects.remove(gone)
        bpy.data.meshes.remove(mesh)
        stage.edit(lambda: None)
        stage.edit(lambda k=k: stage.objects.append(add(4.0, size=0.5 + 0.005 * k)))
        now = bpy.context.evaluated_depsgraph_get()
        place = stage.objects[-1].evaluated_get(now).data.as_pointer()
        if place in places and reused < 5:
            reused += 1
            stage.assert_as_new()
        places.add(place)
    if not reused:
        pytest.skip("no memory was given twice")


@pytest.mark.render
def test_undone_edits_show_no_more(stage: Stage) -> None:
    bpy.ops.ed.undo_push(message="before")
    first = stage.assert_as_new()
    stage.edit(lambda: mesh_edited(stage))
    stage.edit(lambda: sigma(stage))
    stage.edit(lambda: moved(stage))
    assert stage.assert_as_new() != first
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert stage.assert_as_new() == first


@pytest.mark.render
def test_sigma_is_edited_without_reading_objects_or_compiling(stage: Stage, sent: dict[str, int]) -> None:
    stage.assert_as_new()
    groups, tiles = stage.kept.groups, stage.renderer._shadow_maps._tiles
    sent.update(dict.fromkeys(sent, 0))
    for k in range(1, 6):
        stage.edit(lambda k=k: setattr(stage.group(1).inputs["Roughness"], "default_value", 0.1 + 0.13 * k))
    # One block of numbers for each value; objects, lamps and shadow maps stay as they are.
    assert sent == {"meshes": 0, "blocks": 5, "programs": 0}
    assert stage.kept.groups is groups and stage.renderer._shadow_maps._tiles is tiles
    stage.assert_as_new()


@pytest.mark.render
def test_view_that_turns_sends_no_mesh_and_compiles_nothing(stage: Stage, sent: dict[str, int]) -> None:
    stage.assert_as_new()
    sent.update(dict.fromkeys(sent, 0))
    for k in range(5):
        turned = View(ABOVE.projection @ Matrix.Rotation(0.2 * k, 4, "X"), ABOVE.eye, False, WIDTH, HEIGHT)
        stage.renderer.begin(turned)
        stage.renderer.add(turned, 0, 0.0, BLACK)
    assert sent["meshes"] == sent["programs"] == 0


# ---- a first picture that does not wait for the whole scene


@pytest.mark.render
def test_meshes_that_are_left_for_later_come_one_by_one(stage: Stage) -> None:
    """Objects of a mesh that has been read come with it; at the end all is as where nothing was left."""
    for place in (-2.0, 2.0):
        other = stage.objects[0].copy()
        other.location.x = place
        stage.scene.collection.objects.link(other)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    first = scene_cache.SceneCache()
    painter = renderer.Renderer(first)
    first.update(depsgraph, seconds=0.0)
    meshes_read = []
    while True:
        meshes_read.append(len({part.mesh for part in first.groups}))
        painter.refresh()
        seen = picture(painter)
        if first.is_complete:
            break
        first.read_rest(depsgraph, None, 0.0)
    assert meshes_read == [1, 2, 3]
    whole = scene_cache.SceneCache()
    whole.update(depsgraph)
    assert whole.is_complete and sum(map(len, whole.groups.values())) == 5
    assert sum(map(len, first.groups.values())) == 5
    opened = renderer.Renderer(whole)
    opened.refresh()
    assert seen == picture(opened)


@pytest.mark.render
def test_update_reads_all_that_was_left(stage: Stage) -> None:
    """So that nothing vanishes while an animation plays."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    first = scene_cache.SceneCache()
    first.update(depsgraph, seconds=0.0)
    assert not first.is_complete
    stage.objects[2].location.y = 0.5
    depsgraph.update()
    first.update(depsgraph)
    assert first.is_complete and len(first.groups) == 3


# ---- where everything is


class Hull:
    """What of a mesh its extent asks for."""

    def __init__(self, low: meshes.Point, high: meshes.Point) -> None:
        self.bounds = low, high
        self.hull, self.is_hull_a_box = meshes.box(low, high), True


def seen_corners(bounds: scene_bounds.SceneBounds, view: View) -> list[Vector]:
    return [corner for polygon in bounds.visible(view) for corner in polygon]


@pytest.mark.parametrize("count", (1, 20, 33, 500))
def test_extent_holds_all_and_is_small(count: int) -> None:
    """Objects on a lattice 2 apart, turned, each of the 12 triangles of a box; every other casts a shadow."""
    turn = Matrix.Rotation(0.4, 4, "Y") @ Matrix.Rotation(0.3, 4, "X")
    hull = Hull((-0.5, -0.3, -0.1), (0.5, 0.3, 0.1))
    places = [turn @ Matrix.Translation((2.0 * (k % 8), 2.0 * (k // 8 % 8), 2.0 * (k // 64))) for k in range(count)]
    groups = {objects.Part(hull, 0, 0, True, casts): list(range(not casts, count, 2)) for casts in (True, False)}
    matrices = array("f", (value for place in places for column in place.col for value in column))
    made = scene_bounds.SceneBounds(groups, matrices)
    corners = {number: [place @ Vector(point) for point in set(hull.hull)] for number, place in enumerate(places)}

    def ranges(points: list[Vector], count: int) -> list[tuple[Vector, Vector]]:
        """Return the lowest and highest coordinates of each box, of `count` points."""
        groups = [list(zip(*points[at : at + count], strict=True)) for at in range(0, len(points), count)]
        return [(Vector(map(min, axes)), Vector(map(max, axes))) for axes in groups]

    def hold(found: list[tuple[Vector, Vector]], chosen: range) -> bool:
        near = 1e-5  # of numbers of 32 bits up to 30
        return all(
            any(all(low[k] - near <= corner[k] <= high[k] + near for k in range(3)) for low, high in found)
            for number in chosen
            for corner in corners[number]
        )

    everything = View(Matrix.Diagonal((0.01, 0.01, 0.01, 1.0)), Vector((0.0, 0.0, 1.0)), False, WIDTH, HEIGHT)
    found, casting = ranges(seen_corners(made, everything), 6 * 4), ranges(made.casters, 12 * 3)
    assert hold(found, range(count)) and hold(casting, range(0, count, 2))
    assert len(found) <= 32 and len(casting) <= 32  # as many boxes as can be cut for each view
    assert not hold(found[1:], range(count))
    # A part of the picture: within it, and as far as what is there.
    view = View(Matrix.Diagonal((0.5, 0.5, 0.01, 1.0)), Vector((0.0, 0.0, 1.0)), False, WIDTH, HEIGHT)
    shown = [(view.projection @ corner, corner) for corner in seen_corners(made, view)]
    inside = [corner for some in corners.values() for corner in some if max(map(abs, (view.projection @ corner)[:2])) <= 1.0]
    assert shown and all(max(map(abs, clip)) <= 1.0 + 1e-5 for clip, _ in shown)
    for k in range(3):
        assert min(corner[k] for _, corner in shown) - 1e-5 <= min(corner[k] for corner in inside)
        assert max(corner[k] for _, corner in shown) + 1e-5 >= max(corner[k] for corner in inside)


@pytest.mark.render
def test_view_that_turns_asks_no_part_where_it_is(stage: Stage, monkeypatch) -> None:
    stage.assert_as_new()
    monkeypatch.setattr(driver_scene, "SceneBounds", None)
    turned = View(Matrix.Diagonal((3.0, 3.0, 1.0, 1.0)) @ ABOVE.projection, ABOVE.eye, False, WIDTH, HEIGHT)
    (seen,) = stage.renderer._shadow_maps._regions
    stage.renderer.begin(turned)
    (turned_to,) = stage.renderer._shadow_maps._regions
    assert turned_to.points != seen.points
    monkeypatch.undo()


# ---- variants


IMAGE = Image("Image", "sRGB", is_data=False)
UV = UvMap("UVMap")
PAINT = ImageTexture(IMAGE, UV)
RELIEF = NormalMap(PAINT)
# Parameters of surfaces with one feature each, by the definition that makes it
FEATURES: dict[str, dict[str, Expression]] = {
    "METAL": {"metallic": Constant(0.5)},
    "TRANSMISSION": {"transmission_weight": Constant(0.5)},
    "SUBSURFACE": {"subsurface_weight": Constant(0.5), "subsurface_radius": Constant((1.0, 1.0, 1.0))},
    "SPECULAR": {"specular_weight": Constant(1.0)},
    "HIGHLIGHT": {"highlight_weight": Constant(0.1)},
    "COAT": {"coat_weight": Constant(0.5)},
    "FUZZ": {"fuzz_weight": Constant(0.5)},
    "EMISSION": {"emission_strength": Constant(1.0)},
    "OPACITY": {"opacity": ImageTexture(IMAGE, UV, "alpha")},
    "NORMAL": {"normal": RELIEF},
}
# What only the shader of a feature has
OWN = {
    "METAL": "ggx_radiance",
    "TRANSMISSION": "ggx_radiance",
    "SUBSURFACE": "burley_d",
    "SPECULAR": "ggx_radiance",
    "HIGHLIGHT": "blinn_phong_radiance",
    "COAT": "ggx_radiance",
    "FUZZ": "sheen_radiance",
    "NORMAL": "tangent_space_normal",
}
SHADED = [  # of one feature, of none, and of several
    *({name: values} for name, values in FEATURES.items()),
    {},
    {name: FEATURES[name] for name in ("METAL", "COAT", "NORMAL", "OPACITY")},
    {name: FEATURES[name] for name in ("SPECULAR", "SUBSURFACE", "FUZZ", "EMISSION")},
]


def shaded(*chosen: dict[str, Expression], model: str = "lambert") -> RenderMaterial:
    inputs: dict[str, Expression] = {}
    for parameters in chosen:
        inputs |= parameters
    return surface_material(Surface(model, inputs), 1.0)


def variant(material: RenderMaterial, lighting: program.Lighting, subsurface_in_scene: bool = False) -> program.Variant:
    inputs = program.Inputs.of(material.code)
    return program.Variant(material.model, inputs, material.features, subsurface_in_scene or material.has_subsurface, lighting)


SUN = frozenset(("SUN",))
LIGHTINGS = [program.Lighting(SUN, has_shadows, ambient) for has_shadows, ambient in product((False, True), (False, True))]


def functions(text: str) -> set[str]:
    return set(re.findall(r"^\w+ (\w+)\(", text, re.MULTILINE))


@pytest.mark.parametrize("features", SHADED, ids=lambda features: "+".join(features) or "none")
def test_what_a_scene_does_not_need_is_not_in_its_shader(features: dict[str, dict[str, Expression]]) -> None:
    """Files of functions, definitions, and what goes in and out; that the rest depends on these alone, the driver says below."""
    material = shaded(*features.values())
    for light, elsewhere in product(LIGHTINGS, (False, True)):
        made = program.surface_program(variant(material, light, elsewhere))
        has = functions(made.fragment)
        assert set(OWN.values()) & has == {OWN[name] for name in features if name in OWN}
        diffuse = {"blinn_phong_radiance"} if "HIGHLIGHT" in features else {"lambert_radiance"}
        # the albedo of Blinn-Phong's highlight is in the file of all fitted albedos, which builds on EON
        fits = {"oren_nayar_albedo", "eon_radiance"} if "HIGHLIGHT" in features and light.ambient else set()
        assert diffuse <= has and {"oren_nayar_radiance", "oren_nayar_albedo", "eon_radiance"} & has == fits
        defined = set(re.findall(r"^#define (\w+)$", made.fragment, re.MULTILINE)) - {"PASS_ATTRIBUTES"}
        is_glossy = bool({"METAL", "SPECULAR", "TRANSMISSION"} & set(features))
        scatters = elsewhere or "SUBSURFACE" in features
        needed = set(features)
        for name, is_needed in {
            "SHADOWS": light.shadows,
            "AMBIENT": light.ambient,
            "MULTIPLE_SCATTERING": is_glossy,
            "SPECULAR_TABLE": is_glossy or "COAT" in features,
            "SUBSURFACE_IN_SCENE": scatters,
        }.items():
            needed |= {name} if is_needed else set()
        assert defined == needed
        assert re.findall(r"^#define (SUN|POINT|SPOT|AREA) ", made.fragment, re.MULTILINE) == ["SUN"]
        has_image = bool({"NORMAL", "OPACITY"} & set(features))
        assert ("shadow_map" in made.samplers, "image_0" in made.samplers) == (light.shadows, has_image)
        assert ("specular_table" in made.samplers) == ("SPECULAR_TABLE" in needed)
        assert ("shadow_tiles" in made.samplers) == light.shadows
        assert len(made.outputs) == ((5 if light.shadows else 4) if scatters else 1)
        kinds = {name.rsplit("_", 1)[0] for name in set(made.attributes) - {"position", "normal"}}
        assert kinds == ({"uv"} if has_image else set()) | ({"tangent"} if "NORMAL" in features else set())


@pytest.mark.render
def test_every_variant_compiles() -> None:
    """A driver refuses names that are not declared: so what is left out of a variant is nowhere asked for."""
    most = program.Lighting(frozenset(program.LIGHT_TYPES), *(True,) * 4)
    for features in SHADED:
        for light in (LIGHTINGS[0], LIGHTINGS[-1], most):
            of_scene = variant(shaded(*features.values()), light)
            driver.compile_program(program.surface_program(of_scene))
            if light.bounce:
                driver.compile_program(program.surface_program(replace(of_scene, subsurface_in_scene=False, is_layer=True)))
    for name in MODELS:
        for highlight, is_map, bounces in product(({}, FEATURES["HIGHLIGHT"]), (False, True), (False, True)):
            light = replace(most, world_map=is_map, bounce=bounces)
            driver.compile_program(program.surface_program(variant(shaded(highlight, model=name), light, True)))


@pytest.mark.render
@pytest.mark.parametrize("name", [model.id for model in MODELS.values() if model.parameter])
def test_model_whose_parameter_varies_computes_its_numbers_in_the_shader(name: str) -> None:
    parameter = Surface(name).model_parameter
    material = shaded({parameter: Attribute("Wear", "factor")}, model=name)
    made = program.surface_program(variant(material, LIGHTINGS[-1]))
    assert f"{name}_coefficients(" in material.code.text
    driver.compile_program(made)


@pytest.mark.render
def test_each_combination_in_use_is_compiled_once(stage: Stage, sent: dict[str, int]) -> None:
    driver.forget_shaders()
    picture(stage.renderer)
    # One for all three materials, though their numbers differ; the sum's and the picture's. What lies in one plane has no shadows.
    assert sent["programs"] == 1 + 2
    for second in (stage.renderer, renderer.Renderer(stage.kept)):
        second.refresh()
        picture(second)
    assert sent["programs"] == 1 + 2
    stage.edit(lambda: model(stage))
    stage.edit(lambda: setattr(stage.group(2).inputs["Model"], "default_value", "Lambert"))
    picture(stage.renderer)
    assert sent["programs"] == 2 + 2
    stage.edit(lambda: setattr(stage.objects[0].material_slots[0], "material", bpy.data.materials["Coated"]))
    picture(stage.renderer)
    # The coated one's; Lambert's again, which now writes what scattering needs; and what gathers it.
    assert sent["programs"] == 2 + 2 + 2 + 1
    stage.edit(lambda: setattr(stage.group(1).inputs["Color"], "default_value", (0.1, 0.2, 0.3, 1.0)))
    picture(stage.renderer)
    assert sent["programs"] == 2 + 2 + 2 + 1


@pytest.mark.parametrize("model", MODELS)
def test_compiled_text_is_of_the_model_in_use_alone(model: str) -> None:
    made = program.surface_program(variant(shaded(model=model), program.Lighting()))
    others = {f"{other}_radiance" for other in MODELS if other not in (model, *includes(model))}
    assert functions(made.fragment) & others == set()


# ---- uniform blocks


def std140(kind: str) -> int:
    """Return the bytes of a struct of program.py, all of whose members are aligned to 16 bytes."""
    light = source("lights").split("struct Light {")[1].split("};")[0]
    sizes = {"mat4": 64, "vec4": 16, "ivec4": 16, "Light": 16 * light.count("vec4")}
    structs = program.STRUCTS | {"Material": MATERIAL_STRUCT}
    total = 0
    for member in structs[kind].rstrip(";").split(";"):
        name, what = member.split()
        count = int(what.split("[")[1].rstrip("]")) if "[" in what else 1
        total += sizes[name] * count
    return total


LIGHT = Light("AREA", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0), (4.0, 5.0, 6.0), 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False)
METAL = shaded(FEATURES["METAL"])
MATERIAL_STRUCT = re.search(
    r"struct Material \{ (.*); \}", program.surface_program(variant(METAL, program.Lighting())).declarations
)[1]
PACKED = {
    "View": View(Matrix(), Vector((0.0, 0.0, 1.0)), True, 1, 1).to_bytes((0.0, 0.0, 0.0), 0),
    "Material": values_to_bytes(METAL.code),
    "Lights": lights_to_bytes([LIGHT], [0]),
}


@pytest.mark.parametrize("kind", PACKED)
def test_block_is_as_long_as_its_struct(kind: str) -> None:
    assert len(PACKED[kind]) == std140(kind)


def test_lights_beyond_the_most_are_left_out() -> None:
    most = program.MAX_LIGHTS
    assert lights_to_bytes([LIGHT] * (most + 3), [1] * (most + 3)) == lights_to_bytes([LIGHT] * most, [1] * most)


@pytest.mark.parametrize(
    ("node", "output", "socket"), [("ObjectInfo", "Color", "Color"), ("TexIES", "Factor", "Strength")], ids=("Color", "Strength")
)
def test_world_of_an_unknown_node_is_said_and_drawn_in_its_own_value(blend: str, node: str, output: str, socket: str) -> None:
    stage = Stage(blend)
    tree = stage.scene.world.node_tree
    background = tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.25, 0.5, 1.0, 1.0), 2.0
    made = tree.nodes.new(f"ShaderNode{node}")
    tree.links.new(made.outputs[output], background.inputs[socket])
    cache = scene_cache.SceneCache()
    cache.update(bpy.context.evaluated_depsgraph_get())
    assert cache.world == (0.5, 1.0, 2.0)
    what = (
        f"the output {output} of the node {made.bl_label} ({made.name}) is not drawn, the {socket} of the node Background itself is"
    )
    assert list(map(str, cache.warnings)) == [f"World: {what}"]
