# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers that restore an optimized material when an edit of its sockets makes its specialized tree wrong, and before each render.

As long as a file has no optimized material the handlers import nothing but bpy.
"""

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import SPECIALIZED_FOR


def _has_specialized() -> bool:
    return any(SPECIALIZED_FOR in tree for tree in bpy.data.node_groups)


@bpy.app.handlers.persistent
def after_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    changed = [update.id.original for update in depsgraph.updates if isinstance(update.id, CHANGES)]
    if changed and _has_specialized():
        from ..optimize.materials import invalidate

        owners = [each for each in changed if isinstance(each, bpy.types.Material) or not each.is_embedded_data]
        invalidate(None if any(isinstance(each, bpy.types.Action) for each in changed) else owners)


CHANGES = (bpy.types.Material, bpy.types.ShaderNodeTree, bpy.types.Action)


@bpy.app.handlers.persistent
def check_all(*_: object) -> None:
    if _has_specialized():
        from ..optimize.materials import invalidate

        invalidate()


HANDLERS = (
    ("depsgraph_update_post", after_update),
    ("render_pre", check_all),
    ("load_post", check_all),
    ("undo_post", check_all),
    ("redo_post", check_all),
)


register, unregister = register_handlers_factory(HANDLERS)
