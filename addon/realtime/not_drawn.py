# SPDX-License-Identifier: GPL-3.0-or-later
"""What the last picture of each scene lacks or shows in another way, for the panel of the render properties."""

from collections.abc import Iterable

import bpy

_messages: dict[int, tuple[str, ...]] = {}  # by the session_uid of the scene


def messages(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return the messages of the last picture of `scene`, none before there is one."""
    return _messages.get(scene.original.session_uid, ())


def keep(scene: bpy.types.Scene, said: Iterable[str]) -> None:
    """Keep the messages of a picture of `scene`, and have the properties drawn again where they differ from the last."""
    now = tuple(dict.fromkeys(said))
    if now == messages(scene):
        return
    _messages[scene.original.session_uid] = now
    manager = bpy.context.window_manager
    for area in (area for window in (manager.windows if manager else ()) for area in window.screen.areas):
        if area.type == "PROPERTIES":
            area.tag_redraw()
