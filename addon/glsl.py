# SPDX-License-Identifier: GPL-3.0-or-later
"""The GLSL functions of shaders/ as text, ready to compile. No bpy."""

from collections.abc import Mapping
from pathlib import Path

SHADERS = Path(__file__).resolve().parent.parent / "shaders"
BEFORE: Mapping[str, tuple[str, ...]] = {  # what a file of shaders/ needs included before it, in this order
    "geometry": (),
    "lambert": ("geometry",),
    "oren_nayar": ("geometry",),
    "oren_nayar_1994": ("geometry", "oren_nayar"),
    "fujii": ("geometry",),
    "eon": ("geometry", "fujii"),
    "cycles_diffuse": ("geometry", "fujii", "eon"),
    "wolff": ("geometry",),
    "pits": ("geometry",),
    "specular": ("geometry",),
    "albedo": ("geometry", "fujii", "eon", "wolff"),
    "coat": ("geometry", "wolff"),
    "burley": ("geometry",),
    "lamps": (),
}


def source(*stems: str) -> str:
    """Return the functions of shaders/STEM.glsl for all `stems` and for what they need, each once, to follow a #version line."""
    names = dict.fromkeys(name for stem in stems for name in (*BEFORE[stem], stem))
    return "\n".join((SHADERS / f"{name}.glsl").read_text() for name in names)
