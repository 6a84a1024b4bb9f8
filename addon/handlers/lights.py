# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes deleted lights from the chosen lights: their drivers would keep the last values."""

import bpy

from ..blender.handlers import register_handlers_factory


@bpy.app.handlers.persistent
def drop_deleted(_scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph) -> None:
    """Clear the slots of deleted lights, if an object has been deleted since the last call."""
    global object_count
    before, object_count = object_count, len(bpy.data.objects)
    if object_count < before:
        from ..nodes import chosen_lights

        chosen_lights.drop_deleted()


object_count = 0  # of the file at the last call


register, unregister = register_handlers_factory((("depsgraph_update_post", drop_deleted),))
