# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes of a stage that Blender's exporter wrote, with what they were made of, and how it spells names. Needs pxr.

Names are made valid in one of four ways, which is told from what the stage has: with or without letters beyond ASCII (Allow
Unicode), and with the UV map that renders called st or not (Rename UV Maps).
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import bpy

from pxr import Sdf, Usd, UsdGeom, UsdShade

type Written = Mapping[Sdf.Path, Sequence[bpy.types.ID]]
"""The data-blocks that Blender wrote, by prim."""

RENDERED = "st"  # what the exporter calls the UV map that renders
OF_CURVES = "UVMap"  # of meshes that Blender makes of curves, texts and surfaces


@dataclass(frozen=True, eq=False)
class Shape:
    """A prim with geometry: where it is authored, which for an instance is in its prototype, and the `item` that it was made of.

    `bound` has for it and its subsets the paths of their materials in the stage's library.
    """

    prim: Usd.Prim
    item: bpy.types.Object | None
    mesh: bpy.types.Mesh | None
    bound: Mapping[Sdf.Path, Sdf.Path]

    @cached_property
    def types(self) -> dict[str, Sdf.ValueTypeName]:
        """The types of its primvars by name."""
        return {str(one.GetPrimvarName()): one.GetTypeName() for one in UsdGeom.PrimvarsAPI(self.prim).GetPrimvars()}

    @cached_property
    def rendered(self) -> str:
        """The name in Blender of the UV map that renders; empty where there is none."""
        if self.mesh is None:
            return OF_CURVES if self.item else ""
        return next((layer.name for layer in self.mesh.uv_layers if layer.active_render), "")

    @cached_property
    def names(self) -> list[str]:
        """The names in Blender of the attributes and UV maps that may be written, in the order of writing."""
        if self.mesh is None:
            return [self.rendered] if self.rendered else []
        return [one.name for one in self.mesh.attributes if not one.name.startswith(".")]


class Spelling(NamedTuple):
    """How the exporter names things."""

    has_unicode: bool = True
    renames: bool = True

    def primvar(self, shape: Shape, name: str) -> str:
        """Return the name in the stage of an attribute or UV map of a shape."""
        return RENDERED if self.renames and name == shape.rendered else spelled(name, self.has_unicode)


SPELLINGS = tuple(Spelling(has_unicode, renames) for has_unicode in (True, False) for renames in (True, False))


def spelling(shapes: Sequence[Shape]) -> Spelling:
    """Return the way of naming by which the stage has most of the primvars of `shapes`, and least besides."""
    off: Counter[Spelling] = Counter()
    for shape in shapes:
        there = set(shape.types)
        for each in SPELLINGS:
            off[each] += len(there ^ {each.primvar(shape, name) for name in shape.names})
    return min(SPELLINGS, key=lambda each: off[each])


def spelled(name: str, has_unicode: bool) -> str:
    """Return a name as the exporter makes it valid: a letter that it does not allow is an underscore."""
    if not name:
        return "_"
    starts_with_digit = name[0] in "0123456789"
    letters = (_letter(letter, index == 0 and not starts_with_digit, has_unicode) for index, letter in enumerate(name))
    return "_" * starts_with_digit + "".join(letters)


def spellings(name: str) -> set[str]:
    """Return the one or two ways in which the exporter may spell the name of a material."""
    return {spelled(name, has_unicode) for has_unicode in (True, False)}


@cache
def _letter(letter: str, is_first: bool, has_unicode: bool) -> str:
    is_known = has_unicode or letter.isascii()
    return letter if is_known and Sdf.Path.IsValidIdentifier(letter if is_first else f"a{letter}") else "_"


def shapes_of(stage: Usd.Stage, written: Written) -> list[Shape]:
    """Return the shapes of a stage; of several instances of one prototype one."""
    found: dict[Sdf.Path, Shape] = {}
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.Gprim) and _origin(prim) not in found:
            items = [*written.get(prim.GetPath(), ()), *written.get(prim.GetPath().GetParentPath(), ())]
            item = next((item for item in items if isinstance(item, bpy.types.Object) and item.type != "EMPTY"), None)
            mesh = item.data if item and isinstance(item.data, bpy.types.Mesh) else None
            own = stage.GetPrimAtPath(_origin(prim))
            found[own.GetPath()] = Shape(own, item, mesh, dict(_bindings(prim)))
    return list(found.values())


def _bindings(prim: Usd.Prim) -> Iterator[tuple[Sdf.Path, Sdf.Path]]:
    """Yield where a shape or subset of it is authored, with the path in the library of the material that it is bound to."""
    subsets = (child for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies()) if child.IsA(UsdGeom.Subset))
    for part in (prim, *subsets):
        material = prim.GetStage().GetPrimAtPath(UsdShade.MaterialBindingAPI(part).GetDirectBinding().GetMaterialPath())
        if material:
            yield _origin(part), _origin(material)


def _origin(prim: Usd.Prim) -> Sdf.Path:
    """Return where a prim is authored: itself, or what it refers to in the end."""
    return prim.GetPrimStack()[-1].path
