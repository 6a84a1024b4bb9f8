# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as the realtime engine draws them: model, color, coat, subsurface scattering and normal map."""

import struct
from dataclasses import dataclass, field, replace

import bpy

from ..material.read import DEFAULT_UV, Names, group_node, read, read_color, read_number, source_socket
from ..material.surface import Attribute, GroupSurface, Image, Rgb
from ..models import by_label
from ..nodes import SPECULAR_GROUP, SUBSURFACE
from .mesh_attributes import MeshAttribute
from .models import LAMBERT, SPECULAR, GlslModel, glsl_model
from .program import ColorInput

MILLIMETER = 0.001  # m
GRAY: Rgb = (0.8, 0.8, 0.8)  # Blender's color of faces without a material
COLOR_SOCKETS = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color", "SUBSURFACE_SCATTERING": "Color"}


@dataclass(frozen=True)
class Texture:
    """An image texture, and Blender's image, None where it has none."""

    source: Image
    image: bpy.types.Image | None = field(compare=False)

    @property
    def is_missing(self) -> bool:
        """Whether there are no pixels to draw."""
        return self.image is None or (not self.image.has_data and not self.image.size[0])


@dataclass(frozen=True)
class NormalMap:
    """A tangent space normal map. `strength` scales it along u and v, with a sign; `tangents` names the UV map of its tangents."""

    texture: Texture
    strength: tuple[float, float]
    tangents: str


@dataclass(frozen=True)
class RenderMaterial:
    """A material as it is drawn.

    `color`: albedo, 0 to 1; `source` multiplies it. `shape`: the up to four numbers that the model folds.
    `coat`: weight, roughness (0 to 1), index of refraction. `scattering`: the mean free paths of red, green and blue in the scene's
    units, and the weight.
    """

    model: GlslModel
    color: Rgb
    shape: tuple[float, ...] = ()
    coat: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scattering: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    source: Attribute | Texture | None = None
    normals: NormalMap | None = None

    @property
    def color_input(self) -> ColorInput:
        """What multiplies the color."""
        if self.source is None:
            return ColorInput.NONE
        return ColorInput.IMAGE if isinstance(self.source, Texture) else ColorInput.ATTRIBUTE

    @property
    def attributes(self) -> tuple[MeshAttribute, ...]:
        """The attributes that its meshes must have on the driver."""
        needed: list[MeshAttribute] = []
        if isinstance(self.source, Texture):
            needed.append(("uv", self.source.source.primvar))
        elif self.source:
            needed.append(("color", self.source.primvar))
        if self.normals:
            needed += [("normal_uv", self.normals.texture.source.primvar), ("tangent", self.normals.tangents)]
        return tuple(needed)

    @property
    def textures(self) -> dict[str, Texture]:
        """Its image textures by the names of their samplers."""
        color = {"color_image": self.source} if isinstance(self.source, Texture) else {}
        return color | ({"normal_image": self.normals.texture} if self.normals else {})

    @property
    def has_subsurface(self) -> bool:
        """Whether light scatters below the surface."""
        return self.scattering[3] > 0.0 and any(self.scattering[:3])

    def to_bytes(self) -> bytes:
        """Return the struct Material of program.py."""
        u, v = self.normals.strength if self.normals else (0.0, 0.0)
        shape = (*self.shape, 0.0, 0.0, 0.0, 0.0)[:4]
        return struct.pack("16f", *self.color, u, *shape, *self.coat, v, *self.scattering)


def render_material(material: bpy.types.Material | None, meter: float) -> RenderMaterial:
    """Return how `material` is drawn; `meter` is the length of a meter in the scene's units.

    A material of another add-on or of Blender's own is drawn by Lambert's model with its base color.
    """
    if material is None:
        return RenderMaterial(LAMBERT, GRAY)
    images = _Images()
    group = group_node(material)
    node = group[0] if group else _closure(material)
    if node is None:
        red, green, blue, _ = material.diffuse_color
        return RenderMaterial(LAMBERT, (red, green, blue))
    if group:
        surface = read(*group, images.names)
        result, source = _from_group(surface, meter), surface.linked.get("Color")
    else:
        color, source = read_color(node.inputs[COLOR_SOCKETS[node.type]], images.names)
        result = RenderMaterial(LAMBERT, color)
    if source:
        source_or_texture = images.texture(source) if isinstance(source, Image) else source
        result = replace(result, color=(source.factor,) * 3, source=source_or_texture)
    return replace(result, normals=_normal_map(node.inputs["Normal"], images))


class _Images:
    """The images that a material's nodes refer to, by name."""

    def __init__(self) -> None:
        self._images: dict[str, bpy.types.Image] = {}
        self.names = Names(self._add, str)

    def texture(self, source: Image) -> Texture:
        return Texture(source, self._images.get(source.file))

    def _add(self, image: bpy.types.Image) -> str:
        self._images[image.name_full] = image
        return image.name_full


def _from_group(surface: GroupSurface, meter: float) -> RenderMaterial:
    """Return the material of one of our node groups, without what varies over the surface."""
    model = SPECULAR if surface.group == SPECULAR_GROUP.key else glsl_model(by_label(surface.choice("Model")))
    numbers = {name: float(value) for name, value in surface.inputs.items() if isinstance(value, (int, float))}
    color = surface.rgb("Color")
    if surface.group != SUBSURFACE.key:
        return RenderMaterial(model, color, model.constants(numbers))
    scale = max(0.0, numbers["Scale"]) * MILLIMETER * meter
    red, green, blue = (max(0.0, length) * scale for length in surface.rgb("Subsurface Radius"))
    weight = min(max(0.0, numbers["Subsurface"]), 1.0)
    coat = (min(max(0.0, numbers["Specular"]), 1.0), min(max(0.0, numbers["Specular Roughness"]), 1.0), numbers["IOR"])
    return RenderMaterial(model, color, model.constants(numbers), coat, (red, green, blue, weight))


def _closure(material: bpy.types.Material) -> bpy.types.Node | None:
    """Return the closure of a material that is not ours; None where it has several or one that COLOR_SOCKETS lacks."""
    output = material.node_tree.get_output_node("ALL") if material.node_tree else None
    socket = source_socket(output.inputs["Surface"]) if output else None
    return socket.node if socket and socket.node.type in COLOR_SOCKETS else None


def _normal_map(socket: bpy.types.NodeSocket, images: _Images) -> NormalMap | None:
    """Return the normal map linked to a Normal input; None for another node or space, or where its color is not one plain image."""
    output = source_socket(socket)
    node = output.node if output else None
    if node is None or node.bl_idname != "ShaderNodeNormalMap" or node.mute or node.space != "TANGENT":
        return None
    _, source = read_color(node.inputs["Color"], images.names)
    if not isinstance(source, Image) or source.factor != 1.0:
        return None
    strength = read_number(node.inputs["Strength"], images.names)
    sign = -1.0 if node.convention == "DIRECTX" else 1.0
    return NormalMap(images.texture(source), (strength, strength * sign), node.uv_map or DEFAULT_UV)
