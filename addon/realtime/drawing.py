# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a scene's contents with Blender's gpu module: shadow maps, surfaces, what scatters below them, the sum of all samples."""

import atexit
import struct
from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import cache
from threading import RLock

import gpu

from ..blender.glsl import triangle
from . import lights as lamp_data
from . import shadows
from .contents import Contents, Part
from .extent import Extent
from .materials import Look, Texture
from .program import Program, Variant, shadow, structs, surface, whole
from .view import View, offset

EXTENSIONS = {"periodic": "REPEAT", "clamp": "EXTEND", "black": "CLAMP_TO_BORDER", "mirror": "MIRRORED_REPEAT"}
CLEAR = (0.0, 0.0, 0.0, 0.0)
BLANK = {"color_image": CLEAR, "relief_image": (0.5, 0.5, 1.0, 1.0)}  # what is drawn for images that cannot be: black, flat
FAR = (1e30, 1e30, 1e30, 1e30)
TURNS = (0.8191725133961645, 0.6710436067037893)  # a sequence that fills a square evenly, other than the one of view.offset

# Held while one of the programs draws: what is set in it is the same for a viewport and for a render, in another thread.
IN_USE = RLock()

type Rgba = tuple[float, float, float, float]


class Refused(Exception):
    """The graphics driver refuses something; the message says what."""


def compiled(program: Program) -> gpu.types.GPUShader:
    """Return a program on the driver; raises Refused."""
    info = gpu.types.GPUShaderCreateInfo()
    if program.blocks:
        info.typedef_source(structs(program))
    for place, (name, kind) in enumerate(program.attributes.items()):
        info.vertex_in(place, kind, name)
    if program.varyings:
        between = gpu.types.GPUStageInterfaceInfo(program.name)
        for name, kind in program.varyings.items():
            between.smooth(kind, name)
        info.vertex_out(between)
    for name, kind in program.constants.items():
        info.push_constant(kind, name)
    for place, (name, kind) in enumerate(program.samplers.items()):
        info.sampler(place, kind, name)
    for place, (name, kind) in enumerate(program.blocks.items()):
        info.uniform_buf(place, kind, name)
    for place, name in enumerate(program.outputs):
        info.fragment_out(place, "VEC4", name)
    info.vertex_source(program.vertex)
    info.fragment_source(program.fragment)
    try:
        return gpu.shader.create_from_info(info)
    except Exception as error:  # that is what the gpu module raises
        raise Refused(f"The graphics driver does not compile {program.name}") from error


@cache
def surface_shader(variant: Variant) -> gpu.types.GPUShader:
    return compiled(surface(variant))


@cache
def shadow_shader() -> gpu.types.GPUShader:
    return compiled(shadow())


@cache
def gather_shader() -> gpu.types.GPUShader:
    samplers = dict.fromkeys(("radiance_map", "entering_map", "distance_map", "tint_map"), "FLOAT_2D")
    return compiled(whole("gather", samplers, {}, ("burley",), gather="Gather"))


@cache
def add_shader() -> gpu.types.GPUShader:
    return compiled(whole("add", {"radiance_map": "FLOAT_2D"}, {"background": "VEC4"}))


@cache
def show_shader() -> gpu.types.GPUShader:
    return compiled(whole("show", {"sum_map": "FLOAT_2D"}, {"weight": "FLOAT", "corner": "VEC2"}))


def forget_shaders() -> None:
    """Let the driver have back all shaders."""
    for kept in (surface_shader, shadow_shader, gather_shader, add_shader, show_shader):
        kept.cache_clear()


atexit.register(forget_shaders)  # or Blender counts them as lost memory


def _block(data: bytes) -> gpu.types.GPUUniformBuf:
    return gpu.types.GPUUniformBuf(gpu.types.Buffer("UBYTE", len(data), data))


class Targets:
    """What a picture of `width` x `height` pixels is drawn into; with `scattering` also what light does below surfaces."""

    def __init__(self, width: int, height: int, scattering: bool) -> None:
        """Ask the driver for the memory; raises Refused."""
        self.width, self.height, self.scattering = width, height, scattering
        try:
            self._allocate()
        except (RuntimeError, ValueError, MemoryError) as error:
            raise Refused(f"The graphics driver has no room for a picture of {width} x {height} pixels") from error

    def _allocate(self) -> None:
        count = 4 if self.scattering else 1
        self.colors = [self.texture() for _ in range(count)]
        self.depth = gpu.types.GPUTexture((self.width, self.height), format="DEPTH_COMPONENT32F")
        self.surfaces = gpu.types.GPUFrameBuffer(depth_slot=self.depth, color_slots=self.colors)
        self.gathered = self.texture() if self.scattering else self.colors[0]
        self.gathering = gpu.types.GPUFrameBuffer(color_slots=self.gathered)
        self.sum = self.texture()
        self.summing = gpu.types.GPUFrameBuffer(color_slots=self.sum)

    def texture(self) -> gpu.types.GPUTexture:
        return gpu.types.GPUTexture((self.width, self.height), format="RGBA32F")


class Painter:
    """Draws `contents`; keeps on the driver what does not change between pictures. `notes` say what is not drawn as it should."""

    def __init__(self, contents: Contents) -> None:
        self.contents = contents
        self._covering = triangle()
        self._looks: dict[Look, gpu.types.GPUUniformBuf] = {}
        self._images: dict[Texture, gpu.types.GPUTexture] = {}
        self.notes: list[str] = []
        self._kept: Targets | None = None
        self._shadow_map: gpu.types.GPUTexture | None = None
        self._shadowed: list[shadows.Tile] | None = None
        self._parts: list[Part] = []
        self._extent: Extent | None = None
        self._order: list[tuple[Variant, Look, list[Part]]] = []
        self._samples = 0

    @property
    def _targets(self) -> Targets:
        if self._kept is None:
            raise RuntimeError("no picture is begun")
        return self._kept

    def refresh(self) -> None:
        """Take over what `contents` has read anew."""
        contents = self.contents
        looks = dict.fromkeys(contents.looks.values())
        self._looks = {look: self._looks.get(look) or _block(look.packed()) for look in looks}
        self.notes = []
        self._images = {texture: self._image(texture, BLANK[name]) for look in looks for name, texture in look.textures.items()}
        if contents.parts is not self._parts:  # the lamps may be others, too
            self._parts, self._shadowed, self._extent = contents.parts, None, None
            self._lamps = _block(lamp_data.packed(contents.lamps))
        parts: dict[Look, list[Part]] = {look: [] for look in looks}
        for part in contents.parts:
            if part.is_seen:
                parts[contents.looks[part.material]].append(part)
        order = ((contents.variant(look), look, parts[look]) for look in looks if parts[look])
        self._order = sorted(order, key=lambda entry: repr(entry[0]))

    def compile(self) -> Iterable[str]:
        """Compile what is not compiled yet; yields a word on each before it is, as that may take a moment."""
        for variant in dict.fromkeys(variant for variant, _, _ in self._order):
            yield f"Compiling {variant.law.stem}"
            surface_shader(variant)

    def begin(self, view: View) -> None:
        """Start a picture: nothing is in it yet."""
        scattering = self.contents.scatters
        size = (view.width, view.height, scattering)
        if self._kept is None or (self._kept.width, self._kept.height, self._kept.scattering) != size:
            self._kept = None  # the driver may not have room for both
            self._kept = Targets(*size)
        self._targets.sum.clear(format="FLOAT", value=CLEAR)
        self._samples = 0
        with IN_USE:
            self._draw_shadows(view)

    def add(self, view: View, sample: int, filter_size: float, background: Rgba) -> None:
        """Add one sample of every pixel, seen over `background`."""
        x, y = offset(sample, filter_size)
        seen = view.shifted(x, y)
        with IN_USE:
            self._draw_surfaces(self._targets, seen)
            if self._targets.scattering:
                self._gather(self._targets, seen, sample)
            self._sum(self._targets, background)
        self._samples += 1

    def _sum(self, targets: Targets, background: Rgba) -> None:
        """Add the sample that has been drawn to the others."""
        with targets.summing.bind():
            gpu.state.depth_test_set("NONE")
            gpu.state.depth_mask_set(False)
            gpu.state.blend_set("ADDITIVE_PREMULT")
            shader = add_shader()
            shader.bind()
            shader.uniform_sampler("radiance_map", targets.gathered)
            shader.uniform_float("background", background)
            self._covering.draw(shader)
            gpu.state.blend_set("NONE")

    def show_blended(self, x: int, y: int) -> None:
        """Draw the picture so far over what the window has, its corner at the bottom left at `x`, `y` [pixels]."""
        left, bottom, width, height = gpu.state.viewport_get()
        gpu.state.viewport_set(left + x, bottom + y, self._targets.width, self._targets.height)
        gpu.state.blend_set("ALPHA_PREMULT")
        self.show(left + x, bottom + y)
        gpu.state.blend_set("NONE")
        gpu.state.viewport_set(left, bottom, width, height)

    def show(self, x: int = 0, y: int = 0) -> None:
        """Draw the picture so far into the bound framebuffer, to whose viewport it is fit, with a corner at `x`, `y` [pixels]."""
        with IN_USE:
            shader = show_shader()
            shader.bind()
            shader.uniform_sampler("sum_map", self._targets.sum)
            shader.uniform_float("weight", 1.0 / self._samples)
            shader.uniform_float("corner", (x, y))
            self._covering.draw(shader)
            gpu.shader.unbind()  # else Blender keeps what forget_shaders frees

    def read(self) -> gpu.types.Buffer:
        """Return the picture so far: red, green, blue, alpha of each pixel, rows from the bottom."""
        targets = self._targets
        finished = targets.texture()
        with gpu.types.GPUFrameBuffer(color_slots=finished).bind():
            self.show()
        pixels = finished.read()
        pixels.dimensions = 4 * targets.width * targets.height
        return pixels

    def _draw_shadows(self, view: View) -> None:
        """Draw the shadow maps, unless they are as they were."""
        if not self.contents.light().shadows:
            return
        if self._extent is None:
            self._extent = Extent(self.contents.parts)
        tiles = shadows.tiles(self.contents.lamps, self._extent, view)
        if tiles == self._shadowed:
            return
        self._shadowed = tiles
        self._shadow_block = _block(shadows.packed(tiles))
        across = max((tile.x + tile.size for tile in tiles), default=1)
        if self._shadow_map is None or self._shadow_map.width != across:
            self._shadow_map = gpu.types.GPUTexture((across, across), format="R32F")
            # kept, as a framebuffer does not keep its textures
            self._shadow_depth = gpu.types.GPUTexture((across, across), format="DEPTH_COMPONENT32F")
            self._shadow_target = gpu.types.GPUFrameBuffer(depth_slot=self._shadow_depth, color_slots=self._shadow_map)
        shader = shadow_shader()
        with self._shadow_target.bind():
            _draw_nearest()
            self._shadow_target.clear(color=FAR, depth=1.0)
            shader.bind()
            for tile in tiles:
                self._shadow_target.viewport_set(tile.x, tile.y, tile.size, tile.size)
                for part in self.contents.parts:
                    if part.casts:
                        shader.uniform_float("matrix", tile.matrix @ part.matrix)
                        look = self.contents.looks[part.material]
                        part.mesh.batch(part.slot, look.layers).draw(shader)
            self._shadow_target.viewport_set(0, 0, across, across)

    def _draw_surfaces(self, targets: Targets, view: View) -> None:
        """Draw every pixel's nearest surface."""
        seen = _block(view.packed(self.contents.world))
        with targets.surfaces.bind():
            _draw_nearest()
            targets.surfaces.clear(color=CLEAR, depth=1.0)
            gpu.state.front_facing_set(view.is_mirrored)  # as a mirrored view turns the corners of what faces it round
            for variant, look, parts in self._order:
                shader = surface_shader(variant)
                shader.bind()
                shader.uniform_block("view", seen)
                shader.uniform_block("material", self._looks[look])
                shader.uniform_block("lamps", self._lamps)
                if variant.light.shadows:
                    shader.uniform_block("shadows", self._shadow_block)
                    shader.uniform_sampler("shadow_map", self._shadow_map)
                for name, texture in look.textures.items():
                    # here, as the textures of an image share it on the driver
                    self._images[texture].extend_mode(EXTENSIONS[texture.source.wrap])
                    shader.uniform_sampler(name, self._images[texture])
                for part in parts:
                    shader.uniform_float("object_matrix", part.matrix)
                    with suppress(ValueError):  # dropped where nothing depends on it: Lambert's model without lamps
                        shader.uniform_float("orientation", -1.0 if part.matrix.is_negative else 1.0)
                    if variant.scatters:
                        shader.uniform_int("object_number", part.number)
                    part.mesh.batch(part.slot, look.layers).draw(shader)
            gpu.state.front_facing_set(False)
            gpu.state.depth_test_set("NONE")

    def _gather(self, targets: Targets, view: View, sample: int) -> None:
        """Add the light that leaves surfaces elsewhere than it entered."""
        data = struct.pack("8f", view.width, view.height, *view.pixel_size(), *_turn(sample), view.is_perspective, 0.0)
        with targets.gathering.bind():
            shader = gather_shader()
            shader.bind()
            block = _block(data)  # Blender does not keep it until it is drawn with
            shader.uniform_block("gather", block)
            for name, texture in zip(("radiance_map", "entering_map", "distance_map", "tint_map"), targets.colors, strict=True):
                shader.uniform_sampler(name, texture)
            self._covering.draw(shader)

    def _image(self, texture: Texture, blank: Rgba) -> gpu.types.GPUTexture:
        """Return a texture's image on the driver; one that is `blank` where there is none."""
        if not texture.is_lacking:
            try:
                image = gpu.texture.from_image(texture.image)
                image.filter_mode(True)
                return image
            except RuntimeError:
                self.notes.append(f"The graphics driver has no room for {texture.source.file}, which is not drawn")
        image = gpu.types.GPUTexture((1, 1), format="RGBA32F")
        image.clear(format="FLOAT", value=blank)
        return image


def _draw_nearest() -> None:
    """Have what is nearest drawn; before a target is cleared, too, as depth is cleared only where it may be written."""
    gpu.state.blend_set("NONE")
    gpu.state.face_culling_set("NONE")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)


def _turn(sample: int) -> Sequence[float]:
    """Return by how much of a turn, and of a step, the points of a sample's disk differ from those of the first."""
    return [sample * step % 1.0 for step in TURNS]
