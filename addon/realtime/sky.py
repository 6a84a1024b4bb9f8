# SPDX-License-Identifier: GPL-3.0-or-later
"""Skies on the graphics driver: maps that are made anew when the air or the height of the sun changes."""

from array import array
from collections.abc import Mapping
from functools import lru_cache

import gpu

from ..blender.glsl import triangle
from ..material import sky
from ..material.sky import Atmosphere
from .driver import CACHES, PROGRAM_LOCK, bound, uniform_buffer
from .program import sky_program

TRANSMITTANCE_SIZE = (256, 64)
SKY_SIZE = (512, 256)  # of which the second half is the mirror of the first
AIR = (
    *("EARTH_RADIUS", "ATMOSPHERE_HEIGHT", "MOLECULAR_SCATTERING", "MOLECULAR_DECAY", "MOLECULAR_EXPONENT", "OZONE_ABSORPTION"),
    *("OZONE_LOG_HEIGHT", "OZONE_SHARPNESS", "AEROSOL_SCATTERING", "AEROSOL_ABSORPTION", "AEROSOL_HEIGHT", "AEROSOL_BACKGROUND"),
)
CONSTANTS: Mapping[str, tuple[str, ...]] = {  # of material/sky.py that the shaders have
    "sky_transmittance": (*AIR, "TRANSMITTANCE_STEPS"),
    "sky_multiple_scattering": (
        *AIR,
        *("AEROSOL_ANISOTROPY", "GROUND_ALBEDO", "SUN_IRRADIANCE", "SCATTERING_STEPS"),
        *("X_OF_SPECTRUM", "Y_OF_SPECTRUM", "Z_OF_SPECTRUM"),
    ),
    "sky_single_scattering": (
        *("SINGLE_EARTH_RADIUS", "SINGLE_ATMOSPHERE_HEIGHT", "RAYLEIGH_HEIGHT", "MIE_HEIGHT", "RAYLEIGH_SCATTERING"),
        *("MIE_SCATTERING", "MIE_EXTINCTION", "MIE_ANISOTROPY", "SINGLE_STEPS", "BANDS"),
        *("FIRST_NODES", "LAST_NODES", "FIRST_WEIGHTS", "LAST_WEIGHTS"),
    ),
}
KEPT = 8  # maps, for scenes and frames that take turns


@lru_cache(KEPT)
def sky_map(air: Atmosphere) -> gpu.types.GPUTexture:
    """Return the XYZ of half a sky around its zenith, as shaders/realtime/sky.glsl reads it. Raises DriverError."""
    densities = air.air_density, air.aerosol_density, air.ozone_density
    name = "sky_multiple_scattering" if air.is_multiple else "sky_single_scattering"
    with PROGRAM_LOCK:
        table = _transmittance(densities) if air.is_multiple else None
        shader = _bound(name)
        if table:
            shader.uniform_sampler("transmittance", table)
        else:
            block = _spectrum()
            shader.uniform_block("spectrum", block)
        shader.uniform_float("densities", densities)
        shader.uniform_float("sun_elevation", air.sun_elevation)
        shader.uniform_float("altitude", air.altitude / 1000.0)
        return _drawn(shader, (SKY_SIZE[0] // 2, SKY_SIZE[1]))


@lru_cache(KEPT)
def _transmittance(densities: tuple[float, float, float]) -> gpu.types.GPUTexture:
    """Return the table of how much sunlight arrives through air of these densities."""
    shader = _bound("sky_transmittance")
    shader.uniform_float("densities", densities)
    return _drawn(shader, TRANSMITTANCE_SIZE)


CACHES += (sky_map, _transmittance)


def _drawn(shader: gpu.types.GPUShader, size: tuple[int, int]) -> gpu.types.GPUTexture:
    """Return a new texture of what `shader` gives."""
    texture = gpu.types.GPUTexture(size, format="RGBA32F")
    with gpu.types.GPUFrameBuffer(color_slots=texture).bind():
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("NONE")
        triangle().draw(shader)
    return texture


def _bound(name: str) -> gpu.types.GPUShader:
    constants = {constant: getattr(sky, constant) for constant in CONSTANTS[name]}
    constants |= {"TRANSMITTANCE_SIZE": TRANSMITTANCE_SIZE, "SKY_SIZE": SKY_SIZE}
    return bound(sky_program, name, "".join(f"#define {key} {_literal(value)}\n" for key, value in constants.items()))


def _literal(value: float | tuple[float, ...]) -> str:
    if not isinstance(value, tuple):
        return repr(value)
    return f"{'ivec' if isinstance(value[0], int) else 'vec'}{len(value)}({', '.join(map(repr, value))})"


def _spectrum() -> gpu.types.GPUUniformBuf:
    """Return the sun's light and the absorption by ozone at the wavelengths of single scattering."""
    bands = zip(sky.SINGLE_SUN_XYZ, sky.SINGLE_OZONE_ABSORPTION, strict=True)
    return uniform_buffer(array("f", [number for xyz, ozone in bands for number in (*xyz, ozone)]).tobytes())
