# SPDX-License-Identifier: GPL-3.0-or-later
"""How a batch's part is done, whatever it is of: once, by an engine that runs here, its faults told in one line."""

from collections.abc import Callable, Sequence

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.characters.character import CharacterError
from true_diffuse.scripts.farm.results import BatchError, Results

type Made = tuple[Record, dict[str, bytes]]
"""A part's record, and its files by their suffixes."""


def keep_part(name: str, results: Results, make: Callable[[], Made]) -> None:
    """Keep what `make` returns of a part, unless it is done already.

    Raises BatchError where its character cannot be had, it fails, or it cannot be kept.
    """
    if results.has(name):
        return
    try:
        record, files = make()
    except (CharacterError, OSError, RuntimeError) as error:
        raise BatchError(f"{name}: {' '.join(str(error).split())}") from error
    results.keep(name, record, files)


def check_runs(engine: Engine, usable: Sequence[Engine]) -> None:
    """Raise BatchError where an engine is not among those that run here."""
    if engine not in usable:
        raise BatchError(f"{engine.label} does not run on this machine")
