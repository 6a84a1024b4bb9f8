# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a True Diffuse material again from what a USD material remembers of it."""

from collections.abc import Callable
from pathlib import Path

import bpy

from ..material.materials import add_group, set_thickness, show
from ..material.read import DEFAULT_UV, WRAPS
from ..material.surface import Attribute, Image, Setting, Source, Surface
from ..material.upgrade import current_name, current_value
from ..nodes import GROUPS

EXTENSIONS = {wrap: extension for extension, wrap in WRAPS.items()}


type Find = Callable[[str], tuple[str, bool]]
"""Returns where on disk a file is that USD refers to, and whether it will not stay there."""


def rebuild(material: bpy.types.Material, surface: Surface, find: Find) -> list[str]:
    """Make `surface` the only surface of `material`; returns in words what of it could not be."""
    group = next((group for group in GROUPS if group.key == surface.group), None)
    if group is None:
        return [f"the group {surface.group} is not known here, the material is as USD has it"]
    tree = material.node_tree
    tree.nodes.clear()
    node = add_group(tree, group)
    inputs = {current_name(name): value for name, value in surface.inputs.items()}
    lost = [problem for name, value in inputs.items() if (problem := _set(node, name, current_value(name, value)))]
    for name, source in surface.fed.items():
        if current_name(name) in node.inputs:
            lost += _feed(node.inputs[current_name(name)], source, find)
    show(material, node)
    set_thickness(material)
    return lost


def _set(node: bpy.types.Node, name: str, value: Setting) -> str:
    """Set a socket; returns why not, or nothing."""
    if name not in node.inputs:
        return f"{name}: the group has no such input any more"
    try:
        node.inputs[name].default_value = value
    except (TypeError, ValueError):
        return f"{name}: {value!r} is no value for it"
    return ""


def _feed(socket: bpy.types.NodeSocket, source: Source, find: Find) -> list[str]:
    """Connect `source` to `socket`; returns in words what is missing."""
    tree, x, y = socket.id_data, -300.0, -120.0 * list(socket.node.inputs).index(socket)
    lost = []
    if isinstance(source, Attribute):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = source.primvar
    else:
        node = tree.nodes.new("ShaderNodeTexImage")
        node.extension = EXTENSIONS.get(source.wrap, "REPEAT")
        lost = _load(node, source, find)
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
    return lost


def _load(node: bpy.types.Node, source: Image, find: Find) -> list[str]:
    path, passing = find(source.file) if source.file else ("", False)
    if not Path(path).is_file():
        return [f"the image {source.file or 'of a socket'} is missing"]
    image = bpy.data.images.load(path, check_existing=not passing)
    if passing:
        image.pack()
    image.colorspace_settings.name = "sRGB" if source.is_color else "Non-Color"
    node.image = image
    return []
