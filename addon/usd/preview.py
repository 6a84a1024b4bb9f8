# SPDX-License-Identifier: GPL-3.0-or-later
"""Our groups as UsdPreviewSurface, for programs without MaterialX.

It knows Lambert and one GGX lobe with Schlick's Fresnel. Lambert gets the model's average albedo. The lobe is the coat's where
there is one; else its head-on reflectance is 0 both ways that programs read it (ior 1, and black specularColor in the specular
workflow) and its roughness 1. That leaves what Schlick adds at a grazing half-angle, where the specification sets it to 1.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

from ..material.surface import Attribute, Image, Source, Surface, slope
from ..models.geometry import clamp
from .materialx import highlight
from .nearest import Nearest
from .network import COLOR, FILE, FLOAT, INT, STRING, TOKEN, VECTOR2, VECTOR3, VECTOR4, Constant, Input, Network, Output


@dataclass(frozen=True)
class Gloss:
    """The lobe: the weight and index of refraction of the surface that mirrors, and its roughness, alpha = roughness squared."""

    weight: float = 0.0
    ior: float = 1.0
    roughness: float = 1.0

    @property
    def reflectance(self) -> float:
        """What it mirrors head-on."""
        return self.weight * ((self.ior - 1.0) / (self.ior + 1.0)) ** 2


def network(surface: Surface) -> Network:
    """Return the network of `surface`."""
    made = Network("Preview_")
    lobe = gloss(surface)
    mirror = sqrt(min(lobe.reflectance, 0.99))
    source = surface.fed.get("Specular Roughness")
    roughness = Constant(FLOAT, lobe.roughness)
    made.add(
        "surface",
        "UsdPreviewSurface",
        TOKEN,
        "surface",
        diffuseColor=_color(made, surface, albedo(surface)),
        useSpecularWorkflow=Constant(INT, 1),
        specularColor=Constant(COLOR, (lobe.reflectance,) * 3),
        roughness=_image(made, "Specular_Roughness", source, "r", FLOAT) if isinstance(source, Image) else roughness,
        ior=Constant(FLOAT, (1.0 + mirror) / (1.0 - mirror)),
    )
    return made


def lost(surface: Surface) -> list[str]:
    """Return in words what UsdPreviewSurface alone cannot hold: it has nothing to multiply with but in images."""
    source = surface.fed.get("Color")
    factor = source.factor * slope(albedo(surface)) if isinstance(source, Attribute) else 1.0
    exact = abs(factor - 1.0) < 0.005
    return [] if exact else [f"Color: UsdPreviewSurface has the color attribute without the factor {factor:.3g}"]


def albedo(surface: Surface) -> Callable[[float], float]:
    """Return the function that takes a channel of the Color to what is reflected of light from everywhere, below the coat."""
    if surface.group == "specular":
        return lambda rho: clamp(rho, 0.0, 1.0)
    nearest = Nearest(surface.choice("Model"), surface.number("Roughness"), surface.number("IOR"))
    below = clamp(surface.number("Subsurface"), 0.0, 1.0) if surface.group == "subsurface" else 0.0
    return lambda rho: clamp((1.0 - below) * nearest.albedo(rho) + below * rho, 0.0, 1.0)


def gloss(surface: Surface) -> Gloss:
    """Return the lobe that is the coat's, or the highlight's of Standard Specular."""
    if surface.group == "specular":
        height, alpha = highlight(surface)
        mirror = sqrt(clamp(height, 0.0, 0.99))
        return Gloss(1.0, (1.0 + mirror) / (1.0 - mirror), sqrt(alpha)) if height > 0.0 else Gloss()
    weight = clamp(surface.number("Specular"), 0.0, 1.0) if surface.group == "subsurface" else 0.0
    if weight == 0.0:
        return Gloss()
    return Gloss(weight, clamp(surface.number("IOR"), 1.0, 3.0), clamp(surface.number("Specular Roughness"), 0.0, 1.0))


def _color(made: Network, surface: Surface, law: Callable[[float], float]) -> Input:
    source: Source | None = surface.fed.get("Color")
    if isinstance(source, Image):
        return _image(made, "Color", source, "rgb", VECTOR3, slope(law))._replace(type=COLOR)
    if isinstance(source, Attribute):
        name = Constant(STRING, source.primvar)
        return made.add("Color_attribute", "UsdPrimvarReader_float4", VECTOR4, "result", varname=name)._replace(type=COLOR)
    red, green, blue = map(law, surface.rgb("Color"))
    return Constant(COLOR, (red, green, blue))


def _image(made: Network, name: str, image: Image, output: str, kind: str, factor: float = 1.0) -> Output:
    coordinate = made.add(
        f"{name}_coordinate", "UsdPrimvarReader_float2", VECTOR2, "result", varname=Constant(STRING, image.primvar)
    )
    wrap = Constant(TOKEN, "repeat" if image.wrap == "periodic" else image.wrap)
    factor *= image.factor
    return made.add(
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
