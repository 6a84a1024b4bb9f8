# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that measures a material, and the measurements of this session."""

from typing import TYPE_CHECKING

import bpy

from .context import material_of, redraw
from .steps import StepsOperator, Work

if TYPE_CHECKING:
    from ..probe.measurement import Measurement

measurements: dict[int, "Measurement"] = {}  # by a material's session_uid; they hold for this machine, so files do not keep them


class TRUE_DIFFUSE_OT_measure(StepsOperator):
    """Measure error and render time of the material: renders a small sphere, or slab, in the scene's engine. Esc cancels"""

    bl_idname = "true_diffuse.measure"
    bl_label = "Measure This Material"
    bl_options = {"REGISTER"}  # the file is as before, so there is nothing to undo

    @classmethod
    def obstacle(cls, context: bpy.types.Context, /) -> str:
        from ..probe.measurement import MeasurementError, check

        message = super().obstacle(context)
        if message:
            return message
        try:
            check(material_of(context), context.scene)
        except MeasurementError as error:
            return str(error)
        return ""

    def work(self, context: bpy.types.Context) -> Work:
        from ..probe import measurement

        material = material_of(context)
        assert material is not None  # see obstacle
        self._uid = material.session_uid
        steps = measurement.steps(material, context.scene)
        return Work(f"Measuring {material.name}", measurement.total_work(), steps)

    def finish(self, context: bpy.types.Context) -> set[str]:
        measurements[self._uid] = self.result
        self.report({"INFO"}, self.result.text())
        redraw(context)
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_measure,)
