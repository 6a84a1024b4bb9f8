# SPDX-License-Identifier: GPL-3.0-or-later
"""Separates materials whose names are equal in USD: "a b" and "a.b" are both a_b. Needs pxr.

Blender writes only the first of them, and uses it for all their objects. It calls hooks with the whole stage only after that.
"""

from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count

import bpy

from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

from ..blender import report
from .shapes import Shape, Written, spellings

type Holders = Mapping[Sdf.Path, bpy.types.Material]
"""The materials that Blender wrote, by prim."""
type Write = Callable[[bpy.types.Material, UsdShade.Material], None]
"""Writes a material into a prim."""

VIEWPORT_SHADER = "previewShader"  # what Blender writes instead of a UsdPreviewSurface where that is not asked for


def holders_of(written: Written) -> Holders:
    """Return the materials that Blender wrote, by prim."""
    return {path: item for path, items in written.items() for item in items if isinstance(item, bpy.types.Material)}


def separate(stage: Usd.Stage, shapes: Sequence[Shape], holders: Holders, write: Write) -> bool:
    """Give materials that were not written prims of their own, and bind their shapes to them; returns whether any.

    Where the faces of a shape are not those of its mesh, as modifiers change them, that is reported instead.
    """
    made: dict[bpy.types.Material, Sdf.Path] = {}
    for shape in shapes:
        taken = dict(_taken(shape, holders))
        if not taken:
            continue
        faces = _faces(shape)
        if faces is None:
            for material, path in taken.items():
                text = f"has the same name as {holders[path].name} in USD, and is replaced by it on {shape.prim.GetName()}"
                report.add(material.name, text)
            continue
        for material in taken:
            if material not in made:
                new = _prim_beside(stage, taken[material], material)
                write(material, new)
                made[material] = new.GetPath()
        moved, kept = {one: made[one] for one in taken}, {path: holders[path] for path in taken.values()}
        _move(stage, shape, faces, moved, kept)
    return bool(made)


def _taken(shape: Shape, holders: Holders) -> Iterator[tuple[bpy.types.Material, Sdf.Path]]:
    """Yield the materials of a shape that were not written, each with the path of the one that was written instead."""
    written = set(holders.values())
    for material in _slots(shape):
        if material and material not in written:
            names = spellings(material.name)
            path = next((path for path in shape.bound.values() if path.name in names and path in holders), None)
            if path:
                yield material, path


def _slots(shape: Shape) -> list[bpy.types.Material | None]:
    return [slot.material for slot in shape.item.material_slots] if shape.item else []


def _faces(shape: Shape) -> dict[bpy.types.Material | None, list[int]] | None:
    """Return the faces of each material of a shape, of a shape with one material none; None where the mesh does not tell them."""
    slots = _slots(shape)
    if len({material for material in slots if material}) == 1:
        return {}
    if shape.mesh is None:
        return None
    polygons = shape.mesh.polygons
    sizes, indices = (array("i", bytes(4 * len(polygons))) for _ in range(2))
    polygons.foreach_get("loop_total", sizes)
    polygons.foreach_get("material_index", indices)
    if list(sizes) != list(UsdGeom.Mesh(shape.prim).GetFaceVertexCountsAttr().Get() or ()):
        return None
    faces: dict[bpy.types.Material | None, list[int]] = {}
    for face, index in enumerate(indices):
        faces.setdefault(slots[min(index, len(slots) - 1)], []).append(face)
    return faces


def _prim_beside(stage: Usd.Stage, taken: Sdf.Path, material: bpy.types.Material) -> UsdShade.Material:
    """Return a new material prim beside the one at `taken`, with the viewport's color where that one has it for a surface."""
    paths = (taken.ReplaceName(f"{taken.name}_{number:03}") for number in count(1))
    path = next(path for path in paths if not stage.GetPrimAtPath(path))
    made = UsdShade.Material.Define(stage, path)
    if stage.GetPrimAtPath(taken).GetChild(VIEWPORT_SHADER):
        shader = UsdShade.Shader.Define(stage, path.AppendChild(VIEWPORT_SHADER))
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(tuple(material.diffuse_color)[:3])
        made.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return made


def _move(
    stage: Usd.Stage,
    shape: Shape,
    faces: Mapping[bpy.types.Material | None, list[int]],
    moved: Mapping[bpy.types.Material, Sdf.Path],
    kept: Holders,
) -> None:
    """Bind a shape, or its faces, to the materials `moved`, by their new paths, and to those `kept` only what is theirs."""
    used = [material for material in faces if material]
    whole = used[0] if len(used) == 1 else next(material for material in _slots(shape) if material)
    if whole in moved:
        _bind(stage, shape.prim, moved[whole], like=shape.prim)
    if len(used) < 2:
        return
    for path, material in shape.bound.items():
        if path == shape.prim.GetPath() or material not in kept:
            continue
        if kept[material] in faces:
            UsdGeom.Subset(stage.GetPrimAtPath(path)).GetIndicesAttr().Set(Vt.IntArray(faces[kept[material]]))
        else:
            stage.RemovePrim(path)
    for material in used:
        if material in moved:
            name = moved[material].name
            subset = UsdShade.MaterialBindingAPI(shape.prim).CreateMaterialBindSubset(name, Vt.IntArray(faces[material]))
            _bind(stage, subset.GetPrim(), moved[material], like=shape.prim)


def _bind(stage: Usd.Stage, part: Usd.Prim, material: Sdf.Path, like: Usd.Prim) -> None:
    """Bind a shape or subset to a material; inside a prototype to a prim beside what `like` is bound to, which refers to it."""
    path = UsdShade.MaterialBindingAPI(like).GetDirectBinding().GetMaterialPath().ReplaceName(material.name)
    if not stage.GetPrimAtPath(path):
        UsdShade.Material.Define(stage, path).GetPrim().GetReferences().AddInternalReference(material)
    UsdShade.MaterialBindingAPI.Apply(part).Bind(UsdShade.Material.Get(stage, path))
