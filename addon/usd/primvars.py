# SPDX-License-Identifier: GPL-3.0-or-later
"""The names in USD of UV maps and attributes, taken from the shapes that Blender's exporter wrote. Needs pxr.

A hook for materials does not know them, so networks get Blender's names at first, and these when the stage is complete.
"""

from collections import Counter
from collections.abc import Mapping, Sequence

from pxr import Sdf, Usd

from ..blender.wording import listed
from ..material.surface import Loss
from .network import Primvar
from .shapes import RENDERED, Shape, Spelling, spelled, spelling

type Requests = Mapping[Sdf.Path, Mapping[Sdf.Path, Primvar]]
"""For each material its inputs that name UV maps and attributes, by Blender's names."""

UNNAMED = {"uv": RENDERED, "color": "Color"}  # what networks name where no shape has any
TYPES = {
    "uv": (Sdf.ValueTypeNames.TexCoord2fArray, Sdf.ValueTypeNames.Float2Array),
    "color": (Sdf.ValueTypeNames.Color4fArray, Sdf.ValueTypeNames.Color3fArray),
}
NOTHING = "black or zero is read there"


def settle(stage: Usd.Stage, shapes: Sequence[Shape], requests: Requests) -> dict[Sdf.Path, tuple[dict[Primvar, str], list[Loss]]]:
    """Set the inputs to the names in `stage`; return for each material the names, and what the shapes with it lack."""
    users: dict[Sdf.Path, list[Shape]] = {material: [] for material in requests}
    for shape in shapes:
        for material in set(shape.bound.values()) & set(users):
            users[material].append(shape)
    named = spelling([shape for shape in shapes if set(shape.bound.values()) & set(users)])
    return {material: _settled(stage, named, users[material], inputs) for material, inputs in requests.items()}


def _settled(
    stage: Usd.Stage, named: Spelling, users: Sequence[Shape], inputs: Mapping[Sdf.Path, Primvar]
) -> tuple[dict[Primvar, str], list[Loss]]:
    names: dict[Primvar, str] = {}
    losses: list[Loss] = []
    for primvar in dict.fromkeys(inputs.values()):
        found = {user: name_on(user, primvar, named) for user in users}
        known = Counter(name for name in found.values() if name)
        names[primvar] = known.most_common(1)[0][0] if known else _without_shape(primvar, named)
        what = f"the {_words(primvar)}"
        lacking = [user for user, name in found.items() if not name]
        other = [user for user, name in found.items() if name and name != names[primvar]]
        if lacking:
            losses.append(Loss("", "", f"{what}, which {_list(lacking)} lacks,", NOTHING))
        if other:
            losses.append(Loss("", "", f"{what}, which {_list(other)} has under another name in USD,", "it is not found there"))
        covered = {user: last for user in users if (last := _in_its_place(user, primvar, named))}
        for last in dict.fromkeys(covered.values()):
            where = _list([user for user in users if covered.get(user) == last])
            losses.append(Loss("", "", f"{what}, which has the name of {last} in USD on {where},", f"{last} is read there"))
    for path, primvar in inputs.items():
        stage.GetAttributeAtPath(path).Set(names[primvar])
    return names, losses


def name_on(shape: Shape, primvar: Primvar, named: Spelling) -> str:
    """Return the name in the stage of a UV map or attribute on a shape; empty where the shape lacks it.

    One that the mesh lacks may be made by its modifiers, but is not what another of the mesh's is called.
    """
    name = _own_name(shape, primvar)
    there = named.primvar(shape, name) if name else ""
    others = {named.primvar(shape, other) for other in shape.names} if name not in shape.names else set()
    of_kind = TYPES.get(primvar.kind)
    found = shape.types.get(there)
    return there if found and (not of_kind or found in of_kind) and there not in others else ""


def _own_name(shape: Shape, primvar: Primvar) -> str:
    """Return the name in Blender that a request without a name has on a shape; empty where the shape has none."""
    if primvar.name or primvar.kind == "uv":
        return primvar.name or shape.rendered
    return (shape.mesh.attributes.default_color_name or "") if shape.mesh else ""


def _in_its_place(shape: Shape, primvar: Primvar, named: Spelling) -> str:
    """Return which other of a shape's attributes is written under the name of the one that is meant: the last of its type."""
    name = _own_name(shape, primvar)
    if shape.mesh is None or name not in shape.names:
        return ""
    attributes, there = shape.mesh.attributes, named.primvar(shape, name)
    kind = attributes[name].data_type.removeprefix("BYTE_").removeprefix("FLOAT_")
    same = (one for one in shape.names if named.primvar(shape, one) == there)
    *_, last = (one for one in same if attributes[one].data_type.removeprefix("BYTE_").removeprefix("FLOAT_") == kind)
    return last if last != name else ""


def _without_shape(primvar: Primvar, named: Spelling) -> str:
    return spelled(primvar.name, named.has_unicode) if primvar.name else UNNAMED[primvar.kind]


def _words(primvar: Primvar) -> str:
    noun = "UV map" if primvar.kind == "uv" else "color attribute" if primvar.kind == "color" else "attribute"
    return f"{noun} {primvar.name}" if primvar.name else f"active {noun}"


def _list(shapes: Sequence[Shape]) -> str:
    return listed(sorted(shape.prim.GetName() for shape in shapes))
