# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers that restore an optimized material when an edit makes its specialized tree wrong, and before each render.

Examples are the edit of a socket, another engine, a light that is switched on. As long as a file has no
optimized material the handlers import nothing but bpy.
"""

import bpy

from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import SPECIALIZED_FOR

ALWAYS = (bpy.types.Material, bpy.types.NodeTree, bpy.types.Action, bpy.types.Scene)
OBJECTS = (bpy.types.Object, bpy.types.Light)


def _specialized_trees() -> list[bpy.types.NodeTree]:
    return [tree for tree in bpy.data.node_groups if SPECIALIZED_FOR in tree]


@bpy.app.handlers.persistent
def after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    trees = _specialized_trees()
    if not trees:
        return
    from ..optimize.materials import depends_on_objects, invalidate

    types = ALWAYS + OBJECTS if any(map(depends_on_objects, trees)) else ALWAYS
    if any(isinstance(update.id, types) for update in depsgraph.updates):
        invalidate(scene)


@bpy.app.handlers.persistent
def before_render(scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph | None = None) -> None:
    if _specialized_trees():
        from ..optimize.materials import invalidate

        if bpy.app.background:  # where a script may change objects and render at once; with a window Blender has updated
            for layer in scene.view_layers:
                layer.update()
        invalidate(scene)


@bpy.app.handlers.persistent
def after_load(*_: object) -> None:
    if _specialized_trees():
        from ..optimize.materials import invalidate

        invalidate(None)


HANDLERS = (
    ("depsgraph_update_post", after_update),
    ("frame_change_post", after_update),
    ("render_pre", before_render),
    ("load_post", after_load),
    ("undo_post", after_load),
    ("redo_post", after_load),
)


register, unregister = register_handlers_factory(HANDLERS)
