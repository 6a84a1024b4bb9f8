# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a material's nodes again from what a USD material keeps of them. Needs pxr."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import bpy

from pxr import UsdShade

from ..material.restore import restore, with_settings
from . import author, version_0_1_0

type Find = Callable[[str], tuple[str, bool]]
"""Returns the path on disk of a file that USD refers to, and whether that is temporary."""


def rebuild(material: bpy.types.Material, usd_material: UsdShade.Material, find: Find) -> list[str]:
    """Make the nodes of `material` those that `usd_material` keeps; returns messages about what could not be restored.

    Raises KeyError, TypeError or ValueError where what it keeps has another form.
    """
    kept = author.read_nodes(usd_material)
    if kept is None:
        return version_0_1_0.rebuild(material, version_0_1_0.read(usd_material), find)
    nodes, files, names = kept

    def load(name: str, settings: Mapping[str, Any], problems: list[str]) -> bpy.types.Image | None:
        image = _load(files.get(name, ""), find)
        return with_settings(image, settings, problems, is_shared=image.users > 0) if image else None

    return restore(material, nodes, names, load, _set_later)


def _set_later(material: bpy.types.Material, render_method: str) -> None:
    """Set the Render Method when the import is done: Blender crashes where a hook sets it."""
    name = material.name

    def update(*_: object) -> None:
        bpy.app.handlers.depsgraph_update_post.remove(update)
        if found := bpy.data.materials.get(name):
            found.surface_render_method = render_method

    if render_method != material.surface_render_method:
        bpy.app.handlers.depsgraph_update_post.append(update)


def _load(file: str, find: Find) -> bpy.types.Image | None:
    """Return the image in `file`; None where that is missing."""
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
    return image
