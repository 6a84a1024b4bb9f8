# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights as one sample of a picture sees them, and their shadow maps on the graphics driver."""

from collections import Counter
from collections.abc import Sequence
from itertools import zip_longest

import gpu
from mathutils import Vector

from . import shadows
from .driver import bound, uniform_buffer, use_depth_test
from .driver_scene import DriverScene
from .expressions import Code
from .lights import Light, lights_to_bytes
from .objects import Part
from .program import Inputs, Lighting, shadow_program, strip_shadow_program, transparent_shadow_program
from .scene_bounds import SceneBounds
from .shadow_bounds import Polygon, ShadowBounds
from .view import View

COARSE = 2  # by which the first maps are smaller
FAR = (1e30, 1e30, 1e30, 1e30)


class ShadowMaps:
    """The lights of `scene` and their shadow maps, which are drawn anew where something in them has changed.

    All are together on a square of `size` texels.
    """

    def __init__(self, scene: DriverScene, size: int) -> None:
        self._scene = scene
        self._size = size
        self._regions: list[ShadowBounds] = []  # of the picture
        self._lights: gpu.types.GPUUniformBuf | None = None
        self._sampled: list[Light] = []  # as the last sample saw them
        self._tiles: list[shadows.Tile] = []
        self._caster_version = -1  # of the scene that has been drawn
        self._is_marked = False  # by the objects it shows, for the light through their surfaces
        self._map: gpu.types.GPUTexture | None = None
        self._is_coarse = False  # for the next sample
        self._is_stale = True  # since the scene or the view has changed

    def begin(self, view: View, sample: int = 0, starts_coarse: bool = False) -> None:
        """Prepare for samples of `view` from a first one on; with `starts_coarse` its maps are smaller if there are none yet."""
        self._is_coarse = starts_coarse and self._map is None
        bounds = self._scene.bounds
        self._is_marked = self._scene.cache.has_subsurface
        self.begin_within([self._visible(bounds, view) if bounds else []], sample)

    def begin_within(self, regions: Sequence[Sequence[Polygon]], sample: int) -> None:
        """Prepare for samples from a first one on, with shadows of what is within polygons, the best in the first of `regions`."""
        bounds = self._scene.bounds
        has_shadows = bounds is not None and self._scene.cache.lighting().shadows
        self._regions = []
        if bounds and has_shadows:
            self._regions = [ShadowBounds(bounds.casters, region, bounds.caster_boxes) for region in regions]
        self._is_stale = True
        self.light(sample)

    def _visible(self, bounds: SceneBounds, view: View) -> list[list[Vector]]:
        """Return what is seen of `bounds`, and beside the picture as far as light comes into it below a surface."""
        seen = bounds.visible(view)
        reach = self._scene.cache.subsurface_reach
        if not seen or reach == 0.0:
            return seen
        depth = view.depth_row()
        return bounds.visible(view.widened(reach, min(depth.dot(point.to_4d()) for polygon in seen for point in polygon)))

    def light(self, sample: int) -> None:
        """Send the lights as a sample sees them and draw their shadow maps, unless they are up to date."""
        scene = self._scene
        changes = scene.has_transparent_casters or any(light.is_soft for light in scene.cache.lights)
        if not (self._is_stale or changes):
            return
        size = self._size // COARSE if self._is_coarse else self._size
        self._is_stale, self._is_coarse = self._is_coarse, False
        lights = [light.at_sample(sample, index) for index, light in enumerate(scene.cache.lights)]
        tiles = shadows.shadow_tiles(lights, self._regions, size, self._is_marked) if self._regions else []
        before, self._tiles = self._tiles, tiles
        if self._lights is None or lights != self._sampled or tiles != before:
            self._sampled = lights
            counts = Counter(tile.light for tile in tiles)
            self._lights = uniform_buffer(lights_to_bytes(lights, [counts[index] for index in range(len(lights))]))
        if not self._regions:
            return
        is_new = self._allocate(tiles) or scene.caster_version != self._caster_version or scene.has_transparent_casters
        self._caster_version = scene.caster_version
        same = [not is_new and tile == old for tile, old in zip_longest(tiles, before[: len(tiles)])]
        if not all(same):
            self._draw([tile for tile, is_same in zip(tiles, same, strict=True) if not is_same], sample)

    def give(self, shader: gpu.types.GPUShader, lighting: Lighting) -> None:
        """Have `shader` read the lights and, where `lighting` has them, their shadow maps."""
        shader.uniform_block("lights", self._lights)
        if lighting.shadows:
            shader.uniform_sampler("shadow_map", self._map)
            shader.uniform_sampler("shadow_tiles", self._places)

    def _allocate(self, tiles: Sequence[shadows.Tile]) -> bool:
        """Make the shadow map large enough for `tiles`, and the texture that says where they are; return whether the map is new."""
        size = max((tile.x + tile.size for tile in tiles), default=1), max((tile.y + tile.size for tile in tiles), default=1)
        texel_format = "RG32F" if self._is_marked else "R32F"
        is_new = self._map is None or (self._map.width, self._map.height, self._map.format) != (*size, texel_format)
        if is_new:
            self._map = gpu.types.GPUTexture(size, format=texel_format)
            # kept, as a framebuffer does not keep its textures
            self._depth = gpu.types.GPUTexture(size, format="DEPTH_COMPONENT32F")
            self._buffer = gpu.types.GPUFrameBuffer(depth_slot=self._depth, color_slots=self._map)
        rows = b"".join(tile.to_bytes() for tile in tiles) or bytes(16 * shadows.Tile.TEXELS)
        data = gpu.types.Buffer("FLOAT", len(rows) // 4, memoryview(rows).cast("f"))
        self._places = gpu.types.GPUTexture((shadows.Tile.TEXELS, len(tiles) or 1), format="RGBA32F", data=data)
        return is_new

    def _draw(self, tiles: Sequence[shadows.Tile], sample: int) -> None:
        """Draw `tiles` of the shadow map anew, transparent casters as this sample sees them."""
        scene = self._scene
        with self._buffer.bind():
            use_depth_test()
            gpu.state.scissor_test_set(True)
            for tile in tiles:
                casters = scene.casters
                if not self._sampled[tile.light].casts_shadow:  # nothing is before what its light comes through
                    casters = [(part, code) for part, code in casters if scene.cache.materials[part.material].has_subsurface]
                opaque = [part for part, code in casters if code is None]
                meshes, strips = ([part for part in opaque if part.is_strip == is_strip] for is_strip in (False, True))
                transparent = [(part, code) for part, code in casters if code is not None]
                self._buffer.viewport_set(tile.x, tile.y, tile.size, tile.size)
                gpu.state.scissor_set(tile.x, tile.y, tile.size, tile.size)
                self._buffer.clear(color=FAR, depth=1.0)
                for parts in filter(None, (meshes, strips)):
                    shader = bound(strip_shadow_program) if parts is strips else bound(shadow_program, self._is_marked)
                    scene.give_objects(shader)
                    shader.uniform_float("matrix", tile.matrix)
                    if parts is strips:
                        light = self._sampled[tile.light]
                        shader.uniform_float("eye", (*light.axis, 0.0) if light.kind == "SUN" else (*light.position, 1.0))
                    for part in parts:
                        scene.draw_part(shader, part)
                if transparent:
                    self._draw_transparent(tile, transparent, sample)
            gpu.state.scissor_test_set(False)
            self._buffer.viewport_set(0, 0, self._depth.width, self._depth.height)

    def _draw_transparent(self, tile: shadows.Tile, casting: Sequence[tuple[Part, Code]], sample: int) -> None:
        """Draw into a light's part of the shadow map where this sample does not see through."""
        light = self._sampled[tile.light]
        is_sun = light.kind == "SUN"
        view = View(tile.matrix, Vector(light.axis if is_sun else light.position), not is_sun, tile.size, tile.size)
        view_block = uniform_buffer(view.to_bytes(self._scene.cache.world, sample))
        for part, code in casting:
            shader = bound(transparent_shadow_program, Inputs.of(code, part.is_strip), self._is_marked)
            self._scene.give_inputs(shader, view_block, code)
            self._scene.draw_part(shader, part)
