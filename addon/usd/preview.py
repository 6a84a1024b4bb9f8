# SPDX-License-Identifier: GPL-3.0-or-later
"""A `Surface` as UsdPreviewSurface, for programs without MaterialX.

UsdPreviewSurface has Lambert, one GGX lobe with Schlick's Fresnel term, and a coat. Lambert gets the model's average albedo. The
lobe is the metal's and the specular layer's; where there is neither it is the coat's. Without any its reflectance at normal
incidence is 0, both as ior 1 and as black specularColor of the specular workflow, and its roughness is 1. What remains is Schlick's
reflectance at grazing angles, which the specification sets to 1.
"""

from collections.abc import Mapping

from ..material.expression import Attribute, Expression, ImageTexture, NormalMap, apply, number
from ..material.expression import Constant as Value
from ..material.operations import Kind
from ..material.surface import PARAMETERS, Loss, Surface
from ..models.geometry import clamp
from .affine import transformed
from .expressions import COLOR_TYPES, check_attribute, check_image, label
from .files import Files, Unsupported
from .lookups import CHANNELS, Lookup, clipped, leaves, lookup
from .materialx import highlight, index, mapped, mirror_reflectance, unit
from .nearest import Nearest
from .network import COLOR, FILE, FLOAT, INT, NORMAL, TOKEN, VECTOR2, VECTOR3, VECTOR4, Constant, Input, Network, Output, Primvar

WRAPS = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "black", "MIRROR": "mirror"}
COLOR_SPACES = {"srgb_texture": "sRGB", "lin_rec709": "raw", "": "raw"}
ENCODED = "srgb_", "g22_", "g18_", "adobergb", "rec709_display"  # how names of encoded color spaces begin
# What UsdPreviewSurface has nothing for
LACKS = {
    "transmission_weight": "transmission",
    "coat_color": "a coat's tint",
    "fuzz_weight": "sheen",
    "specular_anisotropy": "anisotropy",
    "thin_film_thickness": "thin film",
}
NOT_THERE = "UsdPreviewSurface"
OWN_VALUE = "the socket's own value is written there"


def network(
    surface: Surface, files: Files, own: Mapping[str, Expression], occlusion: Expression | None = None
) -> tuple[Network, list[Loss]]:
    """Return the network of `surface`, and what it lacks.

    `own` has the sockets' own values, which stand for what UsdPreviewSurface lacks. `occlusion` is what of the light from
    everywhere arrives, where the material has it.
    """
    builder = _Builder(surface, files, own)
    builder.build(occlusion)
    return builder.network, builder.losses


class _Builder:
    def __init__(self, surface: Surface, files: Files, own: Mapping[str, Expression]) -> None:
        self.surface, self.files, self.own = surface, files, own
        self.network = Network("Preview_")
        self.losses: list[Loss] = []
        self._textures: list[tuple[ImageTexture, Output, dict[str, tuple[float, float]]]] = []
        self._places: dict[Expression, Output] = {}

    def build(self, occlusion: Expression | None) -> None:
        surface = self.surface
        inputs = {"diffuseColor": self._diffuse_color()} | self._lobe()
        if surface.uses("emission_strength"):
            emission = apply("multiply", surface["emission_color"], surface["emission_strength"])
            inputs["emissiveColor"] = self._color("emission_color", emission)
        inputs |= self._opacity()
        if surface.uses("normal"):
            inputs |= self._normal()
        if occlusion:
            inputs["occlusion"] = self._number("occlusion", occlusion)
        lacking = [what for parameter, what in LACKS.items() if surface.uses(parameter)]
        if surface.uses("coat_weight") and surface["coat_normal"] != surface["normal"]:
            lacking.append("another normal for the coat")
        if lacking:
            what = f"{', '.join(lacking).capitalize()} in {NOT_THERE}"
            self.losses.append(Loss("", "", what, "a surface without it is written there"))
        self.network.add("surface", "UsdPreviewSurface", TOKEN, "surface", **inputs)

    def _diffuse_color(self) -> Input:
        surface = self.surface
        if surface["metallic"] == Value(1.0):
            return self._color("base_color", unit(surface["base_color"]))
        weight = surface["subsurface_weight"]
        below = clamp(number(weight.value), 0.0, 1.0) if isinstance(weight, Value) else 0.5
        nearest = Nearest.of(surface)
        return self._color(
            "base_color",
            mapped(lambda rho: clamp((1.0 - below) * nearest.albedo(rho) + below * rho, 0.0, 1.0), surface["base_color"]),
        )

    def _lobe(self) -> dict[str, Input]:
        """Return the inputs of the lobe, and of the coat."""
        surface = self.surface
        if surface.uses("metallic") or surface.uses("specular_weight") or surface.uses("transmission_weight"):
            inputs = {"roughness": self._number("specular_roughness", unit(surface["specular_roughness"]))}
            mirror = mirror_reflectance(surface)
            if surface.uses("metallic") or not surface.uses("specular_color"):
                inputs["metallic"] = self._number("metallic", unit(surface["metallic"]))
                ior = surface["specular_ior"] if surface["specular_weight"] == Value(1.0) else index(mirror)
                inputs["ior"] = self._number("specular_ior", ior)
                if surface.uses("specular_color"):
                    self.losses.append(Loss("specular_color", "", f"a tint in {NOT_THERE}", "white is written there"))
            else:
                inputs |= self._specular_workflow(apply("multiply", surface["specular_color"], mirror), mirror)
            if surface.uses("coat_weight"):
                inputs["clearcoat"] = self._number("coat_weight", unit(surface["coat_weight"]))
                inputs["clearcoatRoughness"] = self._number("coat_roughness", unit(surface["coat_roughness"]))
            return inputs
        if surface.uses("highlight_weight"):
            height, alpha = highlight(surface)
            roughness = self._number("highlight_exponent", apply("sqrt", alpha))
            mirror = apply("clamp", height, 0.0, 0.99)
            return {"roughness": roughness} | self._specular_workflow(mirror, mirror)
        if surface.uses("coat_weight"):
            coat = Surface(
                "lambert", {"specular_weight": unit(surface["coat_weight"]), "specular_ior": _at_least_1(surface["coat_ior"])}
            )
            roughness = self._number("coat_roughness", unit(surface["coat_roughness"]))
            mirror = mirror_reflectance(coat)
            return {"roughness": roughness} | self._specular_workflow(mirror, mirror)
        return {"roughness": Constant(FLOAT, 1.0)} | self._specular_workflow(Value(0.0), Value(0.0))

    def _specular_workflow(self, color: Expression, mirror: Expression) -> dict[str, Input]:
        return {
            "useSpecularWorkflow": Constant(INT, 1),
            "specularColor": self._color("specular_color", color),
            "ior": self._number("specular_ior", index(mirror)),
        }

    def _opacity(self) -> dict[str, Input]:
        surface = self.surface
        if not surface.uses("opacity"):
            return {}
        found = clipped(surface["opacity"])
        if found:
            alpha, threshold = found
            return {"opacity": self._number("opacity", alpha), "opacityThreshold": Constant(FLOAT, float(threshold))}
        return {"opacity": self._number("opacity", unit(surface["opacity"]))}

    def _normal(self) -> dict[str, Input]:
        """Return the normal in tangent space, whose strength and convention become scale and bias of its image."""
        normal = self.surface["normal"]
        if isinstance(normal, NormalMap) and normal.space == "TANGENT" and isinstance(normal.strength, Value):
            found = self._lookup(normal.color, "triple")
            if found and found.is_exact and isinstance(normal.strength.value, (int, float)):
                strength = max(float(normal.strength.value), 0.0)
                factors = (strength, strength * (-1.0 if normal.convention == "DIRECTX" else 1.0), min(strength, 1.0))
                rest = (0.0, 0.0, 1.0 - min(strength, 1.0))
                scale = tuple(2.0 * factor * one for factor, one in zip(factors, found.scale, strict=True))
                bias = tuple(factor * (2.0 * one - 1.0) + more for factor, one, more in zip(factors, found.bias, rest, strict=True))
                try:
                    texture = self._texture(Lookup(found.texture, "rgb", scale, bias))
                    return {"normal": texture._replace(type=NORMAL)}
                except Unsupported as problem:
                    if problem.what.endswith(NOT_THERE):
                        self._say("normal", normal, problem.what, "the surface's own normal is written there")
                    return {}
        what = "a normal that is no map in the tangent space" if not isinstance(normal, NormalMap) else "such a normal map"
        self.losses.append(Loss("normal", _node(normal), f"{what} in {NOT_THERE}", "the surface's own normal is written there"))
        return {}

    # inputs

    def _color(self, parameter: str, expression: Expression) -> Input:
        return self._input(parameter, expression, "triple")

    def _number(self, parameter: str, expression: Expression) -> Input:
        return self._input(parameter, expression, "number")

    def _input(self, parameter: str, expression: Expression, kind: Kind) -> Input:
        """Return what UsdPreviewSurface has of an expression: a constant, an image, or a color attribute as it is."""
        usd_type = COLOR if kind == "triple" else FLOAT
        if isinstance(expression, Value):
            return _constant(expression, usd_type)
        try:
            found = self._lookup(expression, kind)
            if found:
                if not found.is_exact:
                    what = f"what is made of the image {found.texture.image.name}, in {NOT_THERE}"
                    self._say(parameter, expression, what, "the image alone is written there")
                return self._texture(found)._replace(type=usd_type)
            attribute = next((one for one in leaves(expression) if isinstance(one, Attribute)), None)
            if attribute and kind == "number" and expression == attribute and self._is_number(attribute):
                name = Primvar(attribute.name, "value")
                return self.network.add("attribute", "UsdPrimvarReader_float", FLOAT, "result", varname=name)
            if attribute and kind == "triple" and self._is_triple(attribute):
                check_attribute(attribute)
                if expression != attribute:
                    name = attribute.name or "that is active"
                    what = f"what is made of the color attribute {name}, in {NOT_THERE}"
                    self._say(parameter, expression, what, "the attribute alone is written there")
                return self._attribute(attribute)._replace(type=usd_type)
        except Unsupported as problem:
            if problem.what.endswith(NOT_THERE):  # else MaterialX lacks it, too, and says it
                self._say(parameter, expression, problem.what, OWN_VALUE)
        else:
            self._say(parameter, expression, f"what feeds it, in {NOT_THERE}", OWN_VALUE)
        return _constant(self.own.get(parameter, Value(PARAMETERS.get(parameter, 1.0))), usd_type)

    def _is_number(self, attribute: Attribute) -> bool:
        return attribute.output == "factor" and self.files.attributes.get(attribute.name) == "FLOAT"

    def _is_triple(self, attribute: Attribute) -> bool:
        return self.files.attributes.get(attribute.name, "FLOAT_COLOR") in {"FLOAT_VECTOR", *COLOR_TYPES}

    def _say(self, parameter: str, expression: Expression, what: str, instead: str) -> None:
        self.losses.append(Loss(parameter, _node(expression), what, instead))

    def _lookup(self, expression: Expression, kind: Kind) -> Lookup | None:
        return lookup(expression, kind, lambda texture: self.files[texture.image.name].is_gray)

    def _texture(self, found: Lookup) -> Output:
        """Return the output of a UsdUVTexture, which several inputs share where they do not differ in a channel."""
        wanted = {channel: (found.scale[i], found.bias[i]) for i, channel in enumerate(found.output)}
        for texture, output, channels in self._textures:
            if texture == found.texture and all(channels.get(name, value) == value for name, value in wanted.items()):
                channels |= wanted
                self._set_range(output, channels)
                return self.network.output(output, found.output, VECTOR3 if found.output == "rgb" else FLOAT)
        texture = found.texture
        check_image(texture)
        if texture.interpolation == "Closest":
            what = f"Closest interpolation of the image {texture.image.name} in {NOT_THERE}"
            self.losses.append(Loss("", "", what, "it is interpolated there"))
        file = self.files[texture.image.name]
        if file.color_space not in COLOR_SPACES:
            near = "sRGB" if file.color_space.startswith(ENCODED) else "linear Rec. 709"
            what = f"the color space {texture.image.color_space} of the image {texture.image.name} in {NOT_THERE}"
            self.losses.append(Loss("", "", what, f"{near} is written there"))
        wrap = Constant(TOKEN, WRAPS[texture.extension])
        default = "sRGB" if file.color_space.startswith(ENCODED) else "raw"
        output = self.network.add(
            f"image_{label(texture.image.name)}",
            "UsdUVTexture",
            VECTOR3 if found.output == "rgb" else FLOAT,
            found.output,
            file=Constant(FILE, file.path, interop_id=file.interop_id),
            st=self._place(texture.coordinates),
            sourceColorSpace=Constant(TOKEN, COLOR_SPACES.get(file.color_space, default)),
            wrapS=wrap,
            wrapT=wrap,
        )
        self._textures.append((texture, output, wanted))
        self._set_range(output, wanted)
        return output

    def _set_range(self, output: Output, channels: Mapping[str, tuple[float, float]]) -> None:
        """Set scale and bias where a channel has any."""
        inputs = self.network.shaders[output.shader].inputs
        for name, position, neutral in (("scale", 0, 1.0), ("bias", 1, 0.0)):
            values = tuple(channels[channel][position] if channel in channels else neutral for channel in CHANNELS)
            if any(abs(value - neutral) > 1e-6 for value in values):
                inputs[name] = Constant(VECTOR4, values)

    def _place(self, coordinates: Expression) -> Output:
        """Return the coordinates of an image."""
        if coordinates not in self._places:
            found = transformed(coordinates)
            if found is None:
                raise Unsupported("", f"coordinates that are no UV map, in {NOT_THERE}")
            name, steps = found
            place = self.network.add("uv", "UsdPrimvarReader_float2", VECTOR2, "result", varname=Primvar(name, "uv"))
            for step in steps:
                place = self.network.add(
                    "placement",
                    "UsdTransform2d",
                    VECTOR2,
                    "result",
                    scale=Constant(VECTOR2, step.scale),
                    rotation=Constant(FLOAT, step.rotation),
                    translation=Constant(VECTOR2, step.translation),
                    **{"in": place},
                )
            self._places[coordinates] = place
        return self._places[coordinates]

    def _attribute(self, attribute: Attribute) -> Output:
        if self.files.attributes.get(attribute.name) == "FLOAT_VECTOR":
            name = Primvar(attribute.name, "value")
            return self.network.add("attribute", "UsdPrimvarReader_float3", VECTOR3, "result", varname=name)
        name = Primvar(attribute.name, "color")
        return self.network.add("attribute", "UsdPrimvarReader_float4", VECTOR4, "result", varname=name)


def _constant(value: Expression, usd_type: str) -> Constant:
    number = value.value if isinstance(value, Value) else 1.0
    if usd_type == FLOAT:
        return Constant(FLOAT, float(number if not isinstance(number, tuple) else sum(number) / 3.0))
    return Constant(COLOR, number if isinstance(number, tuple) else (float(number),) * 3)


def _node(expression: Expression) -> str:
    """Return the label of the node that an expression comes from; empty where it has none."""
    return getattr(expression, "label", "")


def _at_least_1(ior: Expression) -> Expression:
    return apply("clamp", ior, 1.0, 3.0)
