# SPDX-License-Identifier: GPL-3.0-or-later
"""Separates materials whose names are equal in USD: "a b" and "a.b" are both a_b.

Blender writes only the first of them, and uses it for all their objects. It calls hooks with the whole stage only after that, when
it no longer writes images.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count

import bpy

from pxr import Sdf, Usd, UsdShade

from ..blender import report
from .export import shown
from .primvars import spellings

type Written = Mapping[Sdf.Path, Sequence[bpy.types.ID]]
"""The data-blocks that Blender wrote, by prim."""
type Write = Callable[[bpy.types.Material, UsdShade.Material], bool]
"""Writes one of our materials into a prim; returns whether it could."""


def separate(stage: Usd.Stage, written: Written, write: Write) -> bool:
    """Give those of our materials that were not written prims of their own, and bind their meshes to them; returns whether any."""
    separated: dict[bpy.types.Material, UsdShade.Material] = {}
    for path, item, material, holder, taken in _collisions(written):
        if len(_materials(item)) > 1 or shown(material) is None:
            report.add(material.name, f"has the same name as {holder.name} in USD, and is replaced by it on {item.name}")
            continue
        if material not in separated:
            separated[material] = UsdShade.Material.Define(stage, _free(stage, taken))
            write(material, separated[material])
        _bind(stage.GetPrimAtPath(path), taken, separated[material])
    return bool(separated)


def _collisions(
    written: Written,
) -> Iterator[tuple[Sdf.Path, bpy.types.Object, bpy.types.Material, bpy.types.Material, Sdf.Path]]:
    """Yield an object's path, the object, its material that was not written, the one written instead, and the latter's path."""
    holders = {item: path for path, items in written.items() for item in items if isinstance(item, bpy.types.Material)}
    by_name = {path.name: (holder, path) for holder, path in holders.items()}
    for path, items in written.items():
        for item in items:
            for material in _materials(item) if isinstance(item, bpy.types.Object) else ():
                if material not in holders:
                    name = next((name for name in spellings(material.name) if name in by_name), None)
                    if name:
                        yield path, item, material, *by_name[name]


def _materials(item: bpy.types.Object) -> list[bpy.types.Material]:
    return list({slot.material: None for slot in item.material_slots if slot.material})


def _free(stage: Usd.Stage, taken: Sdf.Path) -> Sdf.Path:
    """Return a free path beside the one `taken`."""
    paths = (taken.ReplaceName(f"{taken.name}_{number:03}") for number in count(1))
    return next(path for path in paths if not stage.GetPrimAtPath(path))


def _bind(prim: Usd.Prim, taken: Sdf.Path, material: UsdShade.Material) -> None:
    """Bind the meshes of the object `prim` that have the material at `taken` to `material` instead."""
    for shape in (prim, *prim.GetChildren()):
        if UsdShade.MaterialBindingAPI(shape).GetDirectBinding().GetMaterialPath() == taken:
            UsdShade.MaterialBindingAPI.Apply(shape).Bind(material)
