# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates GLSL functions on the graphics driver through Blender's gpu module, one pixel for each set of inputs."""

from array import array
from pathlib import Path

import bpy

import gpu

SHADERS = Path(__file__).resolve().parent.parent / "shaders"
VERTEX = "void main() { gl_Position = vec4(position, 0.0, 1.0); }"


def evaluate(stem: str, call: str, rows: list[tuple[tuple[float, ...], ...]]) -> list[tuple[float, float, float]]:
    """Return what the GLSL expression `call`, a vec3, gives for each of `rows`: its vec4s are called a, b, c and d there.

    The functions of shaders/STEM.glsl can be used in it. Values go in and come out as 32-bit floats.
    """
    if bpy.app.background:
        gpu.init()
    size = (len(rows), 1)
    names = "abcd"[: len(rows[0])]
    info = gpu.types.GPUShaderCreateInfo()
    info.vertex_in(0, "VEC2", "position")
    info.fragment_out(0, "VEC4", "result")
    fetches = ""
    for slot, name in enumerate(names):
        info.sampler(slot, "FLOAT_2D", f"input_{name}")
        fetches += f"vec4 {name} = texelFetch(input_{name}, ivec2(gl_FragCoord.xy), 0);\n"
    info.vertex_source(VERTEX)
    functions = (SHADERS / f"{stem}.glsl").read_text()
    info.fragment_source(f"{functions}\nvoid main() {{ {fetches} result = vec4({call}, 1.0); }}")
    shader = gpu.shader.create_from_info(info)
    triangle = gpu.types.GPUVertFormat()
    triangle.attr_add(id="position", comp_type="F32", len=2, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(triangle, 3)
    vertices.attr_fill("position", [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)])
    target = gpu.types.GPUOffScreen(*size, format="RGBA32F")
    with target.bind():
        shader.bind()
        textures = []  # kept until drawn
        for slot, name in enumerate(names):
            padded = array("f", [value for row in rows for value in (*row[slot], 0.0, 0.0)[:4]])
            data = gpu.types.Buffer("FLOAT", len(padded), padded)
            textures.append(gpu.types.GPUTexture(size, format="RGBA32F", data=data))
            shader.uniform_sampler(f"input_{name}", textures[-1])
        gpu.types.GPUBatch(type="TRIS", buf=vertices).draw(shader)
        pixels = gpu.state.active_framebuffer_get().read_color(0, 0, *size, 4, 0, "FLOAT").to_list()
    target.free()
    return [tuple(pixel[:3]) for pixel in pixels[0]]
