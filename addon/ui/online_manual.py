# SPDX-License-Identifier: GPL-3.0-or-later
"""Online Manual, by F1 or in context menus, on operators, settings and nodes: pages of the site that the manifest names."""

import bpy

from ..blender.extension import website

LIGHTS = "manual/index.html#chosen-lights-and-shadows"
# Patterns of what Blender asks for, in lower case, and pages. The first that fits is taken.
PAGES = (
    ("bpy.ops.true_diffuse.use_selected_lights", LIGHTS),
    ("bpy.ops.true_diffuse.toggle_light", LIGHTS),
    ("bpy.ops.true_diffuse.*_preset", "gallery.html"),
    ("bpy.ops.true_diffuse.*", "manual/index.html"),
    ("bpy.types.truediffusescene.*", "manual/index.html"),
)


def manual_map() -> tuple[str, list[tuple[str, str]]]:
    """Return the site's address and the pages below it by what they tell of; no page where the package names no site."""
    address = website()
    if address is None:
        return "", []
    from ..nodes import GROUPS
    from ..nodes.graph import key_and_version

    pages = list(PAGES)
    node = getattr(bpy.context, "active_node", None)  # Blender asks for its type, which all groups share
    key = key_and_version(node)[0] if node else ""
    if key in {group.key for group in GROUPS}:
        pages.append(("bpy.types.shadernodegroup*", f"manual/{key}.html"))
    return f"{address.rstrip('/')}/", pages


def register() -> None:
    bpy.utils.register_manual_map(manual_map)


def unregister() -> None:
    bpy.utils.unregister_manual_map(manual_map)
