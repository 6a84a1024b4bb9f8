# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a material's nodes again from what a USD material keeps of them. Needs pxr."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import bpy

from pxr import UsdShade

from ..material.node_record import rebuild as rebuild_nodes
from . import author, version_0_1_0

type Find = Callable[[str], tuple[str, bool]]
"""Returns the path on disk of a file that USD refers to, and whether that is temporary."""

RENDER_METHOD = "surface_render_method"
NAMES = {"uv": ("uv_map",), "color": ("layer_name",)}  # of nodes' properties by what they name


def rebuild(material: bpy.types.Material, usd_material: UsdShade.Material, find: Find) -> list[str]:
    """Make the nodes of `material` those that `usd_material` keeps; returns messages about what could not be restored.

    Raises KeyError, TypeError or ValueError where what it keeps has another form.
    """
    kept = author.read_nodes(usd_material)
    if kept is None:
        return version_0_1_0.rebuild(material, version_0_1_0.read(usd_material), find)
    nodes, files, names = kept
    spaces = {value["image"]: value for node in _nodes(nodes) for value in node.get("properties", {}).values() if _is_image(value)}
    loaded: dict[str, bpy.types.Image | None] = {}
    problems: list[str] = []

    def find_image(name: str) -> bpy.types.Image | None:
        if name not in loaded:
            loaded[name] = _load(files.get(name, ""), spaces.get(name, {}), find, problems)
        return loaded[name]

    for node in _nodes(nodes):
        if node["kind"] == "ShaderNodeVertexColor":  # without a name it is the active one, which USD does not know
            node.setdefault("properties", {}).setdefault("layer_name", "")
        _rename(node.get("properties", {}), names)
    settings = nodes.pop("material", {})
    problems += rebuild_nodes(material.node_tree, nodes, find_image)
    for name, value in settings.items():
        try:
            if name != RENDER_METHOD:
                setattr(material, name, value)
            elif value != material.surface_render_method:
                _set_later(material.name, value)
        except (AttributeError, TypeError, ValueError):
            problems.append(f"{name.replace('_', ' ')}: {value!r} is not a valid value")
    return problems


def _set_later(material: str, render_method: str) -> None:
    """Set the Render Method when the import is done: Blender crashes where a hook sets it."""

    def update(*_: object) -> None:
        bpy.app.handlers.depsgraph_update_post.remove(update)
        if found := bpy.data.materials.get(material):
            found.surface_render_method = render_method

    bpy.app.handlers.depsgraph_update_post.append(update)


def _nodes(record: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the nodes of a record, those in groups included."""
    for node in record["nodes"]:
        yield node
        if "tree" in node:
            yield from _nodes(node["tree"])


def _rename(properties: dict[str, Any], names: Mapping[str, Mapping[str, str]]) -> None:
    """Give a node the names that UV maps and attributes have in the stage, and so in the imported mesh."""
    for kind, keys in NAMES.items():
        for key in keys:
            if key in properties:
                properties[key] = names[kind].get(properties[key], properties[key])
    if "attribute_name" in properties:
        every = {**names["uv"], **names["color"]}
        properties["attribute_name"] = every.get(properties["attribute_name"], properties["attribute_name"])


def _is_image(value: object) -> bool:
    return isinstance(value, dict) and "image" in value


def _load(file: str, settings: Mapping[str, Any], find: Find, problems: list[str]) -> bpy.types.Image | None:
    """Return the image in `file`; None where that is missing. Adds to `problems` a color space that Blender does not have here."""
    path, is_temporary = find(file) if file else ("", False)
    if "<UDIM>" in path:
        tiles = sorted(Path(path).parent.glob(Path(path).name.replace("<UDIM>", "[0-9][0-9][0-9][0-9]")))
        if not tiles:
            return None
        image = bpy.data.images.load(str(tiles[0]), check_existing=not is_temporary)
        image.source = "TILED"
    elif Path(path).is_file():
        image = bpy.data.images.load(path, check_existing=not is_temporary)
        if is_temporary:
            image.pack()
    else:
        return None
    current = image.colorspace_settings
    space, is_data = settings.get("color_space", current.name), settings.get("is_data", False)
    if space != current.name and not (is_data and current.is_data):
        if image.users:  # another material has it in another color space
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
