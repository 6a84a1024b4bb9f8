# SPDX-License-Identifier: GPL-3.0-or-later
"""What an export or import could not carry: said in the console, and in Blender's status bar and Info editor where there are such.

A hook has no operator to report with, and may run in a thread of its own; so the words wait for the main thread to look after them.
"""

from collections import deque

import bpy

PERIOD = 1.0  # s, between two looks
_lines: deque[str] = deque(maxlen=1000)


class TRUE_DIFFUSE_OT_say(bpy.types.Operator):
    """Show what a file cannot hold of True Diffuse materials"""

    bl_idname = "true_diffuse.say"
    bl_label = "Report of True Diffuse"
    bl_options = {"INTERNAL"}

    text: bpy.props.StringProperty()  # ty: ignore[invalid-type-form] - how Blender's properties are declared

    def execute(self, context: bpy.types.Context) -> set[str]:
        self.report({"WARNING"}, self.text)
        return {"FINISHED"}


def add(material: str, text: str) -> None:
    """Note one thing about a material."""
    line = f"True Diffuse: {material}: {text}"
    _lines.append(line)
    print(line)


def take() -> list[str]:
    """Return all that was noted since the last call."""
    taken = list(_lines)
    _lines.clear()
    return taken


def show() -> float:
    """Report what was noted; returns, as timers do, when to be called again [s]."""
    for line in take():
        bpy.ops.true_diffuse.say(text=line)
    return PERIOD


def register() -> None:
    bpy.utils.register_class(TRUE_DIFFUSE_OT_say)
    if not bpy.app.background:
        bpy.app.timers.register(show, persistent=True)


def unregister() -> None:
    if bpy.app.timers.is_registered(show):
        bpy.app.timers.unregister(show)
    bpy.utils.unregister_class(TRUE_DIFFUSE_OT_say)
