# SPDX-License-Identifier: GPL-3.0-or-later
"""The registry of reflectance models: each model's own file describes it once, and all targets look it up here.

Menus, node groups, OSL, GLSL, Realtime, USD, panels, studies and tests go through MODELS or the lookups below, which raise for a
model that is not registered. addon/README.md says how to add one.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any

from .geometry import clamp
from .protocol import Formula, Model
from .terms import FLOATS, Arithmetic, LightFunction, Number, SingleLightTerms, Terms, View, polynomial


@dataclass(frozen=True)
class Parameter:
    """A model's shape parameter: the node groups' `socket`, what it means there, and a usual value."""

    socket: str
    meaning: str
    usual: float
    low: float
    high: float
    """The highest that counts; above it, it counts as that."""
    highest_usual: float
    """The highest that is of use."""

    @property
    def name(self) -> str:
        """The socket's name as studies have it."""
        return self.socket.lower()


SIGMA = Parameter(
    "Roughness",
    "standard deviation of the slope angle in radians; 1 is 57°, and values up to 1.57 can be typed",
    0.33,
    0.0,
    100.0,
    math.pi / 2,
)
ROUGHNESS = Parameter("Roughness", "0 to 1", 0.33, 0.0, 1.0, 1.0)
IOR = Parameter("IOR", "index of refraction of a smooth dielectric", 1.5, 1.0, 3.0, 3.0)


class CyclesClosures(StrEnum):
    """What a model becomes in Cycles without Open Shading Language."""

    DIFFUSE = "the Diffuse BSDF, which is the model"
    DIFFUSE_PER_CHANNEL = "a Diffuse BSDF for each channel, in a color that makes its multiple scattering the model's"
    SINGLE_SCATTERING = "the Diffuse BSDF without its multiple scattering, which is the model"
    LOBES = "a sum of closures, fitted to the model: closures/lobes.py"


class Osl(StrEnum):
    """Where the model's branch of shaders/rough_diffuse.osl is exact; elsewhere it is a fit."""

    EXACT = "everywhere"
    EXACT_TOWARDS_VIEWER = "where light and viewer are on the same side of N"
    FITTED = "nowhere"


@dataclass(frozen=True)
class Glsl:
    """shaders/STEM.glsl, STEM being the model's id, with STEM_surface, STEM_radiance and, for a parameter, STEM_coefficients."""

    albedo_stem: str = "directional_albedo"
    """The file that has STEM_albedo; empty for the model's own."""
    folder: Path | None = None
    """Where the model's own file lies, if not in shaders/."""


@dataclass(frozen=True)
class MaterialX:
    """What MaterialX has for a model: `nearest` is the id of the registered model whose closure it gets.

    Its roughness is the model's own, or `roughness`. If it is another model, its color gives it the same average albedo.
    """

    nearest: str
    roughness: float | None = None


@dataclass(frozen=True)
class NearestEon:
    """The EON that comes nearest to a model, for glTF: of the same average albedo, with the roughness above(x) / below(x).

    Both are polynomials, the constant first, in the model's parameter or, where `is_even`, in its square. Their numbers are those
    of scripts/fit/nearest_eon.py, which says how near it comes.
    """

    above: tuple[float, ...]
    below: tuple[float, ...] = (1.0,)
    is_even: bool = False

    @property
    def has_own_roughness(self) -> bool:
        """Whether the roughness is the model's own."""
        return self == OWN_ROUGHNESS

    def roughness(self, value: Number = 0.0, ops: Arithmetic = FLOATS) -> Number:
        """Return EON's roughness in [0, 1] for a `value` of the model's parameter, inside its range."""
        x = value * value if self.is_even else value
        above, below = (polynomial(ops, each, x) if len(each) > 1 else each[0] for each in (self.above, self.below))
        return ops.clamp(above / below, 0.0, 1.0)


OWN_ROUGHNESS = NearestEon((0.0, 1.0))
SMOOTH = NearestEon((0.0,))  # Lambert


@dataclass(frozen=True)
class ReflectanceModel:
    """One entry of the menu Model, and all that any target has to know of it."""

    id: str
    """The name of its files and functions in shaders/, of its node groups, and in studies; stable."""
    number: int
    """Its place in the menu, and what the OSL shader knows it by; stable."""
    label: str
    """The menu's entry, which files keep."""
    description: str
    formula: Callable[..., Formula]
    """The class of the formula; of the value of the parameter, or of nothing."""
    terms: type[Terms]
    """The model for node trees: its expansion into lobes and, from SingleLightTerms, its form under one light."""
    materialx: MaterialX
    eon: NearestEon
    parameter: Parameter | None = None
    functions: tuple[LightFunction, ...] = ()
    """The functions of the light in its expansion, fitted together under the name of the first by scripts/fit/lobes.py."""
    glsl: Glsl = Glsl()
    osl: Osl | None = None
    """None for a model that the OSL shader lacks: it then keeps its closures in Cycles."""
    cycles: CyclesClosures = CyclesClosures.LOBES

    @property
    def has_single_light(self) -> bool:
        """Whether the node groups can evaluate it exactly for chosen lights."""
        return issubclass(self.terms, SingleLightTerms)

    @property
    def is_rough(self) -> bool:
        """Whether it has a roughness, at 0 of which it is Lambert's."""
        return self.parameter is not None and self.parameter.socket == ROUGHNESS.socket

    def shape(self, inputs: Mapping[str, Any]) -> tuple[float, ...]:
        """Return the values of its parameters among a group's sockets by name: one number or none."""
        return (float(inputs[self.parameter.socket]),) if self.parameter else ()

    def reference(self, inputs: Mapping[str, Any]) -> Formula:
        """Return its formula for a group's sockets by name."""
        return self.formula(*self.shape(inputs))

    def terms_of(self, formula: Model, view: View) -> Terms:
        """Return the terms of one of its formulas, inside the parameter's range; TypeError for what is no dataclass."""
        if not is_dataclass(formula) or isinstance(formula, type):
            raise TypeError(f"{formula} is no formula")
        values = (getattr(formula, field.name) for field in fields(formula) if field.init)
        return self.terms(view, *(clamp(value, self.parameter.low, self.parameter.high) for value in values if self.parameter))


class _Models(dict[str, ReflectanceModel]):
    def __missing__(self, key: str) -> ReflectanceModel:
        raise KeyError(f"{key} is no registered reflectance model: {', '.join(self)}")


_models = _Models()
MODELS: Mapping[str, ReflectanceModel] = MappingProxyType(_models)
"""By id, in the order of the menu. Raises KeyError for an id that is not registered."""
DEFAULT = "oren_nayar"
"""The id of the model that a new material has."""


def register(model: ReflectanceModel) -> None:
    """Add `model`; raises ValueError where its id, number or label is another's."""
    for other in _models.values():
        if model.id == other.id or model.number == other.number or model.label == other.label:
            raise ValueError(f"{model.label} ({model.id}, {model.number}) clashes with {other.label} ({other.id}, {other.number})")
    _models[model.id] = model
    ordered = sorted(_models.values(), key=lambda each: each.number)
    _models.clear()
    _models.update((each.id, each) for each in ordered)


def unregister(model: ReflectanceModel) -> None:
    """Take `model` away; raises KeyError where it is not registered."""
    del _models[model.id]


def by_label(label: object) -> ReflectanceModel:
    """Return the model of an entry of the menu Model; raises ValueError where there is none."""
    return _only(lambda model: model.label == label, label)


def by_number(number: int) -> ReflectanceModel:
    """Return the model of a number; raises ValueError where there is none."""
    return _only(lambda model: model.number == number, number)


def by_formula(formula: Model) -> ReflectanceModel:
    """Return the model that `formula` is of; raises ValueError where it is of none."""
    return _only(lambda model: model.formula is type(formula), type(formula).__name__)


def _only(is_it: Callable[[ReflectanceModel], bool], asked: object) -> ReflectanceModel:
    for model in _models.values():
        if is_it(model):
            return model
    raise ValueError(f"{asked} is no registered reflectance model: {', '.join(model.label for model in _models.values())}")
