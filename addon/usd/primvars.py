# SPDX-License-Identifier: GPL-3.0-or-later
"""The names in USD of UV maps and color attributes, taken from the meshes that Blender's exporter wrote. Needs pxr.

The exporter makes names valid, with or without letters beyond ASCII, and calls the UV map that renders st unless told not to. A
hook for materials knows nothing of that, so networks get Blender's names at first, and these when the stage is complete.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import bpy

from pxr import Sdf, Usd, UsdGeom, UsdShade

from ..material.surface import Loss
from .network import Primvar

type Written = Mapping[Sdf.Path, Sequence[bpy.types.ID]]
"""The data-blocks that Blender wrote, by prim."""
type Requests = Mapping[Sdf.Path, Mapping[Sdf.Path, Primvar]]
"""For each material its inputs that name UV maps and attributes, by Blender's names."""

RENDERED = "st"  # what Blender's exporter calls the UV map that renders
NO_COLOR = "displayColor"
TYPES = {
    "uv": (Sdf.ValueTypeNames.TexCoord2fArray, Sdf.ValueTypeNames.Float2Array),
    "color": (Sdf.ValueTypeNames.Color4fArray, Sdf.ValueTypeNames.Color3fArray),
}


def settle(stage: Usd.Stage, written: Written, requests: Requests) -> dict[Sdf.Path, tuple[dict[Primvar, str], list[Loss]]]:
    """Set the inputs to the names in `stage`; return for each material the names, and what the meshes with it lack."""
    users = _users(stage, set(requests)) if requests else {}
    return {material: _settled(stage, written, users.get(material, []), inputs) for material, inputs in requests.items()}


def _settled(
    stage: Usd.Stage, written: Written, users: Sequence[Usd.Prim], inputs: Mapping[Sdf.Path, Primvar]
) -> tuple[dict[Primvar, str], list[Loss]]:
    names: dict[Primvar, str] = {}
    losses: list[Loss] = []
    for primvar in dict.fromkeys(inputs.values()):
        found = {user: name_on(user, _data(written, user), primvar) for user in users}
        known = Counter(name for name in found.values() if name)
        names[primvar] = known.most_common(1)[0][0] if known else _guess(primvar)
        what = f"the {_words(primvar)}"
        lacking = sorted(user.GetName() for user, name in found.items() if not name)
        other = sorted(user.GetName() for user, name in found.items() if name and name != names[primvar])
        if lacking:
            losses.append(Loss("", "", f"{what}, which {_list(lacking)} lacks,", "black or zero is read there"))
        if other:
            losses.append(Loss("", "", f"{what}, which {_list(other)} has under another name in USD,", "it is not found there"))
    for path, primvar in inputs.items():
        stage.GetAttributeAtPath(path).Set(names[primvar])
    return names, losses


def name_on(prim: Usd.Prim, data: bpy.types.ID | None, primvar: Primvar) -> str:
    """Return the name of a UV map or attribute on a prim, made of `data` where that is known; empty where the prim lacks it."""
    there = {one.GetPrimvarName(): one.GetTypeName() for one in UsdGeom.PrimvarsAPI(prim).GetPrimvars()}
    of_kind = [str(name) for name, kind in there.items() if kind in TYPES.get(primvar.kind, (kind,))]
    own = primvar.name
    if primvar.kind == "uv":
        rendered = next((layer.name for layer in getattr(data, "uv_layers", ()) if layer.active_render), "")
        names = spellings(own or rendered)
        if RENDERED in of_kind and (not own or own == rendered) and not set(names) & set(of_kind) - {RENDERED}:
            return RENDERED
    else:
        attributes = getattr(data, "attributes", None)
        names = spellings(own or (attributes.default_color_name if attributes else "") or "")
    match = next((name for name in names if name in of_kind), "") or next((name for name in names if name in there), "")
    if match:
        return match
    return of_kind[0] if not own and len(of_kind) == 1 else RENDERED if not own and RENDERED in of_kind else ""


def spellings(name: str) -> list[str]:
    """Return the ways in which the exporter may spell a name: with letters beyond ASCII, and without."""
    if not name:
        return []
    known = "".join(letter if f"a{letter}".isidentifier() else "_" for letter in name)
    letters = known if known[0].isidentifier() else f"_{known}" if known[0].isdigit() else f"_{known[1:]}"
    ascii_letters = re.sub(r"\W", "_", name, flags=re.ASCII)
    return [name, letters, f"_{ascii_letters}" if ascii_letters[0].isdigit() else ascii_letters]


def _guess(primvar: Primvar) -> str:
    return spellings(primvar.name)[1] if primvar.name else RENDERED if primvar.kind == "uv" else NO_COLOR


def _words(primvar: Primvar) -> str:
    noun = "UV map" if primvar.kind == "uv" else "color attribute" if primvar.kind == "color" else "attribute"
    return f"{noun} {primvar.name}" if primvar.name else f"active {noun}"


def _list(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def _data(written: Written, prim: Usd.Prim) -> bpy.types.ID | None:
    """Return the mesh that a prim was made of."""
    items = [*written.get(prim.GetPath(), ()), *written.get(prim.GetPath().GetParentPath(), ())]
    items = [item.data if isinstance(item, bpy.types.Object) else item for item in items]
    return next((item for item in items if isinstance(item, bpy.types.Mesh)), None)


def _users(stage: Usd.Stage, materials: set[Sdf.Path]) -> dict[Sdf.Path, list[Usd.Prim]]:
    """Return for each material the shapes that are bound to it, whole or in part."""
    users: dict[Sdf.Path, list[Usd.Prim]] = {}
    for prim in _shapes(stage):
        material = UsdShade.MaterialBindingAPI(prim).GetDirectBinding().GetMaterialPath()
        shape = prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim
        if material in materials and shape not in users.setdefault(material, []):
            users[material].append(shape)
    return users


def _shapes(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.Subset):
            yield prim
