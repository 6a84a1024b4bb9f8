# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine True Diffuse Realtime: draws with shaders/*.glsl in the viewport, in final and in headless renders."""


def register() -> None:
    """Register the engine and its panels; its settings are those of addon.blender.properties."""
    import bpy

    from . import engine, panels, preload

    bpy.utils.register_class(engine.TrueDiffuseRealtime)
    panels.register()
    preload.register()


def unregister() -> None:
    """Unregister them and free the shaders on the driver."""
    import bpy

    from . import driver, engine, panels, preload

    preload.unregister()
    panels.unregister()
    bpy.utils.unregister_class(engine.TrueDiffuseRealtime)
    driver.forget_shaders()
