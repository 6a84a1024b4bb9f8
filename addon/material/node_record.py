# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's nodes as plain values that JSON can hold, and nodes made of them again.

`record` keeps of each node its kind, the properties that differ from RNA's defaults, and the values of its sockets; links, frames,
and the trees of the artist's own groups. Of a group of True Diffuse it keeps key and version, as this version can build it. Images
are kept by full name. Other data-blocks that a node names (objects, texts, scenes) are kept by name, too, and are found again where
they are in the file.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import bpy

from ..blender import color_spaces
from ..nodes import GROUPS
from ..nodes.graph import key_and_version
from .materials import add_group
from .read_nodes import shortest
from .upgrade import current_name, current_value

type Record = dict[str, Any]
"""JSON's types alone."""
type Plain = bool | int | float | str | list[Any] | dict[str, Any] | None
type Sockets = bpy.types.NodeInputs | bpy.types.NodeOutputs
type FindImage = Callable[[str], bpy.types.Image | None]

FORMAT = 1
# Properties that say nothing of what a node computes, or that follow from others, or are kept apart
SKIPPED = {
    "rna_type", "type", "name", "inputs", "outputs", "internal_links", "parent", "dimensions", "select", "node_tree",
    "location", "location_absolute", "height", "width_hidden", "is_active_output", "show_preview", "show_options",
    "show_texture", "warning_propagation", "color_tag", "debug_zone_body_lazy_function_graph", "debug_zone_lazy_function_graph",
}  # fmt: skip
# What a new node has where RNA says something else
NEW_MAPPING = {"scale": [1.0, 1.0, 1.0], "max": [1.0, 1.0, 1.0], "mapping_x": "X", "mapping_y": "Y", "mapping_z": "Z"}
NEW_COLOR_MAPPING = {"brightness": 1.0, "contrast": 1.0, "saturation": 1.0, "blend_color": [0.8, 0.8, 0.8]}
NEW_IMAGE_USER = {"frame_duration": 100, "frame_start": 1}
GROUP_TYPES = ("GROUP", "GROUP_INPUT", "GROUP_OUTPUT")
NUMBERS = (bool, int, float, str)
SCRIPT = "ShaderNodeScript"  # whose Open Shading Language can write files


def record(tree: bpy.types.NodeTree) -> Record:
    """Return the nodes of a tree, its links, and the interface of a group's tree."""
    nodes = {node.name: node for node in tree.nodes}
    found: Record = {"format": FORMAT, "nodes": [_node(node) for node in nodes.values()], "links": _links(tree)}
    if tree.interface.items_tree:
        found["interface"] = [_interface_item(item) for item in tree.interface.items_tree]
    return found


def image_names(found: Mapping[str, Any]) -> list[str]:
    """Return the full names of the images in a record, those in groups included, each once."""
    names: list[str] = []
    for node in found["nodes"]:
        names += [value["image"] for value in node.get("properties", {}).values() if isinstance(value, dict) and "image" in value]
        if "tree" in node:
            names += image_names(node["tree"])
    return list(dict.fromkeys(names))


def rebuild(tree: bpy.types.NodeTree, found: Mapping[str, Any], find_image: FindImage) -> list[str]:
    """Make the nodes of a tree those of a record; return what could not be made, in words for the user.

    `find_image` returns the image of a full name, None where it is missing. Raises ValueError for a record of a newer format.
    """
    if found.get("format", 0) > FORMAT:
        raise ValueError(f"nodes in format {found['format']}, which a newer version has written")
    problems: list[str] = []
    tree.nodes.clear()
    made: dict[str, bpy.types.Node] = {}
    for values in found["nodes"]:
        node = _made(tree, values, find_image, problems)
        if node is not None:
            made[values["name"]] = node
    for values in found["nodes"]:
        if values.get("parent") in made and values["name"] in made:
            made[values["name"]].parent = made[values["parent"]]
    for values in found["nodes"]:
        if values["name"] in made:
            made[values["name"]].location = values["location"]
    for source, output, target, input_, is_muted in found["links"]:
        if source not in made or target not in made:
            continue
        start, end = _socket(made[source].outputs, output), _socket(made[target].inputs, input_)
        if start is None or end is None:
            problems.append(f"the link from {source} to {target} has no socket any more")
            continue
        tree.links.new(start, end).is_muted = is_muted
    return problems


# writing


def _node(node: bpy.types.Node) -> Record:
    values: Record = {"kind": node.bl_idname, "name": node.name, "location": _rounded(node.location)}
    if node.parent:
        values["parent"] = node.parent.name
    key, version = key_and_version(node)
    own = key in {group.key for group in GROUPS}
    if own:
        values |= {"group": key, "version": int(version) if version.isdecimal() else 0}
    elif node.type == "GROUP" and node.node_tree:
        values |= {"tree": record(node.node_tree), "tree_name": node.node_tree.name}
    properties = _properties(node)
    if not node.use_custom_color:
        properties.pop("color", None)
    if properties.get("width") == node.bl_width_default:
        del properties["width"]
    if properties:
        values["properties"] = properties
    sockets = {}
    for side, where in (("inputs", node.inputs), ("outputs", node.outputs)):
        found = {}
        for socket in where:
            value = getattr(socket, "default_value", None)
            if value is not None and (side == "inputs" or node.type in ("VALUE", "RGB", "NORMAL")):
                found[_key(socket)] = _plain(value)
        hidden = [_key(socket) for socket in where if socket.hide]
        if found:
            sockets[side] = found
        if hidden:
            values[f"hidden_{side}"] = hidden
    if sockets:
        values["sockets"] = sockets
    if node.type == "GROUP_OUTPUT" or node.type.startswith("OUTPUT"):
        values["is_active"] = node.is_active_output
    return values


def _properties(owner: bpy.types.bpy_struct) -> Record:
    """Return the properties that can be set and are not at their defaults, with those of color ramps, curves and mappings."""
    values: Record = {}
    for prop in owner.bl_rna.properties:
        name = prop.identifier
        if name in SKIPPED or name.startswith("bl_"):
            continue
        value = getattr(owner, name, None)
        if prop.type == "POINTER":
            if isinstance(value, bpy.types.Image):
                space = value.colorspace_settings
                values[name] = {"image": value.name_full, "color_space": space.name, "alpha": value.alpha_mode}
                if color_spaces.is_data(value):
                    values[name]["is_data"] = True
            elif isinstance(value, bpy.types.ID):
                values[name] = {"id": type(value).__name__, "name": value.name_full}
            elif isinstance(value, bpy.types.ColorRamp):
                values[name] = {"ramp": _ramp(value)}
            elif isinstance(value, bpy.types.CurveMapping):
                values[name] = {"curves": _curves(value)}
            elif isinstance(value, (bpy.types.ImageUser, bpy.types.ColorMapping, bpy.types.TexMapping)):
                inner = _properties(value)
                if isinstance(value, bpy.types.ColorMapping) and not value.use_color_ramp:
                    inner.pop("color_ramp", None)
                if inner not in (NEW_MAPPING, NEW_COLOR_MAPPING, NEW_IMAGE_USER, {}):
                    values[name] = {"struct": inner}
        elif prop.type != "COLLECTION" and not prop.is_readonly:
            plain = _plain(value)
            if plain != _default(prop):
                values[name] = plain
    return values


def _default(prop: bpy.types.Property) -> Plain:
    if getattr(prop, "is_array", False):
        return [_number(value) for value in prop.default_array]
    if getattr(prop, "is_enum_flag", False):
        return sorted(prop.default_flag)
    return _plain(prop.default) if hasattr(prop, "default") else None


def _plain(value: object) -> Plain:
    if isinstance(value, bpy.types.ID):
        return {"id": type(value).__name__, "name": value.name_full}
    if isinstance(value, float):
        return _number(value)
    if value is None or isinstance(value, NUMBERS):
        return value
    if isinstance(value, set):
        return sorted(value)
    return [_number(one) for one in value]


def _number(value: float) -> float:
    """Return the shortest number that is the same 32-bit float."""
    return shortest(value) if isinstance(value, float) else value


def _rounded(values: Iterable[float]) -> list[float]:
    return [round(value, 1) for value in values]


def _ramp(ramp: bpy.types.ColorRamp) -> Record:
    stops = [[_number(one.position), *map(_number, one.color)] for one in ramp.elements]
    return {"mode": ramp.color_mode, "hue": ramp.hue_interpolation, "interpolation": ramp.interpolation, "stops": stops}


def _curves(mapping: bpy.types.CurveMapping) -> Record:
    points = [[[*map(_number, point.location), point.handle_type] for point in curve.points] for curve in mapping.curves]
    levels = {name: [*map(_number, getattr(mapping, name))] for name in ("black_level", "white_level")}
    clip = [mapping.use_clip, *(_number(getattr(mapping, f"clip_{side}")) for side in ("min_x", "min_y", "max_x", "max_y"))]
    return {"points": points, "clip": clip, "extend": mapping.extend, "tone": mapping.tone, **levels}


def _links(tree: bpy.types.NodeTree) -> list[list[Any]]:
    links = [link for link in tree.links if link.is_valid]
    return [[link.from_node.name, _key(link.from_socket), link.to_node.name, _key(link.to_socket), link.is_muted] for link in links]


def _key(socket: bpy.types.NodeSocket) -> str:
    """Return what finds a socket again: its name in a group of ours, its place in another's group, else its identifier."""
    if key_and_version(socket.node)[0] in {group.key for group in GROUPS}:
        return socket.name
    if socket.node.type in GROUP_TYPES:
        sockets = socket.node.outputs if socket.is_output else socket.node.inputs
        return f"#{list(sockets).index(socket)}"
    return socket.identifier


def _interface_item(item: bpy.types.NodeTreeInterfaceItem) -> Record:
    values: Record = {"item": item.item_type, "name": getattr(item, "name", "")}
    if isinstance(item, bpy.types.NodeTreeInterfaceSocket):
        values |= {"in_out": item.in_out, "socket": item.bl_socket_idname}
        if (default := getattr(item, "default_value", None)) is not None:
            values["default"] = _plain(default)
        values |= {name: _number(getattr(item, name)) for name in ("min_value", "max_value") if hasattr(item, name)}
        if item.hide_value:
            values["hide_value"] = True
    if item.parent and item.parent.name:
        values["parent"] = item.parent.name
    return values


# reading


def _made(tree: bpy.types.NodeTree, values: Mapping[str, Any], find_image: FindImage, problems: list[str]) -> bpy.types.Node | None:
    if "group" in values:
        group = next((group for group in GROUPS if group.key == values["group"]), None)
        if group is None:
            problems.append(f"the group {values['group']} is unknown")
            return None
        node = add_group(tree, group)
    elif values["kind"] == SCRIPT:
        problems.append(f"the node {values['name']} is left out, as it would run a program of the file")
        return None
    else:
        try:
            node = tree.nodes.new(values["kind"])
        except RuntimeError:
            problems.append(f"the node {values['name']} is of an unknown kind, {values['kind']}")
            return None
        if "tree" in values:
            node.node_tree = _group_tree(values, find_image, problems)
    node.name = values["name"]
    _set_properties(node, values.get("properties", {}), find_image, problems)
    for side, sockets in values.get("sockets", {}).items():
        for name, value in sockets.items():
            _set_socket(node, getattr(node, side), name, value, problems)
    for side in ("inputs", "outputs"):
        for key in values.get(f"hidden_{side}", ()):
            socket = _socket(getattr(node, side), key)
            if socket is not None:
                socket.hide = True
    if "is_active" in values:
        node.is_active_output = values["is_active"]
    return node


def _group_tree(values: Mapping[str, Any], find_image: FindImage, problems: list[str]) -> bpy.types.NodeTree:
    """Return a new tree for an artist's group, or one that is there and has the same nodes."""
    found = values["tree"]
    there = bpy.data.node_groups.get(values["tree_name"])
    if there is not None and there.bl_idname == "ShaderNodeTree" and record(there) == found:
        return there
    tree = bpy.data.node_groups.new(values["tree_name"], "ShaderNodeTree")
    panels: dict[str, bpy.types.NodeTreeInterfacePanel] = {}
    for item in found.get("interface", ()):
        parent = panels.get(item.get("parent", ""))
        if item["item"] == "PANEL":
            panels[item["name"]] = tree.interface.new_panel(item["name"])
            continue
        socket = tree.interface.new_socket(item["name"], in_out=item["in_out"], socket_type=item["socket"], parent=parent)
        for name, key in (("min_value", "min_value"), ("max_value", "max_value"), ("default_value", "default")):
            if key in item and hasattr(socket, name):
                setattr(socket, name, item[key])
        socket.hide_value = item.get("hide_value", False)
    problems += rebuild(tree, found, find_image)
    return tree


def _set_properties(owner: bpy.types.bpy_struct, properties: Mapping[str, Any], find_image: FindImage, problems: list[str]) -> None:
    # what chooses the other properties' meaning, such as a data type, comes first in the order of RNA, as it was written
    for name, value in properties.items():
        try:
            match value:
                case {"image": image}:
                    owner.image = find_image(image)
                    if owner.image is None:
                        problems.append(f"the image {image} is missing")
                case {"id": kind, "name": data_name}:
                    setattr(owner, name, _data_block(kind, data_name))
                case {"ramp": ramp}:
                    _set_ramp(getattr(owner, name), ramp)
                case {"curves": curves}:
                    _set_curves(getattr(owner, name), curves)
                case {"struct": inner}:
                    _set_properties(getattr(owner, name), inner, find_image, problems)
                case list() if isinstance(getattr(owner, name), set):
                    setattr(owner, name, set(value))
                case _:
                    setattr(owner, name, value)
        except (AttributeError, TypeError, ValueError):
            problems.append(f"{name.replace('_', ' ')}: {value!r} is not a valid value")


def _data_block(kind: str, name: str) -> bpy.types.ID | None:
    collections = {"Object": bpy.data.objects, "Text": bpy.data.texts, "Scene": bpy.data.scenes, "World": bpy.data.worlds}
    return collections[kind].get(name) if kind in collections else None


def _set_socket(node: bpy.types.Node, sockets: Sockets, name: str, value: Plain, problems: list[str]) -> None:
    socket = _socket(sockets, name)
    if socket is None:
        problems.append(f"{name}: the group has no such input" if node.type == "GROUP" else f"{node.name} has no socket {name}")
        return
    if isinstance(value, dict):
        value = _data_block(value["id"], value["name"])
    try:
        socket.default_value = current_value(current_name(name), value) if node.type == "GROUP" else value
    except (AttributeError, TypeError, ValueError):
        problems.append(f"{socket.name}: {value!r} is not a valid value")


def _socket(sockets: Sockets, name: str) -> bpy.types.NodeSocket | None:
    """Return a socket by its key: its place, its identifier or, for groups of True Diffuse, its name now."""
    if name.startswith("#"):
        index = int(name[1:])
        return sockets[index] if index < len(sockets) else None
    by_identifier = next((socket for socket in sockets if socket.identifier == name), None)
    return by_identifier or next((socket for socket in sockets if socket.name == current_name(name)), None)


def _set_ramp(ramp: bpy.types.ColorRamp, values: Mapping[str, Any]) -> None:
    ramp.color_mode, ramp.hue_interpolation, ramp.interpolation = values["mode"], values["hue"], values["interpolation"]
    while len(ramp.elements) > 1:
        ramp.elements.remove(ramp.elements[-1])
    for index, (position, *color) in enumerate(values["stops"]):
        stop = ramp.elements[0] if index == 0 else ramp.elements.new(position)
        stop.position, stop.color = position, color


def _set_curves(mapping: bpy.types.CurveMapping, values: Mapping[str, Any]) -> None:
    mapping.extend, mapping.tone = values["extend"], values["tone"]
    mapping.black_level, mapping.white_level = values["black_level"], values["white_level"]
    mapping.use_clip, mapping.clip_min_x, mapping.clip_min_y, mapping.clip_max_x, mapping.clip_max_y = values["clip"]
    for curve, points in zip(mapping.curves, values["points"], strict=True):
        while len(curve.points) > 2:
            curve.points.remove(curve.points[1])
        for index, (x, y, handle) in enumerate(points):
            point = curve.points[index] if index < 2 else curve.points.new(x, y)
            point.location, point.handle_type = (x, y), handle
    mapping.update()
