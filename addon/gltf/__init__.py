# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in glTF, through Blender's exporter and importer.

export.py         one run of the exporter: called by its hooks
exporter.py       makes the exporter read stand-ins in place of our materials
stand_in.py       a copy of a material with a Principled BSDF in place of each of our groups
closures.py       mixes and sums of closures, reduced to one Principled BSDF
inputs.py         what feeds an input, in the shape that the exporter knows
diffuse.py        the EON that stands for the reflectance model: diffuse_roughness.py writes its roughness, base_color.py its color
animation.py      animated inputs
losses.py         what is not in the file
extras.py         all nodes of a material, and their images, for an import
importer.py       one run of the importer: called by its hooks, makes our materials again of their extras
rough_diffuse.py  materials of other programs with KHR_materials_diffuse_roughness
"""

import bpy

NAME = "True Diffuse"  # of the panel in the exporter's options


def draw(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    """Draw the options in the dialog of the exporter."""
    header, body = layout.panel("true_diffuse_gltf")
    header.label(text=NAME)
    if body:
        settings = context.scene.true_diffuse
        row = body.row()
        row.use_property_split = False  # else the label is cut
        row.prop(settings, "bake")
        column = body.column()
        column.active = settings.bake
        column.prop(settings, "bake_resolution")


def register() -> None:
    from io_scene_gltf2 import exporter_extension_layout_draw

    exporter_extension_layout_draw[NAME] = draw


def unregister() -> None:
    from io_scene_gltf2 import exporter_extension_layout_draw

    exporter_extension_layout_draw.pop(NAME, None)
