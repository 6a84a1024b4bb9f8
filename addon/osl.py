# SPDX-License-Identifier: GPL-3.0-or-later
"""OSL shaders for Cycles, compiled into the .blend file: nothing is written beside the source."""

from pathlib import Path

import bpy

SHADERS = Path(__file__).resolve().parent.parent / "shaders"


def compile_osl(node: bpy.types.Node, stem: str) -> bool:
    """Make `node`, a Script node, run shaders/STEM.osl; its text is kept in the file. Return whether this Blender can compile OSL.

    Raises RuntimeError with the compiler's words where it does not compile.
    """
    bpy.utils.expose_bundled_modules()
    try:
        import OpenImageIO  # noqa: F401 - Blender's OSL query needs it loaded first
        from cycles import osl
    except ImportError:
        return False
    node.script = bpy.data.texts.get(f"{stem}.osl") or bpy.data.texts.load(str(SHADERS / f"{stem}.osl"), internal=True)
    messages: list[str] = []
    if not osl.update_script_node(node, lambda _kind, text: messages.append(text)):
        raise RuntimeError("; ".join(messages))
    return True
