# SPDX-License-Identifier: GPL-3.0-or-later
"""A material as an exported file keeps it, and made again of that: its nodes (`node_record.py`) and settings.

What a format names in its own way comes as functions and names from its import: images, UV maps and color attributes.
"""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import bpy

from . import node_record

type Load = Callable[[str, Mapping[str, Any], list[str]], bpy.types.Image | None]
"""Returns the image of a full name with the settings that a record has for it, None where it is missing; adds to problems."""

RENDER_METHOD = "surface_render_method"
SETTINGS = (RENDER_METHOD, "use_backface_culling", "use_transparency_overlap", "displacement_method")
NAMES = {"uv": ("uv_map",), "color": ("layer_name",)}  # of nodes' properties by what they name
# What stands for the active map or attribute where it names none, which files do not know
UNNAMED = {"ShaderNodeUVMap": "uv_map", "ShaderNodeNormalMap": "uv_map", "ShaderNodeVertexColor": "layer_name"}


def kept(material: bpy.types.Material) -> node_record.Record:
    """Return what a file keeps of a material."""
    return node_record.record(material.node_tree) | {"material": {name: getattr(material, name) for name in SETTINGS}}


def restore(
    material: bpy.types.Material,
    nodes: node_record.Record,
    names: Mapping[str, Mapping[str, str]],
    load: Load,
    set_render_method: Callable[[bpy.types.Material, str], None] | None = None,
) -> list[str]:
    """Make a material what `nodes`, of `kept`, say; returns messages about what could not be restored.

    `names` are those of UV maps ("uv") and color attributes ("color") on imported meshes, by those in `nodes`. Raises KeyError,
    TypeError or ValueError where `nodes` have another form.
    """
    every = list(nodes_of(nodes))
    settings = {value["image"]: value for node in every for value in node.get("properties", {}).values() if _is_image(value)}
    loaded: dict[str, bpy.types.Image | None] = {}
    problems: list[str] = []

    def find_image(name: str) -> bpy.types.Image | None:
        if name not in loaded:
            loaded[name] = load(name, settings[name], problems)
        return loaded[name]

    for node in every:
        if node["kind"] in UNNAMED:
            node.setdefault("properties", {}).setdefault(UNNAMED[node["kind"]], "")
        _rename(node.get("properties", {}), names)
    values = nodes.get("material", {})
    problems += node_record.rebuild(material.node_tree, nodes, find_image)
    for name, value in values.items():
        try:
            if name == RENDER_METHOD and set_render_method:
                set_render_method(material, value)
            elif name in SETTINGS:
                setattr(material, name, value)
        except (AttributeError, TypeError, ValueError):
            problems.append(f"{name.replace('_', ' ')}: {value!r} is not a valid value")
    return problems


@contextmanager
def undone_on_failure(material: bpy.types.Material) -> Generator[None]:
    """Give a material the nodes again that it had, where what happens within raises."""
    before = node_record.record(material.node_tree)
    try:
        yield
    except Exception:
        node_record.rebuild(material.node_tree, before, bpy.data.images.get)
        raise


def with_settings(
    image: bpy.types.Image, settings: Mapping[str, Any], problems: list[str], is_shared: bool = False
) -> bpy.types.Image:
    """Return an image with the color space and alpha mode that a record has for it; a copy, if need be, of one that `is_shared`.

    Adds to `problems` a color space that Blender does not have here.
    """
    current = image.colorspace_settings
    space, is_data = settings.get("color_space", current.name), settings.get("is_data", False)
    if space != current.name and not (is_data and current.is_data):
        if is_shared:  # another material has it in another color space
            image = image.copy()
        if space in current.bl_rna.properties["name"].enum_items:
            image.colorspace_settings.name = space
        elif is_data:
            image.colorspace_settings.is_data = True
        else:
            problems.append(f"the image {image.name}: there is no color space {space} here, it is read as {current.name}")
    if "alpha" in settings:
        image.alpha_mode = settings["alpha"]
    return image


def nodes_of(record: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the nodes of a record, those in groups included."""
    for node in record["nodes"]:
        yield node
        if "tree" in node:
            yield from nodes_of(node["tree"])


def _rename(properties: dict[str, Any], names: Mapping[str, Mapping[str, str]]) -> None:
    """Give a node the names that UV maps and attributes have on the imported mesh."""
    for kind, keys in NAMES.items():
        for key in keys:
            if key in properties:
                properties[key] = names[kind].get(properties[key], properties[key])
    if "attribute_name" in properties:
        every = {**names["uv"], **names["color"]}
        properties["attribute_name"] = every.get(properties["attribute_name"], properties["attribute_name"])


def _is_image(value: object) -> bool:
    return isinstance(value, dict) and "image" in value
