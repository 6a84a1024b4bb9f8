# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that measures a material, and the measurements of this session."""

from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy

from .base import Operator
from .context import material_of, redraw

if TYPE_CHECKING:
    from ..probe.measurement import Measurement

measurements: dict[int, "Measurement"] = {}  # by a material's session_uid; they hold for this machine, so files do not keep them


class TRUE_DIFFUSE_OT_measure(Operator):
    """Measure error, noise and render time of the material: renders a small probe in the scene's engine"""

    bl_idname = "true_diffuse.measure"
    bl_label = "Measure This Material"
    bl_options = {"REGISTER"}  # the file is as before, so there is nothing to undo

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        return "There is no material" if material_of(context) is None else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        return measure(self, context, material_of(context))


class WindowProgress:
    """A `Progress` that Blender shows beside the mouse."""

    def __init__(self, window_manager: bpy.types.WindowManager, total: float) -> None:
        self.window_manager, self.total, self.done = window_manager, total, 0.0

    @contextmanager
    def step(self, text: str, work: float) -> Generator[None]:
        yield
        self.done += work
        self.window_manager.progress_update(self.done / self.total)

    def within(self, work: float) -> None:
        """Steps are short."""


def measure(operator: Operator, context: bpy.types.Context, material: bpy.types.Material) -> set[str]:
    """Measure `material` in the context's scene and report the result; returns what an operator's `execute` does."""
    from ..probe import measurement

    context.window_manager.progress_begin(0.0, 1.0)
    try:
        result = measurement.measure(material, context.scene, WindowProgress(context.window_manager, measurement.total_work()))
    except (measurement.MeasurementError, RuntimeError, OSError) as error:
        return operator.cancel_with(error)
    finally:
        context.window_manager.progress_end()
    measurements[material.session_uid] = result
    operator.report({"INFO"}, result.text())
    redraw(context)
    return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_measure,)
