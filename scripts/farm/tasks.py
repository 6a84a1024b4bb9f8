# SPDX-License-Identifier: GPL-3.0-or-later
"""Which work items of a job a task does. No bpy."""

from argparse import ArgumentTypeError
from collections.abc import Iterable, Mapping, Sequence

from true_diffuse.scripts.cli import inputs
from true_diffuse.scripts.studies.comparison.outcomes import WorkError


def chosen[Item](items: Iterable[Item], characters: Iterable[str], given: Mapping[str, str]) -> list[Item]:
    """Return the work items that a task's parameters choose; raises WorkError where these make no sense or choose none."""
    wanted: dict[str, Sequence[object]] = {name: [value] for name, value in given.items()}
    try:
        if "character" in given:
            wanted["character"] = [list(characters)[int(given["character"])]]
        if "frame" in given:
            wanted["frame"] = inputs.frame_numbers(given["frame"])
        if "seed" in given:
            wanted["seed"] = [int(given["seed"])]
    except (ArgumentTypeError, ValueError, IndexError) as error:
        raise WorkError(f"no such task: {error}") from error
    found = [item for item in items if all(getattr(item, name, None) in values for name, values in wanted.items())]
    if not found:
        raise WorkError(f"no such task: {', '.join(f'{name} {value}' for name, value in given.items())}")
    return found
