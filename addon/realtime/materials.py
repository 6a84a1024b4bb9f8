# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine draws of a material: its law, what colors it, its coat and how far light goes below it."""

from dataclasses import dataclass, field, replace

import bpy

from ..material.read import DEFAULT_UV, Names, feeding, group_node, read, read_color, read_number
from ..material.surface import Attribute, Image, Rgb, Surface
from ..nodes import SPECULAR_GROUP, SUBSURFACE
from . import blocks
from .laws import LAMBERT, LAWS, SPECULAR, Law
from .layers import Layer
from .program import Paint, Relief

MILLIMETER = 0.001  # m
GRAY: Rgb = (0.8, 0.8, 0.8)  # what Blender gives a face without a material
COLOR_SOCKETS = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color", "SUBSURFACE_SCATTERING": "Color"}


@dataclass(frozen=True)
class Texture:
    """An image texture and its image, None where Blender has none."""

    source: Image
    image: bpy.types.Image | None = field(compare=False)

    @property
    def is_lacking(self) -> bool:
        return self.image is None or (not self.image.has_data and not self.image.size[0])


@dataclass(frozen=True)
class NormalMap:
    """Normals in tangent space: `strength` of what they differ by along u and v, signed, and `tangents` the UV map of these."""

    texture: Texture
    strength: tuple[float, float]
    tangents: str


@dataclass(frozen=True)
class Look:
    """A material as it is drawn. Numbers of `coat`: weight, roughness, index of refraction; of `scattering`: mean free paths of
    red, green and blue in the scene's units, weight. `source` multiplies the color.
    """

    law: Law
    color: Rgb
    shape: tuple[float, ...] = ()
    coat: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scattering: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    source: Attribute | Texture | None = None
    normals: NormalMap | None = None

    @property
    def paint(self) -> Paint:
        if self.source is None:
            return Paint.NOTHING
        return Paint.IMAGE if isinstance(self.source, Texture) else Paint.ATTRIBUTE

    @property
    def relief(self) -> Relief:
        return Relief.TANGENT if self.normals else Relief.NOTHING

    @property
    def layers(self) -> tuple[Layer, ...]:
        """What is needed of the mesh."""
        needed: list[Layer] = []
        if isinstance(self.source, Texture):
            needed.append(("uv", self.source.source.primvar))
        elif self.source:
            needed.append(("color", self.source.primvar))
        if self.normals:
            needed += [("relief_uv", self.normals.texture.source.primvar), ("tangent", self.normals.tangents)]
        return tuple(needed)

    @property
    def textures(self) -> dict[str, Texture]:
        """Its image textures, by the names of their samplers."""
        found = {"color_image": self.source} if isinstance(self.source, Texture) else {}
        return found | ({"relief_image": self.normals.texture} if self.normals else {})

    @property
    def scatters(self) -> bool:
        return self.scattering[3] > 0.0 and any(self.scattering[:3])

    def packed(self) -> bytes:
        """Return the struct Material of program.py."""
        strength = self.normals.strength if self.normals else (0.0, 0.0)
        return blocks.material(self.color, self.shape, self.coat, self.scattering, strength)


class _Images:
    """The images that a material's nodes refer to, by their names."""

    def __init__(self) -> None:
        self._found: dict[str, bpy.types.Image] = {}
        self.names = Names(self._refer, str)

    def _refer(self, image: bpy.types.Image) -> str:
        self._found[image.name_full] = image
        return image.name_full

    def texture(self, source: Image) -> Texture:
        return Texture(source, self._found.get(source.file))


def look_of(material: bpy.types.Material | None, meter: float) -> Look:
    """Return how `material` is drawn; `meter` is a meter in the scene's units. One not ours is Lambert's, of its base color."""
    if material is None:
        return Look(LAMBERT, GRAY)
    images = _Images()
    found = group_node(material)
    node = found[0] if found else _closure(material)
    if node is None:
        red, green, blue, _ = material.diffuse_color
        return Look(LAMBERT, (red, green, blue))
    if found:
        surface, _ = read(*found, images.names)
        look, source = _ours(surface, meter), surface.fed.get("Color")
    else:
        color, source = read_color(node.inputs[COLOR_SOCKETS[node.type]], images.names)
        look = Look(LAMBERT, color)
    if source:
        look = replace(look, color=(source.factor,) * 3, source=images.texture(source) if isinstance(source, Image) else source)
    return replace(look, normals=_normal_map(node.inputs["Normal"], images))


def _ours(surface: Surface, meter: float) -> Look:
    """Return the look of a node of our groups, but for what varies over the surface."""
    law = SPECULAR if surface.group == SPECULAR_GROUP.key else LAWS[surface.choice("Model")]
    numbers = {name: float(value) for name, value in surface.inputs.items() if isinstance(value, (int, float))}
    color = surface.rgb("Color")
    if surface.group != SUBSURFACE.key:
        return Look(law, color, law.fold(numbers))
    scale = max(0.0, numbers["Scale"]) * MILLIMETER * meter
    red, green, blue = (max(0.0, length) * scale for length in surface.rgb("Subsurface Radius"))
    weight = min(max(0.0, numbers["Subsurface"]), 1.0)
    coat = (min(max(0.0, numbers["Specular"]), 1.0), min(max(0.0, numbers["Specular Roughness"]), 1.0), numbers["IOR"])
    return Look(law, color, law.fold(numbers), coat, (red, green, blue, weight))


def _closure(material: bpy.types.Material) -> bpy.types.Node | None:
    """Return the closure of a material that is not ours, None where it has more than one or another than COLOR_SOCKETS has."""
    output = material.node_tree.get_output_node("ALL") if material.node_tree else None
    socket = feeding(output.inputs["Surface"]) if output else None
    return socket.node if socket and socket.node.type in COLOR_SOCKETS else None


def _normal_map(socket: bpy.types.NodeSocket, images: _Images) -> NormalMap | None:
    """Return what a Normal Map node feeds to a Normal input; None where it is another node, another space or no plain image's."""
    output = feeding(socket)
    node = output.node if output else None
    if node is None or node.bl_idname != "ShaderNodeNormalMap" or node.mute or node.space != "TANGENT":
        return None
    _, source = read_color(node.inputs["Color"], images.names)
    if not isinstance(source, Image) or source.factor != 1.0:
        return None
    strength = read_number(node.inputs["Strength"], images.names)
    down = -1.0 if node.convention == "DIRECTX" else 1.0
    return NormalMap(images.texture(source), (strength, strength * down), node.uv_map or DEFAULT_UV)
