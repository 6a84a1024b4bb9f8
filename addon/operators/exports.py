# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that asks USD and glTF what they carry of a material, and the answers of this session."""

from typing import TYPE_CHECKING

import bpy

from .base import Operator
from .context import material_of, redraw

if TYPE_CHECKING:
    from ..probe.exports import CarriedBy

answers: dict[int, "CarriedBy"] = {}  # by a material's session_uid


class TRUE_DIFFUSE_OT_check_exports(Operator):
    """Export the material to USD and glTF in a temporary folder, and list what these files do not carry of it"""

    bl_idname = "true_diffuse.check_exports"
    bl_label = "Check Exports"
    bl_options = {"REGISTER"}  # the file is as before, so there is nothing to undo

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        from ..probe.exports import exporters

        if material_of(context) is None:
            return "There is no material"
        return "" if exporters() else "This Blender has neither an exporter of USD nor of glTF"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return check(self, context, material_of(context))


def check(operator: Operator, context: bpy.types.Context, material: bpy.types.Material) -> set[str]:
    """Check the exports of `material` and report the result; returns what an operator's `execute` does."""
    from ..probe.exports import check_exports

    try:
        answer = check_exports(material, context)
    except (RuntimeError, OSError) as error:
        return operator.cancel_with(error)
    answers[material.session_uid] = answer
    notes = [f"{target}: {line}" for target, lines in answer.lines.items() for line in lines or ()]
    asked = [target for target, lines in answer.lines.items() if lines is not None]
    carried = f"{' and '.join(asked)} {'carry' if len(asked) > 1 else 'carries'} all of it"
    operator.report_with_notes(f"{material.name}: {'not all is carried' if notes else carried}", notes)
    redraw(context)
    return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_check_exports,)
