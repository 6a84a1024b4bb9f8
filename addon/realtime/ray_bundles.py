# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounced light and the occlusion of the sky by ray bundles: all rays of a sample have one of a few directions.

L. Szirmay-Kalos and W. Purgathofer, "Global Ray-bundle Tracing" (1998); T. Hachisuka, "High-Quality Global Illumination Rendering
Using Rasterization" (GPU Gems 2, 2005). A parallel projection along a direction has the scene's surfaces in layers, peeled from the
farthest to the nearest, with the radiance that they send against it. So the first layer in front of a point is what its ray meets.
"""

import math
import operator
import struct
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product

import gpu
from mathutils import Matrix, Quaternion, Vector

from ..models.vector import Vector as Triple
from .driver import DriverError, bound, specular_table, uniform_buffer
from .driver_scene import DriverScene
from .program import MAX_BUNDLES, Variant, reads_table, surface_program
from .shadow_maps import ShadowMaps
from .view import View, matrix_to_bytes

SMALLEST, LARGEST = 128, 1024  # texels of a map's side, which otherwise is about as long as the picture's longer one
LAYERS = 4  # of surfaces behind each other; a point behind more of them meets the nearest of these
SHADOW_SIZE = 2048  # texels
# The points of a spiral over the sphere, in the order in which they are taken: so that at any time the cosine around any normal is
# integrated well by those that have been, the first 4, 8, 16, 32 and 64 of them with an RMS error of 10, 8, 4, 2 and 0.4 %, and by
# those of each sample (scripts/fit/bundle_directions.py).
# fmt: off
ORDER = (
    19, 18, 63, 25, 44, 51, 0, 37, 35, 16, 60, 15, 46, 32, 39, 4, 1, 53, 26, 41, 50, 10, 59, 14, 12, 40, 62, 21, 34, 38, 6, 36,
    3, 28, 55, 43, 23, 29, 56, 9, 5, 45, 57, 30, 42, 2, 49, 27, 48, 20, 52, 8, 17, 61, 24, 31, 22, 58, 33, 13, 47, 54, 7, 11,
)
# fmt: on
STEPS = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)  # fill a cube evenly: how the sphere turns for more points
TURN = 0.6180339887498949  # of a map from direction to direction, as a fraction of a turn, so that no texel stays where it is
FAR = 1e30  # m
SLACK = 1e-4  # of detail's longest side: its floor is within its box
EMPTY = (0.0, 0.0, 0.0, 0.0)  # a texel of a layer without a surface
FORMATS = ("RGBA16F", "RG32F")  # of the textures, as in shaders/realtime/ray_bundles.glsl
MARGIN = 2.0  # texels around what a map has to hold
# Where the scene is more than WIDER times as wide as the picture is at the nearest detail, as with a ground up to the horizon, what
# is up to REACH times as far away as that has maps of its own, and the rest those of OUTER of a sample's directions.
WIDER, REACH, OUTER = 8.0, 6.0, 1
LARGEST_DETAIL = 0.5  # of the scene's size: larger, it gains little
SURROUNDINGS = (0.25, 0.5)  # around detail, as a fraction of its longest side: others for each sample, so that no edge is seen
FADE_IN = 8  # samples of a picture that grows before the artist's eyes


class Bundle:
    """The map along a direction: `towards` is the unit vector along which its rays go, `texel` the width of a texel [m].

    `row` is the map's place in its texture, `matrix` takes a point of the world to its clip space. `sky` is the world's radiance
    there [W/(m^2 sr)].
    """

    def __init__(
        self, row: int, towards: Vector, sky: Triple, turn: float, size: int, seen: Sequence[Vector], met: Sequence[Vector]
    ) -> None:
        """Fit the projection, turned by so many turns around the rays, to the points `seen`, which send them, and to all `met`."""
        self.row, self.towards, self.sky = row, towards, sky
        turned = Matrix.Rotation(2.0 * math.pi * turn, 3, "Z")
        rotation = turned @ (-self.towards).to_track_quat("Z", "Y").to_matrix().inverted()
        points = [rotation @ point for point in seen]
        low, high = (Vector(pick(point[axis] for point in points) for axis in range(2)) for pick in (min, max))
        width = max(*(high - low), 1e-6) * (1.0 + MARGIN / size)
        near, far = max(point.z for point in points), min((rotation @ point).z for point in (*seen, *met))
        depth = max(near - far, 1e-6) * 1.001
        center = Vector((*((low + high) / 2.0), (near + far) / 2.0))
        scale = Matrix.Diagonal((2.0 / width, 2.0 / width, -2.0 / depth, 1.0))
        self.matrix = scale @ Matrix.Translation(-center) @ rotation.to_4x4()
        self.texel = width / size


@dataclass(frozen=True)
class Bundles:
    """The maps of a sample: `inner` ones of what is within the box from `low` to `high` [m], and `outer` ones of the rest.

    Where one map holds all, all are inner ones.
    """

    inner: Sequence[Bundle] = ()
    outer: Sequence[Bundle] = ()
    low: Triple = (-FAR, -FAR, -FAR)
    high: Triple = (FAR, FAR, FAR)

    def to_bytes(self, size: int, weight: float) -> bytes:
        """Return the struct Bundles of program.py, of maps of `size` texels a side, with light of a `weight`."""
        both = (*self.inner, *self.outer)
        missing = MAX_BUNDLES - len(both)
        # a plane that faces the rays of one direction gets as much as from that part of the sphere which stands for it
        irradiance = [weight * 4.0 * math.pi / len(some) for some in (self.inner, self.outer) for _ in some]
        matrices = b"".join(matrix_to_bytes(bundle.matrix) for bundle in both) + bytes(64 * missing)
        towards = b"".join(struct.pack("4f", *bundle.towards, bundle.texel) for bundle in both) + bytes(16 * missing)
        skies = (struct.pack("4f", *bundle.sky, each) for bundle, each in zip(both, irradiance, strict=True))
        sky = b"".join(skies) + bytes(16 * missing)
        return matrices + towards + sky + struct.pack("12f", *self.low, len(both), *self.high, len(self.inner), size, 0.0, 0.0, 0.0)


class RayBundles:
    """The maps of a sample's MAX_BUNDLES directions, below each other in one texture, and those of the sample before in another.

    The surfaces in a map get as much of the sky as the maps before say.
    """

    def __init__(self, scene: DriverScene) -> None:
        self._scene = scene
        self._shadow_maps = ShadowMaps(scene, SHADOW_SIZE)
        self._size = 0
        self._bundles = Bundles()

    def begin(self, view: View, sample: int) -> None:
        """Prepare for samples of `view` from a first one on. Raises DriverError where the driver has no memory for the maps."""
        bounds = self._scene.bounds
        size = 2 ** round(math.log2(max(view.width, view.height)))
        self._allocate(max(SMALLEST, min(size, LARGEST)))
        self._everything = _corners(bounds.everything if bounds else [])
        polygons = bounds.visible(view) if bounds else []
        seen = _corners([corner for polygon in polygons for corner in polygon])
        self._near = _grown(seen, self._everything, (seen[-1] - seen[0]) / 2.0) if seen else self._everything
        self._detail = self._find_detail(view)
        if not sample:
            self._bundles = Bundles()
        self._shadow_maps.begin_within([polygons, []], sample)

    def draw(self, sample: int, fades_in: bool) -> None:
        """Draw the maps of a sample; with `fades_in` the first FADE_IN samples grow in weight, from none."""
        before, self._bundles = self._bundles, Bundles()
        self._swap()
        weight = 2.0 * sample / (FADE_IN - 1) if fades_in and sample < FADE_IN else 1.0
        if self._everything and weight:
            self._shadow_maps.light(sample)
            self._bundles = self._fitted(sample)
            if not before.inner:  # as many as needed for the sky that the surfaces get
                before = self._bundles
                self._draw_maps(Bundles(), sample)
                self._swap()
            self._draw_maps(before, sample)
        self._block = uniform_buffer(self._bundles.to_bytes(self._size, weight))

    def _find_detail(self, view: View) -> list[Vector]:
        """Return the corners of the box around what `view` shows of small objects, and nearest; none where one map holds all."""
        bounds, everything = self._scene.bounds, self._everything
        polygons = bounds.visible_detail(view) if bounds else []
        if not polygons:
            return []
        row = view.depth_row()
        depths = [min(row.dot(corner.to_4d()) for corner in polygon) if view.is_perspective else 1.0 for polygon in polygons]
        width = max(map(operator.mul, view.pixel_size(), (view.width, view.height))) * min(depths)
        near = [polygon for polygon, depth in zip(polygons, depths, strict=True) if depth <= REACH * min(depths)]
        detail = _corners([corner for polygon in near for corner in polygon])
        size = (everything[-1] - everything[0]).length
        longest = max(detail[-1] - detail[0]) * (1.0 + 2.0 * max(SURROUNDINGS))
        return detail if size > WIDER * width and longest < LARGEST_DETAIL * size else []

    def _fitted(self, sample: int) -> Bundles:
        """Return the maps of a sample, to be drawn."""

        def fitted(count: int, row: int, seen: Sequence[Vector]) -> list[Bundle]:
            return [Bundle(row + k, *self._direction(count * sample + k), self._size, seen, self._everything) for k in range(count)]

        if not self._detail:
            return Bundles(fitted(MAX_BUNDLES, 0, self._near))
        least, most = SURROUNDINGS
        longest, count = max(self._detail[-1] - self._detail[0]), MAX_BUNDLES - OUTER
        by, slack = longest * (least + (most - least) * (TURN * sample % 1.0)), Vector((SLACK * longest,) * 3)
        around = _grown(self._detail, self._everything, Vector((by,) * 3))
        low, high = tuple(around[0] - slack), tuple(around[-1] + slack)
        return Bundles(fitted(count, 0, around), fitted(OUTER, count, self._everything), low, high)

    def _swap(self) -> None:
        """Make the maps of this sample those of the sample before, and the others empty."""
        self._maps.reverse()
        self._buffers.reverse()
        for buffer in self._buffers[0]:
            with buffer.bind():
                gpu.state.depth_mask_set(True)
                buffer.clear(color=EMPTY, depth=0.0)

    def _direction(self, number: int) -> tuple[Vector, Triple, float]:
        """Return the unit vector of a direction, the world's radiance from there [W/(m^2 sr)], and how its map is turned."""
        scene, (block, place) = self._scene, divmod(number, len(ORDER))
        towards = _fibonacci(ORDER[place], len(ORDER))
        if block:
            towards = _rotation(*((0.5 + block * step) % 1.0 for step in STEPS)) @ towards
        sky = scene.cache.world if scene.cache.environment.is_even else scene.world.radiance(towards)
        return towards, sky, TURN * number

    def give(self, shader: gpu.types.GPUShader) -> None:
        """Have `shader` read the maps."""
        shader.uniform_block("bundles", self._block)
        self._give_maps(shader, 0)

    def _allocate(self, size: int) -> None:
        """Make the textures: a row for each map, of its layers. Their depths are in two by turns, as each reads the one before."""
        if self._size == size:
            return
        self._size, self._extent = 0, (LAYERS * size, MAX_BUNDLES * size)
        try:
            self._maps = [
                tuple(gpu.types.GPUTexture(self._extent, format=texel_format) for texel_format in FORMATS) for _ in range(2)
            ]
            self._depths = [gpu.types.GPUTexture(self._extent, format="DEPTH_COMPONENT32F") for _ in range(2)]
            self._buffers = [
                [gpu.types.GPUFrameBuffer(depth_slot=depth, color_slots=textures) for depth in self._depths]
                for textures in self._maps
            ]
        except (RuntimeError, ValueError, MemoryError) as error:
            raise DriverError("The graphics driver has no room for bounced light") from error
        self._size = size

    def _draw_maps(self, before: Bundles, sample: int) -> None:
        """Draw the sample's maps, whose surfaces see the sky by the maps `before`."""
        before_block = uniform_buffer(before.to_bytes(self._size, 1.0))
        for bundle in (*self._bundles.inner, *self._bundles.outer):
            self._draw_layers(bundle, before_block, sample)

    def _draw_layers(self, bundle: Bundle, before_block: gpu.types.GPUUniformBuf, sample: int) -> None:
        """Draw the map of `bundle`."""
        scene, size = self._scene, self._size
        view = View(bundle.matrix, -bundle.towards, False, size, size)
        view_block = uniform_buffer(view.to_bytes(scene.cache.world, MAX_BUNDLES * sample + bundle.row))
        gpu.state.blend_set("NONE")
        gpu.state.face_culling_set("NONE")
        gpu.state.depth_test_set("GREATER")
        gpu.state.depth_mask_set(True)
        for layer in range(LAYERS):
            buffer = self._buffers[0][layer % 2]
            with buffer.bind():
                buffer.viewport_set(layer * size, bundle.row * size, size, size)
                for variant, material, parts in scene.layers:
                    shader = bound(surface_program, variant)
                    scene.give_inputs(shader, view_block, material.code)
                    shader.uniform_sampler("farther_map", self._depths[(layer + 1) % 2])
                    shader.uniform_int("layer", (layer, size))
                    self._give_light(shader, variant, before_block)
                    for part in parts:
                        scene.draw_part(shader, part)
                buffer.viewport_set(0, 0, *self._extent)
        gpu.state.depth_test_set("NONE")

    def _give_light(self, shader: gpu.types.GPUShader, variant: Variant, before_block: gpu.types.GPUUniformBuf) -> None:
        """Have `shader` read what lights a layer; the compiler drops what it does not use."""
        self._shadow_maps.give(shader, variant.lighting)
        if variant.lighting.world_map:
            self._scene.world.give(shader)
        if reads_table(variant.features):
            with suppress(ValueError):
                shader.uniform_sampler("specular_table", specular_table())
        if variant.lighting.bounce:
            shader.uniform_block("bundles", before_block)
            self._give_maps(shader, 1)

    def _give_maps(self, shader: gpu.types.GPUShader, before: int) -> None:
        """Have `shader` read the maps of this sample, or for 1 those before."""
        for name, texture in zip(("bundle_map", "bundle_depths"), self._maps[before], strict=True):
            shader.uniform_sampler(name, texture)


def _fibonacci(number: int, count: int) -> Vector:
    """Return the unit vector of one of `count` points of a spiral, which are evenly spread over the sphere."""
    z, angle = 1.0 - (2.0 * number + 1.0) / count, 2.0 * math.pi * TURN * number
    across = math.sqrt(1.0 - z * z)
    return Vector((across * math.cos(angle), across * math.sin(angle), z))


def _rotation(u: float, v: float, w: float) -> Matrix:
    """Return the rotation for a point of a cube; all are equally likely. K. Shoemake, "Uniform Random Rotations" (1992)."""
    a, b = math.sqrt(1.0 - u), math.sqrt(u)
    v, w = 2.0 * math.pi * v, 2.0 * math.pi * w
    return Quaternion((b * math.cos(w), a * math.sin(v), a * math.cos(v), b * math.sin(w))).to_matrix()


def _corners(points: Sequence[Vector]) -> list[Vector]:
    """Return the corners of the box around `points`, none without points."""
    if not points:
        return []
    return [Vector(corner) for corner in product(*((min(values), max(values)) for values in zip(*points, strict=True)))]


def _grown(near: Sequence[Vector], everything: Sequence[Vector], by: Vector) -> list[Vector]:
    """Return the corners of the box of corners `near`, on each side larger `by` that [m], within the box of `everything`."""
    corners = (tuple(map(max, near[0] - by, everything[0])), tuple(map(min, near[-1] + by, everything[-1])))
    return [Vector(corner) for corner in product(*zip(*corners, strict=True))]
