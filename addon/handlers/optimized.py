# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers that restore an optimized material when an edit of its sockets makes its specialized tree wrong, and before each render.

After an update only the materials that it concerns are looked at: Blender tells of a new driver with the material's own node tree
alone, and of a key in an action that exists with the action alone.

As long as a file has no optimized material the handlers import nothing but bpy.
"""

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import SPECIALIZED_FOR


def _has_specialized() -> bool:
    return any(SPECIALIZED_FOR in tree for tree in bpy.data.node_groups)


@bpy.app.handlers.persistent
def after_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if any(map(depsgraph.id_type_updated, ("MATERIAL", "NODETREE", "ACTION"))) and _has_specialized():
        changed = {update.id.original for update in depsgraph.updates if isinstance(update.id, CHANGES)}
        changed = {each for each in changed if not isinstance(each, bpy.types.Action) or _is_of_shading(each)}
        if changed:
            from ..optimize.materials import invalidate
            from ..optimize.usage import owners_of

            invalidate(owners_of(changed))


CHANGES = (bpy.types.Material, bpy.types.ShaderNodeTree, bpy.types.Action)


def _is_of_shading(action: bpy.types.Action) -> bool:
    return any(slot.target_id_type in ("MATERIAL", "NODETREE") for slot in action.slots)


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
