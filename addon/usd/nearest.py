# SPDX-License-Identifier: GPL-3.0-or-later
"""What MaterialX has for each reflectance model: its oren_nayar_diffuse_bsdf, one of two formulas.

Without energy_compensation that is equation (1), roughness its sigma; with it EON. Another model becomes the one that the registry
says, with the color that gives it the model's average albedo, so both reflect as much of light from everywhere.
"""

from collections.abc import Mapping
from typing import Any

from ..material.expression import Constant
from ..material.surface import Surface
from ..models import MODELS, by_label
from ..models.eon import Eon
from ..models.geometry import clamp
from ..models.oren_nayar import OrenNayar
from ..models.registry import ReflectanceModel

COMPENSATED = {"lambert": False, "oren_nayar": False, "eon": True}
"""The energy_compensation of the models that the closure has, by id."""


USUAL = {"Roughness": "diffuse_roughness", "IOR": "diffuse_ior"}
"""The surface's parameters by the names of the models'."""


class Nearest:
    """The closure that stands for the `model` of an entry of the menu Model, with a group's numbers `inputs` by socket.

    Raises ValueError for a model that is not registered, KeyError for one whose nearest MaterialX does not have.
    """

    def __init__(self, model: object, inputs: Mapping[str, Any]) -> None:
        self.model: ReflectanceModel = by_label(model)
        self._exact = self.model.reference(inputs)
        self.compensated = COMPENSATED[self.model.materialx.nearest]
        fixed = self.model.materialx.roughness
        self.has_own_roughness = fixed is None
        self.roughness = clamp(float(inputs["Roughness"]) if fixed is None else fixed, 0.0, 1.0 if self.compensated else 100.0)

    @classmethod
    def of(cls, surface: Surface) -> "Nearest":
        """Return the closure for a surface; where a parameter of its model varies, for its usual value."""
        parameter = surface.reflectance.parameter
        usual = parameter.usual if parameter else 0.0
        values = {name: surface[own] for name, own in USUAL.items()}
        numbers = {name: one.value if isinstance(one, Constant) else usual for name, one in values.items()}
        return cls(surface.reflectance.label, numbers)

    @property
    def stands_in(self) -> str:
        """What stands for the model, where MaterialX does not have its formula; else empty."""
        if self.model.materialx.nearest == self.model.id:
            return ""
        roughness = "" if self.has_own_roughness or not self.roughness else f"roughness {self.roughness:g} and "
        return f"{MODELS[self.model.materialx.nearest].label} of {roughness}equal average albedo"

    def albedo(self, rho: float) -> float:
        """Return the model's average albedo, in [0, 1] or a little above; `rho` is clamped to [0, 1]."""
        return self._exact.average_albedo(clamp(rho, 0.0, 1.0))

    def color(self, rho: float) -> float:
        """Return the closure's color; `rho` is clamped to [0, 1]."""
        if not self.stands_in:
            return clamp(rho, 0.0, 1.0)
        albedo = self.albedo(rho)
        if self.compensated:
            return Eon(self.roughness).color(albedo)
        return clamp(albedo / OrenNayar(self.roughness).average_albedo(1.0), 0.0, 1.0)
