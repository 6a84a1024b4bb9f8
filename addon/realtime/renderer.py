# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a scene with Blender's gpu module: shadow maps, surfaces, subsurface scattering, and the mean of all samples."""

import atexit
import struct
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from itertools import accumulate
from threading import RLock

import gpu
from mathutils import Vector

from ..blender.glsl import triangle
from . import shadows
from .expressions import Code, Image
from .lights import Light, lights_to_bytes
from .materials import HOLDOUT, RenderMaterial, values_to_bytes
from .not_drawn import Omission
from .objects import MATRIX_BYTES, MATRIX_SIZE, Part
from .program import (
    GATHER_MAPS,
    Inputs,
    Program,
    Variant,
    accumulate_program,
    depth_program,
    reads_table,
    resolve_program,
    shadow_program,
    specular_table_program,
    struct_declarations,
    subsurface_gather_program,
    surface_program,
    transparent_shadow_program,
)
from .scene_bounds import SceneBounds
from .scene_cache import SceneCache
from .view import View, sample_offset

TRANSPARENT = (0.0, 0.0, 0.0, 0.0)
MISSING = (1.0, 0.0, 1.0, 1.0)  # the color of missing images in Blender
SPECULAR_TABLE_SIZE = (32, 32 * 16 + 1)  # as in shaders/realtime/specular_table.glsl
OBJECTS_ACROSS = 256  # in a row of the texture of matrices, as in shaders/realtime/objects.glsl
FAR = (1e30, 1e30, 1e30, 1e30)
GATHER_STEPS = (0.8191725133961645, 0.6710436067037893)  # a sequence that fills a square evenly, other than sample_offset's

# Held while a program draws. Drivers keep the values of uniforms with the program, which a viewport and a render in another thread
# share.
PROGRAM_LOCK = RLock()

type Rgba = tuple[float, float, float, float]


class DriverError(Exception):
    """The graphics driver refuses something; the message says what."""


class RenderTargets:
    """The textures and framebuffers of a picture of `width` x `height` pixels, with `subsurface` also those of the gather pass."""

    def __init__(self, width: int, height: int, subsurface: bool) -> None:
        """Allocate them. Raises DriverError where the driver has no memory for them."""
        self.width, self.height, self.subsurface = width, height, subsurface
        try:
            self.colors = [self.texture() for _ in range(len(GATHER_MAPS) if subsurface else 1)]
            self.depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
            self.surface_buffer = gpu.types.GPUFrameBuffer(depth_slot=self.depth, color_slots=self.colors)
            self.sample = self.texture() if subsurface else self.colors[0]
            self.gather_buffer = gpu.types.GPUFrameBuffer(color_slots=self.sample)
            self.sum = self.texture()
            self.sum_buffer = gpu.types.GPUFrameBuffer(color_slots=self.sum)
        except (RuntimeError, ValueError, MemoryError) as error:
            raise DriverError(f"The graphics driver has no room for a picture of {width} x {height} pixels") from error

    def texture(self) -> gpu.types.GPUTexture:
        """Return a new texture of the picture's size, of 32-bit floats."""
        return gpu.types.GPUTexture((self.width, self.height), format="RGBA32F")


class Renderer:
    """Draws the scene of `cache`, and keeps on the driver what does not change between pictures.

    `warnings` say what the pictures lack because of the driver.
    """

    def __init__(self, cache: SceneCache) -> None:
        self.cache = cache
        self.warnings: list[Omission] = []
        self._triangle = triangle()
        self._values: dict[Code, gpu.types.GPUUniformBuf] = {}
        self._images: dict[Image, gpu.types.GPUTexture] = {}
        self._allocated: RenderTargets | None = None
        self._shadow_map: gpu.types.GPUTexture | None = None
        self._tiles: list[shadows.Tile] | None = None
        self._version = -1  # of `cache` that has been sent
        self._groups: dict[Part, list[int]] = {}
        self._matrices: array[float] | None = None
        self._sampled: list[Light] = []  # as the last sample saw them
        self._visible: list[Vector] = []  # SceneBounds.visible of the picture
        self._casting: object = None  # what casts shadows, and where
        self._first: list[int] = []  # the index of the first object of each group in the texture of matrices
        self._calls: dict[
            Part, tuple[gpu.types.GPUBatch, int, int]
        ] = {}  # what draws a part: its batch, first and number of objects
        self._bounds: SceneBounds | None = None
        self._draws: list[tuple[Variant, RenderMaterial, list[Part]]] = []
        self._has_transparent_shadows = False
        self._shadow_codes: dict[int, Code | None] = {}  # of the materials, by their keys
        self._samples = 0

    @property
    def _targets(self) -> RenderTargets:
        if self._allocated is None:
            raise RuntimeError("begin has not been called")
        return self._allocated

    def refresh(self) -> bool:
        """Send to the driver what has changed in `cache` or in the pixels of its images; return whether there is anything."""
        cache = self.cache
        are_images_changed = self._refresh_images()
        if cache.version == self._version:
            return are_images_changed
        self._version = cache.version
        materials = dict.fromkeys(cache.materials.values())
        codes = dict.fromkeys(code for material in materials for code in (material.code, material.shadow_code) if code is not None)
        self._values = {code: self._values.get(code) or _uniform_buffer(values_to_bytes(code)) for code in codes}
        shadow_codes = {uid: material.shadow_code for uid, material in cache.materials.items()}
        if shadow_codes != self._shadow_codes:
            self._shadow_codes, self._tiles = shadow_codes, None
        if cache.groups is not self._groups or cache.matrices is not self._matrices:
            self._place_objects()
        attributes = {uid: material.attributes for uid, material in cache.materials.items()}
        drawn: dict[tuple[RenderMaterial, bool], list[Part]] = {}
        self._calls = {}
        for (part, group), first in zip(cache.groups.items(), self._first, strict=True):
            self._calls[part] = part.mesh.batches[part.slot, attributes[part.material]], first, len(group)
            if part.is_visible:
                drawn.setdefault((cache.materials[part.material], part.is_holdout), []).append(part)
        draws = ((cache.variant(material, is_holdout), material, parts) for (material, is_holdout), parts in drawn.items())
        self._draws = sorted(draws, key=lambda draw: (draw[0].model.stem, draw[0].inputs.text))
        return True

    def _place_objects(self) -> None:
        """Send where all objects are, in the order of the groups."""
        groups, places = self.cache.groups, self.cache.matrices.tobytes()
        self._groups, self._matrices = groups, self.cache.matrices
        order = [index for group in groups.values() for index in group]
        self._first = list(accumulate((len(group) for group in groups.values()), initial=0))[:-1]
        rows = -(-len(order) // OBJECTS_ACROSS) or 1
        texels = array("f", b"".join(places[MATRIX_BYTES * index : MATRIX_BYTES * (index + 1)] for index in order))
        texels.frombytes(bytes(MATRIX_BYTES * (rows * OBJECTS_ACROSS - len(order))))
        texels[MATRIX_SIZE - 1 : MATRIX_SIZE * len(order) : MATRIX_SIZE] = array("f", (index + 1 for index in order))
        size = (OBJECTS_ACROSS * MATRIX_SIZE // 4, rows)
        self._objects = gpu.types.GPUTexture(size, format="RGBA32F", data=gpu.types.Buffer("FLOAT", len(texels), texels))
        self._bounds = SceneBounds(groups, self.cache.matrices, self._bounds)
        transparent = [part for part in groups if part.casts_shadow and self.cache.materials[part.material].is_transparent]
        casting = (self._bounds.casting, [(part, groups[part]) for part in transparent])
        if casting != self._casting:
            self._casting, self._tiles = casting, None

    def _refresh_images(self) -> bool:
        """Send to the driver the images whose pixels have changed; return whether there are any."""
        before, self.warnings = self._images, []
        materials = self.cache.materials.values()
        self._images = {image: self._image(material, image) for material in materials for image in material.textures}
        is_changed = self._images != before
        if is_changed and self._has_transparent_shadows:
            self._tiles = None
        return is_changed

    def compile(self) -> Iterator[str]:
        """Compile the shaders in use; yields a message before each, as it may take a moment. Raises DriverError."""
        for variant in dict.fromkeys(variant for variant, _, _ in self._draws):
            yield f"Compiling {variant.model.stem}"
            compiled(surface_program, variant)

    def begin(self, view: View) -> None:
        """Start an empty picture of `view`, and draw the shadow maps. Raises DriverError."""
        subsurface = self.cache.has_subsurface
        size = (view.width, view.height, subsurface)
        if self._allocated is None or (self._allocated.width, self._allocated.height, self._allocated.subsurface) != size:
            self._allocated = None  # freed first, as the driver may not have room for both
            self._allocated = RenderTargets(*size)
        self._targets.sum.clear(format="FLOAT", value=TRANSPARENT)
        self._samples = 0
        with PROGRAM_LOCK:
            if any(reads_table(variant.features) for variant, _, _ in self._draws):
                specular_table()  # now, as it has a framebuffer of its own
            self._visible = self._bounds.visible(view) if self._bounds and self.cache.lighting().shadows else []
            self._light(0)

    def add(self, view: View, sample: int, filter_size: float, background: Rgba) -> None:
        """Draw one sample of every pixel over `background` and add it to the picture; `filter_size` is in pixels."""
        shifted = view.shifted(*sample_offset(sample, filter_size))
        with PROGRAM_LOCK:
            if sample and (self._has_transparent_shadows or any(light.is_soft for light in self.cache.lights)):
                self._light(sample)
            self._draw_surfaces(self._targets, shifted, sample)
            if self._targets.subsurface:
                self._gather_subsurface(self._targets, shifted, sample)
            self._accumulate(self._targets, background)
        self._samples += 1

    def show(self, x: int = 0, y: int = 0) -> None:
        """Draw the picture so far into the bound framebuffer, whose viewport has its size and its corner at `x`, `y` [pixels]."""
        with PROGRAM_LOCK:
            shader = _bound(resolve_program)
            shader.uniform_sampler("sum_map", self._targets.sum)
            shader.uniform_float("weight", 1.0 / self._samples)
            shader.uniform_float("corner", (x, y))
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
            shader = _bound(depth_program)
            shader.uniform_sampler("depth_map", targets.depth)
            shader.uniform_float("distances", view.distances)
            self._triangle.draw(shader)
            gpu.shader.unbind()  # else Blender keeps what forget_shaders frees
        distances = found.read()
        distances.dimensions = targets.width * targets.height
        return distances

    def _light(self, sample: int) -> None:
        """Send the lights as a sample sees them and draw their shadow maps, unless they are up to date."""
        lights = [light.at_sample(sample, index) for index, light in enumerate(self.cache.lights)]
        has_shadows = self.cache.lighting().shadows and self._bounds is not None
        tiles = shadows.shadow_tiles(lights, self._bounds.casters, self._visible) if has_shadows else []
        is_moved = tiles != self._tiles
        if lights != self._sampled or is_moved:
            self._sampled, self._tiles = lights, tiles
            counts = Counter(tile.light for tile in tiles)
            self._light_block = _uniform_buffer(lights_to_bytes(lights, [counts[index] for index in range(len(lights))]))
        if has_shadows and (is_moved or self._has_transparent_shadows):
            self._draw_shadows(tiles, sample)

    def _allocate_shadows(self, tiles: Sequence[shadows.Tile]) -> None:
        """Make the shadow map large enough for `tiles`, and the texture that says where they are."""
        width = max((tile.x + tile.size for tile in tiles), default=1)
        if self._shadow_map is None or self._shadow_map.width != width:
            self._shadow_map = gpu.types.GPUTexture((width, width), format="R32F")
            # kept, as a framebuffer does not keep its textures
            self._shadow_depth = gpu.types.GPUTexture((width, width), format="DEPTH_COMPONENT32F")
            self._shadow_buffer = gpu.types.GPUFrameBuffer(depth_slot=self._shadow_depth, color_slots=self._shadow_map)
        rows = b"".join(tile.to_bytes() for tile in tiles) or bytes(shadows.Tile.BYTES)
        data = gpu.types.Buffer("FLOAT", len(rows) // 4, memoryview(rows).cast("f"))
        self._shadow_tiles = gpu.types.GPUTexture((5, len(tiles) or 1), format="RGBA32F", data=data)

    def _draw_shadows(self, tiles: Sequence[shadows.Tile], sample: int) -> None:
        """Draw the shadow maps, transparent casters as this sample sees them."""
        materials = self.cache.materials
        casting = [(part, materials[part.material].shadow_code) for part in self._groups if part.casts_shadow]
        opaque = [part for part, code in casting if code is None]
        transparent = [(part, code) for part, code in casting if code is not None]
        self._has_transparent_shadows = bool(transparent)
        self._allocate_shadows(tiles)
        with self._shadow_buffer.bind():
            _use_depth_test()
            self._shadow_buffer.clear(color=FAR, depth=1.0)
            for tile in tiles:
                self._shadow_buffer.viewport_set(tile.x, tile.y, tile.size, tile.size)
                shader = _bound(shadow_program)
                shader.uniform_sampler("objects", self._objects)
                shader.uniform_float("matrix", tile.matrix)
                for part in opaque:
                    self._draw_part(shader, part)
                if transparent:
                    self._draw_transparent_shadows(tile, transparent, sample)
            self._shadow_buffer.viewport_set(0, 0, self._shadow_depth.width, self._shadow_depth.width)

    def _draw_transparent_shadows(self, tile: shadows.Tile, casting: Sequence[tuple[Part, Code]], sample: int) -> None:
        """Draw into a light's part of the shadow map where this sample does not see through."""
        light = self._sampled[tile.light]
        is_sun = light.kind == "SUN"
        view = View(tile.matrix, Vector(light.axis if is_sun else light.position), not is_sun, tile.size, tile.size)
        view_block = _uniform_buffer(view.to_bytes(self.cache.world, sample))
        for part, code in casting:
            shader = _bound(transparent_shadow_program, Inputs.of(code))
            self._give_inputs(shader, view_block, code)
            self._draw_part(shader, part)

    def _draw_part(self, shader: gpu.types.GPUShader, part: Part) -> None:
        """Draw the objects that show a part, in one call."""
        batch, first, count = self._calls[part]
        shader.uniform_int("first_object", first)
        batch.draw_instanced(shader, instance_count=count)

    def _give_inputs(self, shader: gpu.types.GPUShader, view_block: gpu.types.GPUUniformBuf, code: Code) -> None:
        """Have `shader` read a view, the numbers of `code` and its images; the compiler drops what its text does not use."""
        shader.uniform_block("view", view_block)
        shader.uniform_sampler("objects", self._objects)
        with suppress(ValueError):
            shader.uniform_block("material", self._values[code])
        for index, image in enumerate(code.images):
            with suppress(ValueError):
                shader.uniform_sampler(f"image_{index}", self._images[image])

    def _give_lights(self, shader: gpu.types.GPUShader, variant: Variant) -> None:
        """Have `shader` read the lights, their shadow maps and the table of specular albedos."""
        shader.uniform_block("lights", self._light_block)
        if reads_table(variant.features):
            shader.uniform_sampler("specular_table", specular_table())
        if variant.lighting.shadows:
            shader.uniform_sampler("shadow_map", self._shadow_map)
            shader.uniform_sampler("shadow_tiles", self._shadow_tiles)

    def _draw_surfaces(self, targets: RenderTargets, view: View, sample: int) -> None:
        """Draw the nearest surface of every pixel."""
        view_block = _uniform_buffer(view.to_bytes(self.cache.world, sample))
        with targets.surface_buffer.bind():
            _use_depth_test()
            targets.surface_buffer.clear(color=TRANSPARENT, depth=1.0)
            gpu.state.front_facing_set(view.is_mirrored)  # a mirrored view reverses the winding of front faces
            for variant, material, parts in self._draws:
                shader = _bound(surface_program, variant)
                self._give_inputs(shader, view_block, material.code)
                if HOLDOUT not in variant.features:
                    self._give_lights(shader, variant)
                for part in parts:
                    self._draw_part(shader, part)
            gpu.state.front_facing_set(False)
            gpu.state.depth_test_set("NONE")

    def _gather_subsurface(self, targets: RenderTargets, view: View, sample: int) -> None:
        """Add the light that scattered below the surfaces to the sample."""
        # by how much the pattern on the disk is turned and its radii are moved, as fractions of a turn and of a step
        turn, step = (sample * advance % 1.0 for advance in GATHER_STEPS)
        data = struct.pack("8f", view.width, view.height, *view.pixel_size(), turn, step, view.is_perspective, 0.0)
        with targets.gather_buffer.bind():
            shader = _bound(subsurface_gather_program)
            block = _uniform_buffer(data)  # in a variable, as Blender does not keep it until the draw
            shader.uniform_block("gather", block)
            for name, texture in zip(GATHER_MAPS, targets.colors, strict=True):
                shader.uniform_sampler(name, texture)
            self._triangle.draw(shader)

    def _accumulate(self, targets: RenderTargets, background: Rgba) -> None:
        """Add the sample over `background` to the sum."""
        with targets.sum_buffer.bind():
            gpu.state.depth_test_set("NONE")
            gpu.state.depth_mask_set(False)
            gpu.state.blend_set("ADDITIVE_PREMULT")
            shader = _bound(accumulate_program)
            shader.uniform_sampler("radiance_map", targets.sample)
            shader.uniform_float("background", background)
            self._triangle.draw(shader)
            gpu.state.blend_set("NONE")

    def _image(self, material: RenderMaterial, image: Image) -> gpu.types.GPUTexture:
        """Return an image on the driver, or one pixel where it is missing, as in Blender, or too large."""
        if not material.is_missing(image):
            try:
                return gpu.texture.from_image(material.images[image.name])
            except RuntimeError:
                what = "the graphics driver has no room for the image, which is not drawn"
                self.warnings.append(Omission("IMAGE_DATA", what, image.name))
        return _missing()


def compile_program(program: Program) -> gpu.types.GPUShader:
    """Return `program` compiled by the driver. Raises DriverError where it does not compile."""
    info = gpu.types.GPUShaderCreateInfo()
    if program.uniform_blocks:
        info.typedef_source(struct_declarations(program))
    for location, (name, kind) in enumerate(program.attributes.items()):
        info.vertex_in(location, kind, name)
    if program.varyings:
        interface = gpu.types.GPUStageInterfaceInfo(program.name)
        for name, kind in program.varyings.items():
            interface.smooth(kind, name)
        for name, kind in program.flat_varyings.items():
            interface.flat(kind, name)
        info.vertex_out(interface)
    for name, kind in program.constants.items():
        info.push_constant(kind, name)
    for slot, (name, kind) in enumerate(program.samplers.items()):
        info.sampler(slot, kind, name)
    for slot, (name, kind) in enumerate(program.uniform_blocks.items()):
        info.uniform_buf(slot, kind, name)
    for location, name in enumerate(program.outputs):
        info.fragment_out(location, "VEC4", name)
    info.vertex_source(program.vertex)
    info.fragment_source(program.fragment)
    try:
        return gpu.shader.create_from_info(info)
    except Exception as error:  # the type that the gpu module raises
        raise DriverError(f"The graphics driver does not compile {program.name}") from error


@cache
def compiled(make: Callable[..., Program], *arguments: Variant | Inputs) -> gpu.types.GPUShader:
    """Return the shader of the program that `make` returns, compiled once. Raises DriverError."""
    return compile_program(make(*arguments))


def _bound(make: Callable[..., Program], *arguments: Variant | Inputs) -> gpu.types.GPUShader:
    """Return the shader `compiled` from what `make` returns, as the one that draws from here on."""
    shader = compiled(make, *arguments)
    shader.bind()
    return shader


@cache
def specular_table() -> gpu.types.GPUTexture:
    """Return the table of specular albedos, integrated once. Raises DriverError."""
    table = gpu.types.GPUTexture(SPECULAR_TABLE_SIZE, format="RGBA32F")
    with gpu.types.GPUFrameBuffer(color_slots=table).bind():
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("NONE")
        triangle().draw(_bound(specular_table_program))
    return table


@cache
def _missing() -> gpu.types.GPUTexture:
    """Return one pixel in the color of missing images."""
    texture = gpu.types.GPUTexture((1, 1), format="RGBA32F")
    texture.clear(format="FLOAT", value=MISSING)
    return texture


def forget_shaders() -> None:
    """Free all shaders on the driver, and the textures that no scene owns."""
    compiled.cache_clear()
    specular_table.cache_clear()
    _missing.cache_clear()


atexit.register(forget_shaders)  # or Blender reports them as leaked memory


def _uniform_buffer(data: bytes) -> gpu.types.GPUUniformBuf:
    return gpu.types.GPUUniformBuf(gpu.types.Buffer("UBYTE", len(data), data))


def _use_depth_test() -> None:
    """Draw the nearest surface. To be called before the target is cleared, too: depth is cleared only where it may be written."""
    gpu.state.blend_set("NONE")
    gpu.state.face_culling_set("NONE")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
