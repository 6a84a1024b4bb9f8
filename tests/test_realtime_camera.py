# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime engine's depth of field and passes against closed forms and Cycles."""

import math
from array import array
from collections.abc import Callable, Sequence

import bpy

import bmesh
import pytest
from mathutils import Matrix, Vector

from support import scene_at_centers
from true_diffuse.addon.blender import engines
from true_diffuse.addon.measure import render
from true_diffuse.addon.realtime.lens import Lens
from true_diffuse.addon.realtime.view import View
from true_diffuse.scenes.elements import add, add_sun, towards

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("registered", "driver")]

SIZE = 48  # pixels
ROUND = 1e-5  # of sums of 32-bit floats


def scene_of(size: int = SIZE, lens: float = 50.0) -> bpy.types.Scene:
    """Return an empty scene of a camera at the origin that looks along -Z, whose samples are all at the pixels' centers."""
    scene = scene_at_centers(size, size)
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    scene.camera = add(scene, "Camera", data)
    return scene


def shining(radiance: float = 1.0) -> bpy.types.Material:
    """Return a material that emits a radiance [W/(m^2 sr)] and reflects nothing."""
    made = bpy.data.materials.new("Shining")
    tree = made.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = radiance
    tree.links.new(emission.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    return made


def rectangle(
    scene: bpy.types.Scene, low: tuple[float, float], high: tuple[float, float], z: float, shown: bpy.types.Material
) -> bpy.types.Object:
    """Add a rectangle parallel to the picture, `z` along the camera's axis [m]."""
    mesh = bpy.data.meshes.new("Rectangle")
    (x0, y0), (x1, y1) = low, high
    mesh.from_pydata([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(shown)
    return add(scene, "Rectangle", mesh, Matrix.Translation((0.0, 0.0, z)))


def red(scene: bpy.types.Scene, engine: engines.Engine = engines.REALTIME, samples: int = 1) -> array[float]:
    """Return the red radiance of each pixel, rows from the top."""
    return render.radiance(scene, engine, samples)[1][::3]


def rms_error(got: Sequence[float], expected: Sequence[float]) -> float:
    """Return the RMS difference over the RMS of what is expected."""
    difference = math.fsum((a - b) ** 2 for a, b in zip(got, expected, strict=True))
    return math.sqrt(difference / math.fsum(b * b for b in expected))


# ---- depth of field

FOCUS, FSTOP = 2.0, 0.1  # m; of 50 mm: a lens of 0.25 m


def focus(camera: bpy.types.Object, **settings: object) -> None:
    dof = camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, FOCUS, FSTOP
    for name, value in settings.items():
        setattr(dof, name, value)


def disk_beyond(x: float) -> float:
    """Return the fraction of a disk of radius 1 that is left of a chord at `x` from its middle."""
    x = max(-1.0, min(x, 1.0))
    return 0.5 + (x * math.sqrt(1.0 - x * x) + math.asin(x)) / math.pi


@pytest.mark.parametrize("distance", [1.0, 2.0, 4.0])
def test_edge_is_blurred_by_the_circle_of_confusion(distance: float) -> None:
    """Of an edge `distance` away, at x = 0: a point of the lens moves it by its own offset times |1 / distance - 1 / focus|.

    The picture is 0.72 wide at 1 m. 256 points of a disk leave a chord's fraction uncertain by about 1 / 256 for each of the
    digits that they have in base 7, three, and as much in base 11.
    """
    scene = scene_of()
    focus(scene.camera)
    rectangle(scene, (0.0, -9.0), (9.0, 9.0), -distance, shining())
    row = red(scene, samples=256)[SIZE * (SIZE // 2) :][:SIZE]
    radius = 0.05 / FSTOP / 2.0 * abs(1.0 / distance - 1.0 / FOCUS)  # of the circle, at 1 m
    for column, found in enumerate(row):
        x = 0.72 * ((column + 0.5) / SIZE - 0.5)
        expected = disk_beyond(x / radius) if radius else float(x > 0.0)
        assert found == pytest.approx(expected, abs=6.0 / 256.0 if radius else ROUND)


def aperture(**settings: object) -> Callable[[bpy.types.Scene], None]:
    return lambda scene: focus(scene.camera, **settings)


def parallel(scene: bpy.types.Scene) -> None:
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.4
    focus(scene.camera, aperture_fstop=2.0)


def on_an_object(scene: bpy.types.Scene) -> None:
    target = add(scene, "Focus", None, Matrix.Translation((3.0, 1.0, -1.3)))
    focus(scene.camera, focus_object=target, focus_distance=9.0, aperture_fstop=0.06)


def on_a_bone(scene: bpy.types.Scene) -> None:
    armature = add(scene, "Rig", bpy.data.armatures.new("Rig"), Matrix.Translation((0.0, 0.0, -1.0)))
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bone = armature.data.edit_bones.new("Eye")
    bone.head, bone.tail = (0.0, 0.0, -0.3), (0.0, 1.0, -0.3)
    bpy.ops.object.mode_set(mode="OBJECT")
    focus(scene.camera, focus_object=armature, focus_subtarget="Eye", aperture_fstop=0.06)


LENSES = {
    "polygon": aperture(aperture_blades=5, aperture_rotation=0.4, aperture_fstop=0.02),
    "polygon, narrow": aperture(aperture_blades=3, aperture_rotation=0.2, aperture_ratio=1.5, aperture_fstop=0.02),
    "two blades, wide": aperture(aperture_blades=2, aperture_ratio=0.5, aperture_fstop=0.04),
    "orthographic": parallel,
    "object": on_an_object,
    "bone": on_a_bone,
}


@pytest.mark.parametrize("name", LENSES)
def test_lens_is_that_of_cycles(name: str) -> None:
    """The picture of a small square that is out of focus has the shape of the aperture.

    A square of 3 pixels that is spread over 80 is in a pixel in one sample out of 9: of 1024 random samples, 115 +- 11 would be.
    Evenly spread samples are at least twice as even.
    """
    scene = scene_of(24, 35.0)
    LENSES[name](scene)
    scene.camera.matrix_world = Matrix.Translation((0.5, 1.0, 2.0)) @ towards((0.3, -0.5, 1.0)) @ Matrix.Rotation(0.6, 4, "Z")
    for item in scene.objects:
        if item is not scene.camera:
            item.matrix_world = scene.camera.matrix_world @ item.matrix_world
    small = rectangle(scene, (-0.3, -0.2), (0.2, 0.3), 0.0, shining(100.0))
    small.matrix_world = scene.camera.matrix_world @ Matrix.Translation((0.0, 0.0, -4.0))
    bpy.context.view_layer.update()
    expected = red(scene, engines.CYCLES, 1024)
    assert rms_error(red(scene, samples=1024), expected) < 0.05


def test_what_any_point_of_the_lens_sees_is_within_the_bounds() -> None:
    camera = Matrix.Translation((0.5, 1.0, 2.0)) @ towards((0.3, -0.5, 1.0))
    right, up, axis = (camera.col[column].to_3d() for column in range(3))
    projection = Matrix(((2.0, 0.0, 0.3, 0.0), (0.0, 3.0, 0.0, 0.0), (0.0, 0.0, -1.002, -0.2), (0.0, 0.0, -1.0, 0.0)))
    lens = Lens(camera.translation, right, up, axis, 2.0, 0.3, 0.7, 5, 0.2)
    view = View(projection @ camera.inverted(), camera.translation, True, 48, 32, lens=lens)
    held = beyond = 0
    for sample in range(32):
        seen = view.at_sample(sample, 0.0)
        from_clip = seen.projection.inverted()
        for x in (-1.0, -0.5, 1.0):
            for y in (-1.0, 0.3, 1.0):
                for z in (-0.9, 0.0, 0.8, 0.9, 0.95, 0.99):
                    point = from_clip @ Vector((x, y, z, 1.0))
                    point /= point.w
                    assert any(is_within(part, point, 1.0 + 1e-5) for part in view.holding()), (sample, x, y, z)
                    held += 1
                    beyond += not is_within(view, point, 1.0)
    assert 0 < beyond < held  # a view without a lens does not hold them


def is_within(view: View, point: Vector, margin: float) -> bool:
    clip = view.projection @ point
    return all(abs(coordinate) <= clip.w * margin for coordinate in clip[:3])


# ---- passes

PASSES = {"Position": "XYZ", "Normal": "XYZ", "Object Index": "X", "Material Index": "X", "Diffuse Color": "RGB"}


def numbered_material(number: int, color: Sequence[float], opacity: float = 1.0, **inputs: float) -> bpy.types.Material:
    """Return a Principled BSDF; sockets by name with _ for a space."""
    made = bpy.data.materials.new("Numbered")
    made.pass_index = number
    node = made.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value, node.inputs["Alpha"].default_value = (*color, 1.0), opacity
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return made


def numbered_scene() -> bpy.types.Scene:
    """Return a scene of two spheres, an instance of one, and two panes before them, the second opaque by less than half."""
    scene = scene_of(32)
    mesh = bpy.data.meshes.new("Sphere")
    sphere = bmesh.new()
    bmesh.ops.create_uvsphere(sphere, u_segments=48, v_segments=24, radius=0.5)
    for face in sphere.faces:
        face.smooth = True
    sphere.to_mesh(mesh)
    sphere.free()
    mesh.materials.append(numbered_material(7, (0.8, 0.4, 0.1), Specular_IOR_Level=0.0))
    add(scene, "First", mesh, Matrix.Translation((-0.5, 0.4, -3.0))).pass_index = 3
    other = add(scene, "Second", mesh, Matrix.Translation((0.5, 0.5, -3.0)) @ Matrix.Scale(0.8, 4, (0.0, 1.0, 0.0)))
    other.pass_index, other.material_slots[0].link = 30000, "OBJECT"
    other.material_slots[0].material = numbered_material(2, (0.2, 0.3, 0.9), Metallic=0.3)
    group = bpy.data.collections.new("Group")
    group.objects.link(scene.objects["First"])
    empty = add(scene, "Instance", None, Matrix.Translation((0.6, -1.0, -0.5)))
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    for x, opacity, number in ((-0.6, 0.7, 11), (0.6, 0.3, 12)):
        pane = rectangle(scene, (x - 0.3, -0.2), (x + 0.3, 0.4), -2.0, numbered_material(number, (0.1, 0.9, 0.2), opacity))
        pane.pass_index = number
    bpy.context.view_layer.update()
    return scene


def passes_of(scene: bpy.types.Scene, engine: engines.Engine, samples: int) -> dict[str, array[float]]:
    engines.use(scene, engine, samples)
    channels = render.passes(scene)
    return {name: render.interleaved(channels, name, letters) for name, letters in PASSES.items()}


def ask_for_passes(layer: bpy.types.ViewLayer) -> None:
    layer.use_pass_position = layer.use_pass_normal = layer.use_pass_diffuse_color = True
    layer.use_pass_object_index = layer.use_pass_material_index = True


def test_passes_are_those_of_cycles() -> None:
    """Between the panes; before one, the mean of a color that is seen through by chance, in 24 pixels of 64 samples or more.

    Positions and numbers are exact. Cycles' samples are within a hundredth of a pixel, in which normals turn by up to 3e-3 near a
    silhouette, and the specular layer takes up to 1e-2 more.
    """
    scene = numbered_scene()
    ask_for_passes(scene.view_layers[0])
    expected, got = (passes_of(scene, engine, 64) for engine in (engines.CYCLES, engines.REALTIME))
    tolerances = {"Position": ROUND, "Normal": 3e-3, "Object Index": 0.0, "Material Index": 0.0, "Diffuse Color": 1e-2}
    for name, tolerance in tolerances.items():
        width = len(PASSES[name])
        columns = [index // width % 32 for index in range(len(got[name]))]
        between = [index for index, column in enumerate(columns) if 9 <= column < 23]
        assert [got[name][index] for index in between] == pytest.approx(
            [expected[name][index] for index in between], abs=tolerance
        ), name
    assert set(got["Object Index"]) == {0.0, 3.0, 11.0, 30000.0}  # of panes, what is opaque by at least half
    assert set(got["Material Index"]) == {0.0, 2.0, 7.0, 11.0}
    for channel in range(3):
        for before_pane in (range(9), range(23, 32)):
            sums = [
                math.fsum(
                    picture["Diffuse Color"][3 * (32 * row + column) + channel] for row in range(32) for column in before_pane
                )
                for picture in (got, expected)
            ]
            assert sums[0] == pytest.approx(sums[1], rel=0.02)


def test_passes_of_a_border_are_those_of_the_whole_picture() -> None:
    scene = numbered_scene()
    ask_for_passes(scene.view_layers[0])
    whole = passes_of(scene, engines.REALTIME, 1)
    render.crop(scene, render.Region(10, 4, 12, 9))
    part = passes_of(scene, engines.REALTIME, 1)
    for name in ("Position", "Normal", "Object Index"):
        width = len(PASSES[name])
        rows = [whole[name][width * (32 * row + 10) : width * (32 * row + 22)] for row in range(19, 28)]  # of rows from the top
        assert part[name] == pytest.approx([value for row in rows for value in row], abs=ROUND), name


# ---- motion blur

SPEED, WIDTH = 0.1, 0.3  # m in a frame, m: of a square
SAMPLES = 64
HEADWAY = {"START": 0.5, "CENTER": 0.0, "END": -0.5}  # of the middle of the shutter's time before the frame


def linear(owner: bpy.types.bpy_struct, path: str, index: int, first: float, last: float) -> None:
    """Key a value at the frames 0 and 10, with a straight line between."""
    for frame, value in ((0, first), (10, last)):
        if index < 0:
            setattr(owner, path, value)
        else:
            getattr(owner, path)[index] = value
        owner.keyframe_insert(path, index=index, frame=frame)
    animation = owner.id_data.animation_data
    for curve in animation.action.layers[0].strips[0].channelbag(animation.action_slot).fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def moving_square() -> tuple[bpy.types.Scene, bpy.types.Object]:
    """Return a scene at its frame 4 and a square 1 m away, which is in the middle of the picture then and moves to the right."""
    scene = scene_of()
    square = rectangle(scene, (-WIDTH / 2.0, -9.0), (WIDTH / 2.0, 9.0), -1.0, shining())
    linear(square, "location", 0, -4.0 * SPEED, 6.0 * SPEED)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.5
    scene.frame_set(4)
    return scene, square


def covered(x: float, open_until: Callable[[float], float], start: float, length: float) -> float:
    """Return the fraction of the light in which the square is at `x` [m]: it is, from one time to another [frames from the middle].

    `open_until` is the fraction of the light up to a fraction of the shutter's time, which starts at `start` and has `length`.
    """
    first, last = ((x + side * WIDTH / 2.0) / SPEED for side in (-1.0, 1.0))
    return open_until(min(max((last - start) / length, 0.0), 1.0)) - open_until(min(max((first - start) / length, 0.0), 1.0))


def middle_row(scene: bpy.types.Scene, engine: engines.Engine = engines.REALTIME, samples: int = SAMPLES) -> array[float]:
    return red(scene, engine, samples)[SIZE * (SIZE // 2) :][:SIZE]


def places() -> list[float]:
    """Return where each pixel of a row is at 1 m [m]."""
    return [0.72 * ((column + 0.5) / SIZE - 0.5) for column in range(SIZE)]


@pytest.mark.parametrize("position", HEADWAY)
def test_moving_square_is_there_for_the_time_that_it_takes(position: str) -> None:
    """Each of the evenly spaced samples shows or does not show it, at both ends of that time."""
    scene, _ = moving_square()
    scene.render.motion_blur_position = position
    start = 1.5 * (HEADWAY[position] - 0.5)
    expected = [covered(x, lambda time: time, start, 1.5) for x in places()]
    assert expected[SIZE // 2] > 0.0 and any(0.1 < value < 0.9 for value in expected)
    assert list(middle_row(scene)) == pytest.approx(expected, abs=2.0 / SAMPLES)
    assert (scene.frame_current, scene.frame_subframe) == (4, 0.0)


def test_shutter_opens_as_its_curve_says() -> None:
    """Of a curve that rises from 0 to 1, the light up to a time is its square."""
    scene, _ = moving_square()
    curve = scene.render.motion_blur_shutter_curve
    points = curve.curves[0].points
    while len(points) > 2:
        points.remove(points[1])
    for point, height in zip(points, (0.0, 1.0), strict=True):
        point.location, point.handle_type = (height, height), "VECTOR"
    curve.update()
    expected = [covered(x, lambda time: time * time, -0.75, 1.5) for x in places()]
    assert list(middle_row(scene)) == pytest.approx(expected, abs=2.0 / SAMPLES)


def moving_camera(scene: bpy.types.Scene, square: bpy.types.Object) -> None:
    square.animation_data_clear()
    square.location.x = 0.0
    linear(scene.camera, "location", 0, 4.0 * SPEED, -6.0 * SPEED)


def moving_vertices(_: bpy.types.Scene, square: bpy.types.Object) -> None:
    square.animation_data_clear()
    square.location.x = 0.0
    square.shape_key_add(name="Basis")
    key = square.shape_key_add(name="Aside")
    for point in key.data:
        point.co.x += 1.0
    key.slider_min = -10.0
    linear(key, "value", -1, -4.0 * SPEED, 6.0 * SPEED)


def moving_instance(scene: bpy.types.Scene, square: bpy.types.Object) -> None:
    group = bpy.data.collections.new("Group")
    scene.collection.objects.unlink(square)
    group.objects.link(square)
    empty = add(scene, "Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group


@pytest.mark.parametrize("move", [moving_camera, moving_vertices, moving_instance])
def test_whatever_moves_is_blurred(move: Callable[[bpy.types.Scene, bpy.types.Object], None]) -> None:
    scene, square = moving_square()
    move(scene, square)
    scene.frame_set(4)
    expected = [covered(x, lambda time: time, -0.75, 1.5) for x in places()]
    assert list(middle_row(scene)) == pytest.approx(expected, abs=2.0 / SAMPLES)


def test_motion_blur_is_that_of_cycles() -> None:
    """With Blender's own curve. Cycles' 256 samples of a time are as uncertain as ours, and once in 256 more."""
    scene, _ = moving_square()
    assert list(middle_row(scene)) == pytest.approx(list(middle_row(scene, engines.CYCLES, 256)), abs=3.0 / SAMPLES)


# ---- hair


def curves(
    scene: bpy.types.Scene, points: Sequence[Sequence[tuple[float, float, float, float]]], shown: bpy.types.Material
) -> bpy.types.Object:
    """Add hair curves; a point is its place and radius [m]."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([len(one) for one in points])
    flat = [point for one in points for point in one]
    data.attributes["position"].data.foreach_set("vector", [number for point in flat for number in point[:3]])
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", [point[3] for point in flat])
    data.materials.append(shown)
    return add(scene, "Hair", data)


def test_straight_hair_is_the_ribbon_of_cycles() -> None:
    """Where both engines have it: a pixel along the edges may be lacking in one.

    Its radius is up to 0.036 m at 1.8 m: Cycles turns the ribbon to each ray, by up to 0.02 from where the middle faces and by 1.4
    times as much around a hair that is tilted by 45 degrees. Positions are on the round hair, in Cycles on the ribbon.
    """
    scene = scene_of(96)
    scene.cycles_curves.shape = "RIBBONS"
    shown = numbered_material(1, (0.8, 0.4, 0.1), Specular_IOR_Level=0.0)
    first = [(-0.3, -0.4, 0.2, 0.03), (0.0, 0.0, 0.0, 0.02), (0.3, 0.4, -0.2, 0.015)]
    item = curves(scene, [first, [(-0.3, 0.1, 0.0, 0.015), (0.1, -0.6, 0.0, 0.03)]], shown)
    item.matrix_world = Matrix.Translation((0.0, 0.1, -2.0)) @ Matrix.Rotation(0.3, 4, "X") @ Matrix.Scale(1.2, 4)
    add_sun(scene, "Sun", (0.5, 0.5, 1.0), 3.0).data.use_shadow = False
    ask_for_passes(scene.view_layers[0])
    bpy.context.view_layer.update()
    expected, got = (passes_of(scene, engine, 1) for engine in (engines.CYCLES, engines.REALTIME))
    both = [index for index in range(96 * 96) if expected["Material Index"][index] and got["Material Index"][index]]
    sizes = [sum(picture["Material Index"]) for picture in (expected, got)]
    assert len(both) > 0.95 * max(sizes) > 200.0
    for name, tolerance in (("Normal", 0.03), ("Position", 0.02), ("Diffuse Color", 1e-5)):
        of_hair = [[picture[name][3 * pixel + channel] for pixel in both for channel in range(3)] for picture in (got, expected)]
        assert rms_error(*of_hair) < tolerance, name
    shades, lights = red(scene, samples=1), red(scene, engines.CYCLES, 1)
    assert rms_error([shades[pixel] for pixel in both], [lights[pixel] for pixel in both]) < 0.03


def test_hair_has_attributes_of_curves_and_points() -> None:
    """Each of two hairs has its color, and what goes from 0 to 1 along both; Cycles is within a pixel's 1 / 90 of it."""
    scene = scene_of(64)
    scene.cycles_curves.shape = "RIBBONS"
    shown = bpy.data.materials.new("By Attributes")
    tree = shown.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    for name, socket in (("tint", "Color"), ("along", "Strength")):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        tree.links.new(node.outputs["Color" if name == "tint" else "Fac"], emission.inputs[socket])
    tree.links.new(emission.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    item = curves(scene, [[(x, y, -1.0, 0.08) for y in (-0.5, 0.0, 0.5)] for x in (-0.2, 0.2)], shown)
    item.data.attributes.new("tint", "FLOAT_COLOR", "CURVE").data.foreach_set("color", (0.9, 0.0, 0.0, 1.0, 0.4, 0.0, 0.0, 1.0))
    item.data.attributes.new("along", "FLOAT", "POINT").data.foreach_set("value", (0.0, 0.5, 1.0) * 2)
    expected, got = red(scene, engines.CYCLES, 1), red(scene)
    assert max(got) > 0.6
    assert rms_error(got, expected) < 0.05


def test_hair_casts_the_shadow_of_cycles_wherever_it_is() -> None:
    """Of a light at the side, for which a strip has to turn, and of hair that is not in the picture."""
    scene = scene_of(48)
    scene.cycles_curves.shape = "RIBBONS"
    shown = numbered_material(1, (0.8, 0.4, 0.1), Specular_IOR_Level=0.0)
    rectangle(scene, (-2.0, -2.0), (2.0, 2.0), -2.0, shown)
    curves(scene, [[(x, 0.1 * x - 0.4, -1.4 + 0.2 * x, 0.05), (x, 0.4, -1.6, 0.02)] for x in (-1.2, -0.8, -0.1, 0.3)], shown)
    add_sun(scene, "Sun", (-1.0, 0.3, 0.7), 3.0)
    bpy.context.view_layer.update()
    got, expected = red(scene), red(scene, engines.CYCLES, 16)
    dark = [sum(value < 0.2 for value in picture) for picture in (got, expected)]
    assert dark[0] == pytest.approx(dark[1], rel=0.1) and dark[1] > 200
    assert rms_error(got, expected) < 0.2  # its edges are sharp


@pytest.mark.parametrize("children", ["NONE", "INTERPOLATED"])
def test_hair_of_particles_is_that_of_cycles(children: str) -> None:
    """Of an emitter that is not shown itself. A pixel along the edges may be lacking in one engine: a hair is two to four wide."""
    scene = scene_of(96)
    scene.cycles_curves.shape = "RIBBONS"
    emitter = rectangle(scene, (-0.4, -0.4), (0.4, 0.4), 0.0, shining(2.0))
    emitter.data.materials.append(shining(1.0))
    emitter.matrix_world = Matrix.Translation((0.1, 0.0, -3.0)) @ Matrix.Rotation(0.9, 4, "X") @ Matrix.Scale(1.5, 4)
    emitter.show_instancer_for_render = False
    emitter.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length, settings.render_type, settings.material = "HAIR", 12, 0.5, "PATH", 2
    settings.root_radius, settings.radius_scale, settings.shape = 0.06, 1.0, 0.3
    settings.child_type, settings.rendered_child_count, settings.brownian_factor = children, 3, 0.03
    bpy.context.view_layer.update()
    got, expected = red(scene), red(scene, engines.CYCLES)
    assert set(got) == {0.0, 1.0}
    both = sum(a == b == 1.0 for a, b in zip(got, expected, strict=True))
    assert both > 0.9 * max(sum(got), sum(expected)) > 100.0


# ---- layers before each other


def test_stacked_transparent_layers_cover_each_other_by_their_opacity() -> None:
    """Five panes of opacity 0.3: a sample shows the first that it does not see through.

    Of 32 x 32 pixels of 64 samples each, whose radiances lie between 0 and 5 around a mean of 2.5: 2 / sqrt(65536) = 0.8 % off.
    """
    scene = scene_of(32)
    visible, expected = 1.0, 0.0
    for layer in range(5):
        pane = numbered_material(layer, (0.0, 0.0, 0.0), 0.3, Emission_Strength=1.0 + layer, Specular_IOR_Level=0.0)
        pane.node_tree.nodes["Principled BSDF"].inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        rectangle(scene, (-2.0, -2.0), (2.0, 2.0), -1.0 - 0.1 * layer, pane)
        expected += visible * 0.3 * (1.0 + layer)
        visible *= 0.7
    assert sum(red(scene, samples=64)) / 1024.0 == pytest.approx(expected, rel=0.008)
