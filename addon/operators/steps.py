# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of operators that work step by step while the window stays alive, with their progress in the status bar."""

from typing import Any

import bpy

from ..blender.handlers import register_handlers_factory
from ..measure.record import Step, Steps, WorkError, advance
from .base import Operator
from .context import redraw

INTERVAL = 0.05  # s between steps, in which Blender hears the user and draws
BAR_WIDTH = 8.0  # of the progress, times an icon's size
ERRORS = (WorkError, RuntimeError, OSError)  # of steps: their messages are for the user


class Work:
    """Steps that an operator does under a `title`; `total` is the work of all of them."""

    def __init__(self, title: str, total: float, steps: Steps[Any]) -> None:
        self.title, self.total, self.steps = title, total, steps
        self.done, self.step = 0.0, Step("", 0.0)
        self.result: Any = None
        self.operator: type[Operator] | None = None
        self.timer: bpy.types.Timer | None = None

    def advance(self) -> bool:
        """Do the step that came last; returns whether there is another one, and has the `result` if not."""
        self.done += self.step.work
        step = advance(self.steps)
        if isinstance(step, Step):
            self.step = step
            return True
        self.result = step
        return False

    @property
    def fraction(self) -> float:
        """The fraction that is done, 0 to 1."""
        return min(self.done / self.total, 1.0)

    @property
    def text(self) -> str:
        """What is done now."""
        return f"{self.title}: {self.step.text}"


running: list[Work] = []  # in windows: one at most


def _draw_status(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    """Draw the status bar while work runs."""
    layout = header.layout
    for work in running:
        layout.label(icon="EVENT_ESC")
        layout.separator()
        layout.label(text="Cancel")
        bar = layout.row()
        bar.ui_units_x = BAR_WIDTH
        bar.progress(factor=work.fraction, text=f"{100.0 * work.fraction:.0f} %")
        layout.label(text=work.text)
    layout.separator_spacer()
    layout.template_reports_banner()
    layout.separator_spacer()
    row = layout.row()
    row.alignment = "RIGHT"
    row.template_status_info()


class StepsOperator(Operator):
    """Base of operators that do `Work`: from a button or a menu step by step (`has_window`), from a script all at once."""

    has_window = False

    def work(self, context: bpy.types.Context) -> Work | None:
        """Return the work to do before `finish`, None where there is none. Raises one of ERRORS where it cannot be done."""
        raise NotImplementedError

    def finish(self, context: bpy.types.Context) -> set[str]:
        """Use the `result` of the work, None where there was none to do; returns what an operator's `execute` does."""
        raise NotImplementedError

    @property
    def result(self) -> Any:  # noqa: ANN401 - whatever the steps return
        """What the steps returned."""
        return self._work and self._work.result

    @classmethod
    def obstacle(cls, _context: bpy.types.Context, /) -> str:
        if running:
            return f"{running[0].title}: wait until it is done, or press Esc to cancel it"
        return "Wait until the render is done" if bpy.app.is_job_running("RENDER") else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self._work = self.work(context)
            while self._work and self._work.advance():
                pass
            return self.finish(context)
        except ERRORS as error:
            return self.cancel_with(error)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background:
            return self.execute(context)
        self.has_window = True
        try:
            self._work = self.work(context)
            if self._work is None or not self._work.advance():
                return self.finish(context)
        except ERRORS as error:
            return self.cancel_with(error)
        running.append(self._work)
        self._work.operator = type(self)
        self._work.timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self._work not in running:  # another file has been opened
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            stop(self._work)
            redraw(context)
            self.report({"INFO"}, f"{self._work.title}: cancelled, nothing has changed")
            return {"CANCELLED"}
        if event.type != "TIMER" or bpy.app.is_job_running("RENDER"):
            return {"PASS_THROUGH"}
        has_more = False
        try:
            has_more = self._work.advance()
        except ERRORS as error:
            return self.cancel_with(error)
        finally:
            if not has_more:
                stop(self._work)
                redraw(context)
        if has_more:
            self._show(context)
            return {"PASS_THROUGH"}
        try:
            return self.finish(context)
        except ERRORS as error:
            return self.cancel_with(error)

    def cancel(self, _context: bpy.types.Context) -> None:
        """End as the window is closed."""
        stop(self._work)

    def _show(self, context: bpy.types.Context) -> None:
        context.workspace.status_text_set(_draw_status)
        redraw(context)


def stop(work: Work) -> None:
    """End `work` in a window if it still runs; nothing of it is left, as it has nothing open between its steps."""
    if work not in running:
        return
    running.remove(work)
    work.steps.close()
    bpy.context.window_manager.event_timer_remove(work.timer)
    bpy.data.workspaces[0].status_text_set(None)  # the status bar is that of all


@bpy.app.handlers.persistent
def before_load(*_: object) -> None:
    """End what runs: the material that it is about goes with the file."""
    for work in running[:]:
        stop(work)


register, _unregister = register_handlers_factory((("load_pre", before_load),))


def unregister() -> None:
    before_load()
    _unregister()
