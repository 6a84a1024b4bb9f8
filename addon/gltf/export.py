# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in Blender's own File > Export > glTF: what it writes for a Principled BSDF, with what differs put right.

glTF has Lambert and one GGX lobe, as UsdPreviewSurface does, so it gets the same: the model's average albedo as base color, and the
coat as the lobe. Without a coat KHR_materials_specular switches the lobe off.
"""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy

from ..blender import report
from ..material.bake import bake_input
from ..material.expression import Constant, number
from ..material.links import Place
from ..material.read_closures import ClosureReader
from ..material.surface import Loss, Surface, texture_factor
from ..models.geometry import clamp
from . import inputs, losses
from .exporter import read_stand_ins
from .stand_in import Replaced, StandIn, StandIns, holds_ours

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import Material

FAILURES = (RuntimeError, TypeError, ValueError, LookupError, AttributeError, ImportError, ArithmeticError, OSError, ReferenceError)
NEGLIGIBLE = 0.005  # of a factor


class Export:
    """One run of the exporter. Failures are reported instead of raised: the export goes on."""

    def __init__(self) -> None:
        self._stand_ins = StandIns()

    def begin(self) -> None:
        """Get ready for the export that is about to run."""
        try:
            read_stand_ins(self._stand_ins, self._make)
        except FAILURES as error:
            report.add("glTF", f"True Diffuse materials are left as Blender has them: {error}")

    def _make(self) -> None:
        for material in list(bpy.data.materials):
            if material.node_tree and holds_ours(material.node_tree):
                with _guarded(material):
                    _arrange(self._stand_ins.add(material), material)

    def gather_material(self, gltf_material: "Material", material: bpy.types.Material) -> None:
        """Put right what the exporter has gathered for one of our materials."""
        stand_in = self._stand_ins.of(material)
        if stand_in is None:
            return
        found = list(stand_in.losses)
        with _guarded(material):
            written, replaced = _written(stand_in)
            if replaced:
                found += [*_adjust(gltf_material, replaced), *losses.of_node(replaced), *losses.of_layers(gltf_material, replaced)]
            if written:
                found += losses.of_output(gltf_material, stand_in, written)
        for loss in dict.fromkeys(found):
            report.add(material.name, str(loss))


@contextmanager
def _guarded(material: bpy.types.Material) -> Generator[None]:
    try:
        yield
    except FAILURES as error:
        report.add(material.name, f"is left as Blender has it: {error or type(error).__name__}")


def _written(stand_in: StandIn) -> tuple[bpy.types.Node | None, Replaced | None]:
    """Return the Principled BSDF that the exporter writes, the first that it finds, and the node of ours that it stands for."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import get_socket

    socket = get_socket(stand_in.material.node_tree, "Base Color").socket
    node = socket.node if socket else None
    return node, next((replaced for replaced in stand_in.replaced if replaced.principled == node), None)


def _arrange(stand_in: StandIn, material: bpy.types.Material) -> None:
    """Link what feeds the Principled BSDF that is written as the exporter knows it; notes what glTF cannot hold."""
    settings = bpy.context.scene.true_diffuse

    def bake(place: Place, is_color: bool) -> bpy.types.Image:
        image = bake_input(stand_in.material, place, settings.bake_resolution, is_color=is_color, used_as=material)
        stand_in.images.append(image)
        return image

    _, replaced = _written(stand_in)
    if replaced:
        stand_in.losses += inputs.arrange(replaced.principled, replaced.groups, bake if settings.bake else None)


def _adjust(gltf_material: "Material", replaced: Replaced) -> Iterator[Loss]:
    """Put right what the exporter has gathered; yields what cannot be."""
    yield from _adjust_base_color(gltf_material, replaced)
    extensions = gltf_material.extensions
    if "KHR_materials_specular" in extensions and "KHR_materials_ior" in extensions and extensions["KHR_materials_ior"].extension:
        # else the exporter drops the index of refraction, as KHR_materials_specular says nothing
        extensions["KHR_materials_specular"].extension.setdefault("specularFactor", 1.0)


def _adjust_base_color(gltf_material: "Material", replaced: Replaced) -> Iterator[Loss]:
    """Give the base color the model's average albedo: exact for a constant; an image or a color attribute can only be scaled."""
    reader = ClosureReader(bpy.context.scene.unit_settings.scale_length)
    surface = reader.surface(Place(replaced.node.outputs["BSDF"].links[0].to_socket))
    own = {parameter: place.socket.default_value for parameter, place in reader.places.items()}
    albedo, base = _albedo(surface, own), gltf_material.pbr_metallic_roughness
    if surface.model_parameter and not isinstance(surface[surface.model_parameter], Constant):
        place = reader.places[surface.model_parameter]
        what = f"what feeds {place.socket.name} of {surface.reflectance.label}"
        yield Loss(surface.model_parameter, place.label, what, "the average albedo of the socket's own value is written")
    red, green, blue, alpha = base.base_color_factor or (1.0, 1.0, 1.0, 1.0)
    scale = texture_factor(albedo)
    if base.metallic_roughness_texture and not isinstance(surface["metallic"], Constant) and abs(scale - 1.0) > NEGLIGIBLE:
        what = f"the albedo of {surface.reflectance.label}, {scale:.3g}, of the part that is no metal"
        yield Loss("Base Color", replaced.label, what, "the color is written as it is")
        return
    if inputs.varies(Place(replaced.principled.inputs["Base Color"], replaced.groups)):
        red, green, blue = (clamp(scale * channel, 0.0, 1.0) for channel in (red, green, blue))
    else:
        red, green, blue = map(albedo, (red, green, blue))
    base.base_color_factor = [red, green, blue, alpha]


def _albedo(surface: Surface, own: Mapping[str, float]) -> Callable[[float], float]:
    """Return the function from a channel of the base color to the average albedo of what lies below the specular layer.

    Inputs that vary have their `own` values, by parameter.
    """

    def constant(parameter: str) -> float:
        value = surface[parameter]
        return number(value.value) if isinstance(value, Constant) else own[parameter]

    model = surface.reflectance.reference({"Roughness": constant("diffuse_roughness"), "IOR": constant("diffuse_ior")})
    rough = 1.0
    for weight in ("metallic", "transmission_weight", "subsurface_weight"):
        rough *= 1.0 - clamp(constant(weight), 0.0, 1.0)

    def albedo(rho: float) -> float:
        return clamp(rough * model.average_albedo(clamp(rho, 0.0, 1.0)) + (1.0 - rough) * rho, 0.0, 1.0)

    return albedo
