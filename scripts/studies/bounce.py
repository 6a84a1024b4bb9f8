# SPDX-License-Identifier: GPL-3.0-or-later
"""Realtime's bounce of diffuse light and its shade from the sky against Cycles, by the number of samples."""

import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial

import bpy

from mathutils import Matrix, Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Record
from true_diffuse.scenes import elements, five_characters
from true_diffuse.scripts.characters import face
from true_diffuse.scripts.studies.study import Step, Table, pivot

FILTER = 1.5  # pixels, the width of Blackman and Harris's window in both engines
NOISELESS = 512  # samples of Cycles
BOX, BOX_PIXELS = 2.0, 128  # m, pixels a side
WHITE, RED, GREEN = (0.73, 0.73, 0.73), (0.65, 0.05, 0.05), (0.12, 0.45, 0.15)
SKY = 1.0  # radiance of the sky over the box without a ceiling [W/(m^2 sr)]
GROUND, GROUND_PIXELS = 200.0, (160, 64)  # m a side, and the picture of five blocks on it

CHARACTERS = ("five characters", "face")  # which take some ten times as long

type Corner = tuple[float, float, float]


def box(is_open: bool) -> bpy.types.Scene:
    """Return a scene of a box with a red and a green wall and two blocks in it, seen through its open front.

    An area light hangs below its ceiling; if it `is_open`, it has none, and is lit by an even sky.
    """
    scene = bpy.data.scenes.new("Box")
    half = BOX / 2.0
    left, right, front, back, top = -half, half, -half, half, BOX
    walls: list[tuple[str, Corner, list[Corner]]] = [
        ("Floor", WHITE, [(left, front, 0.0), (right, front, 0.0), (right, back, 0.0), (left, back, 0.0)]),
        ("Back", WHITE, [(left, back, 0.0), (right, back, 0.0), (right, back, top), (left, back, top)]),
        ("Left", RED, [(left, front, 0.0), (left, back, 0.0), (left, back, top), (left, front, top)]),
        ("Right", GREEN, [(right, front, 0.0), (right, back, 0.0), (right, back, top), (right, front, top)]),
    ]
    if is_open:
        scene.world = elements.uniform_world(strength=SKY)
    else:
        walls.append(("Ceiling", WHITE, [(left, front, top), (right, front, top), (right, back, top), (left, back, top)]))
        light = bpy.data.lights.new("Light", "AREA")
        light.energy, light.size = 40.0, 0.5
        elements.add(scene, "Light", light, Matrix.Translation((0.0, 0.0, 0.99 * top)))
    for name, color, corners in walls:
        _add(scene, name, color, corners, [(0, 1, 2, 3)])
    for name, height, place, turn in (("Tall", 1.2, (-0.35, 0.3), 0.3), ("Short", 0.6, (0.35, -0.35), -0.3)):
        _add_block(scene, name, WHITE, (0.6, 0.6, height), Matrix.Translation((*place, 0.0)) @ Matrix.Rotation(turn, 4, "Z"))
    _add_camera(scene, Vector((0.0, -3.9, 1.5 if is_open else 1.0)), (BOX_PIXELS, BOX_PIXELS))
    return scene


def ground() -> bpy.types.Scene:
    """Return a scene of five blocks of a person's size on a ground up to the horizon, under a sun and an even sky."""
    scene = bpy.data.scenes.new("Ground")
    half = GROUND / 2.0
    _add(scene, "Ground", WHITE, [(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)], [(0, 1, 2, 3)])
    for number, color in enumerate((WHITE, RED, WHITE, GREEN, WHITE)):
        turned = Matrix.Translation((1.1 * (number - 2), 0.4 * (number % 2), 0.0)) @ Matrix.Rotation(0.5 - 0.25 * number, 4, "Z")
        _add_block(scene, f"Block {number}", color, (0.7, 0.5, 1.8), turned)
    scene.world = elements.uniform_world(strength=SKY)
    elements.add_sun(scene, "Sun", (0.5, -0.6, 0.5), math.pi, math.radians(2.0))
    _add_camera(scene, Vector((0.0, -6.5, 1.7)), GROUND_PIXELS)
    return scene


def _add_camera(scene: bpy.types.Scene, eye: Vector, pixels: tuple[int, int]) -> None:
    """Have `scene` seen from `eye` towards the point 1 m above its origin."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens, camera.sensor_width, camera.clip_end = 35.0, 36.0, 2.0 * GROUND
    scene.camera = elements.add(scene, "Camera", camera, Matrix.Translation(eye) @ elements.towards(eye - Vector((0.0, 0.0, 1.0))))
    scene.render.resolution_x, scene.render.resolution_y = pixels


def _add_block(scene: bpy.types.Scene, name: str, color: Corner, size: Corner, matrix: Matrix) -> None:
    """Add a block that stands on the middle of its lowest side."""
    x, y, z = size
    corners = [(a, b, c) for a in (-x / 2.0, x / 2.0) for b in (-y / 2.0, y / 2.0) for c in (0.0, z)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    _add(scene, name, color, corners, faces, matrix)


def _add(
    scene: bpy.types.Scene,
    name: str,
    color: Corner,
    corners: Sequence[Corner],
    faces: Sequence[tuple[int, ...]],
    matrix: Matrix | None = None,
) -> None:
    """Add a mesh of one color."""
    material, node = materials.create_plain(name)
    node.inputs["Color"].default_value = (*color, 1.0)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material)
    elements.add(scene, name, mesh, matrix)


def characters(mesh: bpy.types.Mesh) -> bpy.types.Scene:
    """Return the scene of the five characters with plain Diffuse BSDFs."""
    five = five_characters.build(mesh, 0.8, True, (320, 120))
    for character in five.characters:
        character.subject.material_slots[0].material = five.plain
    return five.scene


class Picture:
    """A scene that Cycles renders with one bounce of diffuse light alone."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self.scene = scene
        settings = scene.cycles
        settings.max_bounces = settings.diffuse_bounces = 1
        settings.glossy_bounces = settings.transmission_bounces = 0
        settings.caustics_reflective = settings.caustics_refractive = False
        settings.light_sampling_threshold = settings.sample_clamp_indirect = 0.0
        scene.render.filter_size = FILTER
        settings.filter_width = FILTER / 2.0  # half the window
        self.cycles = cache(lambda: render.radiance(scene, engines.CYCLES, NOISELESS)[1])

    def realtime(self, samples: int, bounces: bool) -> tuple[float, array[float]]:
        """Return the seconds that a picture of Realtime takes, and its radiance."""
        self.scene.true_diffuse.bounces_light = bounces
        return render.radiance(self.scene, engines.REALTIME, samples)


def steps(mesh: bpy.types.Mesh, quick: bool) -> list[Step]:
    """Return steps that yield Realtime's RMS difference from Cycles, with Bounce Light and without."""
    built: Mapping[str, tuple[tuple[int, ...], Callable[[], bpy.types.Scene]]] = {
        "box": ((1, 16, 64), partial(box, is_open=False)),
        "open box under a sky": ((16, 64), partial(box, is_open=True)),
        "ground": ((16, 64), ground),
        "five characters": ((16,), partial(characters, mesh)),
        "face": ((32,), lambda: face.build(mesh, True, (240, 96)).scene),
    }
    pictures = {name: cache(lambda build=build: Picture(build())) for name, (_, build) in built.items()}

    def measure(name: str, samples: int) -> Iterator[Record]:
        picture = pictures[name]()
        expected = picture.cycles()
        for bounces in (False, True):
            seconds, got = picture.realtime(samples, bounces)
            yield {
                "scene": name,
                "samples": samples,
                "bounces_light": bounces,
                "rms_difference": error.difference(got, expected, range(len(got) // 3)),
                "mean_difference": math.fsum(got) / math.fsum(expected) - 1.0,
                "seconds_per_sample": seconds / samples,
            }

    return [
        Step(f"{name}  {count} samples", partial(measure, name, count), (count + 20.0) * (10.0 if name in CHARACTERS else 1.0))
        for name in (("box",) if quick else built)
        for count in built[name][0]
    ]


def table(records: Sequence[Record]) -> Table:
    """Return the differences, a row for each scene and setting and a column for each number of samples."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        whole, mean = (100.0 * one[key] for key in ("rms_difference", "mean_difference"))
        return f"{whole:.1f} / {mean:+.1f} %, {1000.0 * one['seconds_per_sample']:.0f} ms"

    def row(one: Record) -> tuple[str, ...]:
        return one["scene"], "on" if one["bounces_light"] else "off"

    return pivot(records, ("Scene", "Bounce Light"), row, lambda one: f"{one['samples']} samples", cell)
