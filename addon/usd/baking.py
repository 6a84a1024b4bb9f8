# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes, before an export, what the networks of materials cannot hold. What MaterialX can hold stays as it is there.

Blender calls the hook in the middle of its work, with a window in another thread, so nothing can be baked then.
"""

from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy

from ..blender import report
from ..material.bake import CannotBake, bake_input
from ..material.expression import Expression, ImageTexture, NormalMap, UvMap, apply
from ..material.links import Place
from ..material.read import Reading
from ..material.read_closures import ClosureReader, material_surface
from ..material.read_nodes import NodeReader
from ..material.surface import PARAMETERS, Loss
from . import materialx, preview
from .files import Files, ImageFile

type Key = tuple[str, ...]
"""Names that find an input in any copy of a material, as Blender hands copies to the hook."""

NORMALS = ("normal", "coat_normal", "tangent")


@dataclass
class Baked:
    """Images in place of what feeds inputs of a material: `everywhere`, and where only UsdPreviewSurface lacks it."""

    resolution: int
    everywhere: dict[Key, Expression] = field(default_factory=dict)
    in_preview: dict[Key, Expression] = field(default_factory=dict)
    images: list[bpy.types.Image] = field(default_factory=list)


_baked: dict[str, Baked] = {}
"""By full name of the material."""


class _Reader(NodeReader):
    """Reads inputs as nodes have them, but for those that are replaced."""

    def __init__(self, replaced: Mapping[Key, Expression], images: Iterable[bpy.types.Image]) -> None:
        super().__init__()
        self.replaced = replaced
        self.images |= {image.name_full: image for image in images}

    def expression(self, place: Place) -> Expression:
        return self.replaced.get(key(place)) or super().expression(place)


class _AnyFiles(Files):
    """A file for every image, as none is written yet."""

    def __missing__(self, name: str) -> ImageFile:
        return ImageFile(name, "")


def key(place: Place) -> Key:
    """Return the names of the groups around an input, of its node and of itself."""
    return (*(group.name for group in place.groups), place.node.name, place.socket.identifier)


def read(material: bpy.types.Material, unit: float, target: str, *, for_preview: bool = False) -> Reading:
    """Return the surface of a material as `read_surface` does, with the images that are baked for one of the networks."""
    baked = _baked.get(material.name_full)
    reader = ClosureReader(unit)
    if baked:
        replaced = baked.everywhere | (baked.in_preview if for_preview else {})
        reader.nodes = _Reader(replaced, baked.images)
    surface = material_surface(material, target, reader)
    losses = [*dict.fromkeys(reader.losses), *(_losses(baked, reader, for_preview=for_preview) if baked else ())]
    notes = [f"{what} ({node})" for node, what in reader.nodes.notes]
    return Reading(surface, losses, notes, reader.nodes.images, reader.places)


def _losses(baked: Baked, reader: ClosureReader, *, for_preview: bool) -> Iterator[Loss]:
    instead = f"it is baked to an image of {baked.resolution} pixels"
    where = f", in {preview.NOT_THERE}," if for_preview else ""
    for parameter, place in reader.places.items():
        if key(place) in (baked.in_preview if for_preview else baked.everywhere):
            yield Loss(parameter, place.label, f"what feeds {place.socket.name}{where}", instead)


@contextmanager
def baking(materials: Iterable[tuple[bpy.types.Material, str]], unit: float, resolution: int) -> Generator[None]:
    """Have images of `resolution` pixels for what the networks of `materials` lack; they are removed afterwards.

    With each material comes the target at whose output its surface is. What cannot be baked is reported.
    """
    try:
        for material, target in materials:
            _baked[material.name_full] = Baked(resolution)
            _bake(material, unit, target, _baked[material.name_full])
        yield
    finally:
        for baked in _baked.values():
            for image in baked.images:
                bpy.data.images.remove(image)
        _baked.clear()


def _bake(material: bpy.types.Material, unit: float, target: str, baked: Baked) -> None:
    for for_preview, replaced in ((False, baked.everywhere), (True, baked.in_preview)):
        reading = read(material, unit, target, for_preview=for_preview)
        if for_preview:
            _, losses = preview.network(reading.surface, _AnyFiles(), {})
        else:
            _, losses = materialx.network(reading.surface, _AnyFiles(), 1.0, {})
        for parameter in dict.fromkeys(loss.parameter for loss in [*reading.losses, *losses]):
            place = reading.places.get(parameter)
            if place is None or key(place) in baked.everywhere:
                continue
            is_color = parameter.endswith("color")
            try:
                image = bake_input(material, place, baked.resolution, is_color=is_color)
            except CannotBake as reason:
                report.add(material.name, f"{parameter.replace('_', ' ').capitalize()} is not baked, as {reason}")
                continue
            baked.images.append(image)
            replaced[key(place)] = _expression(image, parameter)


def _expression(image: bpy.types.Image, parameter: str) -> Expression:
    texture = ImageTexture(NodeReader().image(image), UvMap())
    if parameter in NORMALS:
        return NormalMap(texture)
    return texture if isinstance(PARAMETERS[parameter], tuple) else apply("x", texture)
