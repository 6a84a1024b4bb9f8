# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine draws of a material: its law, what colors it, its coat and how far light goes below it."""

from dataclasses import dataclass, field

import bpy

from ..nodes import SPECULAR_GROUP, SUBSURFACE
from ..usd.read import Names, group_node, read, read_color
from ..usd.surface import Image, Rgb, Source, Surface
from . import blocks
from .laws import LAMBERT, LAWS, SPECULAR, Law
from .program import Paint

MILLIMETER = 0.001  # m
GRAY: Rgb = (0.8, 0.8, 0.8)  # what Blender gives a face without a material
COLOR_SOCKETS = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color", "SUBSURFACE_SCATTERING": "Color"}


@dataclass(frozen=True)
class Look:
    """A material as it is drawn. Numbers of `coat`: weight, roughness, index of refraction; of `scattering`: mean free paths of
    red, green and blue in the scene's units, weight. `image` is None unless `source` is one.
    """

    law: Law
    color: Rgb
    shape: tuple[float, ...] = ()
    coat: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scattering: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    source: Source | None = None
    image: bpy.types.Image | None = field(default=None, compare=False)

    @property
    def paint(self) -> Paint:
        if self.source is None:
            return Paint.NOTHING
        return Paint.IMAGE if isinstance(self.source, Image) else Paint.ATTRIBUTE

    @property
    def attribute(self) -> str:
        """The color attribute or UV map that is needed of the mesh."""
        return self.source.primvar if self.source else ""

    @property
    def scatters(self) -> bool:
        return self.scattering[3] > 0.0 and any(self.scattering[:3])

    @property
    def texture(self) -> Image | None:
        """The image texture that colors it."""
        return self.source if isinstance(self.source, Image) else None

    @property
    def lacks_image(self) -> bool:
        return self.texture is not None and (self.image is None or (not self.image.has_data and not self.image.size[0]))

    def packed(self) -> bytes:
        """Return the struct Material of program.py."""
        return blocks.material(self.color, self.shape, self.coat, self.scattering)


def look_of(material: bpy.types.Material | None, meter: float) -> Look:
    """Return how `material` is drawn; `meter` is a meter in the scene's units. One not ours is Lambert's, of its base color."""
    if material is None:
        return Look(LAMBERT, GRAY)
    images: dict[str, bpy.types.Image] = {}

    def refer(image: bpy.types.Image) -> str:
        images[image.name_full] = image
        return image.name_full

    names = Names(refer, str)
    found = group_node(material)
    if found is None:
        color, source = _base_color(material, names)
        look = Look(LAMBERT, color, source=source)
    else:
        surface, _ = read(*found, names)
        look = _ours(surface, meter)
    if look.source is None:
        return look
    image = images.get(look.texture.file) if look.texture else None
    factor = look.source.factor
    return Look(look.law, (factor, factor, factor), look.shape, look.coat, look.scattering, look.source, image)


def _ours(surface: Surface, meter: float) -> Look:
    """Return the look of a node of our groups."""
    law = SPECULAR if surface.group == SPECULAR_GROUP.key else LAWS[surface.choice("Model")]
    numbers = {name: float(value) for name, value in surface.inputs.items() if isinstance(value, (int, float))}
    color, source = surface.rgb("Color"), surface.fed.get("Color")
    if surface.group != SUBSURFACE.key:
        return Look(law, color, law.fold(numbers), source=source)
    scale = max(0.0, numbers["Scale"]) * MILLIMETER * meter
    red, green, blue = (max(0.0, length) * scale for length in surface.rgb("Mean Free Path"))
    weight = min(max(0.0, numbers["Subsurface"]), 1.0)
    coat = (min(max(0.0, numbers["Specular"]), 1.0), min(max(0.0, numbers["Specular Roughness"]), 1.0), numbers["IOR"])
    return Look(law, color, law.fold(numbers), coat, (red, green, blue, weight), source)


def _base_color(material: bpy.types.Material, names: Names) -> tuple[Rgb, Source | None]:
    """Return the color of a material that is not ours, and what takes its place: that of its closure, else that of the viewport."""
    output = material.node_tree.get_output_node("ALL") if material.node_tree else None
    link = next(iter(output.inputs["Surface"].links), None) if output else None
    if link and link.from_node.type in COLOR_SOCKETS:
        return read_color(link.from_node.inputs[COLOR_SOCKETS[link.from_node.type]], names)
    red, green, blue, _ = material.diffuse_color
    return (red, green, blue), None
