# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a True Diffuse material from the surface in the custom data of a USD material."""

from collections.abc import Callable
from pathlib import Path

import bpy

from ..material.materials import add_group, set_thickness, show
from ..material.read import DEFAULT_UV, WRAPS
from ..material.surface import Attribute, GroupSurface, Image, Setting, Source
from ..material.upgrade import current_name, current_value
from ..nodes import GROUPS

EXTENSIONS = {wrap: extension for extension, wrap in WRAPS.items()}

type Find = Callable[[str], tuple[str, bool]]
"""Returns the path on disk of a file that USD refers to, and whether that is temporary."""


def rebuild(material: bpy.types.Material, surface: GroupSurface, find: Find) -> list[str]:
    """Make `surface` the only surface of `material`; returns messages about what could not be restored."""
    group = next((group for group in GROUPS if group.key == surface.group), None)
    if group is None:
        return [f"the group {surface.group} is unknown, the material is as USD has it"]
    tree = material.node_tree
    tree.nodes.clear()
    node = add_group(tree, group)
    inputs = {current_name(name): value for name, value in surface.inputs.items()}
    problems = [problem for name, value in inputs.items() if (problem := _set(node, name, current_value(name, value)))]
    for name, source in surface.linked.items():
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
    if isinstance(source, Attribute):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = source.primvar
    else:
        node = tree.nodes.new("ShaderNodeTexImage")
        if source.wrap in EXTENSIONS:
            node.extension = EXTENSIONS[source.wrap]
        else:
            problems.append(f"{socket.name}: the wrap mode {source.wrap!r} is unknown, the image is repeated")
        problems += _load(node, source, find)
        if source.primvar != DEFAULT_UV:
            uv = tree.nodes.new("ShaderNodeUVMap")
            uv.uv_map, uv.location = source.primvar, (x - 600.0, y)
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


def _load(node: bpy.types.Node, source: Image, find: Find) -> list[str]:
    """Load the image of `source` into an image node; returns a message where its file is missing."""
    path, is_temporary = find(source.file) if source.file else ("", False)
    if not Path(path).is_file():
        return [f"the image {source.file or 'of a socket'} is missing"]
    image = bpy.data.images.load(path, check_existing=not is_temporary)
    if is_temporary:
        image.pack()
    image.colorspace_settings.name = "sRGB" if source.is_color else "Non-Color"
    node.image = image
    return []
