# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in USD: a MaterialX network, a UsdPreviewSurface for programs without MaterialX, and all nodes for the way back.

hook.py                 called by Blender's exporter and importer
export.py               a material -> both networks, its image files and nodes, while Blender writes the stage; needs pxr
materialx.py            Surface -> MaterialX: the closures; nearest.py: what stands for each reflectance model
expressions.py          what feeds an input -> MaterialX: images, attributes, normals; operations by terms.py and compositions.py
preview.py, lookups.py  Surface -> UsdPreviewSurface; lookups.py: what of an expression is one image, scaled
baking.py               images in place of what the networks lack
affine.py               coordinates that are a UV map moved, turned and scaled
network.py              a shading network as plain values
shapes.py               what Blender wrote, and how it names it; primvars.py: the names of UV maps and attributes; need pxr
separate.py             materials whose names are equal in the stage; needs pxr
author.py               networks and nodes -> prims, and back; needs pxr
restore.py              prims -> a Blender material; version_0_1_0.py: from files of that version; need pxr
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
