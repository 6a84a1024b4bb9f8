# SPDX-License-Identifier: GPL-3.0-or-later
"""What panels draw of a material and cannot work out at every redraw, kept until Blender tells that a material changed."""

from collections.abc import Callable, Hashable
from typing import Any

import bpy

from ..blender.handlers import register_handlers_factory

CHANGES = ("MATERIAL", "NODETREE", "IMAGE", "ACTION")
kept: dict[tuple[int, Hashable], Any] = {}  # by a material's session_uid and what it is


def keep[T](material: bpy.types.Material, layer: bpy.types.ViewLayer, what: Hashable, work_out: Callable[[], T]) -> T:
    """Return what `work_out` returns for `material`: anew after a change, and for a material that `layer` does not show, whose
    changes Blender does not tell."""
    depsgraph = layer.depsgraph
    if depsgraph is None or not material.evaluated_get(depsgraph).is_evaluated:
        return work_out()
    key = (material.session_uid, what)
    if key not in kept:
        kept[key] = work_out()
    return kept[key]


@bpy.app.handlers.persistent
def after_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Forget all if a material may have changed."""
    if kept and any(map(depsgraph.id_type_updated, CHANGES)):
        kept.clear()


@bpy.app.handlers.persistent
def after_load(*_: object) -> None:
    """Forget all: the file is another one."""
    kept.clear()


HANDLERS = (
    ("depsgraph_update_post", after_update),
    ("frame_change_post", after_update),
    ("load_post", after_load),
    ("undo_post", after_load),
    ("redo_post", after_load),
)


register, _unregister = register_handlers_factory(HANDLERS)


def unregister() -> None:
    _unregister()
    kept.clear()
