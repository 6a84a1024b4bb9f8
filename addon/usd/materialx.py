# SPDX-License-Identifier: GPL-3.0-or-later
"""Our groups as networks of MaterialX 1.39's physically based shading nodes.

    Rough Diffuse       oren_nayar_diffuse_bsdf
    Subsurface          dielectric_bsdf over a mix of subsurface_bsdf and oren_nayar_diffuse_bsdf
    Standard Specular   oren_nayar_diffuse_bsdf of roughness 0 and a microfacet lobe, added

The lobe of Standard Specular is that of the node group: GGX with alpha^2 = 2 / (n + 2), of height (n + 8) / (n + 2) k_s, times V.H,
which generalized_schlick_bsdf has with exponent 1 from color0 to black: V.H is mu at the mirror direction.
"""

from collections.abc import Callable

from ..material.surface import Attribute, GroupSurface, Image, texture_factor
from ..models.color import LUMINANCE
from ..models.geometry import clamp
from ..nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from .nearest import Nearest
from .network import BOOL, COLOR, COLOR4, FILE, FLOAT, INT, STRING, TOKEN, VECTOR2, Constant, Input, Network, Output

VERSION = "1.39"
# Inputs of each group that take image textures, and inputs that take color attributes
IMAGES = {
    ROUGH_DIFFUSE.key: ("Color", "Roughness"),
    SUBSURFACE.key: ("Color", "Roughness", "Subsurface", "Subsurface Radius", "Specular", "Specular Roughness"),
    SPECULAR_GROUP.key: ("Color",),
}
ATTRIBUTES = ("Color", "Subsurface Radius")


def network(surface: GroupSurface, millimeter: float) -> Network:
    """Return the network of `surface`; `millimeter` is a millimeter in the stage's units. Raises KeyError for an unknown group."""
    builder = _Builder(surface)
    bsdfs = {
        ROUGH_DIFFUSE.key: builder.rough,
        SUBSURFACE.key: lambda: builder.subsurface(millimeter),
        SPECULAR_GROUP.key: builder.specular,
    }
    builder.network.add("surface", "ND_surface", TOKEN, bsdf=bsdfs[surface.group]())
    return builder.network


class _Builder:
    def __init__(self, surface: GroupSurface) -> None:
        self.surface = surface
        self.network = Network("MaterialX_")

    def rough(self) -> Output:
        surface = self.surface
        nearest = Nearest(surface.choice("Model"), surface.inputs)
        fixed = Constant(FLOAT, nearest.roughness)
        roughness = self.number("Roughness", lambda _: nearest.roughness) if nearest.has_own_roughness else fixed
        return self.diffuse(nearest.color, roughness, nearest.compensated)

    def diffuse(self, color: Callable[[float], float], roughness: Input, compensated: bool) -> Output:
        """Return Oren-Nayar's closure in the `color` made of each channel of the surface's Color."""
        return self.network.add(
            "diffuse",
            "ND_oren_nayar_diffuse_bsdf",
            TOKEN,
            color=self.color("Color", color),
            roughness=roughness,
            energy_compensation=Constant(BOOL, compensated),
        )

    def subsurface(self, millimeter: float) -> Output:
        surface, add = self.surface, self.network.add
        scale = clamp(surface.number("Scale"), 0.0, float("inf")) * millimeter
        scattered = add(
            "subsurface",
            "ND_subsurface_bsdf",
            TOKEN,
            color=self.color("Color", _unit),
            radius=self.color("Subsurface Radius", lambda length: scale * max(length, 0.0)),
        )
        base = add("base", "ND_mix_bsdf", TOKEN, fg=scattered, bg=self.rough(), mix=self.number("Subsurface", _unit))
        coat = add(
            "coat",
            "ND_dielectric_bsdf",
            TOKEN,
            weight=self.number("Specular", _unit),
            ior=Constant(FLOAT, clamp(surface.number("IOR"), 1.0, 3.0)),
            roughness=self.alpha("Specular Roughness"),
        )
        return add("layers", "ND_layer_bsdf", TOKEN, top=coat, base=base)

    def specular(self) -> Output:
        height, alpha = highlight(self.surface)
        diffuse = self.diffuse(_unit, Constant(FLOAT, 0.0), False)
        lobe = self.network.add(
            "highlight",
            "ND_generalized_schlick_bsdf",
            TOKEN,
            color0=Constant(COLOR, (height,) * 3),
            color90=Constant(COLOR, (0.0,) * 3),
            exponent=Constant(FLOAT, 1.0),
            roughness=Constant(VECTOR2, (alpha, alpha)),
        )
        return self.network.add("sum", "ND_add_bsdf", TOKEN, in1=diffuse, in2=lobe)

    def color(self, socket: str, function: Callable[[float], float]) -> Input:
        """Return `function` of each channel of a color or vector input; of an image or attribute, times `texture_factor`."""
        source = self.surface.linked.get(socket)
        if source is None:
            red, green, blue = map(function, self.surface.rgb(socket))
            return Constant(COLOR, (red, green, blue))
        name = socket.replace(" ", "_")
        value = self.image(name, source) if isinstance(source, Image) else self.attribute(name, source)
        return self.scaled(name, value, source.factor * texture_factor(function))

    def number(self, socket: str, function: Callable[[float], float]) -> Input:
        """Return `function` of a number input, or the luminance of an image linked to it."""
        source = self.surface.linked.get(socket)
        if not isinstance(source, Image):
            return Constant(FLOAT, function(self.surface.number(socket)))
        name = socket.replace(" ", "_")
        weights = Constant(COLOR, LUMINANCE)
        gray = self.network.add(
            f"{name}_gray", "ND_luminance_color3", COLOR, lumacoeffs=weights, **{"in": self.image(name, source)}
        )
        value = self.network.add(name, "ND_extract_color3", FLOAT, index=Constant(INT, 0), **{"in": gray})
        return self.scaled(name, value, source.factor)

    def alpha(self, socket: str) -> Input:
        """Return alpha of a microfacet lobe along both axes, the square of the roughness."""
        roughness = self.number(socket, _unit)
        if isinstance(roughness, Constant):
            alpha = _unit(self.surface.number(socket)) ** 2
            return Constant(VECTOR2, (alpha, alpha))
        return self.network.add("alpha", "ND_roughness_anisotropy", VECTOR2, roughness=roughness)

    def image(self, name: str, image: Image) -> Output:
        coordinate = self.network.add(
            f"{name}_coordinate", "ND_geompropvalue_vector2", VECTOR2, geomprop=Constant(STRING, image.primvar)
        )
        wrap = Constant(STRING, "constant" if image.wrap == "black" else image.wrap)
        return self.network.add(
            f"{name}_image",
            "ND_image_color3",
            COLOR,
            file=Constant(FILE, image.file, "srgb_texture" if image.is_color else "lin_rec709"),
            texcoord=coordinate,
            uaddressmode=wrap,
            vaddressmode=wrap,
        )

    def attribute(self, name: str, attribute: Attribute) -> Output:
        value = self.network.add(
            f"{name}_attribute", "ND_geompropvalue_color4", COLOR4, geomprop=Constant(STRING, attribute.primvar)
        )
        return self.network.add(f"{name}_rgb", "ND_convert_color4_color3", COLOR, **{"in": value})

    def scaled(self, name: str, value: Output, factor: float) -> Output:
        if factor == 1.0:
            return value
        identifier = "ND_multiply_color3FA" if value.type == COLOR else "ND_multiply_float"
        return self.network.add(f"{name}_factor", identifier, value.type, in1=value, in2=Constant(FLOAT, factor))


def _unit(value: float) -> float:
    return clamp(value, 0.0, 1.0)


def highlight(surface: GroupSurface) -> tuple[float, float]:
    """Return the height and alpha of Standard Specular's lobe."""
    exponent = clamp(surface.number("Exponent"), 0.0, 10000.0)
    height = _unit(surface.number("Specular")) * (exponent + 8.0) / (exponent + 2.0)
    return height, (2.0 / (exponent + 2.0)) ** 0.5


def unsupported(surface: GroupSurface) -> list[str]:
    """Return a message where MaterialX does not have the surface's reflectance model."""
    if surface.group == SPECULAR_GROUP.key:
        return []
    nearest = Nearest(surface.choice("Model"), surface.inputs)
    return [f"{nearest.model.label} is no model of MaterialX: {nearest.stands_in} stands for it"] if nearest.stands_in else []
