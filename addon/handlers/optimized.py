# SPDX-License-Identifier: GPL-3.0-or-later
"""Handlers that look after least trees: where Blender says that something changed, and before each render whatever it says.

An edit of a socket, another engine, a lamp that lights up, a camera that comes near: the node has its whole group again, until the
next Simplify. Nothing but bpy is imported as long as a file has no least tree.
"""

import bpy

from ..blender.id_properties import SPECIALIZED_FOR

ALWAYS = (bpy.types.Material, bpy.types.NodeTree, bpy.types.Action, bpy.types.Scene)
PLACES = (bpy.types.Object, bpy.types.Light, bpy.types.Camera)


def _least() -> list[bpy.types.NodeTree]:
    return [tree for tree in bpy.data.node_groups if SPECIALIZED_FOR in tree]


@bpy.app.handlers.persistent
def after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    least = _least()
    if not least:
        return
    from ..optimize.invalidate import check, depends_on_places

    kinds = ALWAYS + PLACES if any(map(depends_on_places, least)) else ALWAYS
    if any(isinstance(update.id, kinds) for update in depsgraph.updates):
        check(scene)


@bpy.app.handlers.persistent
def before_render(scene: bpy.types.Scene, _depsgraph: bpy.types.Depsgraph | None = None) -> None:
    if _least():
        from ..optimize.invalidate import check

        if bpy.app.background:  # where scripts move things and render at once; a window's loop has seen to that
            for layer in scene.view_layers:
                layer.update()
        check(scene)


@bpy.app.handlers.persistent
def after_load(*_: object) -> None:
    if _least():
        from ..optimize.invalidate import check

        check(None)


HANDLERS = (
    ("depsgraph_update_post", after_update),
    ("frame_change_post", after_update),
    ("render_pre", before_render),
    ("load_post", after_load),
    ("undo_post", after_load),
    ("redo_post", after_load),
)


def register() -> None:
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in reversed(HANDLERS):
        getattr(bpy.app.handlers, name).remove(handler)
