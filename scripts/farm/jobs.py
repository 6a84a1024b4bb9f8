# SPDX-License-Identifier: GPL-3.0-or-later
"""What the jobs of compare.py and report.py share: writing their bundle, and which work items a task chooses. No bpy."""

from argparse import ArgumentTypeError
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from true_diffuse.scripts.cli import inputs
from true_diffuse.scripts.cli.console import BadInput, Terminal
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.farm import bundle
from true_diffuse.scripts.studies.comparison.outcomes import WorkError


def write_job(
    name: str,
    description: str,
    document: Mapping[str, Any],
    steps: Sequence[bundle.Step],
    results: Path | None,
    output: OutputFolder,
    terminal: Terminal,
) -> None:
    """Write the bundle of a job into `output`, and say how to run it. `results` is their folder where one is asked for."""
    import bpy

    folder = output.target
    if [path for path in folder.iterdir() if path.resolve() != output.folder]:
        raise BadInput(f"job folder {folder} exists and is not empty")
    results = results and results.absolute()
    try:
        bundle.write(output.folder, name, description, document, steps, results, bpy.app.binary_path)
    except OSError as error:
        raise BadInput(f"cannot write to job folder {folder}: {error.strerror}") from error
    output.publish()
    given = f" -p OutputDir={results}" if results else ""
    terminal.say(f"Wrote the job to {folder}. To run it here: openjd run {folder / 'template.json'}{given}")


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
