# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of what surfaces are, drawn without their light: normals, colors, positions, numbers."""

from array import array
from collections.abc import Iterator
from dataclasses import replace

import bpy

import gpu

from ..blender.glsl import triangle
from .driver import PROGRAM_LOCK, TRANSPARENT, DriverError, bound, specular_table
from .driver_scene import OBJECTS_ACROSS, DriverScene
from .materials import HOLDOUT
from .passes import DataPass, asked
from .program import Data, Lighting, Variant, accumulate_program, reads_table, surface_program
from .view import View

CHANNELS = 4  # of a texture


class DataPasses:
    """The passes that the view layer of `depsgraph` asks for, of a picture of `width` x `height` pixels of `scene`."""

    def __init__(self, scene: DriverScene, depsgraph: bpy.types.Depsgraph, width: int, height: int) -> None:
        """Allocate their textures. Raises DriverError where the driver has no memory for them."""
        self._scene, self._depsgraph = scene, depsgraph
        self._passes = list(asked(depsgraph.view_layer))
        self._samples = 0
        try:
            self._sums = {data: _texture(width, height) for data in self._passes}
            if self._passes:
                self._sample = _texture(width, height)
                self._depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
                self._buffer = gpu.types.GPUFrameBuffer(depth_slot=self._depth, color_slots=self._sample)
        except (RuntimeError, ValueError, MemoryError) as error:
            raise DriverError(f"The graphics driver has no room for the passes of {width} x {height} pixels") from error
        for texture in self._sums.values():
            texture.clear(format="FLOAT", value=TRANSPARENT)

    def add(self, view: View, sample: int) -> None:
        """Draw a sample of `view`, and add it to each pass of which it is a part."""
        with PROGRAM_LOCK:
            for data, total in self._sums.items():
                if data.is_mean or not self._samples:
                    self._draw(data, view, sample)
                    _add(self._sample, total)
        self._samples += 1

    def read(self) -> Iterator[tuple[DataPass, array[float]]]:
        """Yield each pass with its values, pixel by pixel, rows from the bottom."""
        for data, total in self._sums.items():
            pixels = array("f", memoryview(total.read()).cast("B").cast("f"))
            count, width = (self._samples if data.is_mean else 1), len(data.channels)
            values = array("f", bytes(4 * width * (len(pixels) // CHANNELS)))
            for channel in range(width):
                values[channel::width] = array("f", (value / count for value in pixels[channel::CHANNELS]))
            yield data, values

    def _draw(self, data: DataPass, view: View, sample: int) -> None:
        """Draw what a sample shows of a pass."""
        threshold = None if data.follows_opacity else self._depsgraph.view_layer.pass_alpha_threshold
        written = Data(data.value, threshold)
        numbers = self._numbers(data) if written.has_number else None

        def shader(variant: Variant) -> gpu.types.GPUShader:
            found = bound(surface_program, replace(variant, lighting=Lighting(), subsurface_in_scene=False, data=written))
            if reads_table(variant.features) and HOLDOUT not in variant.features:
                found.uniform_sampler("specular_table", specular_table())
            if numbers:
                found.uniform_sampler("numbers", numbers)
            return found

        with self._buffer.bind():
            self._scene.draw_surfaces(self._buffer, view, sample, shader)
            gpu.state.depth_test_set("NONE")

    def _numbers(self, data: DataPass) -> gpu.types.GPUTexture:
        """Return the texture of the pass index of each object, or of its material, in the order of the texture of matrices."""
        groups = self._scene.cache.groups.items()
        if data.setting == "use_pass_object_index":
            of_objects = [instance.object.pass_index for instance in self._depsgraph.object_instances]
            found = array("f", (of_objects[index] for _, group in groups for index in group))
        else:
            of_materials = {material.session_uid: material.pass_index for material in bpy.data.materials}
            found = array("f", (of_materials.get(part.material, 0) for part, group in groups for _ in group))
        rows = -(-len(found) // OBJECTS_ACROSS) or 1
        found.frombytes(bytes(4 * (rows * OBJECTS_ACROSS - len(found))))
        return gpu.types.GPUTexture((OBJECTS_ACROSS, rows), format="R32F", data=gpu.types.Buffer("FLOAT", len(found), found))


def _add(sample: gpu.types.GPUTexture, total: gpu.types.GPUTexture) -> None:
    with gpu.types.GPUFrameBuffer(color_slots=total).bind():
        gpu.state.blend_set("ADDITIVE_PREMULT")
        shader = bound(accumulate_program)
        shader.uniform_sampler("radiance_map", sample)
        shader.uniform_float("background", TRANSPARENT)
        triangle().draw(shader)
        gpu.state.blend_set("NONE")


def _texture(width: int, height: int) -> gpu.types.GPUTexture:
    return gpu.types.GPUTexture((width, height), format="RGBA32F")
