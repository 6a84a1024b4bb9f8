# SPDX-License-Identifier: GPL-3.0-or-later
"""OSL shaders for Cycles, compiled into the .blend file: nothing is written beside the source."""

from pathlib import Path

import bpy

SHADERS = Path(__file__).resolve().parent.parent / "shaders"


def compiles_osl() -> bool:
    """Return whether this Blender can compile OSL: some Linux packages lack OpenImageIO, which Blender's OSL query needs."""
    bpy.utils.expose_bundled_modules()
    try:
        import OpenImageIO  # noqa: F401
        from cycles import osl  # noqa: F401
    except ImportError:
        return False
    return True


def compile_osl(node: bpy.types.Node, stem: str) -> None:
    """Make `node`, a Script node, run shaders/STEM.osl; its text is kept in the file.

    Raises RuntimeError with the compiler's words where it does not compile, ImportError where `compiles_osl` is false.
    """
    bpy.utils.expose_bundled_modules()
    import OpenImageIO  # noqa: F401 - Blender's OSL query needs it loaded first
    from cycles import osl

    node.script = bpy.data.texts.get(f"{stem}.osl") or bpy.data.texts.load(str(SHADERS / f"{stem}.osl"), internal=True)
    messages: list[str] = []
    if not osl.update_script_node(node, lambda _kind, text: messages.append(text)):
        raise RuntimeError("; ".join(messages))
