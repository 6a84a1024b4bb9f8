# SPDX-License-Identifier: GPL-3.0-or-later
"""Our groups as UsdPreviewSurface, for programs without MaterialX.

UsdPreviewSurface has Lambert and one GGX lobe with Schlick's Fresnel term. Lambert gets the model's average albedo. The lobe is the
coat's where there is one; else its reflectance at normal incidence is 0, both as ior 1 and as black specularColor of the specular
workflow, and its roughness is 1. What remains is Schlick's reflectance at grazing angles, which the specification sets to 1.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

from ..material.surface import Attribute, GroupSurface, Image, Source, texture_factor
from ..models.geometry import clamp
from ..nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from .materialx import highlight
from .nearest import Nearest
from .network import COLOR, FILE, FLOAT, INT, STRING, TOKEN, VECTOR2, VECTOR3, VECTOR4, Constant, Input, Network, Output


@dataclass(frozen=True)
class Gloss:
    """The specular lobe: its weight in [0, 1], index of refraction and roughness, the square root of alpha."""

    weight: float = 0.0
    ior: float = 1.0
    roughness: float = 1.0

    @property
    def reflectance(self) -> float:
        """Return the reflectance at normal incidence."""
        return self.weight * ((self.ior - 1.0) / (self.ior + 1.0)) ** 2


def network(surface: GroupSurface) -> Network:
    """Return the network of `surface`. Raises ValueError for an unknown group."""
    shaders = Network("Preview_")
    lobe = gloss(surface)
    mirror = sqrt(min(lobe.reflectance, 0.99))
    source = surface.linked.get("Specular Roughness")
    roughness = Constant(FLOAT, lobe.roughness)
    shaders.add(
        "surface",
        "UsdPreviewSurface",
        TOKEN,
        "surface",
        diffuseColor=_color(shaders, surface, albedo(surface)),
        useSpecularWorkflow=Constant(INT, 1),
        specularColor=Constant(COLOR, (lobe.reflectance,) * 3),
        roughness=_image(shaders, "Specular_Roughness", source, "r", FLOAT) if isinstance(source, Image) else roughness,
        ior=Constant(FLOAT, (1.0 + mirror) / (1.0 - mirror)),
    )
    return shaders


def unsupported(surface: GroupSurface) -> list[str]:
    """Return a message where only UsdPreviewSurface cannot hold the color: it can scale images, but not attributes."""
    source = surface.linked.get("Color")
    factor = source.factor * texture_factor(albedo(surface)) if isinstance(source, Attribute) else 1.0
    exact = abs(factor - 1.0) < 0.005
    return [] if exact else [f"Color: UsdPreviewSurface has the color attribute without the factor {factor:.3g}"]


def albedo(surface: GroupSurface) -> Callable[[float], float]:
    """Return the function from a channel of Color to the average albedo below the coat. Raises ValueError for an unknown group."""
    if surface.group == SPECULAR_GROUP.key:
        return lambda rho: clamp(rho, 0.0, 1.0)
    if surface.group not in (ROUGH_DIFFUSE.key, SUBSURFACE.key):
        raise ValueError(f"unknown group {surface.group}")
    nearest = Nearest(surface.choice("Model"), surface.inputs)
    subsurface = clamp(surface.number("Subsurface"), 0.0, 1.0) if surface.group == SUBSURFACE.key else 0.0
    return lambda rho: clamp((1.0 - subsurface) * nearest.albedo(rho) + subsurface * rho, 0.0, 1.0)


def gloss(surface: GroupSurface) -> Gloss:
    """Return the lobe of the coat, or of Standard Specular's highlight; one of weight 0 where there is neither."""
    if surface.group == SPECULAR_GROUP.key:
        height, alpha = highlight(surface)
        mirror = sqrt(clamp(height, 0.0, 0.99))
        return Gloss(1.0, (1.0 + mirror) / (1.0 - mirror), sqrt(alpha)) if height > 0.0 else Gloss()
    weight = clamp(surface.number("Specular"), 0.0, 1.0) if surface.group == SUBSURFACE.key else 0.0
    if weight == 0.0:
        return Gloss()
    return Gloss(weight, clamp(surface.number("IOR"), 1.0, 3.0), clamp(surface.number("Specular Roughness"), 0.0, 1.0))


def _color(shaders: Network, surface: GroupSurface, function: Callable[[float], float]) -> Input:
    source: Source | None = surface.linked.get("Color")
    if isinstance(source, Image):
        return _image(shaders, "Color", source, "rgb", VECTOR3, texture_factor(function))._replace(type=COLOR)
    if isinstance(source, Attribute):
        name = Constant(STRING, source.primvar)
        return shaders.add("Color_attribute", "UsdPrimvarReader_float4", VECTOR4, "result", varname=name)._replace(type=COLOR)
    red, green, blue = map(function, surface.rgb("Color"))
    return Constant(COLOR, (red, green, blue))


def _image(shaders: Network, name: str, image: Image, output: str, kind: str, factor: float = 1.0) -> Output:
    coordinate = shaders.add(
        f"{name}_coordinate", "UsdPrimvarReader_float2", VECTOR2, "result", varname=Constant(STRING, image.primvar)
    )
    wrap = Constant(TOKEN, "repeat" if image.wrap == "periodic" else image.wrap)
    factor *= image.factor
    return shaders.add(
        f"{name}_image",
        "UsdUVTexture",
        kind,
        output,
        file=Constant(FILE, image.file),
        st=coordinate,
        sourceColorSpace=Constant(TOKEN, "sRGB" if image.is_color else "raw"),
        scale=Constant(VECTOR4, (factor, factor, factor, 1.0)),
        wrapS=wrap,
        wrapT=wrap,
    )
