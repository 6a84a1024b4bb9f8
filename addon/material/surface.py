# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's surface as plain values, which all targets read: Realtime, USD, glTF. No bpy."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ..models.registry import MODELS, ReflectanceModel
from .expression import Constant, Expression, Value

type Rgb = tuple[float, float, float]
type Setting = float | str | tuple[float, ...]


# Every parameter of a surface with its default, which means that the surface lacks it. The names are OpenPBR's
# (https://academysoftwarefoundation.github.io/OpenPBR) where it has them; Blender's meaning holds where they differ.
PARAMETERS: Mapping[str, Value] = {
    # the base: metal, glass, and a mix of subsurface scattering and rough diffuse reflection under a specular layer
    "base_color": (0.8, 0.8, 0.8),
    "diffuse_roughness": 0.0,  # the parameter Roughness of the reflectance model, as it has it: sigma in radians, or 0 to 1
    "diffuse_ior": 1.5,  # the parameter IOR of Wolff's model
    "metallic": 0.0,
    "transmission_weight": 0.0,
    "subsurface_weight": 0.0,
    "subsurface_radius": (0.0, 0.0, 0.0),  # mean free path of red, green, blue [mm]
    "subsurface_anisotropy": 0.0,
    "specular_weight": 0.0,  # scales the reflectance at normal incidence: twice Principled's Specular IOR Level
    "specular_color": (1.0, 1.0, 1.0),  # Specular Tint
    "specular_roughness": 0.5,  # also of metal and glass; the square root of GGX's alpha
    "specular_ior": 1.5,
    "specular_anisotropy": 0.0,
    "specular_rotation": 0.0,  # of the tangent, in turns
    # Blinn-Phong's highlight k_s (n + 8) / 8 (N.H)^n of Standard Specular
    "highlight_weight": 0.0,
    "highlight_exponent": 30.0,
    # layers above, and what passes all of them
    "coat_weight": 0.0,
    "coat_color": (1.0, 1.0, 1.0),
    "coat_roughness": 0.03,
    "coat_ior": 1.5,
    "fuzz_weight": 0.0,  # Principled's sheen
    "fuzz_color": (1.0, 1.0, 1.0),
    "fuzz_roughness": 0.5,
    "thin_film_thickness": 0.0,  # nm
    "thin_film_ior": 1.33,
    "emission_color": (1.0, 1.0, 1.0),
    "emission_strength": 0.0,  # radiance [W/(m^2 sr)] of white
    "opacity": 1.0,
    # geometry, in the world's space; zero is the surface's own
    "normal": (0.0, 0.0, 0.0),
    "coat_normal": (0.0, 0.0, 0.0),
    "tangent": (0.0, 0.0, 0.0),
}


@dataclass(frozen=True)
class Surface:
    """A surface: OpenPBR's layers over a base whose diffuse reflection is one of our models.

    The layers are Principled's: coat and sheen above all, below them metal by `metallic`, of the rest glass by
    `transmission_weight`, of the rest a dielectric specular layer over subsurface scattering by `subsurface_weight` and rough
    diffuse reflection. `inputs` hold the parameters that differ from their defaults.
    """

    model: str
    """Id of the reflectance model."""
    inputs: Mapping[str, Expression] = field(default_factory=dict)
    subsurface_method: str = "RANDOM_WALK"
    """Blender's name of the method."""
    is_multi_scattering: bool = True
    """Whether the specular layers keep the light that their single scattering loses (Multiscatter GGX)."""
    is_coat_averaged: bool = False
    """Whether the coat reflects by its mean reflectance and keeps the light that its single scattering loses, as that of our
    Subsurface group does, rather than by each microfacet's."""
    is_thin_wall: bool = False
    is_blended: bool = False
    """Whether the opacity blends sorted surfaces rather than dithers (Render Method)."""
    is_culled: bool = False
    """Whether the back is not drawn (Backface Culling)."""

    def __post_init__(self) -> None:
        if unknown := set(self.inputs) - set(PARAMETERS):
            raise ValueError(f"unknown parameters: {', '.join(sorted(unknown))}")

    @property
    def reflectance(self) -> ReflectanceModel:
        """The reflectance model; KeyError where it is not registered."""
        return MODELS[self.model]

    def uses(self, parameter: str) -> bool:
        """Return whether a parameter differs from its default."""
        return parameter in self.inputs

    def __getitem__(self, parameter: str) -> Expression:
        """Return a parameter; KeyError where there is no such."""
        return self.inputs.get(parameter) or Constant(PARAMETERS[parameter])

    @property
    def model_parameter(self) -> str:
        """The parameter that the model's own is; empty where it has none."""
        parameter = self.reflectance.parameter
        return {"Roughness": "diffuse_roughness", "IOR": "diffuse_ior"}[parameter.socket] if parameter else ""


@dataclass(frozen=True)
class Loss:
    """Something of a material that cannot be carried: where, what, and what takes its place."""

    parameter: str
    """Of the surface; empty where it is the whole."""
    node: str
    """The node's label or name in Blender."""
    what: str
    instead: str

    def __str__(self) -> str:
        # in Blender's words: what OpenPBR calls fuzz is its sheen
        words = self.parameter.replace("_", " ").replace("fuzz", "sheen").capitalize()
        place = f"{re.sub(r'(?i)\bior\b', 'IOR', words)}: " if words else ""
        return f"{place}{self.what}{f' ({self.node})' if self.node else ''} is not supported, {self.instead}"


@dataclass(frozen=True)
class GroupInputs:
    """A node of one of our groups: the `group`'s key and the values of all `inputs` by name."""

    group: str
    inputs: Mapping[str, Setting]

    def number(self, name: str) -> float:
        """Return the value of a number input; raises TypeError where it is of another type."""
        value = self.inputs[name]
        if not isinstance(value, (int, float)):
            raise TypeError(f"{name} is {value!r}, not a number")
        return float(value)

    def rgb(self, name: str) -> Rgb:
        """Return the value of a color or vector input; raises TypeError where it is of another type."""
        try:
            return rgb(self.inputs[name])
        except TypeError as error:
            raise TypeError(f"{name}: {error}") from error

    def choice(self, name: str) -> str:
        """Return the chosen entry of a menu; raises TypeError where the input is no menu."""
        value = self.inputs[name]
        if not isinstance(value, str):
            raise TypeError(f"{name} is {value!r}, not an entry of a menu")
        return value


def rgb(value: Setting) -> Rgb:
    """Return the first three components of a color or vector; raises TypeError where `value` is neither."""
    if not isinstance(value, tuple) or len(value) < 3:
        raise TypeError(f"{value!r} is not a color")
    return value[0], value[1], value[2]


def texture_factor(function: Callable[[float], float]) -> float:
    """Return the factor that replaces `function` where a target can only scale a texture: exact for 0.5 and where it is linear."""
    return function(0.5) / 0.5
