# SPDX-License-Identifier: GPL-3.0-or-later
"""Records of results, and the protocol by which long work reports its progress. No bpy."""

import math
from contextlib import AbstractContextManager
from typing import Any, Protocol

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


def known(value: float) -> float | None:
    """Return `value`, or None for NaN, which JSON cannot hold."""
    return None if math.isnan(value) else value
