# SPDX-License-Identifier: GPL-3.0-or-later
"""The diffuse reflection of a node of ours as glTF has it: EON of KHR_materials_diffuse_roughness, or Lambert where that is smooth.

KHR_materials_diffuse_roughness is Khronos' proposal (KhronosGroup/glTF, pull request 2481): the roughness of EON as in OpenPBR, its
texture's red channel times its factor. EON's color is the base color.
"""

import bpy

from ..material.expression import Constant, number
from ..material.links import Place
from ..material.read_closures import ClosureReader
from ..material.surface import PARAMETERS, texture_factor
from ..models.eon import Eon, diluted
from ..models.geometry import clamp
from ..models.terms import FLOATS, Arithmetic, Number
from .stand_in import Replaced

NEGLIGIBLE = 0.005  # of a factor of the color


class Diffuse:
    """What stands for the reflectance model of `replaced` and the subsurface scattering mixed with it.

    Inputs that vary count with their own values, an image of the roughness with its mean.
    """

    def __init__(self, replaced: Replaced) -> None:
        self._reader = ClosureReader(bpy.context.scene.unit_settings.scale_length)
        self.surface = self._reader.surface(Place(replaced.node.outputs["BSDF"].links[0].to_socket))
        self.model = self.surface.reflectance
        self._seen = (1.0 - self._weight("metallic")) * (1.0 - self._weight("transmission_weight"))
        self._share = 1.0 - self._weight("subsurface_weight")  # of the model; the rest scatters as Lambert reflects
        own = self.constant(self.surface.model_parameter) if self.model.parameter else 0.0
        self._value = own if replaced.mean_roughness is None else replaced.mean_roughness
        self.roughness = self.eon_roughness(self._value)
        """EON's, in [0, 1]."""

    def constant(self, parameter: str) -> float:
        """Return the number that a parameter of the surface is, or its input's own where it varies."""
        value = self.surface[parameter]
        if isinstance(value, Constant):
            return number(value.value)
        place = self._reader.places.get(parameter) or self._reader.places.get(parameter.replace("diffuse_", "specular_"))
        return place.socket.default_value if place else number(PARAMETERS[parameter])

    def _weight(self, parameter: str) -> float:
        return clamp(self.constant(parameter), 0.0, 1.0)

    @property
    def varies(self) -> bool:
        """Whether the model's parameter does."""
        parameter = self.surface.model_parameter
        return bool(parameter) and not isinstance(self.surface[parameter], Constant)

    @property
    def color_varies(self) -> bool:
        """Whether the base color would have to vary with the model's parameter: not for EON, whose color is rho."""
        parameter = self.model.parameter
        if not (parameter and self.varies):
            return False
        scale = texture_factor(lambda rho: self.color(rho, parameter.highest_usual))
        return abs(scale - 1.0) > NEGLIGIBLE

    @property
    def has_own_roughness(self) -> bool:
        """Whether EON's roughness is the model's."""
        return self.model.eon.has_own_roughness and self._share == 1.0 and self._seen > 0.0

    def eon_roughness(self, value: Number, ops: Arithmetic = FLOATS) -> Number:
        """Return EON's roughness in [0, 1] for a `value` of the model's parameter."""
        parameter = self.model.parameter
        if not self._seen:
            return 0.0
        inside = ops.clamp(value, parameter.low, parameter.high) if parameter else value
        return diluted(self.model.eon.roughness(inside, ops), self._share)

    def color(self, rho: float, value: float | None = None) -> float:
        """Return the base color's channel for the model's `rho`, in [0, 1].

        What reflects diffusely gets EON's color of the same average albedo, metal and glass keep `rho`. `value` of the model's
        parameter is the surface's own by default.
        """
        value, rho = self._value if value is None else value, clamp(rho, 0.0, 1.0)
        formula = self.model.formula(*([value] if self.model.parameter else []))
        albedo = self._share * formula.average_albedo(rho) + (1.0 - self._share) * rho
        color = Eon(self.eon_roughness(value)).color(min(albedo, 1.0))
        return clamp(self._seen * color + (1.0 - self._seen) * rho, 0.0, 1.0)
