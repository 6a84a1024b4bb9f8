# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages on what an export or import could not keep: printed and, where there is a window, reported in Blender's Info editor.

A hook has no operator to report with, and may run in another thread, so its messages wait for the main thread.
"""

from collections import deque

import bpy

PERIOD = 1.0  # s, between two reports
_lines: deque[str] = deque(maxlen=1000)


class TRUE_DIFFUSE_OT_report(bpy.types.Operator):
    """Report what a file cannot keep of True Diffuse materials"""

    bl_idname = "true_diffuse.report"
    bl_label = "True Diffuse Report"
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
    """Return all notes since the last call."""
    lines = list(_lines)
    _lines.clear()
    return lines


def put_back(lines: list[str]) -> None:
    """Have lines of `take` shown after all, before those that have come since."""
    _lines.extendleft(reversed(lines))


def show() -> float:
    """Report all notes; returns the time until the next call [s], as Blender's timers want it."""
    for line in take():
        bpy.ops.true_diffuse.report(text=line)
    return PERIOD


def register() -> None:
    bpy.utils.register_class(TRUE_DIFFUSE_OT_report)
    if not bpy.app.background:
        bpy.app.timers.register(show, persistent=True)


def unregister() -> None:
    if bpy.app.timers.is_registered(show):
        bpy.app.timers.unregister(show)
    bpy.utils.unregister_class(TRUE_DIFFUSE_OT_report)
