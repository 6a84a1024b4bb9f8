# SPDX-License-Identifier: GPL-3.0-or-later
"""The base color: glTF's diffuse reflection is Lambert's, so it gets the reflectance model's average albedo as its color."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import bpy

from ..material.expression import Constant, number
from ..material.links import Place
from ..material.read_closures import ClosureReader
from ..material.surface import PARAMETERS, Loss, Surface, texture_factor
from ..models.geometry import clamp
from .inputs import varies
from .stand_in import Replaced

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import MaterialPBRMetallicRoughness

NEGLIGIBLE = 0.005  # of a factor
WEIGHTS = ("metallic", "transmission_weight", "subsurface_weight")  # of what reflects no light by the reflectance model


def adjust(base: "MaterialPBRMetallicRoughness", replaced: Replaced) -> Iterator[Loss]:
    """Give the base color the average albedo: exact for a constant; an image or a color attribute can only be scaled."""
    reader = ClosureReader(bpy.context.scene.unit_settings.scale_length)
    surface = reader.surface(Place(replaced.node.outputs["BSDF"].links[0].to_socket))
    parameter = surface.model_parameter
    if parameter and not isinstance(surface[parameter], Constant):
        what = f"what feeds the {parameter.removeprefix('diffuse_').replace('ior', 'IOR')} of {surface.reflectance.label}"
        yield Loss("base_color", replaced.label, what, "the average albedo of the socket's own value is written")
    albedo = _albedo(surface, reader)
    scale = texture_factor(albedo)
    if not isinstance(surface["metallic"], Constant) and abs(scale - 1.0) > NEGLIGIBLE:
        what = f"the albedo of {surface.reflectance.label}, {scale:.3g} times Lambert's, beside a metal that varies"
        yield Loss("base_color", replaced.label, what, "the color is written as it is")
        return
    red, green, blue, alpha = base.base_color_factor or (1.0, 1.0, 1.0, 1.0)
    if varies(Place(replaced.principled.inputs["Base Color"], replaced.groups)):
        red, green, blue = (clamp(scale * channel, 0.0, 1.0) for channel in (red, green, blue))
    else:
        red, green, blue = map(albedo, (red, green, blue))
    if base.base_color_factor or (red, green, blue) != (1.0, 1.0, 1.0):
        base.base_color_factor = [red, green, blue, alpha]


def _albedo(surface: Surface, reader: ClosureReader) -> Callable[[float], float]:
    """Return the function from a channel of the base color to the average albedo of what lies below the specular layer.

    Inputs that vary count with their own values.
    """

    def constant(parameter: str) -> float:
        value = surface[parameter]
        if isinstance(value, Constant):
            return number(value.value)
        place = reader.places.get(parameter) or reader.places.get(parameter.replace("diffuse_", "specular_"))
        return place.socket.default_value if place else number(PARAMETERS[parameter])

    model = surface.reflectance.reference({"Roughness": constant("diffuse_roughness"), "IOR": constant("diffuse_ior")})
    rough = 1.0
    for weight in WEIGHTS:
        rough *= 1.0 - clamp(constant(weight), 0.0, 1.0)

    def albedo(rho: float) -> float:
        return clamp(rough * model.average_albedo(clamp(rho, 0.0, 1.0)) + (1.0 - rough) * rho, 0.0, 1.0)

    return albedo
