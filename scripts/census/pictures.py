# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the open file's meshes under one sun without bounces, and how far one is from another on each material.

Each pixel is seen through its center. Compared are interior pixels: those around which the picture shows the same material without
a step in depth, as at an edge engines may see different surfaces.
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.measure import render
from true_diffuse.scenes.elements import add_sun

LENS = 85.0  # mm
VIEW = Vector((0.25, -1.0, 0.2)).normalized()  # from the middle of the meshes towards the camera: characters face -Y
SUN = (-0.45, -0.8, 0.5)  # from the middle towards the sun
IRRADIANCE = math.pi  # W/m^2 on a plane facing the sun: a white one has a radiance of 1
SAMPLES = 16  # for what Cycles chooses at random, as subsurface scattering
ALPHA_SAMPLES = 256  # where engines choose at random whether they see through a surface
STEP = 4.0  # pixels: a greater difference in depth between neighbors is an edge
FEWEST_PIXELS = 20
DARK = 1e-3  # W/(m^2 sr), mean radiance below which a relative error says nothing


@dataclass(frozen=True)
class Difference:
    """The root mean square of a picture's difference from another over that of the other, in the interior of a material."""

    rms: float
    pixels: int


class Stage:
    """The open file's scene with one sun, no world and a camera that sees all meshes in `size` pixels a side."""

    def __init__(self, size: int, has_alpha: bool = False) -> None:
        self.scene = scene = bpy.context.scene
        self.size, self.has_alpha = size, has_alpha
        for item in scene.objects:
            if item.type in ("LIGHT", "LIGHT_PROBE"):
                item.hide_render = True
            # so that what emits lights nothing: Cycles follows one more ray than it has bounces to find that
            item.visible_diffuse = item.visible_glossy = item.visible_transmission = False
        scene.world = None
        center, self.radius = _bounds()
        add_sun(scene, "Census Sun", SUN, IRRADIANCE).data.use_shadow = False
        data = bpy.data.cameras.new("Census Camera")
        data.lens = LENS
        distance = self.radius / math.sin(0.5 * data.angle)
        data.clip_start, data.clip_end = 0.01 * distance, 10.0 * distance
        scene.camera = bpy.data.objects.new("Census Camera", data)
        scene.collection.objects.link(scene.camera)
        place = VIEW.to_track_quat("Z", "Y").to_matrix().to_4x4()
        place.translation = center + distance * VIEW
        scene.camera.matrix_world = place
        settings = scene.render
        settings.resolution_x = settings.resolution_y = size
        settings.resolution_percentage = 100
        settings.use_border = settings.use_compositing = settings.use_sequencer = settings.use_motion_blur = False
        settings.film_transparent = True
        settings.filter_size = 0.0
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", render.CENTER
        engines.leave_out_bounces(scene)
        scene.cycles.light_sampling_threshold = 0.0
        scene.cycles.use_fast_gi = False
        for index, material in enumerate(bpy.data.materials):
            if material.library is None:
                material.pass_index = index + 1
                material.cycles.emission_sampling = "NONE"
        layer = scene.view_layers[0]
        for other in list(scene.view_layers)[1:]:
            other.use = False
        layer.use_pass_material_index = layer.use_pass_z = True
        layer.material_override = None
        for modifier in (modifier for item in scene.objects for modifier in item.modifiers):
            modifier.show_viewport = modifier.show_render  # Realtime draws the viewport's meshes

    def draw(self, engine: engines.Engine) -> dict[str, array[float]]:
        """Return the passes of a render."""
        samples = SAMPLES if engine is engines.CYCLES else 1
        engines.use(self.scene, engine, ALPHA_SAMPLES if self.has_alpha else samples)
        culled = [material for material in bpy.data.materials if material.use_backface_culling and material.library is None]
        for material in culled:  # which Cycles does not know
            material.use_backface_culling = False
        try:
            return render.passes(self.scene)
        finally:
            for material in culled:
                material.use_backface_culling = True

    def compare(
        self, picture: dict[str, array[float]], reference: dict[str, array[float]], indices: dict[str, int]
    ) -> dict[str, Difference]:
        """Return how far a picture is from a `reference` that Cycles rendered, by material; `indices` have their pass indices."""
        index, depth = (_plane(reference, name) for name in ("Material Index.X", "Depth.Z"))
        got, wanted = (render.interleaved(each) for each in (picture, reference))
        if self.has_alpha:
            got, wanted = self._smoothed(got), self._smoothed(wanted)
        found = {}
        inside: dict[int, list[int]] = {}
        for pixel in self._interior(index, depth):
            inside.setdefault(round(index[pixel]), []).append(pixel)
        for name, number in indices.items():
            pixels = inside.get(number, [])
            if len(pixels) < FEWEST_PIXELS:
                continue
            values = [3 * pixel + channel for pixel in pixels for channel in range(3)]
            power = sum(wanted[i] ** 2 for i in values)
            if power < len(values) * DARK**2:
                power = len(values) * DARK**2
            found[name] = Difference(math.sqrt(sum((got[i] - wanted[i]) ** 2 for i in values) / power), len(pixels))
        return found

    def _smoothed(self, rgb: Sequence[float]) -> array[float]:
        """Return the mean of each pixel and the eight around it; of an interior pixel all show the same material."""
        size = self.size
        result = array("f", bytes(4 * len(rgb)))
        around = [3 * (row * size + column) for row in (-1, 0, 1) for column in (-1, 0, 1)]
        for y in range(1, size - 1):
            for index in range(3 * (y * size + 1), 3 * (y * size + size - 1)):
                result[index] = sum(rgb[index + offset] for offset in around) / len(around)
        return result

    def _interior(self, index: Sequence[float], depth: Sequence[float]) -> list[int]:
        """Return the pixels around which there is the same material without a step in depth."""
        size, step = self.size, STEP * 2.0 * self.radius / self.size
        around = [row * size + column for row in (-1, 0, 1) for column in (-1, 0, 1)]
        return [
            y * size + x
            for y in range(1, size - 1)
            for x in range(1, size - 1)
            if index[y * size + x] > 0.5
            and all(
                index[y * size + x + offset] == index[y * size + x]
                and abs(depth[y * size + x + offset] - depth[y * size + x]) < step
                for offset in around
            )
        ]


def _plane(channels: dict[str, array[float]], ending: str) -> array[float]:
    return next(values for key, values in channels.items() if key.endswith(ending))


def _bounds() -> tuple[Vector, float]:
    """Return the middle and radius of a sphere around all that a render shows of meshes."""
    corners = []
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        item = instance.object
        if item.type == "MESH" and not item.original.hide_render and item.data.polygons:
            corners += [instance.matrix_world @ Vector(corner) for corner in item.bound_box]
    if not corners:
        return Vector(), 1.0
    low, high = (Vector(limit(corner[axis] for corner in corners) for axis in range(3)) for limit in (min, max))
    return 0.5 * (low + high), max(0.5 * (high - low).length, 1e-6)
