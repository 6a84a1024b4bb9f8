# SPDX-License-Identifier: GPL-3.0-or-later
"""The GLSL functions of shaders/ as text, ready to compile, and a triangle that covers a render target. No bpy."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

from ..models.registry import MODELS

if TYPE_CHECKING:
    import gpu

SHADERS = Path(__file__).resolve().parents[2] / "shaders"
FULLSCREEN_VERTEX_SHADER = "void main() { gl_Position = vec4(position, 0.0, 1.0); }"  # the vertex shader of `triangle`
INCLUDES = re.compile(r"Include ([^.]*\.glsl.*?) before it")


def own_text(stem: str) -> str:
    """Return shaders/STEM.glsl or shaders/nodes/STEM.glsl, or the file of the registered model STEM if that lies elsewhere."""
    model = MODELS.get(stem)
    folder = model.glsl.folder if model else None
    path = (folder or SHADERS) / f"{stem}.glsl"
    return (path if path.exists() else SHADERS / "nodes" / path.name).read_text(encoding="utf-8")


def includes(stem: str) -> list[str]:
    """Return the stems of the files that the comment in STEM.glsl wants included before it, in this order."""
    match = INCLUDES.search(own_text(stem))
    return re.findall(r"(\w+)\.glsl", match[1]) if match else []


def source(*stems: str) -> str:
    """Return the functions of all `stems` and of the files they include, without repetition, to follow a #version line."""
    return "\n".join(own_text(name) for name in dict.fromkeys(name for stem in stems for name in (*includes(stem), stem)))


def triangle() -> "gpu.types.GPUBatch":
    """Return a triangle that covers all of a target, with Blender's gpu module."""
    import gpu

    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="position", comp_type="F32", len=2, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, 3)
    vertices.attr_fill("position", [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)])
    return gpu.types.GPUBatch(type="TRIS", buf=vertices)
