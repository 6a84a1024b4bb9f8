# SPDX-License-Identifier: GPL-3.0-or-later
"""Animated materials, which the exporter writes with KHR_animation_pointer: by paths in the material, not in its stand-in."""

import bpy

from ..material.revert import taken_as_is
from ..material.upgrade import current_name
from .stand_in import Replaced

PATHS = "current_paths"  # in the exporter's settings: what in glTF each path in the material animates
REFERENCES = ("additional_path", "strength_channel", "factor_channel")  # of an entry of PATHS to other paths


def use_own_paths(settings: dict, material: bpy.types.Material, replaced: Replaced, without: set[str]) -> set[str]:
    """Turn paths to a stand-in's nodes into those to the nodes of `material`; returns the inputs of ours that are animated.

    Paths that only the stand-in has, and those of its inputs `without`, are left out.
    """
    own: dict[str, str | None] = {}
    written = set()
    inputs, names = {current_name(socket.name): socket for socket in replaced.node.inputs}, taken_as_is(replaced.node)
    for socket in replaced.principled.inputs:
        path = _path(socket)
        own[path] = None
        given = inputs.get(names.get(socket.name, ""))
        if given and socket.name not in without and not replaced.groups:
            own[path] = _path(given)
            if path in settings[PATHS]:
                written.add(given.name)

    def in_material(path: str | None) -> str | None:
        if path is None or path in own:
            return own[path] if path else None
        try:
            material.path_resolve(path)
        except ValueError:
            return None
        return path

    paths = {in_material(path): entry for path, entry in settings[PATHS].items()}
    paths.pop(None, None)
    for entry in paths.values():
        entry |= {name: in_material(entry[name]) for name in REFERENCES if name in entry}
    settings[PATHS] = paths
    return written if settings["gltf_export_anim_pointer"] else set()


def _path(socket: bpy.types.NodeSocket) -> str:
    return f"node_tree.{socket.path_from_id()}.default_value"
