# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes deleted lights from the chosen lights: their drivers would keep the last values."""

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import GROUP_ID


@bpy.app.handlers.persistent
def drop_deleted(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Clear the slots of deleted lights, where an update tells of changed collections: a deleted object changes its own."""
    if depsgraph.id_type_updated("COLLECTION") and any(GROUP_ID in tree for tree in bpy.data.node_groups):
        from ..nodes import chosen_lights

        chosen_lights.drop_deleted()


register, unregister = register_handlers_factory((("depsgraph_update_post", drop_deleted),))
