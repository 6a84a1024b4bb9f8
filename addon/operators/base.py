# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators."""

from collections.abc import Sequence

import bpy

MOST_NAMES = 4  # of a list in the status bar


def counted(number: int, noun: str) -> str:
    """Return `number` and its `noun`, which gets an s unless there is one of it: "1 material", "2 materials"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def listed(names: Sequence[str]) -> str:
    """Return `names` in one line; of more than MOST_NAMES the first, and how many more there are."""
    if len(names) <= MOST_NAMES:
        return ", ".join(names)
    return f"{', '.join(names[: MOST_NAMES - 1])} and {len(names) - MOST_NAMES + 1} more"


def counted_names(names: Sequence[str], noun: str) -> str:
    """Return how many of `noun` there are, and their `names`: "3 materials: Skin, Shirt, Boots"; "no material" of none."""
    return f"{counted(len(names), noun)}: {listed(names)}" if names else f"no {noun}"


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
