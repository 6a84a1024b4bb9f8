# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders, blocks of numbers and textures on the graphics driver, as Blender's gpu module makes them."""

import atexit
from collections.abc import Callable, Hashable
from functools import cache
from threading import RLock

import gpu

from ..blender.glsl import triangle
from .program import Program, specular_table_program, struct_declarations

TRANSPARENT = (0.0, 0.0, 0.0, 0.0)
MISSING = (1.0, 0.0, 1.0, 1.0)  # the color of missing images in Blender
SPECULAR_TABLE_SIZE = (32, 32 * 16 + 1)  # as in shaders/realtime/specular_table.glsl

# Held while a program draws. Drivers keep the values of uniforms with the program, which a viewport and a render in another thread
# share.
PROGRAM_LOCK = RLock()

type Rgba = tuple[float, float, float, float]


class DriverError(Exception):
    """The graphics driver refuses something; the message says what."""


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
def compiled(make: Callable[..., Program], *arguments: Hashable) -> gpu.types.GPUShader:
    """Return the shader of the program that `make` returns, compiled once. Raises DriverError."""
    return compile_program(make(*arguments))


def bound(make: Callable[..., Program], *arguments: Hashable) -> gpu.types.GPUShader:
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
        triangle().draw(bound(specular_table_program))
    return table


@cache
def missing_image() -> gpu.types.GPUTexture:
    """Return one pixel in the color of missing images."""
    texture = gpu.types.GPUTexture((1, 1), format="RGBA32F")
    texture.clear(format="FLOAT", value=MISSING)
    return texture


CACHES = [compiled, specular_table, missing_image]
"""Of shaders on the driver, and of textures that no scene owns."""


def forget_shaders() -> None:
    """Free all shaders on the driver, and the textures that no scene owns."""
    for one in CACHES:
        one.cache_clear()


atexit.register(forget_shaders)  # or Blender reports them as leaked memory


def uniform_buffer(data: bytes) -> gpu.types.GPUUniformBuf:
    """Return a uniform block of `data`. Keep it until the draw: Blender does not."""
    return gpu.types.GPUUniformBuf(gpu.types.Buffer("UBYTE", len(data), data))


def use_depth_test() -> None:
    """Draw the nearest surface. To be called before the target is cleared, too: depth is cleared only where it may be written."""
    gpu.state.blend_set("NONE")
    gpu.state.face_culling_set("NONE")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
