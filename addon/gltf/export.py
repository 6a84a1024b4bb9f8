# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in Blender's own File > Export > glTF: what it writes for a Principled BSDF, with what differs put right.

glTF has EON, by KHR_materials_diffuse_roughness, and one GGX lobe. So it gets the EON that comes nearest to the model, of its
average albedo, and the coat as the lobe. Without a coat KHR_materials_specular switches the lobe off.
"""

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy

from ..blender import report
from ..material.bake import bake_input
from ..material.links import Place
from ..material.surface import Loss
from . import animation, base_color, closures, diffuse_roughness, inputs, losses
from .diffuse import Diffuse
from .exporter import read_stand_ins
from .extras import FAILURES, Extras
from .stand_in import Replaced, StandIn, StandIns, holds_ours

if TYPE_CHECKING:
    from io_scene_gltf2.blender.exp.primitive_extract import PrimitiveCreator
    from io_scene_gltf2.io.com.gltf2_io import Material


class Export:
    """One run of the exporter. Failures are reported instead of raised: the export goes on."""

    def __init__(self) -> None:
        self._stand_ins = StandIns()
        self.extras = Extras()

    def begin(self) -> None:
        """Get ready for the export that is about to run."""
        try:
            read_stand_ins(self._stand_ins, self._make, self._note_mesh)
        except FAILURES as error:
            report.add("glTF", f"True Diffuse materials are left as Blender has them: {error}")

    def _make(self, settings: dict) -> None:
        if settings["gltf_materials"] != "EXPORT":  # no nodes are read
            return
        bakes = bpy.context.scene.true_diffuse.bake and settings["gltf_image_format"] != "NONE"
        for material in list(bpy.data.materials):
            if material.users and material.node_tree and holds_ours(material.node_tree):
                with _guarded(material):
                    _arrange(self._stand_ins.add(material), material, bakes)

    def gather_material(self, gltf_material: "Material", material: bpy.types.Material, settings: dict) -> None:
        """Put right what the exporter has gathered for one of our materials."""
        stand_in = self._stand_ins.of(material)
        if stand_in is None:
            return
        self.extras.add_material(gltf_material, material)
        found = list(stand_in.losses)
        with _guarded(material):
            written, replaced = _written(stand_in)
            if replaced:
                found += _adjust(gltf_material, material, replaced, settings)
            found += losses.of_output(gltf_material, stand_in, written)
            moving = settings[animation.PATHS] if settings["gltf_export_anim_pointer"] else ()
            found += losses.of_animation(material.original, moving)
        for loss in dict.fromkeys(found):
            report.add(material.name, str(loss))

    def _note_mesh(self, creator: "PrimitiveCreator") -> None:
        try:
            self.extras.add_mesh(creator)
        except FAILURES as error:
            reason = error or type(error).__name__
            report.add(creator.blender_mesh.name, f"an import will not know its UV maps and attributes: {reason}")

    def write_extras(self, settings: dict) -> None:
        """Write what an import makes our materials again of, when all materials and meshes are gathered."""
        for name, message in self.extras.write(settings):
            report.add(name, message)


@contextmanager
def _guarded(material: bpy.types.Material) -> Generator[None]:
    try:
        yield
    except FAILURES as error:
        report.add(material.name, f"is left as Blender has it: {error or type(error).__name__}")


def _written(stand_in: StandIn) -> tuple[bpy.types.Node | None, Replaced | None]:
    """Return the Principled BSDF at the output, else the first that the exporter finds, and the node of ours that it is for."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import get_socket

    end = losses.closure(Place(losses.output(stand_in).inputs["Surface"]))
    if not end.socket.is_output:
        return None, None
    node = end.node
    if node.bl_idname != "ShaderNodeBsdfPrincipled":
        socket = get_socket(stand_in.material.node_tree, "Base Color").socket
        node = socket.node if socket else None
    return node, next((replaced for replaced in stand_in.replaced if replaced.principled == node), None)


def _arrange(stand_in: StandIn, material: bpy.types.Material, bakes: bool) -> None:
    """Link what feeds the Principled BSDF that is written as the exporter knows it; notes what glTF cannot hold, or bakes it."""
    resolution = bpy.context.scene.true_diffuse.bake_resolution

    def bake(place: Place, is_color: bool) -> bpy.types.Image:
        image = bake_input(stand_in.material, place, resolution, is_color=is_color, used_as=material)
        stand_in.images.append(image)
        return image

    surface = Place(losses.output(stand_in).inputs["Surface"])
    stand_in.losses += closures.reduce(surface, stand_in.replaced)
    _, replaced = _written(stand_in)
    meshes = [mesh for mesh in bpy.data.meshes if material in mesh.materials[:]]
    if replaced:
        stand_in.losses += inputs.arrange(Place(replaced.principled.outputs[0], replaced.groups), meshes, bake if bakes else None)
        stand_in.losses += diffuse_roughness.arrange(replaced, bake if bakes else None)
    stand_in.losses += inputs.arrange_emission(losses.emissions(surface))


def _adjust(gltf_material: "Material", material: bpy.types.Material, replaced: Replaced, settings: dict) -> Iterator[Loss]:
    """Put right what the exporter has gathered; yields what glTF cannot hold."""
    base = gltf_material.pbr_metallic_roughness
    before = base.base_color_factor
    diffuse = Diffuse(replaced)
    yield from base_color.adjust(base, replaced, diffuse)
    yield from diffuse_roughness.write(gltf_material, material, replaced, diffuse, settings)
    extensions = gltf_material.extensions
    if "KHR_materials_specular" in extensions and "KHR_materials_ior" in extensions and extensions["KHR_materials_ior"].extension:
        # else the exporter drops the index of refraction, as KHR_materials_specular says nothing
        extensions["KHR_materials_specular"].extension.setdefault("specularFactor", 1.0)
    yield from losses.of_layers(gltf_material, replaced)
    is_scaled = base.base_color_factor != before
    animated = animation.use_own_paths(settings, material, replaced, {"Base Color"} if is_scaled else set())
    yield from losses.of_node(replaced, animated)
