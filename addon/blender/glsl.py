# SPDX-License-Identifier: GPL-3.0-or-later
"""The GLSL functions of shaders/ as text, ready to compile, and what covers a target. No bpy."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import gpu

SHADERS = Path(__file__).resolve().parents[2] / "shaders"
FULLSCREEN_VERTEX_SHADER = "void main() { gl_Position = vec4(position, 0.0, 1.0); }"  # the vertex shader of `triangle`
INCLUDES: Mapping[str, tuple[str, ...]] = {  # what a file of shaders/ needs included before it, in this order
    "geometry": (),
    "lambert": ("geometry",),
    "oren_nayar": ("geometry",),
    "oren_nayar_1994": ("geometry", "oren_nayar"),
    "fujii": ("geometry",),
    "eon": ("geometry", "fujii"),
    "cycles_diffuse": ("geometry", "fujii", "eon"),
    "wolff": ("geometry",),
    "pits": ("geometry",),
    "blinn_phong": ("geometry",),
    "directional_albedo": ("geometry", "fujii", "eon", "wolff"),
    "coat": ("geometry", "wolff"),
    "burley": ("geometry",),
    "lights": (),
}


def source(*stems: str) -> str:
    """Return the functions of shaders/STEM.glsl for all `stems` and for what they need, each once, to follow a #version line."""
    names = dict.fromkeys(name for stem in stems for name in (*INCLUDES[stem], stem))
    return "\n".join((SHADERS / f"{name}.glsl").read_text() for name in names)


def triangle() -> "gpu.types.GPUBatch":
    """Return a triangle that covers all of a target, with Blender's gpu module."""
    import gpu

    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="position", comp_type="F32", len=2, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, 3)
    vertices.attr_fill("position", [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)])
    return gpu.types.GPUBatch(type="TRIS", buf=vertices)
