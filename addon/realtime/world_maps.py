# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a world on the graphics driver: its suns, and maps of the rest for diffuse and for glossy reflection.

They are made anew where the world has changed, of its expression in GLSL: first an octahedral map, whose texels share
out the sphere (shaders/realtime/octahedral.glsl), and of it those that surfaces read, as two hemispheres (hemispheres.glsl).
"""

import itertools
import math
import struct
from array import array
from collections.abc import Callable, Sequence
from typing import NamedTuple

import gpu
from mathutils import Vector

from ..blender.glsl import triangle
from ..material.expression import Image
from ..material.sky import Atmosphere, Sun
from ..models.vector import Vector as Triple
from .driver import PROGRAM_LOCK, bound, missing_image, uniform_buffer
from .expressions import Code
from .lights import Light
from .materials import values_to_bytes
from .not_drawn import Omission
from .program import (
    MAX_TILES,
    MAX_WORLD_SUNS,
    Inputs,
    Program,
    world_background_program,
    world_convolved_program,
    world_glossy_program,
    world_radiance_program,
    world_reduce_program,
    world_remaining_program,
    world_suns_program,
)
from .sky import sky_map
from .view import View
from .world import Radiance, World

MATTE_SIZE = 256  # texels across the map where nothing reflects it sharply
SIZES = (128, 2048)  # the least and the most
SMALLEST_TILE = 32  # texels across, of maps as smooth as the cosine
INTEGRATED = 64  # texels across the map that the irradiance is the sum of
SUN_GRID = 128  # blocks across the map in which suns are looked for: 1.6 degrees
CAP = math.radians(6.0)  # how far around its brightest block a sun reaches
FLAT = math.radians(4.0)  # the half angle from which on it is no sun
FAINTEST = 0.01  # the part of the world's luminance that a sun has at least
SHARPNESS = 60.0  # of the smoothed map: a standard deviation of 7 degrees
FEW_SAMPLES, GLOSSY_SAMPLES = 16, 48  # of what is reflected rather sharply, and of the rest
SHARP_LEVELS = 3
WIDEST = 5.0  # the width of the widest texel of an octahedral map times the map's size [rad]
MIRROR = 1e-4  # alpha of what is reflected sharply
BRIGHT = 10.0  # [W/(m^2 sr)] from which on all of a texel is looked at closely where no suns are made


NO_CAP = (0.0, 0.0, 0.0, 2.0)

type Given = gpu.types.GPUTexture | gpu.types.GPUUniformBuf | int | float | tuple[float, ...]
"""Of a shader: a sampler, a block, or a number or vector."""
type Cap = tuple[float, float, float, float]


class Tile(NamedTuple):
    """A square in a texture, or the left one of two, without its border, in texels."""

    x: int
    y: int
    size: int


class WorldMaps:
    """The light of a world, after `refresh`. `suns` are lights; `warnings` say what the driver does not draw."""

    def __init__(self) -> None:
        self.suns: tuple[Light, ...] = ()
        self.warnings: list[Omission] = []
        self._made_of: object = None
        self._textures: dict[Image | Atmosphere, gpu.types.GPUTexture] = {}
        self._values: dict[Code, gpu.types.GPUUniformBuf] = {}
        self._triangle = triangle()
        self._caps: list[Cap] = []  # of the suns that were found
        self._radiance: list[Triple] | None = None  # of the smallest map, by texel

    def refresh(self, world: World, has_glossy: bool) -> bool:
        """Make all of a `world` again where it, or a pixel of its images, has changed; return whether it has. Raises DriverError.

        The maps for glossy reflection are made if `has_glossy`: some material in the scene reflects them.
        """
        self.warnings = []
        textures = {image: self._texture(world, image) for code in world.codes for image in code.images}
        made_of = world, has_glossy, textures
        if made_of == self._made_of:
            return False
        self._made_of, self._textures = made_of, textures
        self._values = {code: uniform_buffer(values_to_bytes(code)) for code in world.codes}
        self.suns = tuple(sun_light(sun, world.has_shadows) for sun in world.suns)
        self._caps, self._radiance = [], None
        if not world.is_even:
            with PROGRAM_LOCK:
                gpu.state.depth_test_set("NONE")
                gpu.state.blend_set("NONE")
                self._make(world, has_glossy)
                gpu.shader.unbind()  # else Blender keeps what forget_shaders frees
        return True

    def give(self, shader: gpu.types.GPUShader) -> None:
        """Have `shader` read the maps."""
        shader.uniform_block("world_tiles", self._tiles)
        shader.uniform_sampler("world_map", self._map)

    def draw_background(self, code: Code, view: View, subsurface: bool) -> None:
        """Draw the world where the bound target has no surface yet, as `view` sees it; the target has all outputs of surfaces."""
        right, up, forward = view.directions()
        shader = bound(world_background_program, Inputs.of(code), subsurface)
        self._give_code(shader, code)
        for name, vector in (("right", right), ("up", up), ("forward", forward)):
            shader.uniform_float(name, (*vector, 0.0))
        shader.uniform_float("pixel", (2.0 / view.width, 2.0 / view.height, 0.0, 0.0))
        self._triangle.draw(shader)

    def radiance(self, direction: Vector) -> Triple:
        """Return the radiance from around a unit vector [W/(m^2 sr)], of a world that varies, without its suns."""
        if self._radiance is None:
            texels, tile = _floats(self._small), self._small_tile
            rows = range(tile.y, tile.y + tile.size)
            starts = [4 * (self._small.width * y + x) for y in rows for x in range(tile.x, tile.x + tile.size)]
            self._radiance = [(texels[start], texels[start + 1], texels[start + 2]) for start in starts]
        return self._radiance[_texel(direction, self._small_tile.size)]

    def _texture(self, world: World, read: Image | Atmosphere) -> gpu.types.GPUTexture:
        """Return a sky's map or an image on the driver, or one pixel where it is missing, as in Blender, or too large."""
        if isinstance(read, Atmosphere):
            return sky_map(read)
        name, image = read.name, world.images.get(read.name)
        if image is None or (not image.has_data and not image.size[0]):
            self.warnings.append(Omission("IMAGE_DATA", "the image cannot be read", name))
            return missing_image()
        try:
            return gpu.texture.from_image(image)
        except RuntimeError:
            what = "the graphics driver has no room for the image, which is not drawn"
            self.warnings.append(Omission("IMAGE_DATA", what, name))
            return missing_image()

    def _give_code(self, shader: gpu.types.GPUShader, code: Code) -> None:
        for name, give, value in (
            ("material", shader.uniform_block, self._values[code]),
            *((f"image_{k}", shader.uniform_sampler, self._textures[image]) for k, image in enumerate(code.images)),
        ):
            try:
                give(name, value)
            except ValueError:  # the compiler has dropped it
                continue

    # ---- the maps

    def _make(self, world: World, has_glossy: bool) -> None:
        """Find the suns and make the maps of the rest."""
        size = min(max(world.resolution, SIZES[0]), SIZES[1]) if has_glossy else MATTE_SIZE
        diffuse = self._rest(world, world.diffuse, size, finds_suns=True)
        glossy = diffuse
        if has_glossy and world.glossy != world.diffuse:
            glossy = self._rest(world, world.glossy, size, finds_suns=False)
        levels = int(math.log2(size)) - 1 if has_glossy else 0  # alpha from 4 / size to 1
        sizes = [SMALLEST_TILE, SMALLEST_TILE, *(max(size >> level, SMALLEST_TILE) for level in range(levels))]
        tiles, across = _placed(sizes, 2)
        self._map = gpu.types.GPUTexture(across, format="RGBA16F")
        self._map.filter_mode(True)
        self._tiles = _tile_block(tiles, levels - 1)
        self._small, parts = self._pyramid(diffuse, [INTEGRATED, SMALLEST_TILE])
        self._small_tile = parts[1]
        for tile, sharpness in zip(tiles, (0.0, SHARPNESS), strict=False):
            given: dict[str, Given] = {"world_map": self._small, "source": (*parts[0], 0.0), "sharpness": sharpness}
            self._fill(self._map, world_convolved_program, tile, 2, **given)
        if has_glossy:
            pyramid, parts = self._pyramid(glossy, [size >> level for level in range(levels - 1)])
            block = _tile_block(parts, len(parts) - 1)
            for level, tile in enumerate(tiles[2:]):
                alpha = 4.0 / size * 2.0**level if level else MIRROR
                samples = GLOSSY_SAMPLES if level >= SHARP_LEVELS else FEW_SAMPLES if level else 1
                given = {"world_map": pyramid, "alpha": alpha, "samples": samples, "world_tiles": block}
                self._fill(self._map, world_glossy_program, tile, 2, **given)

    def _rest(self, world: World, radiance: Radiance, size: int, *, finds_suns: bool) -> gpu.types.GPUTexture:
        """Return the map of a radiance without the suns, which are found in it or known already."""
        maps = [gpu.types.GPUTexture((size, size), format="RGBA32F") for _ in range(3)]
        if isinstance(radiance, tuple):
            maps[0].clear(format="FLOAT", value=(*radiance, 1.0))
            return maps[0]
        width = max((image.size[0] for image in world.images.values()), default=0) or 1024
        with gpu.types.GPUFrameBuffer(color_slots=maps).bind():
            shader = bound(world_radiance_program, Inputs.of(radiance))
            self._give_code(shader, radiance)
            shader.uniform_float("size", float(size))
            shader.uniform_float("threshold", world.sun_threshold)
            shader.uniform_float("bright", world.sun_threshold or BRIGHT)
            subsamples = max(1, math.ceil(WIDEST / size * width / math.tau))  # no step is longer than a pixel of the image
            shader.uniform_int("subsamples", subsamples)
            shader.uniform_int("fine", 2 * subsamples + 2)
            self._triangle.draw(shader)
        if world.sun_threshold <= 0.0:
            return maps[0]
        block = size // SUN_GRID
        if finds_suns:
            self._caps = self._found_suns(maps, block, world.has_shadows)
        if not self._caps:
            return maps[0]
        rest = gpu.types.GPUTexture((size, size), format="RGBA32F")
        with gpu.types.GPUFrameBuffer(color_slots=rest).bind():
            shader = bound(world_remaining_program)
            shader.uniform_sampler("radiance_map", maps[0])
            shader.uniform_sampler("excess_map", maps[1])
            shader.uniform_int("block", block)
            none = [NO_CAP] * (MAX_WORLD_SUNS - len(self._caps))
            caps = uniform_buffer(struct.pack(f"{4 * MAX_WORLD_SUNS}f", *itertools.chain.from_iterable(self._caps + none)))
            shader.uniform_block("caps", caps)
            self._triangle.draw(shader)
        return rest

    def _found_suns(self, maps: Sequence[gpu.types.GPUTexture], block: int, has_shadows: bool) -> list[Cap]:
        """Keep the suns of the maps that world_radiance.glsl makes; return the direction of each and the cosine of its reach."""
        sums = [gpu.types.GPUTexture((SUN_GRID, SUN_GRID), format="RGBA32F") for _ in range(2)]
        with gpu.types.GPUFrameBuffer(color_slots=sums).bind():
            shader = bound(world_suns_program)
            for name, texture in zip(("radiance_map", "excess_map", "moment_map"), maps, strict=True):
                shader.uniform_sampler(name, texture)
            shader.uniform_int("block", block)
            self._triangle.draw(shader)
        powers, moments = (_floats(texture) for texture in sums)
        bright = {k: moments[4 * k + 3] for k in range(SUN_GRID * SUN_GRID) if moments[4 * k + 3] > 0.0}
        faintest = FAINTEST * math.fsum(powers[3::4])
        caps: list[Cap] = []
        while bright and len(caps) < MAX_WORLD_SUNS:
            brightest = texel_direction(max(bright, key=lambda k: bright[k]), SUN_GRID)
            inside = [k for k in bright if texel_direction(k, SUN_GRID).dot(brightest) >= math.cos(CAP)]
            luminance = math.fsum(bright.pop(k) for k in inside)
            toward = Vector([math.fsum(moments[4 * k + axis] for k in inside) for axis in range(3)])
            # of a disk of even radiance, the mean of the cosine to its middle is that of 1 and its edge's
            half_angle = math.acos(min(1.0, max(2.0 * toward.length / luminance - 1.0, -1.0)))
            if half_angle > FLAT or luminance < faintest:
                continue
            red, green, blue = (math.fsum(powers[4 * k + channel] for k in inside) for channel in range(3))
            self.suns += (_light(tuple(toward.normalized()), (red, green, blue), half_angle, has_shadows),)
            caps.append((*brightest, math.cos(CAP)))
        return caps

    def _pyramid(self, radiance: gpu.types.GPUTexture, sizes: Sequence[int]) -> tuple[gpu.types.GPUTexture, list[Tile]]:
        """Return a map in smaller sizes, as one texture."""
        tiles, across = _placed(sizes, 1)
        made = gpu.types.GPUTexture(across, format="RGBA32F")
        made.filter_mode(True)
        for tile in tiles:
            self._fill(made, world_reduce_program, tile, 1, radiance_map=radiance)
        return made, tiles

    def _fill(self, target: gpu.types.GPUTexture, make: Callable[[], Program], tile: Tile, squares: int, **given: Given) -> None:
        """Draw a tile of `target`, one square or two with borders, by the program that `make` returns, which reads `given`."""
        buffer = gpu.types.GPUFrameBuffer(color_slots=target)
        with buffer.bind():
            buffer.viewport_set(tile.x - 1, tile.y - 1, squares * (tile.size + 2), tile.size + 2)
            shader = bound(make)
            shader.uniform_float("tile", (*tile, 0.0))
            for name, value in given.items():
                if isinstance(value, gpu.types.GPUTexture):
                    shader.uniform_sampler(name, value)
                elif isinstance(value, int):
                    shader.uniform_int(name, value)
                elif isinstance(value, gpu.types.GPUUniformBuf):
                    shader.uniform_block(name, value)
                else:
                    shader.uniform_float(name, value)
            self._triangle.draw(shader)
            buffer.viewport_set(0, 0, target.width, target.height)


def sun_light(sun: Sun, casts_shadow: bool) -> Light:
    """Return a world's sun as a light."""
    return _light(sun.direction, sun.irradiance, sun.diameter / 2.0, casts_shadow)


def _light(direction: Triple, irradiance: Triple, half_angle: float, casts_shadow: bool) -> Light:
    """Return a sun in a unit `direction`: its irradiance on a plane that faces it [W/m^2], and half the angle across it [rad]."""
    none = (0.0, 0.0, 0.0)
    return Light("SUN", none, direction, irradiance, 0.0, 0.0, none, none, casts_shadow, half_angle)


def texel_direction(texel: int, size: int, x: float = 0.5, y: float = 0.5) -> Vector:
    """Return the unit vector of a place in a texel of an octahedral map, as shaders/realtime/octahedral.glsl has it."""
    row, column = divmod(texel, size)
    a, b = 2.0 * (column + x) / size - 1.0, 2.0 * (row + y) / size - 1.0
    z = 1.0 - abs(a) - abs(b)
    if z < 0.0:
        a, b = math.copysign(1.0 - abs(b), a), math.copysign(1.0 - abs(a), b)
    return Vector((a, b, z)).normalized()


def _texel(direction: Vector, size: int) -> int:
    """Return the texel of an octahedral map that a direction is in."""
    a, b = (coordinate / sum(map(abs, direction)) for coordinate in direction[:2])
    if direction.z < 0.0:
        a, b = math.copysign(1.0 - abs(b), a), math.copysign(1.0 - abs(a), b)
    column, row = (min(int((place + 1.0) / 2.0 * size), size - 1) for place in (a, b))
    return size * row + column


def _placed(sizes: Sequence[int], squares: int) -> tuple[list[Tile], tuple[int, int]]:
    """Return tiles of these sizes, of so many squares with borders around them, and the size of the texture that holds them."""
    tiles, y = [], 0
    for size in sizes:
        tiles.append(Tile(1, y + 1, size))
        y += size + 2
    return tiles, (squares * (max(sizes) + 2), y)


def _tile_block(tiles: Sequence[Tile], last: int) -> gpu.types.GPUUniformBuf:
    """Return the struct WorldTiles of program.py; `last`: the number of the last level of its maps."""
    rows = [(*tile, last) for tile in tiles]
    return uniform_buffer(b"".join(struct.pack("4f", *row) for row in rows).ljust(16 * MAX_TILES, b"\0"))


def _floats(texture: gpu.types.GPUTexture) -> array[float]:
    """Return the texels of a texture of 32-bit floats."""
    pixels = texture.read()
    pixels.dimensions = 4 * texture.width * texture.height
    return array("f", pixels)
