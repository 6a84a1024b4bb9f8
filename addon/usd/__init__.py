# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in USD: a MaterialX network, a UsdPreviewSurface for programs without MaterialX, and all values for the way back.

hook.py       called by Blender's exporter and importer; it reads materials with material/read.py
nearest.py    for each reflectance model the MaterialX closure that is the same or nearest
materialx.py, preview.py    Surface -> the plain shaders of network.py
author.py     shaders and values -> prims, and values back from prims; needs pxr
names.py      materials whose names are equal in USD; needs pxr
restore.py    Surface -> Blender material
"""

import bpy

from ..blender import report


def register() -> None:
    report.register()
    if bpy.app.build_options.usd:
        from .hook import TRUE_DIFFUSE_USD_hook

        bpy.utils.expose_bundled_modules()  # so that this and Blender's hook use one copy of pxr
        bpy.utils.register_class(TRUE_DIFFUSE_USD_hook)


def unregister() -> None:
    if bpy.app.build_options.usd:
        from .hook import TRUE_DIFFUSE_USD_hook

        bpy.utils.unregister_class(TRUE_DIFFUSE_USD_hook)
    report.unregister()
