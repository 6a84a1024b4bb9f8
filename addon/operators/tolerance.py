# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that picks the fastest quality and samples for an error."""

from pathlib import Path

import bpy

from .base import Operator
from .context import material_of, scene_obstacle
from .measure import measure


class TRUE_DIFFUSE_OT_pick_settings(Operator):
    """Set quality and samples to the fastest that stay below the error, by the report of this machine, and measure the material"""

    bl_idname = "true_diffuse.pick_settings"
    bl_label = "Pick Settings for Error"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        return scene_obstacle(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material.summary import engine_of
        from ..probe import settings
        from ..probe.environment import environment
        from ..probe.tolerance import ToleranceError, percent, read_report

        scene, tolerance = context.scene, context.scene.true_diffuse.error / 100.0
        engine = engine_of(scene)
        if engine is None:
            return self.cancel_with(f"Reports have no data for {scene.render.engine.title()}, only for EEVEE, Cycles and Realtime")
        try:
            report = read_report(_report_path(), environment([]))
        except ToleranceError as error:
            return self.cancel_with(error)
        choices, problems = settings.choose_all(scene, report, tolerance)
        for text in problems if choices else problems[:-1]:
            self.report({"WARNING"}, text)
        if not choices:
            return self.cancel_with(problems[-1] if problems else "The scene uses no True Diffuse material with a Quality")
        samples, linked = settings.apply(scene, choices)
        self.report_linked(linked)
        picked = ", ".join(dict.fromkeys(choice.variant for choice in choices.values()))
        expected = max(choice.expected_error for choice in choices.values())
        self.report(
            {"INFO"}, f"{engine.label}, {percent(tolerance)}: {picked} with {samples} samples, {percent(expected)} expected"
        )
        if material_of(context) in choices:
            measure(self, context, material_of(context))
        return {"FINISHED"}


def _report_path() -> Path:
    from ..blender.extension import preferences
    from ..probe.tolerance import MAKE, ToleranceError

    settings = preferences()
    if settings is None or not settings.report:
        raise ToleranceError(f"No report is chosen: {MAKE}, then choose its report.json in the extension's preferences")
    return Path(bpy.path.abspath(settings.report))


CLASSES = (TRUE_DIFFUSE_OT_pick_settings,)
