# SPDX-License-Identifier: GPL-3.0-or-later
"""OSL shaders for Cycles, compiled into the .blend file: nothing is written beside the source."""

import bpy

from .glsl import SHADERS


def compiles_osl() -> bool:
    """Return whether this Blender can compile OSL: some Linux packages lack the OSL query, or OpenImageIO, which that needs."""
    bpy.utils.expose_bundled_modules()
    try:
        import OpenImageIO  # noqa: F401
        import oslquery  # noqa: F401
        from cycles import osl  # noqa: F401
    except ImportError:
        return False
    return True


def compile_osl(node: bpy.types.Node, stem: str) -> None:
    """Make `node`, a Script node, run shaders/STEM.osl; its text is kept in the file.

    Raises RuntimeError with the compiler's messages where it does not compile, ImportError where `compiles_osl` is false.
    """
    bpy.utils.expose_bundled_modules()
    import OpenImageIO  # noqa: F401 - Blender's OSL query needs it loaded first
    from cycles import osl

    path = SHADERS / f"{stem}.osl"
    source = path.read_text(encoding="utf-8").strip()
    # one of that name may be an older True Diffuse's, or the user's
    same = (text for text in bpy.data.texts if text.library is None and text.as_string().strip() == source)
    node.script = next(same, None) or bpy.data.texts.load(str(path), internal=True)
    messages: list[str] = []
    if not osl.update_script_node(node, lambda _kind, text: messages.append(text)):
        raise RuntimeError("; ".join(messages))
