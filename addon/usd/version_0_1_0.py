# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what version 0.1.0 wrote into a material's custom data: one group, its inputs, and what was linked to them. Needs pxr."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from pxr import UsdShade

from ..material.materials import add_group, set_thickness, show
from ..material.upgrade import current_name, current_value
from ..nodes import GROUPS

KEY = "trueDiffuse"
EXTENSIONS = {"periodic": "REPEAT", "clamp": "EXTEND", "black": "CLIP", "mirror": "MIRROR"}
DEFAULT_UV = "st"

type Setting = float | str | tuple[float, ...]
type Find = Callable[[str], tuple[str, bool]]
"""Returns the path on disk of a file that USD refers to, and whether that is temporary."""


@dataclass(frozen=True)
class Source:
    """An image or, without `wrap`, a color attribute, times `factor`; `name` is a UV map's or the attribute's."""

    name: str
    factor: float
    wrap: str = ""
    is_color: bool = False
    file: str = ""


@dataclass(frozen=True)
class GroupNode:
    """A node of a group by its key, the values of its inputs, and what is linked to them."""

    group: str
    inputs: Mapping[str, Setting]
    linked: Mapping[str, Source] = field(default_factory=dict)


def read(material: UsdShade.Material) -> GroupNode:
    """Return the node. Raises KeyError, TypeError or ValueError where the custom data have another form."""
    data = material.GetPrim().GetCustomDataByKey(KEY)
    int(data["version"])  # of the group; names of all versions are known by their own
    inputs = {name: value if isinstance(value, (str, int, float)) else tuple(value) for name, value in data["inputs"].items()}
    linked = {name: _source(material, name, values) for name, values in data.get("fed", {}).items()}
    return GroupNode(str(data["group"]), inputs, linked)


def _source(material: UsdShade.Material, socket: str, values: Mapping[str, float | str]) -> Source:
    primvar, factor = str(values["primvar"]), float(values["factor"])
    if values["kind"] == "attribute":
        return Source(primvar, factor)
    path = material.GetPath().AppendChild(f"MaterialX_{socket.replace(' ', '_')}_image")
    shader = UsdShade.Shader.Get(material.GetPrim().GetStage(), path)
    file = shader.GetInput("file").Get() if shader else None
    found = (file.resolvedPath or file.path) if file else ""
    return Source(primvar, factor, str(values["wrap"]), bool(values["is_color"]), found)


def rebuild(material: bpy.types.Material, found: GroupNode, find: Find) -> list[str]:
    """Make the node the only surface of `material`; returns messages about what could not be restored."""
    group = next((group for group in GROUPS if group.key == found.group), None)
    if group is None:
        return [f"the group {found.group} is unknown, the material is as USD has it"]
    tree = material.node_tree
    tree.nodes.clear()
    node = add_group(tree, group)
    inputs = {current_name(name): value for name, value in found.inputs.items()}
    problems = [problem for name, value in inputs.items() if (problem := _set(node, name, current_value(name, value)))]
    for name, source in found.linked.items():
        if current_name(name) in node.inputs:
            problems += _link(node.inputs[current_name(name)], source, find)
    show(material, node)
    set_thickness(material)
    return problems


def _set(node: bpy.types.Node, name: str, value: Setting) -> str:
    """Set a socket; returns why that failed, else an empty text."""
    if name not in node.inputs:
        return f"{name}: the group has no such input"
    try:
        node.inputs[name].default_value = value
    except (TypeError, ValueError):
        return f"{name}: {value!r} is not a valid value"
    return ""


def _link(socket: bpy.types.NodeSocket, source: Source, find: Find) -> list[str]:
    """Link new nodes for `source` to `socket`; returns messages about what is missing."""
    tree, x, y = socket.id_data, -300.0, -120.0 * list(socket.node.inputs).index(socket)
    problems = []
    if not source.wrap:
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = source.name
    else:
        node = tree.nodes.new("ShaderNodeTexImage")
        if source.wrap in EXTENSIONS:
            node.extension = EXTENSIONS[source.wrap]
        else:
            problems.append(f"{socket.name}: the wrap mode {source.wrap!r} is unknown, the image is repeated")
        problems += _load(node, source, find)
        if source.name != DEFAULT_UV:
            uv = tree.nodes.new("ShaderNodeUVMap")
            uv.uv_map, uv.location = source.name, (x - 600.0, y)
            tree.links.new(uv.outputs["UV"], node.inputs["Vector"])
    node.location = (x - 300.0, y)
    color = node.outputs["Color"]
    if source.factor != 1.0:
        scale = tree.nodes.new("ShaderNodeVectorMath")
        scale.operation, scale.location = "SCALE", (x, y)
        scale.inputs["Scale"].default_value = source.factor
        tree.links.new(color, scale.inputs["Vector"])
        color = scale.outputs["Vector"]
    tree.links.new(color, socket)
    return problems


def _load(node: bpy.types.Node, source: Source, find: Find) -> list[str]:
    """Load the image of `source` into an image node; returns a message where its file is missing."""
    path, is_temporary = find(source.file) if source.file else ("", False)
    if not Path(path).is_file():
        return [f"the image {source.file or 'of a socket'} is missing"]
    image = bpy.data.images.load(path, check_existing=not is_temporary)
    if is_temporary:
        image.pack()
    if not source.is_color:  # else the color space stays that of a file of its kind
        image.colorspace_settings.is_data = True
    node.image = image
    return []
