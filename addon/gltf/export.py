# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in Blender's own File > Export > glTF: what it writes for a Principled BSDF, with what differs put right.

glTF has Lambert and one GGX lobe, as UsdPreviewSurface does, so it gets the same: the model's average albedo as base color, and the
coat as the lobe. Without a coat KHR_materials_specular switches the lobe off.
"""

from typing import TYPE_CHECKING

import bpy

from ..blender import report
from ..material.read import Names, identifier, read
from ..material.surface import GroupSurface, texture_factor
from ..models.geometry import clamp
from ..usd import preview
from .exporter import FAILURES, read_stand_ins
from .stand_in import Replaced, StandIn, StandIns

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import Material

WRITTEN = {"Color", "Specular", "Specular Roughness", "Normal"}


class Export:
    """One run of the exporter. Failures are reported instead of raised: the export goes on."""

    def __init__(self) -> None:
        self._stand_ins = StandIns()

    def begin(self) -> None:
        """Get ready for the export that is about to run."""
        try:
            read_stand_ins(self._stand_ins)
        except FAILURES as error:
            report.add("glTF", f"True Diffuse materials are left as Blender has them: {error}")

    def gather_material(self, gltf_material: "Material", material: bpy.types.Material) -> None:
        """Put right what the exporter has gathered for one of our materials."""
        stand_in = self._stand_ins.of(material)
        if stand_in is None:
            return
        try:
            replaced = _exported(stand_in)
            if replaced:
                _adjust(gltf_material, material, replaced)
        except FAILURES as error:
            report.add(material.name, f"is left as Blender has it: {error or type(error).__name__}")


def _exported(stand_in: StandIn) -> Replaced | None:
    """Return the node of ours that the exporter has written, which takes the first Principled BSDF that it finds."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import get_socket

    socket = get_socket(stand_in.material.node_tree, "Base Color").socket
    return next((replaced for replaced in stand_in.replaced if socket and replaced.principled == socket.node), None)


def _adjust(gltf_material: "Material", material: bpy.types.Material, replaced: Replaced) -> None:
    surface = read(replaced.node, replaced.group, replaced.version, Names(lambda image: image.name, identifier))
    _adjust_base_color(gltf_material, surface)
    _keep_ior(gltf_material)
    for message in surface.supported(WRITTEN, WRITTEN)[1]:
        report.add(material.name, message)


def _adjust_base_color(gltf_material: "Material", surface: GroupSurface) -> None:
    """Give the base color the model's average albedo: exact for a constant; a texture or attribute can only be scaled."""
    albedo, base = preview.albedo(surface), gltf_material.pbr_metallic_roughness
    red, green, blue, alpha = base.base_color_factor or (1.0, 1.0, 1.0, 1.0)
    if "Color" in surface.linked:
        scale = texture_factor(albedo)
        red, green, blue = (clamp(scale * channel, 0.0, 1.0) for channel in (red, green, blue))
    else:
        red, green, blue = map(albedo, (red, green, blue))
    base.base_color_factor = [red, green, blue, alpha]


def _keep_ior(gltf_material: "Material") -> None:
    """Keep an index of refraction beside a full specular lobe: the exporter drops it where KHR_materials_specular says nothing."""
    extensions = gltf_material.extensions
    if "KHR_materials_specular" in extensions and extensions["KHR_materials_ior"].extension:
        extensions["KHR_materials_specular"].extension.setdefault("specularFactor", 1.0)
