# SPDX-License-Identifier: GPL-3.0-or-later
"""Results as records, and how those who wait for them are told how far the work is. No bpy."""

import math
from contextlib import AbstractContextManager
from typing import Any, Protocol

# Of what renders, as records name it, for people
LABELS = {"eevee": "EEVEE", "cycles": "Cycles", "realtime": "Realtime", "glsl": "GLSL"}

type Record = dict[str, Any]  # a line of a results file: names to text, numbers or None


class Progress(Protocol):
    """Somebody who wants to know how far the work is."""

    def step(self, text: str, work: float) -> AbstractContextManager[None]: ...

    def within(self, work: float) -> None: ...


def known(value: float) -> float | None:
    """Return `value`, or None, which JSON can hold, for NaN."""
    return None if math.isnan(value) else value
