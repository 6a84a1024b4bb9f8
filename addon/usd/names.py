# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts materials whose names are the same once USD has cleaned them: "a b" and "a.b" are both a_b.

Blender writes the first of them for all objects. Only after that does it ask hooks about the whole stage, and then it writes no
images any more.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count

import bpy

from pxr import Sdf, Usd, UsdShade

from ..blender import report
from ..material.read import group_node, identifier

type Written = Mapping[Sdf.Path, Sequence[bpy.types.ID]]
"""The data-blocks that Blender wrote, by prim."""
type Write = Callable[[bpy.types.Material, UsdShade.Material], bool]
"""Writes one of our materials into a prim."""


def part(stage: Usd.Stage, written: Written, write: Write) -> bool:
    """Give those of our materials that were not written a prim of their own, and the meshes that have them; returns if any."""
    parted: dict[bpy.types.Material, UsdShade.Material] = {}
    for path, item, material, holder, taken in _confused(written):
        if len(_materials(item)) > 1 or group_node(material) is None:
            report.add(material.name, f"has the same name as {holder.name} in USD, and on {item.name} looks like it")
            continue
        if material not in parted:
            parted[material] = UsdShade.Material.Define(stage, _free(stage, taken))
            write(material, parted[material])
        _bind(stage.GetPrimAtPath(path), taken, parted[material])
    return bool(parted)


def _confused(
    written: Written,
) -> Iterator[tuple[Sdf.Path, bpy.types.Object, bpy.types.Material, bpy.types.Material, Sdf.Path]]:
    """Yield an object's prim, the object, a material of it that was not written, the one that has its name, and that one's prim."""
    holders = {item: path for path, items in written.items() for item in items if isinstance(item, bpy.types.Material)}
    by_name = {path.name: (holder, path) for holder, path in holders.items()}
    for path, items in written.items():
        for item in items:
            for material in _materials(item) if isinstance(item, bpy.types.Object) else ():
                if material not in holders and identifier(material.name) in by_name:
                    yield path, item, material, *by_name[identifier(material.name)]


def _materials(item: bpy.types.Object) -> list[bpy.types.Material]:
    return list({slot.material: None for slot in item.material_slots if slot.material})


def _free(stage: Usd.Stage, taken: Sdf.Path) -> Sdf.Path:
    """Return a path beside the one `taken` where nothing is."""
    paths = (taken.ReplaceName(f"{taken.name}_{number:03}") for number in count(1))
    return next(path for path in paths if not stage.GetPrimAtPath(path))


def _bind(prim: Usd.Prim, taken: Sdf.Path, material: UsdShade.Material) -> None:
    """Give the meshes of the object `prim` that have the material at `taken` another one."""
    for shape in (prim, *prim.GetChildren()):
        if UsdShade.MaterialBindingAPI(shape).GetDirectBinding().GetMaterialPath() == taken:
            UsdShade.MaterialBindingAPI.Apply(shape).Bind(material)
