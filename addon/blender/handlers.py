# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that Blender calls: how a module adds them to bpy.app.handlers and takes them away."""

from collections.abc import Callable, Sequence

import bpy

type Handler = tuple[str, Callable[..., None]]
"""The name of a list in bpy.app.handlers, and a function for it."""


def register_handlers_factory(handlers: Sequence[Handler]) -> tuple[Callable[[], None], Callable[[], None]]:
    """Return `register` and `unregister` of a module, as bpy.utils.register_classes_factory does for classes."""

    def register() -> None:
        for name, handler in handlers:
            getattr(bpy.app.handlers, name).append(handler)

    def unregister() -> None:
        for name, handler in reversed(handlers):
            getattr(bpy.app.handlers, name).remove(handler)

    return register, unregister
