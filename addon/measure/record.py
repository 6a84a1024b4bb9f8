# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of results, and the protocol by which long work reports its progress. No bpy."""

import math
from collections.abc import Generator
from contextlib import AbstractContextManager
from typing import Any, NamedTuple, Protocol

# By the names of engines in records
LABELS = {"eevee": "EEVEE", "cycles": "Cycles", "realtime": "Realtime", "glsl": "GLSL"}

type Record = dict[str, Any]  # a line of a results file: names to text, numbers or None


class Progress(Protocol):
    """Receives the progress of long work, whose parts are weighted by their `work`."""

    def step(self, text: str, work: float) -> AbstractContextManager[None]:
        """Return the context of a step described by `text`."""
        ...

    def within(self, work: float) -> None:
        """Report that `work` of the current step is done."""
        ...


class WorkError(Exception):
    """Work cannot be done; the message is one line for the user."""


class Step(NamedTuple):
    """What long work does next, in words, and which part of its `work` that is."""

    text: str
    work: float


type Steps[Result] = Generator[Step, None, Result]
"""Long work that stops before each of its steps, and has nothing open there: what it needs, it makes and removes within a step."""


def advance[Result](steps: Steps[Result]) -> Step | Result:
    """Do the step that `steps` named last; return the next one, or the result after the last."""
    try:
        return next(steps)
    except StopIteration as end:
        return end.value


def run_steps[Result](steps: Steps[Result], progress: Progress) -> Result:
    """Do all `steps` at once; return their result."""
    step = advance(steps)
    while isinstance(step, Step):
        with progress.step(*step):
            step = advance(steps)
    return step


def known(value: float) -> float | None:
    """Return `value`, or None for NaN, which JSON cannot hold."""
    return None if math.isnan(value) else value
