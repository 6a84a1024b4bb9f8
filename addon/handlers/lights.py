# SPDX-License-Identifier: GPL-3.0-or-later
"""Has the chosen lights follow what becomes of them: drivers of a deleted light would keep the last values."""

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import GROUP_ID


@bpy.app.handlers.persistent
def keep_up(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Look after the chosen lights where an update tells of lights, or of collections: a deleted object changes its own."""
    if any(map(depsgraph.id_type_updated, ("COLLECTION", "LIGHT"))) and any(GROUP_ID in tree for tree in bpy.data.node_groups):
        from ..nodes import chosen_lights

        chosen_lights.keep_up()


register, unregister = register_handlers_factory((("depsgraph_update_post", keep_up),))
