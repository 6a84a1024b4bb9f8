# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates GLSL functions on the graphics driver through Blender's gpu module, one pixel for each set of inputs."""

from array import array
from collections.abc import Sequence

import bpy

import gpu

from true_diffuse.addon.blender.glsl import FULLSCREEN_VERTEX_SHADER, source, triangle

WIDTH = 1024  # pixels in a row of the target


def evaluate(stem: str, call: str, rows: Sequence[tuple[Sequence[float], ...]]) -> list[tuple[float, float, float]]:
    """Return what `evaluate_functions` does for a `call` of the functions of shaders/STEM.glsl and of the files it needs."""
    return evaluate_functions(source(stem), call, rows)


def evaluate_functions(functions: str, call: str, rows: Sequence[tuple[Sequence[float], ...]]) -> list[tuple[float, float, float]]:
    """Return the value of the GLSL expression `call`, a vec3, for each of `rows`, whose vec4s are called a, b, c and d there.

    `functions` is the GLSL text that `call` uses. Shorter vectors end in zeros. Values go in and come out as 32-bit floats. Needs a
    graphics driver.
    """
    if bpy.app.background:
        gpu.init()
    width, height = min(len(rows), WIDTH), -(-len(rows) // WIDTH)
    names = "abcd"[: len(rows[0])]
    info = gpu.types.GPUShaderCreateInfo()
    info.vertex_in(0, "VEC2", "position")
    info.fragment_out(0, "VEC4", "result")
    fetches = ""
    for slot, name in enumerate(names):
        info.sampler(slot, "FLOAT_2D", f"input_{name}")
        fetches += f"vec4 {name} = texelFetch(input_{name}, ivec2(gl_FragCoord.xy), 0);\n"
    info.vertex_source(FULLSCREEN_VERTEX_SHADER)
    info.fragment_source(f"{functions}\nvoid main() {{ {fetches} result = vec4({call}, 1.0); }}")
    shader = gpu.shader.create_from_info(info)
    target = gpu.types.GPUOffScreen(width, height, format="RGBA32F")
    with target.bind():
        shader.bind()
        textures = []  # kept until drawn
        for slot, name in enumerate(names):
            padded = array("f", (value for row in rows for value in (*row[slot], 0.0, 0.0, 0.0)[:4]))
            padded.extend([0.0] * (4 * width * height - len(padded)))
            data = gpu.types.Buffer("FLOAT", len(padded), padded)
            textures.append(gpu.types.GPUTexture((width, height), format="RGBA32F", data=data))
            shader.uniform_sampler(f"input_{name}", textures[-1])
        triangle().draw(shader)
        pixels = gpu.state.active_framebuffer_get().read_color(0, 0, width, height, 4, 0, "FLOAT").to_list()
    target.free()
    return [(red, green, blue) for line in pixels for red, green, blue, _ in line][: len(rows)]
