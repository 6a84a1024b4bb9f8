# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a scene with Blender's gpu module: shadow maps, surfaces, subsurface scattering, and the mean of all samples."""

import math
import struct
from collections.abc import Iterator

import bpy

import gpu

from ..blender.glsl import triangle
from . import shadows
from .data_passes import DataPasses
from .driver import PROGRAM_LOCK, TRANSPARENT, DriverError, Rgba, bound, compiled, specular_table, uniform_buffer
from .driver_scene import DriverScene
from .expressions import Code
from .materials import HOLDOUT
from .not_drawn import Omission
from .program import (
    Variant,
    accumulate_program,
    depth_program,
    gather_maps,
    reads_table,
    resolve_program,
    subsurface_gather_program,
    surface_program,
)
from .ray_bundles import RayBundles
from .scene_cache import SceneCache
from .shadow_maps import ShadowMaps
from .view import View, matrix_to_bytes

GATHER_STEPS = (0.8191725133961645, 0.6710436067037893)  # a sequence that fills a square evenly, other than view.sample_offset's


class RenderTargets:
    """The textures and framebuffers of a picture of `width` x `height` pixels; the gather pass, if there is one, reads `maps`."""

    def __init__(self, width: int, height: int, maps: tuple[str, ...]) -> None:
        """Allocate them. Raises DriverError where the driver has no memory for them."""
        self.width, self.height, self.maps = width, height, maps
        try:
            self.colors = [self.texture() for _ in maps or ("radiance_map",)]
            self.depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
            self.surface_buffer = gpu.types.GPUFrameBuffer(depth_slot=self.depth, color_slots=self.colors)
            self.sample = self.texture() if maps else self.colors[0]
            self.gather_buffer = gpu.types.GPUFrameBuffer(color_slots=self.sample)
            self.sum = self.texture()
            self.sum_buffer = gpu.types.GPUFrameBuffer(color_slots=self.sum)
        except (RuntimeError, ValueError, MemoryError) as error:
            raise DriverError(f"The graphics driver has no room for a picture of {width} x {height} pixels") from error

    def texture(self) -> gpu.types.GPUTexture:
        """Return a new texture of the picture's size, of 32-bit floats."""
        return gpu.types.GPUTexture((self.width, self.height), format="RGBA32F")


class Renderer:
    """Draws the scene of `cache`, and keeps on the driver what does not change between pictures."""

    def __init__(self, cache: SceneCache) -> None:
        self.cache = cache
        self._scene = DriverScene(cache)
        self._shadow_maps = ShadowMaps(self._scene, shadows.MAP_SIZE)
        self._bundles = RayBundles(self._scene)
        self._triangle = triangle()
        self._allocated: RenderTargets | None = None
        self._samples = 0

    @property
    def warnings(self) -> list[Omission]:
        """What the pictures lack because of the driver."""
        return self._scene.warnings

    @property
    def _targets(self) -> RenderTargets:
        if self._allocated is None:
            raise RuntimeError("begin has not been called")
        return self._allocated

    @property
    def _maps(self) -> tuple[str, ...]:
        """What the gather pass reads, nothing where there is none."""
        return gather_maps(self.cache.lighting().shadows) if self.cache.has_subsurface else ()

    @property
    def _least(self) -> float:
        """The least radiance of a picture [W/(m^2 sr)].

        Few directions of bounced light may take away more of the sky than there is, from what sees little of it; where nothing
        takes light away, as lights of negative power do, that is none.
        """
        cache = self.cache
        shining = (*cache.world, *(strength for light in cache.lights for strength in light.strength))
        return 0.0 if cache.bounces_light and min(shining) >= 0.0 else -1e30

    def refresh(self) -> bool:
        """Send to the driver what has changed in `cache` or in the pixels of its images; return whether there is anything."""
        return self._scene.refresh()

    def compile(self) -> Iterator[str]:
        """Compile the shaders in use; yields a message before each, as it may take a moment. Raises DriverError."""
        for variant in dict.fromkeys(variant for variant, _, _ in (*self._scene.draws, *self._scene.layers)):
            yield f"Compiling {variant.model.stem}"
            compiled(surface_program, variant)

    def begin(self, view: View, starts_coarse: bool = False) -> None:
        """Start an empty picture of `view`, and draw the shadow maps. Raises DriverError.

        With `starts_coarse` the first sample ever has coarser shadow maps, for which a driver needs less time.
        """
        size = (view.width, view.height, self._maps)
        if self._allocated is None or (self._allocated.width, self._allocated.height, self._allocated.maps) != size:
            self._allocated = None  # freed first, as the driver may not have room for both
            self._allocated = RenderTargets(*size)
        self._targets.sum.clear(format="FLOAT", value=TRANSPARENT)
        self._samples = 0
        self._prepare(view, starts_coarse=starts_coarse)

    def move(self, view: View, sample: int) -> None:
        """Go on with the picture from a sample on, of the scene and the view as they are now. Raises DriverError."""
        self.refresh()
        before = self._targets
        if before.maps != self._maps:
            self._allocated = RenderTargets(before.width, before.height, self._maps)
            self._allocated.sum, self._allocated.sum_buffer = before.sum, before.sum_buffer
        self._prepare(view, sample)

    def _prepare(self, view: View, sample: int = 0, starts_coarse: bool = False) -> None:
        """Draw what samples of `view` from a first one on read."""
        with PROGRAM_LOCK:
            if any(reads_table(variant.features) for variant, _, _ in self._scene.draws):
                specular_table()  # now, as it has a framebuffer of its own
            self._shadow_maps.begin(view, sample, starts_coarse)
            if self._scene.layers:
                self._bundles.begin(view, sample)

    def add(self, view: View, sample: int, filter_size: float, background: Rgba | Code, fades_in: bool = False) -> None:
        """Draw one sample of every pixel over `background` and add it to the picture; `filter_size` is in pixels.

        With `fades_in` the first samples have little bounced light, as few of its directions would show.
        """
        sampled = view.at_sample(sample, filter_size)
        with PROGRAM_LOCK:
            if sample:
                self._shadow_maps.light(sample)
            if self._scene.layers:
                self._bundles.draw(sample, fades_in)
            self._draw_surfaces(self._targets, sampled, sample, background if isinstance(background, Code) else None)
            if self._targets.maps:
                self._gather_subsurface(self._targets, sampled, sample)
            self._accumulate(self._targets, TRANSPARENT if isinstance(background, Code) else background)
        self._samples += 1

    def data_passes(self, depsgraph: bpy.types.Depsgraph, view: View) -> DataPasses:
        """Return the passes that the view layer of `depsgraph` asks for of a picture of `view`. Raises DriverError."""
        return DataPasses(self._scene, depsgraph, view.width, view.height)

    def show(self, x: int = 0, y: int = 0) -> None:
        """Draw the picture so far into the bound framebuffer, whose viewport has its size and its corner at `x`, `y` [pixels]."""
        with PROGRAM_LOCK:
            shader = bound(resolve_program)
            shader.uniform_sampler("sum_map", self._targets.sum)
            shader.uniform_float("weight", 1.0 / self._samples)
            shader.uniform_float("corner", (x, y))
            shader.uniform_float("least", self._least)
            self._triangle.draw(shader)
            gpu.shader.unbind()  # else Blender keeps what forget_shaders frees

    def show_blended(self, x: int, y: int) -> None:
        """Draw the picture so far over the window, its corner at the bottom left at `x`, `y` [pixels]."""
        left, bottom, width, height = gpu.state.viewport_get()
        gpu.state.viewport_set(left + x, bottom + y, self._targets.width, self._targets.height)
        gpu.state.blend_set("ALPHA_PREMULT")
        self.show(left + x, bottom + y)
        gpu.state.blend_set("NONE")
        gpu.state.viewport_set(left, bottom, width, height)

    def read(self) -> gpu.types.Buffer:
        """Return the picture so far: red, green, blue, alpha of each pixel, rows from the bottom."""
        targets = self._targets
        resolved = targets.texture()
        with gpu.types.GPUFrameBuffer(color_slots=resolved).bind():
            self.show()
        pixels = resolved.read()
        pixels.dimensions = 4 * targets.width * targets.height
        return pixels

    def read_distances(self, view: View) -> gpu.types.Buffer:
        """Return how far the last sample's surfaces are along the axis of `view` [m], 1e10 without one; rows from the bottom."""
        targets = self._targets
        found = gpu.types.GPUTexture((targets.width, targets.height), format="R32F")
        with PROGRAM_LOCK, gpu.types.GPUFrameBuffer(color_slots=found).bind():
            shader = bound(depth_program)
            shader.uniform_sampler("depth_map", targets.depth)
            shader.uniform_float("distances", view.distances)
            self._triangle.draw(shader)
            gpu.shader.unbind()  # else Blender keeps what forget_shaders frees
        distances = found.read()
        distances.dimensions = targets.width * targets.height
        return distances

    def _draw_surfaces(self, targets: RenderTargets, view: View, sample: int, background: Code | None) -> None:
        """Draw the nearest surface of every pixel, and the world in those without one."""

        def shader(variant: Variant) -> gpu.types.GPUShader:
            found = bound(surface_program, variant)
            if HOLDOUT not in variant.features:
                if variant.lighting.world_map:
                    self._scene.world.give(found)
                self._shadow_maps.give(found, variant.lighting)
                if variant.lighting.bounce:
                    self._bundles.give(found)
                if reads_table(variant.features):
                    found.uniform_sampler("specular_table", specular_table())
            return found

        with targets.surface_buffer.bind():
            self._scene.draw_surfaces(targets.surface_buffer, view, sample, shader)
            if background is not None:
                self._scene.world.draw_background(background, view, bool(targets.maps))
            gpu.state.depth_test_set("NONE")

    def _gather_subsurface(self, targets: RenderTargets, view: View, sample: int) -> None:
        """Add the light that scattered below the surfaces to the sample."""
        # by how much the pattern on the disk is turned and its radii are moved, as fractions of a turn and of a step
        turn, step = (sample * advance % 1.0 for advance in GATHER_STEPS)
        ambient = (math.pi * radiance for radiance in self.cache.world)
        data = matrix_to_bytes(view.projection) + matrix_to_bytes(view.from_pixel())
        data += struct.pack("12f", *view.depth_row(), *view.eye, 0.0, *ambient, 0.0)
        data += struct.pack("8f", view.width, view.height, *view.pixel_size(), turn, step, view.is_perspective, 0.0)
        lighting = self.cache.lighting()
        with targets.gather_buffer.bind():
            shader = bound(subsurface_gather_program, lighting.types if lighting.shadows else frozenset())
            block = uniform_buffer(data)  # in a variable, as Blender does not keep it until the draw
            shader.uniform_block("gather", block)
            for name, texture in zip(targets.maps, targets.colors, strict=True):
                shader.uniform_sampler(name, texture)
            if lighting.shadows:
                self._shadow_maps.give(shader, lighting)
            self._triangle.draw(shader)

    def _accumulate(self, targets: RenderTargets, background: Rgba) -> None:
        """Add the sample over `background` to the sum."""
        with targets.sum_buffer.bind():
            gpu.state.depth_test_set("NONE")
            gpu.state.depth_mask_set(False)
            gpu.state.blend_set("ADDITIVE_PREMULT")
            shader = bound(accumulate_program)
            shader.uniform_sampler("radiance_map", targets.sample)
            shader.uniform_float("background", background)
            self._triangle.draw(shader)
            gpu.state.blend_set("NONE")
