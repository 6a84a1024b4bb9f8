# SPDX-License-Identifier: GPL-3.0-or-later
"""A render engine of its own: draws with shaders/*.glsl in the viewport, in final and in headless renders."""


def register() -> None:
    """Make the engine known to Blender; its settings are those of `addon.properties`."""
    import bpy

    from . import engine, panels

    bpy.utils.register_class(engine.TrueDiffuseRealtime)
    panels.register()


def unregister() -> None:
    import bpy

    from . import drawing, engine, panels

    panels.unregister()
    bpy.utils.unregister_class(engine.TrueDiffuseRealtime)
    drawing.forget_shaders()
