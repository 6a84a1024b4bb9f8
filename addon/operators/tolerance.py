# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that picks the fastest quality and samples for an error, and what it picked in this session."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import bpy

from .context import material_of, redraw, scene_obstacle
from .steps import StepsOperator, Work

if TYPE_CHECKING:
    from ..probe.benchmark import Variant
    from ..probe.measurement import RenderSetup


class Picked(NamedTuple):
    """What was picked for an `error` in % with a `setup`, in `lines` for the panel."""

    error: float
    setup: "RenderSetup"
    lines: tuple[str, ...]


picked: dict[int, Picked] = {}  # by a scene's session_uid


class TRUE_DIFFUSE_OT_pick_settings(StepsOperator):
    """Set quality and samples to the fastest that stay below the error. Measures this machine first where needed; Esc cancels"""

    bl_idname = "true_diffuse.pick_settings"
    bl_label = "Pick Settings for Error"

    @classmethod
    def obstacle(cls, context: bpy.types.Context, /) -> str:
        from ..measure.render import openimageio
        from ..probe.measurement import LACKS_OPENIMAGEIO, MeasurementError, RenderSetup

        message = super().obstacle(context) or scene_obstacle(context)
        if message:
            return message
        try:
            RenderSetup.of(context.scene)
            if not report_path():
                openimageio()
        except MeasurementError as error:
            return str(error)
        except ImportError:
            return LACKS_OPENIMAGEIO
        return ""

    def work(self, context: bpy.types.Context) -> Work | None:
        from ..probe import benchmark
        from ..probe.measurement import RenderSetup

        self._scene, self._setup = context.scene.session_uid, RenderSetup.of(context.scene)
        if report_path():
            return None
        missing = benchmark.missing(_wanted(context.scene, self._setup), self._setup, benchmark.read())
        total = benchmark.total_work(missing, self._setup)
        return Work("Measuring this machine", total, benchmark.steps(missing, self._setup)) if missing else None

    def finish(self, context: bpy.types.Context) -> set[str]:
        from ..probe import benchmark, settings
        from ..probe.environment import environment
        from ..probe.measurement import RenderSetup
        from ..probe.tolerance import ToleranceError, percent, read_report

        kept = [*benchmark.read(), *(self.result or ())]
        if self.result:
            try:
                benchmark.keep(kept)
            except OSError as error:
                self.report({"WARNING"}, f"What was measured cannot be kept: {error}")
        scene, setup = context.scene, self._setup
        if scene.session_uid != self._scene or RenderSetup.of(scene) != setup:
            return self.cancel_with("Another scene or engine is in use now: this machine is measured, pick again")
        path = report_path()
        if path:
            try:
                report = read_report(path, environment([]))
            except ToleranceError as error:
                return self.cancel_with(f"{error}, or choose none in the preferences")
            choices, problems = settings.choose_all(scene, lambda _: report, scene.true_diffuse.error / 100.0)
        elif benchmark.missing(_wanted(scene, setup), setup, kept):
            return self.cancel_with("Materials have changed while this machine was measured: pick again")
        else:
            choices, problems = settings.choose_all(
                scene,
                lambda summary: benchmark.report(benchmark.variants(summary, setup), setup, kept),
                scene.true_diffuse.error / 100.0,
            )
        for text in problems if choices else problems[:-1]:
            self.report({"WARNING"}, text)
        if not choices:
            return self.cancel_with(problems[-1] if problems else "The scene uses no True Diffuse material with a Quality")
        samples, linked = settings.apply(scene, choices)
        self.report_linked(linked)
        variants = ", ".join(dict.fromkeys(choice.variant for choice in choices.values()))
        expected = percent(max(choice.expected_error for choice in choices.values()))
        asked = percent(scene.true_diffuse.error / 100.0)
        self.report({"INFO"}, f"{setup.engine.label}, {asked}: {variants} with {samples} samples, {expected} expected")
        lines = [f"{expected} expected with {samples} samples", f"{setup.engine.label}, {variants}"]
        if len({choice.samples for choice in choices.values()}) > 1:
            lines.append(f"{max(choices, key=lambda material: choices[material].samples).name} needs the most samples")
        picked[scene.session_uid] = Picked(scene.true_diffuse.error, setup, tuple(lines))
        redraw(context)
        if self.has_window and material_of(context) in choices and bpy.ops.true_diffuse.measure.poll():
            bpy.ops.true_diffuse.measure("INVOKE_DEFAULT")
        return {"FINISHED"}


def _wanted(scene: bpy.types.Scene, setup: "RenderSetup") -> "list[Variant]":
    from ..material.materials import materials_of
    from ..material.summary import material_summary
    from ..probe import benchmark

    summaries = filter(None, map(material_summary, materials_of(scene)))
    return [variant for summary in summaries for variant in benchmark.variants(summary, setup)]


def report_path() -> Path | None:
    """Return the report that is chosen in the preferences; None where this machine's own benchmark is used."""
    from ..blender.extension import preferences

    settings = preferences()
    return Path(bpy.path.abspath(settings.report)) if settings and settings.report else None


CLASSES = (TRUE_DIFFUSE_OT_pick_settings,)
