# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads the engine's modules while Blender is idle, so that who first switches to the engine does not wait for them."""

from importlib import import_module

import bpy

MODULES = ("..material.read", ".program", ".scene_cache", ".viewport")  # each with those it needs: a fiftieth of a second
FIRST, BETWEEN = 1.0, 0.1  # seconds after registration, and from one to the next

_waiting: list[str] = []


def load_next() -> float | None:
    """Load one of MODULES; return the time until the next [s], None after the last, as Blender's timers want it."""
    import_module(_waiting.pop(0), __package__)
    return BETWEEN if _waiting else None


def register() -> None:
    """Have the modules loaded in a while, in a Blender that has a window."""
    _waiting[:] = MODULES
    if not bpy.app.background:
        bpy.app.timers.register(load_next, first_interval=FIRST, persistent=True)


def unregister() -> None:
    """Load no more."""
    if bpy.app.timers.is_registered(load_next):
        bpy.app.timers.unregister(load_next)
