# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators."""

from collections.abc import Sequence

import bpy

from ..blender.wording import listed


class Operator(bpy.types.Operator):
    """An operator with an undo step, which is available where it has no `obstacle`."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def obstacle(cls, _context: bpy.types.Context, /) -> str:
        """Return why the operator cannot run, as a message for its tooltip; empty where it can."""
        return ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        message = cls.obstacle(context)
        if message:
            cls.poll_message_set(message)
        return not message

    def cancel_with(self, message: object) -> set[str]:
        """Report `message` as an error; returns what `execute` returns."""
        self.report({"ERROR"}, str(message))
        return {"CANCELLED"}

    def report_with_notes(self, message: str, notes: Sequence[str]) -> None:
        """Report each note in the Info editor, and in the status bar `message` with the only note or the number of notes."""
        for note in notes:
            self.report({"WARNING"}, note)
        if notes:
            message += f"; {notes[0] if len(notes) == 1 else f'{len(notes)} notes are in the Info editor'}"
        self.report({"INFO"}, message)

    def report_linked(self, names: Sequence[str]) -> None:
        """Warn of data-blocks that did not change because other files own them."""
        if names:
            self.report({"WARNING"}, f"Linked from other files and not changed: {listed(names)}")
