# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in USD: a MaterialX network, a UsdPreviewSurface for programs without MaterialX, and all values to come back from.

surface.py    a material as plain values: what all others pass on
read.py       Blender material -> Surface; restore.py the way back
nearest.py    each rough model -> the closure of MaterialX that is or comes near it
materialx.py, preview.py    Surface -> network.py's plain shaders
author.py     those and the values -> prims; the only one that needs pxr
hook.py       where Blender calls us; report.py what could not be carried
"""

import bpy

from ..blender import report


def register() -> None:
    report.register()
    if bpy.app.build_options.usd:
        from .hook import TRUE_DIFFUSE_USD_hook

        bpy.utils.expose_bundled_modules()  # before Blender imports pxr to call the hook: another copy would not fit
        bpy.utils.register_class(TRUE_DIFFUSE_USD_hook)


def unregister() -> None:
    if bpy.app.build_options.usd:
        from .hook import TRUE_DIFFUSE_USD_hook

        bpy.utils.unregister_class(TRUE_DIFFUSE_USD_hook)
    report.unregister()
